use super::segment::Segment;
use super::{StreamState, check_output};
use crate::engine::{CompiledModel, Direction, Memory, Method, Piece, Point, Reach, check_same};
use crate::error::{Bound, Error, MAX_MAGNITUDE, check_finite, check_within_limits, is_admissible};
use crate::model::{ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii};
use crate::process::Process;

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
    segment: Segment,
    offsets: Offsets,
    limits: (f64, f64),
    /// The limits relative to the input offset, as the memory counts inputs.
    reach: (f64, f64),
    memory: Memory,
    saturated: bool,
    rejected: u64,
    fingerprint: u64,
}

/// Where a target would bring an inverse.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Look {
    pub(crate) drive: f64,
    /// The output of the model there.
    pub(crate) reached: f64,
    /// Whether the target is out of reach.
    pub(crate) saturated: bool,
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

    fn start(model: &CompiledModel, limits: Option<(f64, f64)>, memory: Memory) -> Result<Self, Error> {
        model.invertible?;
        let limits = check_limits(limits)?;
        let offsets = model.offsets;
        let reach = (limits.0 - offsets.input, limits.1 - offsets.input);
        let nowhere = Segment::new(Piece::point(Direction::Rising, 0.0, 0.0), 0.0);
        let (saturated, rejected, fingerprint) = (false, 0, model.fingerprint());
        let mut stream = Self { segment: nowhere, offsets, limits, reach, memory, saturated, rejected, fingerprint };
        stream.reset();
        Ok(stream)
    }

    #[cold]
    #[inline(never)]
    fn leave_segment(&mut self, y: f64) -> f64 {
        if self.is_at(y) {
            // Where it is already, and to be found there exactly: a search would come back to within a rounding.
            self.saturated = false;
        } else if is_admissible(y) {
            let reached = self.memory.move_output(self.segment.direction_to(y), self.known(), y, self.reach);
            self.saturated = reached.saturated;
            self.enter_segment(reached.input, reached.output);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.segment.output()
    }

    /// The segment at a place of the memory. Where the line misses the place, by rounding at a kink or at a limit, the
    /// segment is a point, so that the next sample starts from exactly there.
    #[inline]
    fn enter_segment(&mut self, input: f64, output: f64) {
        let piece = self.memory.inverse_piece(input, output, self.reach);
        self.segment = Segment::new(piece, output);
        if self.segment.output() != input {
            self.stay_at(piece.direction, input, output);
        }
    }

    #[cold]
    #[inline(never)]
    fn stay_at(&mut self, direction: Direction, input: f64, output: f64) {
        self.segment = Segment::new(Piece::point(direction, output, input), output);
    }

    /// Where the memory is: its input, the drive, and its output, the target.
    #[inline]
    fn known(&self) -> Point {
        Point { input: self.segment.output(), output: self.segment.input() }
    }

    /// Whether the output `y` is the present one, and the memory has come to the drive.
    fn is_at(&self, y: f64) -> bool {
        y == self.segment.input() && self.memory.is_at(self.segment.output())
    }

    /// The input that the memory has come to, as a drive: at a limit of the reach the very limit, never beyond.
    #[inline]
    fn drive(&self, x: f64) -> f64 {
        let drive = x + self.offsets.input;
        if x >= self.reach.1 || drive >= self.limits.1 {
            self.limits.1
        } else if x <= self.reach.0 || drive <= self.limits.0 {
            self.limits.0
        } else {
            drive
        }
    }

    /// The present drive: the last one, or that at rest.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.drive(self.segment.output())
    }

    /// The output of the model at the present drive: the last target, or what a limit allows.
    #[inline]
    #[must_use]
    pub fn reached(&self) -> f64 {
        self.segment.input() + self.offsets.output
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[must_use]
    pub fn saturated(&self) -> bool {
        self.saturated
    }

    /// The limits of the drive (low, high), if there are any.
    #[must_use]
    pub fn limits(&self) -> Option<(f64, f64)> {
        (self.limits != UNLIMITED).then_some(self.limits)
    }

    /// Which algorithm evaluates the stream.
    #[must_use]
    pub fn method(&self) -> Method {
        self.memory.method()
    }

    /// How many targets were not finite (or beyond 1e100) and left drive and memory as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The reversals of the drive that still determine the output, oldest first, in the unit of the drive. Empty for
    /// a bank. Allocates: for plots, not for the loop.
    #[must_use]
    pub fn turning_points(&self) -> alloc::vec::Vec<f64> {
        self.memory.turning_points().into_iter().map(|x| x + self.offsets.input).collect()
    }

    /// Where [`step`](Process::step) would come to.
    #[inline]
    pub(crate) fn look(&self, target: f64) -> Look {
        let y = target - self.offsets.output;
        let Point { input: here, output } = self.known();
        let reach = match self.segment.peek(y) {
            Some(input) => Reach { input, output: y, saturated: false },
            None if self.is_at(y) => Reach { input: here, output, saturated: false },
            None if is_admissible(y) => {
                self.memory.peek_output(self.segment.direction_to(y), self.known(), y, self.reach)
            }
            None => Reach { input: here, output, saturated: self.saturated },
        };
        let Reach { input, output, saturated } = reach;
        Look { drive: self.drive(input), reached: output + self.offsets.output, saturated }
    }

    /// The output of the model that [`follow_drive`](Self::follow_drive) would return.
    #[inline]
    pub(crate) fn look_at_drive(&self, drive: f64) -> f64 {
        if !is_admissible(drive) {
            return self.reached();
        }
        self.memory.peek_input(self.segment.output(), self.input_at(drive)) + self.offsets.output
    }

    /// A drive, kept within the limits, as the memory counts inputs.
    #[inline]
    fn input_at(&self, drive: f64) -> f64 {
        let within = drive.max(self.limits.0).min(self.limits.1);
        (within - self.offsets.input).max(self.reach.0).min(self.reach.1)
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
        if is_admissible(drive) {
            let x = self.input_at(drive);
            self.memory.move_input(self.segment.output(), x);
            self.saturated = false;
            self.enter_segment(x, self.memory.output(x));
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.reached()
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
        check_within_limits("drives", drives, self.limits)?;
        for drive in drives {
            self.follow_drive(*drive);
        }
        Ok(())
    }

    /// Goes on with the weights and the output offset of another model of the same operators, without a jump of the
    /// drive: the drive and what the operators remember of it stay, and the next target is met by the new model.
    ///
    /// The output that the new model has at the present drive, as a target, gives the present drive; any other moves it
    /// by what it differs, over a slope of the new model. From then on the stream is the one that the new model would be
    /// in after the same drives, to rounding; a model that is equal changes no bit. [`saturated`](Self::saturated) stays
    /// until the next target. Nothing is allocated. What the old model holds is freed if no other clone of it is left:
    /// keep one where freeing must wait.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] if the new model may not be, [`Error::OtherOperators`] if thresholds, their number or the
    /// input offset differ; the stream is as before then.
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
        check_same("input_offset", self.offsets.input, model.offsets.input)?;
        let input = self.known().input;
        if self.memory.reweigh(model, input)? {
            self.enter_segment(input, self.memory.output(input));
        }
        self.offsets = model.offsets;
        self.fingerprint = model.fingerprint();
        Ok(())
    }

    /// Everything that the stream remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> StreamState {
        StreamState {
            model: self.fingerprint,
            last_input: self.segment.input(),
            last_output: self.segment.output(),
            saturated: self.saturated,
            rejected: self.rejected,
            memory: self.memory.state(),
        }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another model, [`Error::State`] for one that this stream cannot be in, also one whose drive lies outside the limits,
    /// [`Error::Domain`] for a number that is not finite; the stream is as before then.
    pub fn set_state(&mut self, state: &StreamState) -> Result<(), Error> {
        state.check_model(self.fingerprint)?;
        check_output("state.last_input", state.last_input)?;
        let (low, high) = self.reach;
        if !(low <= state.last_output && state.last_output <= high) {
            return Err(Error::State { expected: "a drive within the limits of the stream" });
        }
        self.memory.restore(&state.memory, state.last_output, state.last_input)?;
        self.saturated = state.saturated;
        self.rejected = state.rejected;
        self.enter_segment(state.last_output, state.last_input);
        Ok(())
    }
}

const UNLIMITED: (f64, f64) = (-MAX_MAGNITUDE, MAX_MAGNITUDE);

pub(crate) fn check_limits(limits: Option<(f64, f64)>) -> Result<(f64, f64), Error> {
    let Some((low, high)) = limits else { return Ok(UNLIMITED) };
    check_finite("limits", Some(0), low)?;
    check_finite("limits", Some(1), high)?;
    if low < high {
        Ok((low, high))
    } else {
        let expected = Bound::Above { what: "the low limit", limit: low };
        Err(Error::Domain { parameter: "limits", index: Some(1), expected, got: high })
    }
}

impl Process for Inverse {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        let y = target - self.offsets.output;
        let x = match self.segment.step(y) {
            Some(x) => x,
            None => self.leave_segment(y),
        };
        self.drive(x)
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        self.look(target).drive
    }

    fn reset(&mut self) {
        self.memory.reset();
        let (low, high) = self.reach;
        let start = 0.0_f64.max(low).min(high);
        let output = if start == 0.0 {
            self.memory.output(0.0)
        } else {
            self.memory.move_input(0.0, start);
            self.memory.output(start)
        };
        self.saturated = false;
        self.rejected = 0;
        self.enter_segment(start, output);
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
