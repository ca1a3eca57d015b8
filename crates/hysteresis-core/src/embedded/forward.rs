use super::model::{Holds, Model};
use crate::engine::Engine;
use crate::error::Error;
use crate::process::Process;
use crate::real::Real;
use crate::stream::{ForwardCore, Walk};

/// The output of a model, sample by sample, without an allocator; it owns its model or borrows one.
///
/// What [`crate::Forward`](../struct.Forward.html) is on the heap, and with `f64` bit for bit the same. Starts at rest. An input that
/// is not finite, or beyond [`Real::MAX_MAGNITUDE`], leaves output and memory as they are and is counted.
///
/// ```
/// use hysteresis_core::embedded::{Forward, Model};
/// use hysteresis_core::{Offsets, Process};
/// let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut forward = Forward::new(model);
/// let mut y = [0.0; 3];
/// forward.run(&[4.0, 3.0, f32::NAN], &mut y)?;
/// assert_eq!(y, [5.0, 4.0, 4.0]);
/// assert_eq!((forward.peek(-4.0), forward.output(), forward.rejected()), (-5.0, 4.0, 1));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Forward<T: Real, const N: usize, M: Holds<T, N> = Model<T, N>> {
    core: ForwardCore<T, Engine<M>>,
}

impl<T: Real, const N: usize, M: Holds<T, N>> Forward<T, N, M> {
    /// A stream at rest.
    #[must_use]
    pub fn new(model: M) -> Self {
        let origin = model.model().origin;
        Self { core: ForwardCore::new(Engine::new(model), origin) }
    }

    /// The last output; at rest, the output at rest.
    #[must_use]
    pub fn output(&self) -> T {
        self.core.output()
    }

    /// How many inputs were not admissible and left output and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &Model<T, N> {
        self.core.memory().model().model()
    }
}

impl<T: Real, const N: usize, M: Holds<T, N>> Process<T> for Forward<T, N, M> {
    #[inline]
    fn step(&mut self, input: T) -> T {
        self.core.step(input)
    }

    #[inline]
    fn peek(&self, input: T) -> T {
        self.core.peek(input)
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[T], output: &mut [T]) -> Result<(), Error> {
        self.core.run(input, output)
    }
}
