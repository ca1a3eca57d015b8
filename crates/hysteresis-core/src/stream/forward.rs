use super::forward_core::ForwardCore;
use super::state::{StreamState, check_input, check_output};
use super::walk::Walk;
use crate::engine::{CompiledModel, HeapMemory, Method, Point, check_same};
use crate::error::{Error, check_all_finite};
use crate::model::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
use crate::process::Process;

/// The output of a model, sample by sample: equations (4) and (6).
///
/// Starts at rest: all operators zero at the input offset. On the turning-point engine a sample costs a few
/// nanoseconds for any number of operators; the output equals the loop over all operators to 1e-12 of its range.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut forward = model.forward();
/// let mut y = [0.0; 2];
/// forward.run(&[4.0, 3.0], &mut y)?;
/// assert_eq!(y, [5.0, 4.0]);
/// assert_eq!(forward.peek(-4.0), -5.0);
/// assert_eq!(forward.turning_points(), [4.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Forward {
    core: ForwardCore<f64, HeapMemory>,
    fingerprint: u64,
}

impl Forward {
    /// A stream at rest.
    #[must_use]
    pub fn new(model: &CompiledModel) -> Self {
        Self::start(model, model.memory_at_rest())
    }

    /// A stream that starts from the operator outputs `initial`, on the bank; the first sample projects each onto
    /// what its operator can reach (erratum 6).
    ///
    /// # Errors
    /// [`Error::Length`] unless there is one number per operator, [`Error::Domain`] unless all are finite.
    pub fn with_initial(model: &CompiledModel, initial: &[f64]) -> Result<Self, Error> {
        Ok(Self::start(model, model.memory_from(initial)?))
    }

    /// A stream at rest that is evaluated by `method`: [`Method::Bank`] for few operators along jumps (with the feature `simd`).
    ///
    /// # Errors
    /// [`Error::Domain`] that names the first threshold that is not nested, for [`Method::TurningPoints`].
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Forward, Method, Offsets, PrandtlIshlinskii, Process};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let mut stream = Forward::with_method(&CompiledModel::new(&(&model).into()), Method::Bank)?;
    /// assert_eq!([stream.step(4.0), stream.step(3.0)], [5.0, 4.0]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn with_method(model: &CompiledModel, method: Method) -> Result<Self, Error> {
        Ok(Self::start(model, model.memory_by(method)?))
    }

    fn start(model: &CompiledModel, memory: HeapMemory) -> Self {
        Self { core: ForwardCore::new(memory, model.offsets.into()), fingerprint: model.fingerprint() }
    }

    /// The last output; at rest, the output at rest.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.core.output()
    }

    /// Which algorithm evaluates the stream.
    #[must_use]
    pub fn method(&self) -> Method {
        self.core.memory().method()
    }

    /// How many inputs were not finite (or beyond 1e100) and left output and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// The reversals of the input that still determine the output, oldest first, in the unit of the input. Empty
    /// for a bank. Allocates: for plots, not for the loop.
    #[must_use]
    pub fn turning_points(&self) -> alloc::vec::Vec<f64> {
        self.core.memory.turning_points().into_iter().map(|x| x + self.core.origin.input).collect()
    }

    /// Takes over what was driven before, oldest input first.
    ///
    /// # Errors
    /// [`Error::Domain`] for an input that is not finite; nothing is taken then.
    pub fn follow(&mut self, inputs: &[f64]) -> Result<(), Error> {
        check_all_finite("inputs", inputs)?;
        for input in inputs {
            self.step(*input);
        }
        Ok(())
    }

    /// Goes on with the weights and the output offset of another model of the same operators: the input and what the
    /// operators remember of it stay, the output is that of the new model.
    ///
    /// From then on the stream is the one that the new model would be in after the same inputs, to rounding; a model
    /// that is equal changes no bit. Nothing is allocated. What the old model holds is freed if no other clone of it is
    /// left: keep one where freeing must wait.
    ///
    /// # Errors
    /// [`Error::OtherOperators`] if thresholds, their number or the input offset differ (an identity of a split model
    /// that weighs differently above and below zero counts as one operator more); the stream is as before then.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, Process};
    /// let model = |w| PrandtlIshlinskii::new(&[1.0, w], &[0.0, 2.0], Offsets::default());
    /// let mut forward = model(0.5)?.forward();
    /// assert_eq!(forward.step(4.0), 4.0 + 0.5 * 2.0);
    /// forward.set_model(&CompiledModel::new(&(&model(0.75)?).into()))?;
    /// assert_eq!(forward.step(3.0), 3.0 + 0.75 * 2.0); // the play remembers the 2
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        let core = &mut self.core;
        check_same("input_offset", core.origin.input, model.offsets.input)?;
        let x = core.known().input;
        core.memory.reweigh(model, x)?;
        core.origin = model.offsets.into();
        core.enter_segment(x);
        self.fingerprint = model.fingerprint();
        Ok(())
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> StreamState {
        let Point { input: last_input, output: last_output } = self.core.known();
        StreamState {
            model: self.fingerprint,
            last_input,
            last_output,
            saturated: false,
            rejected: self.core.rejected,
            memory: self.core.memory.state(last_input),
        }
    }

    /// Continues from `state`, bit for bit; from a state of the other [`Method`], with the same outputs to 1e-12 of the range.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`] for one that this stream cannot be in (by turning points:
    /// operator outputs of a bank that no drive leads to), [`Error::Domain`] for a number that is not finite; the stream is as before then.
    pub fn set_state(&mut self, state: &StreamState) -> Result<(), Error> {
        state.check_model(self.fingerprint)?;
        check_input("state.last_input", state.last_input)?;
        check_output("state.last_output", state.last_output)?;
        self.core.memory.restore(&state.memory, state.last_input, state.last_output)?;
        self.core.enter_segment(state.last_input);
        self.core.rejected = state.rejected;
        Ok(())
    }
}

impl Process for Forward {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        self.core.step(input)
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        self.core.peek(input)
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), Error> {
        self.core.run_by_method(input, output)
    }

    #[inline]
    fn step_at_hand(&mut self, input: f64) -> Option<f64> {
        self.core.step_on_line(input)
    }

    #[inline]
    fn fetch(&self, depth: usize) -> u64 {
        self.core.memory.fetch(depth)
    }
}

impl ModifiedPrandtlIshlinskii {
    /// The forward model as a stream at rest. For many streams of one model make one [`CompiledModel`].
    #[must_use]
    pub fn forward(&self) -> Forward {
        Forward::new(&CompiledModel::new(self))
    }
}

impl PrandtlIshlinskii {
    /// The forward model as a stream at rest. For many streams of one model make one [`CompiledModel`].
    #[must_use]
    pub fn forward(&self) -> Forward {
        ModifiedPrandtlIshlinskii::from(self).forward()
    }
}
