//! The hybrid controller of one axis: its samples, and changes while it runs.

use super::feedforward::{FeedForward, Preview};
use super::law::{Counters, Gate, LoopState, Mode, Reading, Rules, Sample, StopRamp, Terms, add};
use super::limiter::Limiter;
use super::options::{ControllerOptions, Gains};
use super::source::{DriveSource, View};
use crate::error::{Error, check_between, check_length, is_admissible};
use crate::filter::Sections;
use crate::real::check_within_limits;

/// What is asked of one sample.
///
/// A number is a command too: `1.5.into()` asks for the position 1.5.
///
/// ```
/// use hysteresis_core::Command;
/// assert_eq!(Command::from(1.5), Command { reference: 1.5, target: None, correction: 0.0, estimate: None, feedforward: None });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The position that is wanted, in the unit of the measurement. With a [`Preview`](super::Preview) it is the
    /// position wanted `ahead` samples later.
    pub reference: f64,
    /// The target of the feed-forward, if it is not the reference (or what the preview makes of it).
    pub target: Option<f64>,
    /// What learning adds to the target of the feed-forward; the feedback goes on with the reference.
    pub correction: f64,
    /// What the feedback takes instead of the measurement: the estimate of an observer. It stands in for up to
    /// `max_missing` measurements in a row that are missing or implausible; these are counted all the same.
    pub estimate: Option<f64>,
    /// Volts that replace the output of the feed-forward for this sample. Its source follows the target all the same.
    pub feedforward: Option<f64>,
}

impl From<f64> for Command {
    #[inline]
    fn from(reference: f64) -> Self {
        Self { reference, target: None, correction: 0.0, estimate: None, feedforward: None }
    }
}

/// Feed-forward and proportional-integral feedback, sample by sample: equation (8) with errata 10 to 12,
///
/// ```text
/// u(k) = H^-1[target(k)] + kp e(k) + ki dt (e(0) + ... + e(k)) + bumpless(k),   e = F (reference - measurement)
/// ```
///
/// kept within limits and slew, F being the [`filters`](ControllerOptions::filters), one without any. Positions are in
/// the unit of the model's output (um), drives in volts, times in seconds.
///
/// **The drive** is always finite, within the limits and no farther than slew times dt from the last one. It is what
/// the amplifier gets: nothing is added behind the limiter. The first drive is that of
/// [`start_drive`](ControllerOptions::start_drive), and the slew holds from there on.
///
/// **No jumps.** A motion starts from the present drive: at the first sample, after [`reset`](Self::reset), after a
/// hold or a stop and after samples that were held, `bumpless` makes the output equal the last one, to the bit. It then
/// goes to zero in a straight line, over the time [`bumpless_time`](ControllerOptions::bumpless_time): that is the
/// lead-in of a motion ([`lead_in`](Self::lead_in)), in which the drive is not yet that of the law. When gains, model
/// or source change, `bumpless` takes the difference that the change makes at the last sample; when feedback goes or
/// returns, the proportional term.
///
/// From the first sample of all, after a reset, a hold and a stop the integral rests for the bumpless time, whatever is
/// switched meanwhile: it would only learn the errors of the start, and unlearn them slowly. After samples that were
/// held for other reasons it goes on at once. The integral is kept in volts.
///
/// **Filters** stand before both gains: so the integral never hides in them, and limits cut off nothing that they
/// remember. They are at rest where a motion begins or the feedback returns, and wait where measurements are missing.
///
/// **Memory.** The feed-forward remembers the drives that it asked for, not what the feedback adds. A stop, and
/// [`follow`](Self::follow), give it the drives that really go out. While the drive is held, its creep goes on.
///
/// **Bad samples.** A reference, target, correction or given feed-forward that is not finite (or beyond 1e100) leaves
/// the drive as it is and is counted. So does a measurement that is not finite, out of
/// [`measurement_range`](ControllerOptions::measurement_range) or farther than
/// [`max_measurement_step`](ControllerOptions::max_measurement_step) from the last one, up to
/// [`max_missing`](ControllerOptions::max_missing) in a row. Then feed-forward goes on alone, the integral frozen,
/// until a plausible measurement returns. If the drive has not come back to that of the law since it was held last, the
/// last error stands in instead: however often measurements are missing, the drive goes on. (References that come with
/// missing measurements still enter the preview, which so keeps its place in the trajectory.)
///
/// [`step`](Self::step), [`peek`](Self::peek), [`plan`](Self::plan), [`commit`](Self::commit), [`stop`](Self::stop) and
/// the changes of gains and mode do not allocate, lock, panic, log or read a clock.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let limits = (-500.0, 500.0); // V
/// let mut actuator = model.forward(); // an ideal one: no dynamics, no noise
/// let options = ControllerOptions::new(5.0, 6e3, 1e-4, limits); // V/um, V/um/s, s, V
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
pub struct HybridController<S = FeedForward> {
    pub(super) now: LoopState,
    pub(super) rules: Rules,
    pub(super) limiter: Limiter,
    gate: Gate,
    pub(super) source: S,
    pub(super) preview: Option<Preview>,
    pub(super) options: ControllerOptions,
    /// A sample that is decided upon but not taken.
    pub(super) planned: Option<Planned>,
}

/// What becomes of a sample.
#[derive(Clone, Copy, Debug)]
enum SampleStatus {
    /// Nothing: a hold.
    Held,
    /// The next drive of a stop.
    Stopping(StopRamp),
    /// The reference, the target or the feed-forward is not admissible, or there is no feed-forward.
    Rejected,
    /// The measurement is unusable, and not yet too often: the newest reference, and what the measurement was taken
    /// for.
    Waiting(f64, Reading),
    /// The newest reference, and what the law works with.
    Accepted(f64, Sample),
}

/// A sample, and the state of the loop after it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Planned {
    status: SampleStatus,
    after: LoopState,
}

impl HybridController {
    /// A controller that starts from the drive that the amplifier has. Allocates nothing but what it is given.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the option, what was expected and what came; [`Error::OtherLimits`] for an inverse
    /// that has not the limits of the controller.
    pub fn new(feedforward: FeedForward, preview: Option<Preview>, options: &ControllerOptions) -> Result<Self, Error> {
        Self::with_source(feedforward, preview, options)
    }
}

impl<S: DriveSource> HybridController<S> {
    /// The same over a source of another kind: the inverse of a model of fixed size, where nothing may allocate.
    ///
    /// # Errors
    /// As [`new`](HybridController::new).
    ///
    /// ```
    /// use hysteresis_core::embedded::{Inverse, Model};
    /// use hysteresis_core::{ControllerOptions, HybridController, Offsets};
    /// let model = Model::<f64, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.5, 0.0, 1e-4, (-10.0, 10.0)) };
    /// let inverse = Inverse::new(model, Some(options.limits))?;
    /// let mut controller = HybridController::with_source(inverse, None, &options)?;
    /// controller.step(5.0.into(), 0.0); // starts from 0 V
    /// assert!((controller.step(5.0.into(), 4.0) - (4.0 + 0.5 * 1.0)).abs() < 1e-14);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn with_source(source: S, preview: Option<Preview>, options: &ControllerOptions) -> Result<Self, Error> {
        let (limiter, rules, gate) = (Limiter::new(options)?, Rules::new(options)?, Gate::new(options)?);
        let now = LoopState::at(options.checked_start_drive()?);
        source.check_limits(options.limits)?;
        Ok(Self { now, rules, limiter, gate, source, preview, options: *options, planned: None })
    }

    /// Takes one sample and returns the drive: bit for bit [`plan`](Self::plan) and [`commit`](Self::commit).
    #[inline]
    pub fn step(&mut self, command: Command, measurement: f64) -> f64 {
        self.planned = None;
        let status = self.sample_status(command, measurement);
        let feedforward = self.advance(&status);
        self.now = self.after(&status, feedforward);
        self.follow_stop(&status);
        self.now.terms.drive
    }

    /// Takes a block of samples: bit for bit the drives of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Length`] unless all three slices have the same length; nothing is taken then.
    pub fn run(&mut self, references: &[f64], measurements: &[f64], drives: &mut [f64]) -> Result<(), Error> {
        check_length("measurements", references.len(), measurements.len())?;
        check_length("drives", references.len(), drives.len())?;
        for ((reference, measurement), drive) in references.iter().zip(measurements).zip(drives) {
            *drive = self.step((*reference).into(), *measurement);
        }
        Ok(())
    }

    /// The drive that [`step`](Self::step) would return, without taking the sample.
    #[must_use]
    pub fn peek(&self, command: Command, measurement: f64) -> f64 {
        self.decide(command, measurement).after.terms.drive
    }

    /// The drive for a sample, which only [`commit`](Self::commit) takes: between the two it can be written to the
    /// amplifier, and if that fails, memory and terms are those of the drive that the amplifier still has. A plan
    /// replaces the one before; any change of the controller drops it.
    pub fn plan(&mut self, command: Command, measurement: f64) -> f64 {
        let planned = self.decide(command, measurement);
        self.planned = Some(planned);
        planned.after.terms.drive
    }

    /// Takes the sample that was planned; false if there is none.
    pub fn commit(&mut self) -> bool {
        let Some(Planned { status, after }) = self.planned.take() else { return false };
        self.advance(&status);
        self.now = after;
        self.follow_stop(&status);
        true
    }

    /// Forgets a plan.
    pub fn discard_plan(&mut self) {
        self.planned = None;
    }

    fn decide(&self, command: Command, measurement: f64) -> Planned {
        let status = self.sample_status(command, measurement);
        let feedforward = match &status {
            SampleStatus::Accepted(_, sample) => sample.given.unwrap_or_else(|| self.source.peek(sample.target)),
            _ => 0.0,
        };
        Planned { status, after: self.after(&status, feedforward) }
    }

    #[inline]
    fn sample_status(&self, command: Command, measurement: f64) -> SampleStatus {
        let Command { reference: newest, target, correction, estimate, feedforward: given } = command;
        if let Some(ramp) = self.now.stop {
            return SampleStatus::Stopping(ramp);
        }
        if self.now.mode == Mode::Hold {
            return SampleStatus::Held;
        }
        if !(is_admissible(newest) && given.is_none_or(is_admissible)) || (given.is_none() && self.source.is_given()) {
            return SampleStatus::Rejected;
        }
        let view = match &self.preview {
            Some(preview) => preview.look(newest),
            None => View { reference: newest, target: newest, filled: false },
        };
        let window_filled = view.filled && target.is_none();
        let (reference, target) = (view.reference, target.unwrap_or(view.target) + correction);
        if !is_admissible(target) {
            return SampleStatus::Rejected;
        }
        let reading = self.gate.read(measurement, &self.now);
        let estimate = estimate.filter(|estimate| is_admissible(*estimate));
        let few = self.now.missing_in_a_row < self.rules.max_missing;
        let seen = match reading {
            Reading::Plausible(measurement) => Some(estimate.unwrap_or(measurement)),
            Reading::Missing | Reading::Implausible => {
                let stand_in = || self.now.stand_in_error().map(|error| reference - error);
                estimate.or_else(stand_in).filter(|_| few)
            }
        };
        if self.now.mode == Mode::Run && few && seen.is_none() {
            return SampleStatus::Waiting(newest, reading);
        }
        SampleStatus::Accepted(newest, Sample { reference, target, window_filled, reading, seen, given })
    }

    /// Moves preview and source on, and returns the feed-forward there.
    #[inline]
    fn advance(&mut self, status: &SampleStatus) -> f64 {
        match (status, &mut self.preview) {
            (SampleStatus::Waiting(newest, _) | SampleStatus::Accepted(newest, _), Some(preview)) => {
                preview.push(*newest);
            }
            (SampleStatus::Rejected, Some(preview)) => preview.restart(),
            _ => {}
        }
        match status {
            SampleStatus::Accepted(_, sample) => {
                let own = self.source.step(sample.target);
                sample.given.unwrap_or(own)
            }
            SampleStatus::Held | SampleStatus::Rejected | SampleStatus::Waiting(..) => {
                self.source.wait();
                0.0
            }
            SampleStatus::Stopping(_) => 0.0,
        }
    }

    /// During a stop the source remembers the drive that goes out.
    #[inline]
    fn follow_stop(&mut self, status: &SampleStatus) {
        if let SampleStatus::Stopping(_) = status {
            self.source.follow_drive(self.now.terms.drive);
        }
    }

    /// The state of the loop after a sample, whose feed-forward is `feedforward`.
    #[inline]
    fn after(&self, status: &SampleStatus, feedforward: f64) -> LoopState {
        let mut now = self.now;
        match status {
            SampleStatus::Held => {}
            SampleStatus::Stopping(ramp) => return self.rules.ramp(&now, &self.limiter, ramp),
            SampleStatus::Rejected => {
                now.started = false;
                add(&mut now.counters.rejected_count, 1);
            }
            SampleStatus::Waiting(_, reading) => {
                now.started = false;
                now.take_reading(*reading);
            }
            SampleStatus::Accepted(_, sample) => return self.rules.act(&now, &self.limiter, sample, feedforward),
        }
        now
    }

    /// Whether the feedback would take a measurement now: not one that is missing or implausible.
    #[must_use]
    #[inline]
    pub fn believes(&self, measurement: f64) -> bool {
        self.gate.read(measurement, &self.now).is_plausible()
    }

    /// What the coming measurement is compared with if this is the next reference: itself, or what the preview has for
    /// now.
    #[must_use]
    #[inline]
    pub fn reference_of_now(&self, reference: f64) -> f64 {
        self.preview.as_ref().map_or(reference, |preview| preview.look(reference).reference)
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

    /// How many samples were unusual.
    #[must_use]
    pub fn counters(&self) -> Counters {
        self.now.counters
    }

    /// For how many seconds at most, from the next sample on, the drive is not yet that of the law: until the window of
    /// the preview is full and the bumpless term is gone. Where no motion is under way, it is the lead-in of the next
    /// one. It is shorter where there is no difference to take, and longer where limits or slew hold the drive back.
    #[must_use]
    pub fn lead_in(&self) -> f64 {
        let whole = self.rules.bumpless_samples.max(1);
        let samples = match self.preview.as_ref().and_then(Preview::samples_until_full) {
            Some(filling) => filling + f64::from(whole),
            None if self.now.started => f64::from(self.now.bumpless_samples.saturating_sub(1)),
            None => f64::from(whole),
        };
        samples * self.options.dt
    }

    /// How many samples a [lead-in](Self::lead_in) takes behind a full preview.
    #[must_use]
    pub fn bumpless_samples(&self) -> u32 {
        self.rules.bumpless_samples
    }

    /// Whether the last sample was acted upon: not one that was held, rejected or waited for a measurement.
    #[must_use]
    #[inline]
    pub fn is_under_way(&self) -> bool {
        self.now.started
    }

    /// The options, with the present gains.
    #[must_use]
    pub fn options(&self) -> &ControllerOptions {
        &self.options
    }

    /// Where the feed-forward comes from.
    #[must_use]
    pub fn feedforward(&self) -> &S {
        &self.source
    }

    /// The preview, if there is one.
    #[must_use]
    pub fn preview(&self) -> Option<&Preview> {
        self.preview.as_ref()
    }

    /// What the controller does with its samples.
    #[must_use]
    pub fn mode(&self) -> Mode {
        self.now.mode
    }
}

impl<S: DriveSource> HybridController<S> {
    /// Changes what the controller does with its samples, from the next one on and without a jump. A hold forgets
    /// neither memory nor integral; the motion after it starts from the drive that was held.
    ///
    /// # Errors
    /// [`Error::StopWithoutRate`] for [`Mode::Stop`], which [`stop`](Self::stop) enters; the controller is as before
    /// then.
    pub fn set_mode(&mut self, mode: Mode) -> Result<(), Error> {
        match mode {
            Mode::Stop => return Err(Error::StopWithoutRate),
            Mode::Hold => self.hold(),
            Mode::Run | Mode::Feedforward => {
                self.now.resumes = mode;
                self.release();
            }
        }
        Ok(())
    }

    /// Holds the drive: as [`set_mode`](Self::set_mode) with [`Mode::Hold`].
    pub fn hold(&mut self) {
        self.end_motion();
        (self.now.mode, self.now.stop) = (Mode::Hold, None);
    }

    /// Ramps the drive to `rest_drive` at `rate` volts per second, or at the slew if that is slower, and holds it
    /// there.
    ///
    /// From the next sample on every [`step`](Self::step) puts out the next drive of the ramp, whatever reference and
    /// measurement come, also NaN. [`mode`](Self::mode) is [`Mode::Stop`]. A new stop replaces the one before. An
    /// inverse that feeds forward remembers the drives of the ramp; a model that is itself an inverse cannot, and stays
    /// as it is. [`release`](Self::release), or another mode, starts a motion from the drive that is reached then. The
    /// integral stays as it is, as in a hold; [`reset`](Self::reset) forgets it.
    ///
    /// # Errors
    /// [`Error::Domain`] unless the rate is above zero and the rest drive within the limits; the controller is as
    /// before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
    /// let set = ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0));
    /// let options = ControllerOptions { start_drive: Some(1.0), ..set };
    /// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
    /// controller.stop(500.0, 0.0)?; // 0.5 V per sample
    /// let drives = [0; 3].map(|_| controller.step(f64::NAN.into(), f64::NAN));
    /// assert_eq!(drives, [0.5, 0.0, 0.0]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn stop(&mut self, rate: f64, rest_drive: f64) -> Result<(), Error> {
        let ramp = StopRamp { rate, rest_drive };
        ramp.check(["rate", "rest_drive"], self.options.limits)?;
        self.end_motion();
        (self.now.mode, self.now.stop) = (Mode::Stop, Some(ramp));
        Ok(())
    }

    /// The drive moves by at most so many volts per sample from now on, besides the slew: for samples that come closer
    /// together than `dt`. Infinity takes the bound back; 0 and NaN hold the drive where it is. It is no part of the
    /// state.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
    /// let options = ControllerOptions { slew: Some(1e3), ..ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0)) }; // 1 V per sample
    /// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
    /// controller.stop(1e6, 9.0)?;
    /// let drives = [0.25, f64::INFINITY].map(|bound| {
    ///     controller.bound_step(bound);
    ///     controller.step(f64::NAN.into(), f64::NAN)
    /// });
    /// assert_eq!(drives, [0.25, 1.25]);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn bound_step(&mut self, volts: f64) {
        self.planned = None;
        self.limiter.bound_step(volts);
    }

    /// Back from a hold or a stop to the mode before it.
    pub fn release(&mut self) {
        self.planned = None;
        (self.now.mode, self.now.stop) = (self.now.resumes, None);
    }

    /// The next sample starts a motion from the present drive.
    fn end_motion(&mut self) {
        self.planned = None;
        self.now.end_motion();
        if let Some(preview) = &mut self.preview {
            preview.restart();
        }
    }

    /// Changes the gains (V/um and V/um/s) without a jump.
    ///
    /// # Errors
    /// [`Error::Domain`] for a gain that is negative (a proportional one may be, behind filters) or not finite; the
    /// controller is as before then.
    pub fn set_gains(&mut self, kp: f64, ki: f64) -> Result<(), Error> {
        let gains = Gains::new(kp, ki, self.options.dt, &self.rules.filters)?;
        self.planned = None;
        self.rules.gains = gains;
        (self.options.kp, self.options.ki) = (kp, ki);
        self.restate_proportional();
        Ok(())
    }

    /// Goes on with other filters, without a jump: with the same error what they put out stays as it was, and goes on
    /// from there.
    ///
    /// # Errors
    /// [`Error::Domain`] for no filter behind a negative gain; the controller is as before then.
    pub fn set_filters(&mut self, filters: &Sections) -> Result<(), Error> {
        let Self { options, rules, now, .. } = self;
        rules.gains = Gains::new(options.kp, options.ki, options.dt, filters)?;
        self.planned = None;
        now.filter = filters.taking_over(&now.filter, &rules.filters);
        now.terms.filtered_error = now.filter.output;
        (rules.filters, options.filters) = (*filters, *filters);
        self.restate_proportional();
        Ok(())
    }

    /// Restates the last sample with the present gain and filters.
    fn restate_proportional(&mut self) {
        if self.now.feedback_active {
            let proportional = self.rules.gains.kp * self.now.filter.output;
            self.now.carry(self.now.terms.proportional - proportional, self.rules.bumpless_samples);
            self.now.terms.proportional = proportional;
        }
    }

    /// Goes on with another source of the feed-forward, without a jump. While a motion is under way the new source
    /// first moves to the last target. Volts that are given are not known before the next sample: that one repeats the
    /// drive.
    ///
    /// # Errors
    /// [`Error::OtherLimits`] for an inverse that has not the limits of the controller; the controller is as before
    /// then.
    pub fn set_feedforward(&mut self, source: S) -> Result<(), Error> {
        source.check_limits(self.options.limits)?;
        let LoopState { terms, feedforward_given: given, .. } = self.now;
        // What the last target would give at the next sample: an inverse with creep moves on by itself.
        let old = if given { terms.feedforward } else { self.source.peek(terms.target) };
        self.planned = None;
        self.source = source;
        if self.source.is_given() {
            self.now.started = false;
        } else if self.now.started {
            self.source.step(terms.target);
            let new = self.source.peek(terms.target);
            self.now.change_feedforward(old, new, self.rules.bumpless_samples);
        }
        Ok(())
    }

    /// As made, but for options and gains that were changed since and for the drive, which stays: the next motion
    /// starts from it. Source and preview forget, the counters are zero, the mode is [`Mode::Run`].
    pub fn reset(&mut self) {
        self.restart(self.now.terms.drive);
    }

    /// [`reset`](Self::reset), the amplifier being at another drive now.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    pub fn reset_at(&mut self, drive: f64) -> Result<(), Error> {
        check_between("drive", None, drive, self.options.limits)?;
        self.restart(drive);
        Ok(())
    }

    /// Goes on from another drive that the amplifier has, with everything that is remembered: after a state was loaded
    /// into a controller whose amplifier is not at its drive. The next motion starts from there.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive outside the limits; the controller is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
    /// let inverse = model.inverse(Some((-500.0, 500.0)))?;
    /// let options = ControllerOptions::new(60.0, 6e3, 1e-4, (-500.0, 500.0));
    /// let mut controller = HybridController::new(inverse.into(), None, &options)?;
    /// controller.step(1.5.into(), 0.0);
    /// let saved = controller.state();
    /// controller.set_state(&saved)?;
    /// controller.start_at(35.0)?;
    /// assert_eq!(controller.step(1.5.into(), 0.2), 35.0); // and from there over to what the law says
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn start_at(&mut self, drive: f64) -> Result<(), Error> {
        check_between("drive", None, drive, self.options.limits)?;
        self.end_motion();
        self.now.terms.drive = drive;
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first, one per sampling interval: the feed-forward remembers it,
    /// and the next motion starts from the last of the drives. Without any nothing changes.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits, [`Error::CannotFollow`] for a
    /// feed-forward by a model that is itself an inverse, as it knows targets alone; the controller is as before then.
    ///
    /// ```
    /// use hysteresis_core::{ControllerOptions, HybridController, Offsets, PrandtlIshlinskii};
    /// let limits = (-10.0, 10.0);
    /// let inverse = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?.inverse(Some(limits))?;
    /// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, limits) };
    /// let mut controller = HybridController::new(inverse.into(), None, &options)?;
    /// controller.follow(&[8.0, 4.0])?;
    /// assert_eq!(controller.step(7.0.into(), 0.0), 4.0);
    /// assert_eq!(controller.step(7.0.into(), 0.0), 4.0); // 7 = 4 + 0.5 * 6: the play remembers the 8
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        let Some(last) = drives.last() else { return Ok(()) };
        check_within_limits("drives", drives, self.options.limits)?;
        self.source.follow(drives)?;
        self.end_motion();
        self.now.terms.drive = *last;
        Ok(())
    }

    fn restart(&mut self, drive: f64) {
        self.end_motion();
        self.source.reset();
        self.now = LoopState::at(drive);
    }
}
