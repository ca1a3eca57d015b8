use super::model::{Holds, Model};
use crate::engine::Engine;
use crate::error::Error;
use crate::process::Process;
use crate::real::Real;
use crate::stream::{InverseCore, Walk, check_limits};

/// The exact inverse of a model, sample by sample, without an allocator: the drive that brings the model's output to the target.
///
/// What [`crate::Inverse`](../struct.Inverse.html) is on the heap, and with `f64` bit for bit the same. The drive is always finite and
/// within the limits. A target out of reach puts it at the limit, which is what the memory then knows, and sets
/// [`saturated`](Self::saturated); a target that is not finite, or beyond [`Real::MAX_MAGNITUDE`], leaves it as it is and is counted.
///
/// ```
/// use hysteresis_core::embedded::{Inverse, Model};
/// use hysteresis_core::{Offsets, Process};
/// let model = Model::<f64, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut inverse = Inverse::new(model, Some((-10.0, 10.0)))?;
/// assert!((inverse.step(5.0) - 4.0).abs() < 1e-15);
/// assert_eq!((inverse.step(99.0), inverse.saturated()), (10.0, true));
/// assert_eq!((inverse.step(f64::NAN), inverse.rejected()), (10.0, 1));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Inverse<T: Real, const N: usize, M: Holds<T, N> = Model<T, N>> {
    core: InverseCore<T, Engine<M>>,
}

impl<T: Real, const N: usize, M: Holds<T, N>> Inverse<T, N, M> {
    /// An inverse at rest, the drive kept within `limits` (low, high) in the unit of the model's input. If the rest position, the
    /// input offset, lies outside the limits, the memory starts at the nearer one.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the model may not be, [`Error::Domain`] unless the limits are finite and low < high.
    pub fn new(model: M, limits: Option<(T, T)>) -> Result<Self, Error> {
        model.model().invertible?;
        let (origin, limits) = (model.model().origin, check_limits(limits)?);
        Ok(Self { core: InverseCore::new(Engine::new(model), origin, limits) })
    }

    /// The present drive: the last one, or that at rest.
    #[must_use]
    pub fn output(&self) -> T {
        self.core.output()
    }

    /// The output of the model at the present drive: the last target, or what a limit allows.
    #[must_use]
    pub fn reached(&self) -> T {
        self.core.reached()
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.core.saturated()
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(T, T)> {
        self.core.limits()
    }

    /// How many targets were not admissible and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// Its model.
    #[must_use]
    pub fn model(&self) -> &Model<T, N> {
        self.core.memory().model().model()
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds feedback or
    /// limits a slew. The drive is kept within the limits; one that is not admissible is counted and changes nothing else. Returns
    /// the output of the model there.
    ///
    /// ```
    /// use hysteresis_core::embedded::{Inverse, Model};
    /// use hysteresis_core::{Offsets, Process};
    /// let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let mut inverse = Inverse::new(model, Some((-10.0, 10.0)))?;
    /// assert_eq!(inverse.follow_drive(4.0), 5.0);
    /// assert_eq!(inverse.step(4.5), 3.5); // the play holds
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[inline]
    pub fn follow_drive(&mut self, drive: T) -> T {
        self.core.follow_drive(drive)
    }

    /// Takes over what was driven before, oldest drive first.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits; nothing is taken then.
    pub fn follow(&mut self, drives: &[T]) -> Result<(), Error> {
        self.core.follow(drives)
    }
}

impl<T: Real, const N: usize, M: Holds<T, N>> Process<T> for Inverse<T, N, M> {
    #[inline]
    fn step(&mut self, target: T) -> T {
        self.core.step(target)
    }

    #[inline]
    fn peek(&self, target: T) -> T {
        self.core.look(target).drive
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[T], output: &mut [T]) -> Result<(), Error> {
        self.core.run(input, output)
    }
}
