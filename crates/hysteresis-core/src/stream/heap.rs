//! Streams of models of any size, their memory on the heap, and what they remember as a plain value.

use super::walk::{ForwardCore, InverseCore, Look, Walk};
use crate::engine::{CompiledModel, HeapMemory, Memory, MemoryState, Method, Point};
use crate::error::{Bound, Error, check_all_finite, check_model, check_same, is_admissible};
use crate::model::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
use crate::process::Process;
use crate::real::check_limits;

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

    /// A stream at rest that is evaluated by `method`: [`Method::Bank`] for few operators along jumps (with the feature
    /// `simd`).
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
        self.core.memory.turning_points(self.core.origin.input)
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

    /// Continues from `state`, bit for bit; from a state of the other [`Method`], with the same outputs to 1e-12 of the
    /// range.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`] for one that this stream cannot be in (by
    /// turning points: operator outputs of a bank that no drive leads to), [`Error::Domain`] for a number that is not
    /// finite; the stream is as before then.
    pub fn set_state(&mut self, state: &StreamState) -> Result<(), Error> {
        check_model(self.fingerprint, state.model)?;
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

/// The exact inverse of a model, sample by sample: the drive that brings the model's output to the target.
///
/// It walks the same polyline as [`Forward`](super::Forward) with the roles of input and output swapped, so
/// `forward(inverse(y)) == y` to rounding. A target out of reach puts the drive at the limit, which is what the
/// memory then knows, and sets [`saturated`](Self::saturated); the drive leaves the limit without a jump when the
/// target comes back.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut inverse = model.inverse(Some((-10.0, 10.0)))?;
/// assert!((inverse.step(5.0) - 4.0).abs() < 1e-15);
/// assert_eq!(inverse.step(99.0), 10.0);
/// assert!(inverse.saturated());
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Inverse {
    core: InverseCore<f64, HeapMemory>,
    fingerprint: u64,
}

impl Inverse {
    /// An inverse at rest, the drive kept within `limits` (low, high) in the unit of the model's input.
    ///
    /// If the rest position, the input offset, lies outside the limits, the memory starts at the nearer one.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the model may not be, [`Error::Domain`] unless the limits are finite and
    /// low < high.
    pub fn new(model: &CompiledModel, limits: Option<(f64, f64)>) -> Result<Self, Error> {
        Self::start(model, limits, model.memory_at_rest())
    }

    /// An inverse that starts from the operator outputs `initial`, on the bank.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`Error::Length`] unless there is one number per operator.
    pub fn with_initial(model: &CompiledModel, limits: Option<(f64, f64)>, initial: &[f64]) -> Result<Self, Error> {
        Self::start(model, limits, model.memory_from(initial)?)
    }

    /// An inverse at rest that is evaluated by `method`.
    ///
    /// # Errors
    /// As [`new`](Self::new), and [`Error::Domain`] that names the first threshold that is not nested, for
    /// [`Method::TurningPoints`].
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Inverse, Method, Offsets, PrandtlIshlinskii, Process};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let mut inverse = Inverse::with_method(&CompiledModel::new(&(&model).into()), None, Method::Bank)?;
    /// assert!((inverse.step(5.0) - 4.0).abs() < 1e-14);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn with_method(model: &CompiledModel, limits: Option<(f64, f64)>, method: Method) -> Result<Self, Error> {
        Self::start(model, limits, model.memory_by(method)?)
    }

    /// The same of a model that need have no inverse, as it stands in a sum that has one: only its drive is moved then.
    pub(crate) fn in_sum(model: &CompiledModel, limits: Option<(f64, f64)>) -> Result<Self, Error> {
        Self::unchecked(model, limits, model.memory_at_rest())
    }

    fn start(model: &CompiledModel, limits: Option<(f64, f64)>, memory: HeapMemory) -> Result<Self, Error> {
        model.invertible?;
        Self::unchecked(model, limits, memory)
    }

    fn unchecked(model: &CompiledModel, limits: Option<(f64, f64)>, memory: HeapMemory) -> Result<Self, Error> {
        let core = InverseCore::new(memory, model.offsets.into(), check_limits(limits)?);
        Ok(Self { core, fingerprint: model.fingerprint() })
    }

    /// The present drive: the last one, or that at rest.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.core.output()
    }

    /// The output of the model at the present drive: the last target, or what a limit allows.
    #[inline]
    #[must_use]
    pub fn reached(&self) -> f64 {
        self.core.reached()
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.core.saturated()
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        self.core.limits()
    }

    /// Which algorithm evaluates the stream.
    #[must_use]
    pub fn method(&self) -> Method {
        self.core.memory().method()
    }

    /// How many targets were not finite (or beyond 1e100) and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.core.rejected()
    }

    /// The reversals of the drive that still determine the output, oldest first, in the unit of the drive. Empty for
    /// a bank. Allocates: for plots, not for the loop.
    #[must_use]
    pub fn turning_points(&self) -> alloc::vec::Vec<f64> {
        self.core.memory.turning_points(self.core.origin.input)
    }

    /// Where [`step`](Process::step) would come to.
    #[inline]
    pub(crate) fn look(&self, target: f64) -> Look {
        self.core.look(target)
    }

    /// The output of the model that [`follow_drive`](Self::follow_drive) would return.
    #[inline]
    pub(crate) fn look_at_drive(&self, drive: f64) -> f64 {
        self.core.look_at_drive(drive)
    }

    /// Puts out another drive than the one that a target asks for, and remembers it: what a controller does that adds
    /// feedback or limits a slew. The drive is kept within the limits; one that is not finite is counted and changes
    /// nothing else. Neither allocates nor panics. Returns the output of the model there.
    ///
    /// ```
    /// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let mut inverse = model.inverse(Some((-10.0, 10.0)))?;
    /// assert_eq!(inverse.follow_drive(4.0), 5.0);
    /// assert_eq!(inverse.step(4.5), 3.5); // the play holds
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[inline]
    pub fn follow_drive(&mut self, drive: f64) -> f64 {
        self.core.follow_drive(drive)
    }

    /// The same of a drive that a target led to, at a limit or not.
    #[inline]
    pub(crate) fn move_to_limit(&mut self, drive: f64, saturated: bool) {
        self.core.follow_drive(drive);
        self.core.saturated = saturated;
    }

    /// Takes over what was driven before, oldest drive first.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits; nothing is taken then.
    ///
    /// ```
    /// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let (mut actuator, mut inverse) = (model.forward(), model.inverse(Some((-10.0, 10.0)))?);
    /// let before = [7.0, -3.0, 4.0];
    /// actuator.follow(&before)?;
    /// inverse.follow(&before)?;
    /// assert!((actuator.step(inverse.step(1.0)) - 1.0).abs() < 1e-15);
    /// assert!(inverse.follow(&[99.0]).is_err());
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.core.follow(drives)
    }

    /// Goes on with the weights and the output offset of another model of the same operators, without a jump of the
    /// drive: the drive and what the operators remember of it stay, and the next target is met by the new model.
    ///
    /// The output that the new model has at the present drive, as a target, gives the present drive; any other moves it
    /// by what it differs, over a slope of the new model. From then on the stream is the one that the new model would
    /// be in after the same drives, to rounding; a model that is equal changes no bit. [`saturated`](Self::saturated)
    /// stays until the next target. Nothing is allocated. What the old model holds is freed if no other clone of it is
    /// left: keep one where freeing must wait.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the new model may not be, [`Error::OtherOperators`] if thresholds, their number or
    /// the input offset differ; the stream is as before then.
    ///
    /// ```
    /// use hysteresis_core::{CompiledModel, Offsets, PrandtlIshlinskii, Process};
    /// let model = |w| PrandtlIshlinskii::new(&[1.0, w], &[0.0, 2.0], Offsets::default());
    /// let mut inverse = model(0.5)?.inverse(None)?;
    /// assert!((inverse.step(5.0) - 4.0).abs() < 1e-15);
    /// inverse.set_model(&CompiledModel::new(&(&model(0.75)?).into()))?;
    /// assert!((inverse.step(4.0 + 0.75 * 2.0) - 4.0).abs() < 1e-15); // where it was
    /// assert!((inverse.step(3.0 + 0.75 * 2.0) - 3.0).abs() < 1e-15); // the play remembers the 2
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        model.invertible?;
        self.set_model_in_sum(model)
    }

    /// The same of a model that need have no inverse, as it stands in a sum that has one.
    pub(crate) fn set_model_in_sum(&mut self, model: &CompiledModel) -> Result<(), Error> {
        let core = &mut self.core;
        check_same("input_offset", core.origin.input, model.offsets.input)?;
        let input = core.known().input;
        if core.memory.reweigh(model, input)? {
            core.enter_segment(input, core.memory.output(input));
        }
        core.origin = model.offsets.into();
        self.fingerprint = model.fingerprint();
        Ok(())
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> StreamState {
        let Point { input: drive, output: target } = self.core.known();
        StreamState {
            model: self.fingerprint,
            last_input: target,
            last_output: drive,
            saturated: self.core.saturated,
            rejected: self.core.rejected,
            memory: self.core.memory.state(drive),
        }
    }

    /// Continues from `state`, bit for bit; from a state of the other [`Method`], with the same outputs to 1e-12 of the
    /// range.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`] for one that this stream cannot be in (by
    /// turning points: operator outputs of a bank that no drive leads to), also one whose drive lies outside the
    /// limits, [`Error::Domain`] for a number that is not finite; the stream is as before then.
    pub fn set_state(&mut self, state: &StreamState) -> Result<(), Error> {
        check_model(self.fingerprint, state.model)?;
        check_output("state.last_input", state.last_input)?;
        let (low, high) = self.core.reach;
        if !(low <= state.last_output && state.last_output <= high) {
            return Err(Error::State { expected: "a drive within the limits of the stream" });
        }
        self.core.memory.restore(&state.memory, state.last_output, state.last_input)?;
        self.core.saturated = state.saturated;
        self.core.rejected = state.rejected;
        self.core.enter_segment(state.last_output, state.last_input);
        Ok(())
    }
}

impl Process for Inverse {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        self.core.step(target)
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        self.core.look(target).drive
    }

    fn reset(&mut self) {
        self.core.reset();
    }

    fn run(&mut self, input: &[f64], output: &mut [f64]) -> Result<(), Error> {
        self.core.run(input, output)
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
    /// The exact inverse as a stream at rest, the drive kept within `limits` (low, high).
    ///
    /// # Errors
    /// As [`Inverse::new`].
    pub fn inverse(&self, limits: Option<(f64, f64)>) -> Result<Inverse, Error> {
        Inverse::new(&CompiledModel::new(self), limits)
    }
}

impl PrandtlIshlinskii {
    /// The exact inverse as a stream at rest, the drive kept within `limits` (low, high).
    ///
    /// # Errors
    /// As [`Inverse::new`].
    pub fn inverse(&self, limits: Option<(f64, f64)>) -> Result<Inverse, Error> {
        ModifiedPrandtlIshlinskii::from(self).inverse(limits)
    }
}

/// Everything that a stream remembers: restored, it continues bit for bit; by a bank, on a processor of the same kind.
///
/// A stream of the other [`Method`](crate::Method) takes the state too, and goes on with the same outputs to 1e-12 of
/// the range. Operator outputs that no drive leads to, as arbitrary initial ones may be, are known to a bank alone.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let thresholds = [0.0, 150.0, 300.0]; // V
/// let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default())?;
/// let mut stream = actuator.forward();
/// stream.step(300.0);
/// let saved = stream.state();
/// let next = stream.step(-100.0);
/// let mut other = actuator.forward();
/// other.set_state(&saved)?;
/// assert_eq!(other.step(-100.0), next);
///
/// let mut bank = Forward::with_method(&CompiledModel::new(&actuator), Method::Bank)?;
/// bank.set_state(&saved)?;
/// assert!((bank.step(-100.0) - next).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct StreamState {
    /// The fingerprint of the model: a state is restored into a stream of the same model only.
    pub model: u64,
    /// The last accepted sample, relative to the offset of the model on that side (for an inverse at a limit: the
    /// output that the limit allows).
    pub last_input: f64,
    /// The last output, relative to the offset of the model on that side.
    pub last_output: f64,
    /// Whether the last target was out of reach (inverse only).
    pub saturated: bool,
    /// How many inputs were rejected.
    pub rejected: u64,
    /// What the operators remember.
    #[cfg_attr(feature = "serde", serde(with = "memory_form"))]
    pub memory: MemoryState,
}

/// An admissible input in a saved state, relative to an offset that is admissible too.
fn check_input(parameter: &'static str, got: f64) -> Result<(), Error> {
    if is_admissible(0.5 * got) {
        Ok(())
    } else {
        Err(Error::Domain { parameter, index: None, expected: Bound::Finite, got })
    }
}

/// An output of the model in a saved state: inputs and weights of any admissible size may have made it larger than
/// they.
fn check_output(parameter: &'static str, got: f64) -> Result<(), Error> {
    if got.is_finite() { Ok(()) } else { Err(Error::Domain { parameter, index: None, expected: Bound::Finite, got }) }
}

#[cfg(feature = "serde")]
mod memory_form {
    //! A memory in a saved state. Text names its form by a tag beside the other fields. Formats without names of fields
    //! cannot have such a tag, so they get the number of the form first.

    use alloc::borrow::Cow;

    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::engine::{BankState, Direction, MemoryState, TurningPointState};

    /// Numbers in files: a new form comes last.
    #[derive(Serialize, Deserialize)]
    enum Numbered<'a> {
        TurningPoints(Cow<'a, TurningPointState>),
        Bank { outputs: Cow<'a, [f64]> },
        BankOnLine { outputs: Cow<'a, [f64]>, direction: Direction },
        BankAfterSmallMoves { outputs: Cow<'a, [f64]>, small_moves: u8 },
    }

    impl<'a> From<&'a MemoryState> for Numbered<'a> {
        fn from(memory: &'a MemoryState) -> Self {
            match memory {
                MemoryState::TurningPoints(state) => Self::TurningPoints(Cow::Borrowed(state)),
                MemoryState::Bank(BankState { outputs, line, small_moves }) => {
                    let outputs = Cow::Borrowed(&**outputs);
                    match (line, *small_moves) {
                        (Some(direction), _) => Self::BankOnLine { outputs, direction: *direction },
                        (None, 0) => Self::Bank { outputs },
                        (None, small_moves) => Self::BankAfterSmallMoves { outputs, small_moves },
                    }
                }
            }
        }
    }

    impl From<Numbered<'_>> for MemoryState {
        fn from(numbered: Numbered<'_>) -> Self {
            let bank = |outputs: Cow<'_, [f64]>, line, small_moves| {
                Self::Bank(BankState { outputs: outputs.into_owned().into(), line, small_moves })
            };
            match numbered {
                Numbered::TurningPoints(state) => Self::TurningPoints(state.into_owned()),
                Numbered::Bank { outputs } => bank(outputs, None, 0),
                Numbered::BankOnLine { outputs, direction } => bank(outputs, Some(direction), 0),
                Numbered::BankAfterSmallMoves { outputs, small_moves } => bank(outputs, None, small_moves),
            }
        }
    }

    pub(super) fn serialize<S: Serializer>(memory: &MemoryState, serializer: S) -> Result<S::Ok, S::Error> {
        if serializer.is_human_readable() {
            memory.serialize(serializer)
        } else {
            Numbered::from(memory).serialize(serializer)
        }
    }

    pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<MemoryState, D::Error> {
        if deserializer.is_human_readable() {
            MemoryState::deserialize(deserializer)
        } else {
            Numbered::deserialize(deserializer).map(MemoryState::from)
        }
    }
}
