use super::feedforward::FeedForward;
use super::law::{Gains, Rules, Sample};
use super::limiter::Limiter;
use super::options::{ControllerOptions, check_drive};
use super::preview::{Preview, View};
use super::state::{ControllerState, LoopState};
use super::terms::{Counters, Terms};
use super::{Command, Mode};
use crate::engine::CompiledModel;
use crate::error::{Error, is_admissible};

/// Feed-forward and proportional-integral feedback, sample by sample: equation (8) with errata 10 to 12,
///
/// ```text
/// u(k) = H^-1[target(k)] + kp e(k) + ki (e(0) + ... + e(k)) + transition(k),   e = reference - measurement
/// ```
///
/// kept within limits and slew. Positions are in the unit of the model's output (um), drives in volts.
///
/// **The drive** is finite, within the limits and no farther than slew times dt from the last one at every sample, whatever
/// comes: it is what the amplifier gets, so nothing is added behind the limiter.
///
/// **Bad samples.** A reference, target or given feed-forward that is not finite (or beyond 1e100) leaves the drive and all
/// memory as they are and is counted. So does a measurement, up to [`max_missing`](ControllerOptions::max_missing) in a row;
/// then feed-forward goes on alone, the integral frozen, until a measurement returns. (References that come with missing
/// measurements still enter the preview, which so keeps its place in the trajectory.)
///
/// **No jumps.** A motion starts from the present drive: at the first sample, after [`reset`](Self::reset), after a hold and
/// after samples that were held, `transition` makes the output equal the last one, to the bit. When gains, model or source
/// change, it takes the difference that the change makes at the last sample, so the motion goes on; when feedback goes or
/// returns, the proportional term. It goes down to nothing in a straight line, over the time
/// [`transition`](ControllerOptions::transition). From the first sample of all, after a reset and after a hold the integral
/// rests for that time, whatever is switched meanwhile: what errs then is the start's, and would have to be unlearned
/// slowly. After samples that were held it goes on at once. The integral is kept in volts.
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan), [`commit`](Self::commit) and the changes of gains and
/// mode do not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let limits = (-500.0, 500.0); // V
/// let mut actuator = model.forward(); // an ideal one: no dynamics, no noise
/// let options = ControllerOptions::new(5.0, 0.6, limits);
/// let mut controller = HybridController::new(model.inverse(Some(limits))?.into(), None, &options)?;
/// let (mut drive, mut position) = (0.0, 0.0);
/// for k in 0..2000 {
///     let reference = 2.0 * (0.01 * f64::from(k)).sin(); // um
///     drive = controller.step(reference.into(), position);
///     position = actuator.step(drive);
/// }
/// assert!(controller.terms().error.abs() < 0.02, "one sample of motion, as the measurement is the last one");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct HybridController {
    now: LoopState,
    rules: Rules,
    limiter: Limiter,
    source: FeedForward,
    preview: Option<Preview>,
    options: ControllerOptions,
    planned: Option<Planned>,
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug)]
enum Intake {
    /// Nothing: a hold.
    Stay,
    /// The reference, the target or the feed-forward is none.
    Reject,
    /// The measurement is none, and not yet too often. The newest reference.
    Miss(f64),
    /// The newest reference, and what the law works with.
    Act(f64, Sample),
}

/// A sample that is decided upon but not taken.
#[derive(Clone, Copy, Debug)]
struct Planned {
    intake: Intake,
    after: LoopState,
}

impl HybridController {
    /// A controller that starts from the drive that the amplifier has. Allocates nothing but what it is given.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the option, what was expected and what came.
    pub fn new(feedforward: FeedForward, preview: Option<Preview>, options: &ControllerOptions) -> Result<Self, Error> {
        let limiter = options.limiter()?;
        let (rules, start) = (options.rules()?, options.start()?);
        let now = LoopState::at(start);
        Ok(Self { now, rules, limiter, source: feedforward, preview, options: *options, planned: None })
    }

    /// Takes one sample and returns the drive: bit for bit [`plan`](Self::plan) and [`commit`](Self::commit).
    #[inline]
    pub fn step(&mut self, command: Command, measurement: f64) -> f64 {
        self.planned = None;
        let intake = self.intake(command, measurement);
        let feedforward = self.move_on(&intake);
        self.now = self.after(&intake, feedforward);
        self.now.terms.drive
    }

    /// The drive that [`step`](Self::step) would return, without taking the sample.
    #[must_use]
    pub fn peek(&self, command: Command, measurement: f64) -> f64 {
        self.decide(command, measurement).after.terms.drive
    }

    /// The drive for a sample, which only [`commit`](Self::commit) takes: between the two it can be written to the
    /// amplifier, and if that fails, memory and terms are those of the drive that the amplifier still has. A plan replaces
    /// the one before; any change of the controller drops it.
    pub fn plan(&mut self, command: Command, measurement: f64) -> f64 {
        let planned = self.decide(command, measurement);
        self.planned = Some(planned);
        planned.after.terms.drive
    }

    /// Takes the sample that was planned; false if there is none.
    pub fn commit(&mut self) -> bool {
        let Some(Planned { intake, after }) = self.planned.take() else { return false };
        self.move_on(&intake);
        self.now = after;
        true
    }

    fn decide(&self, command: Command, measurement: f64) -> Planned {
        let intake = self.intake(command, measurement);
        let feedforward = match &intake {
            Intake::Act(_, sample) => sample.given.unwrap_or_else(|| self.source.peek(sample.target)),
            _ => 0.0,
        };
        Planned { intake, after: self.after(&intake, feedforward) }
    }

    #[inline]
    fn intake(&self, command: Command, measurement: f64) -> Intake {
        let Command { reference: newest, target, feedforward: given } = command;
        if self.now.mode == Mode::Hold {
            return Intake::Stay;
        }
        if !(is_admissible(newest) && given.is_none_or(is_admissible)) || (given.is_none() && self.source.is_given()) {
            return Intake::Reject;
        }
        let view = match &self.preview {
            Some(preview) => preview.look(newest),
            None => View { reference: newest, target: newest },
        };
        let (reference, target) = (view.reference, target.unwrap_or(view.target));
        if !is_admissible(target) {
            return Intake::Reject;
        }
        let error = is_admissible(measurement).then_some(reference - measurement);
        let waits = self.now.mode == Mode::Run && self.now.missing_in_a_row < self.rules.max_missing;
        if error.is_none() && waits {
            return Intake::Miss(newest);
        }
        Intake::Act(newest, Sample { reference, target, error, given })
    }

    /// Moves preview and source on; the feed-forward there.
    #[inline]
    fn move_on(&mut self, intake: &Intake) -> f64 {
        match (intake, &mut self.preview) {
            (Intake::Miss(newest) | Intake::Act(newest, _), Some(preview)) => preview.push(*newest),
            (Intake::Reject, Some(preview)) => preview.restart(),
            _ => {}
        }
        let Intake::Act(_, sample) = intake else { return 0.0 };
        let own = self.source.step(sample.target);
        sample.given.unwrap_or(own)
    }

    #[inline]
    fn after(&self, intake: &Intake, feedforward: f64) -> LoopState {
        let mut now = self.now;
        match intake {
            Intake::Stay => now,
            Intake::Reject => {
                now.started = false;
                now.counters.rejected = now.counters.rejected.saturating_add(1);
                now
            }
            Intake::Miss(_) => {
                now.started = false;
                now.miss();
                now
            }
            Intake::Act(_, sample) => {
                if sample.error.is_some() {
                    now.missing_in_a_row = 0;
                } else {
                    now.miss();
                }
                self.rules.act(&now, &self.limiter, sample, feedforward)
            }
        }
    }

    /// The present drive: what the amplifier has.
    #[must_use]
    pub fn drive(&self) -> f64 {
        self.now.terms.drive
    }

    /// The terms of the last sample that was acted upon.
    #[must_use]
    pub fn terms(&self) -> Terms {
        self.now.terms
    }

    /// What was counted.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.now.counters
    }

    /// What it was told, the gains being the present ones.
    #[must_use]
    pub fn options(&self) -> &ControllerOptions {
        &self.options
    }

    /// Where the feed-forward comes from.
    #[must_use]
    pub fn feedforward(&self) -> &FeedForward {
        &self.source
    }

    /// The preview, if there is one.
    #[must_use]
    pub fn preview(&self) -> Option<&Preview> {
        self.preview.as_ref()
    }

    /// What the controller is to do.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.now.mode
    }

    /// Changes what the controller is to do, from the next sample on and without a jump. A hold forgets neither memory nor
    /// integral; the motion after it starts from the drive that was held.
    pub fn set_mode(&mut self, mode: Mode) {
        self.planned = None;
        if mode == Mode::Hold {
            self.stop();
        } else {
            self.now.resumes = mode;
        }
        self.now.mode = mode;
    }

    /// Back from a hold to the mode before it.
    pub fn release(&mut self) {
        self.set_mode(self.now.resumes);
    }

    /// The next sample starts a motion from the present drive.
    fn stop(&mut self) {
        (self.now.started, self.now.resting) = (false, u32::MAX);
        if let Some(preview) = &mut self.preview {
            preview.restart();
        }
    }

    /// Changes the gains without a jump.
    ///
    /// # Errors
    /// [`Error::Domain`] for a gain that is negative or not finite; the controller is as before then.
    pub fn set_gains(&mut self, kp: f64, ki: f64) -> Result<(), Error> {
        let gains = Gains::new(kp, ki)?;
        self.planned = None;
        self.rules.gains = gains;
        (self.options.kp, self.options.ki) = (kp, ki);
        if self.now.feedback {
            let proportional = kp * self.now.terms.error;
            self.now.carry(self.now.terms.proportional - proportional, self.rules.fading);
            self.now.terms.proportional = proportional;
        }
        Ok(())
    }

    /// Goes on with the weights and the offset of another model of the same operators, as
    /// [`Inverse::set_model`](crate::Inverse::set_model) or [`Forward::set_model`](crate::Forward::set_model) of the source,
    /// without a jump. Allocates nothing, and frees what the old kernel holds if no other clone of it is left.
    ///
    /// # Errors
    /// As there, and [`Error::NoModel`] without a source that has one; the controller is as before then.
    pub fn set_model(&mut self, kernel: &CompiledModel) -> Result<(), Error> {
        self.source.set_model(kernel)?;
        self.planned = None;
        if self.now.started && !self.now.given {
            let feedforward = self.source.peek(self.now.terms.target);
            self.now.change_feedforward(feedforward, self.rules.fading);
        }
        Ok(())
    }

    /// Goes on with another source of the feed-forward, without a jump. While a motion is under way the new source first
    /// moves to the last target. Volts that are given are not known before the next sample: that one repeats the drive.
    pub fn set_feedforward(&mut self, source: FeedForward) {
        self.planned = None;
        self.source = source;
        if self.source.is_given() {
            self.now.started = false;
        } else if self.now.started {
            let feedforward = self.source.step(self.now.terms.target);
            self.now.change_feedforward(feedforward, self.rules.fading);
        }
    }

    /// As made, but for options and gains that were changed since and for the drive, which stays: the next motion starts
    /// from it. Source and preview forget, the counters are zero, the mode is [`Mode::Run`].
    pub fn reset(&mut self) {
        self.restart(self.now.terms.drive);
    }

    /// [`reset`](Self::reset), the amplifier being at another drive now.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    pub fn reset_at(&mut self, drive: f64) -> Result<(), Error> {
        check_drive("drive", drive, self.options.limits)?;
        self.restart(drive);
        Ok(())
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered: after a state was loaded into
    /// a controller whose amplifier is not at its drive. The next motion starts from there.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
    /// let inverse = model.inverse(Some((-500.0, 500.0)))?;
    /// let options = ControllerOptions::new(60.0, 0.6, (-500.0, 500.0));
    /// let mut controller = HybridController::new(inverse.into(), None, &options)?;
    /// controller.step(1.5.into(), 0.0);
    /// let saved = controller.state();
    /// controller.set_state(&saved)?;
    /// controller.start_at(35.0)?;
    /// assert_eq!(controller.step(1.5.into(), 0.2), 35.0); // and from there over to what the law says
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn start_at(&mut self, drive: f64) -> Result<(), Error> {
        check_drive("drive", drive, self.options.limits)?;
        self.planned = None;
        self.stop();
        self.now.terms.drive = drive;
        Ok(())
    }

    fn restart(&mut self, drive: f64) {
        self.planned = None;
        self.source.reset();
        self.stop();
        self.now = LoopState::at(drive);
    }

    /// Everything that the controller remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> ControllerState {
        ControllerState {
            feedback_loop: self.now,
            feedforward: self.source.state(),
            preview: self.preview.as_ref().map(Preview::state),
        }
    }

    /// Continues from `state`, bit for bit. The amplifier must be at the drive of the state.
    ///
    /// # Errors
    /// [`Error::State`], [`Error::Domain`] or [`Error::Length`] for a state that this controller cannot be in, also one
    /// whose drive lies outside the limits; the controller is as before then.
    pub fn set_state(&mut self, state: &ControllerState) -> Result<(), Error> {
        state.check(&self.options)?;
        match (&mut self.preview, &state.preview) {
            (None, None) => self.source.set_state(state.feedforward.as_ref())?,
            (Some(preview), Some(saved)) => {
                preview.check(saved)?;
                self.source.set_state(state.feedforward.as_ref())?;
                preview.set_state(saved);
            }
            _ => return Err(Error::State { expected: "a preview if, and only if, the controller has one" }),
        }
        self.planned = None;
        self.now = state.feedback_loop;
        Ok(())
    }
}

impl LoopState {
    /// Counts a measurement that is none.
    #[inline]
    fn miss(&mut self) {
        self.missing_in_a_row = self.missing_in_a_row.saturating_add(1);
        self.counters.missing = self.counters.missing.saturating_add(1);
    }

    /// Lets the transition take what a switch would make the drive jump by. No difference starts no transition.
    fn carry(&mut self, difference: f64, fading: u32) {
        if difference != 0.0 {
            self.terms.transition += difference;
            self.fading = fading;
        }
    }

    /// Restates the last sample with another feed-forward.
    fn change_feedforward(&mut self, feedforward: f64, fading: u32) {
        self.carry(self.terms.feedforward - feedforward, fading);
        self.terms.feedforward = feedforward;
        self.given = false;
    }
}
