//! Equation (8) for one sample: from one state of the loop to the next, and which measurements are believed.

use super::limiter::{Limiter, approach};
use super::options::{AntiWindup, ControllerOptions, Gains, Law, bumpless_samples};
#[cfg(feature = "alloc")]
use crate::error::check_finite;
use crate::error::{Error, check_between, check_positive, is_admissible};
use crate::filter::{FilterState, Sections};
use crate::real::check_range;

/// What the controller does with its samples.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Mode};
/// let options = ControllerOptions::new(2.0, 1e3, 1e-4, (-500.0, 500.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.set_mode(Mode::Hold)?;
/// assert_eq!(controller.step(3.0.into(), 0.0), 0.0);
/// controller.release();
/// assert_eq!(controller.mode(), Mode::Run);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Mode {
    /// Feed-forward and feedback.
    #[default]
    Run,
    /// Feed-forward alone: the proportional term is off, the integral is frozen and stays part of the drive.
    Feedforward,
    /// The drive stays, for any reference and measurement, and nothing advances but the creep of a feed-forward that
    /// has any.
    Hold,
    /// The drive goes to a rest drive at a given rate and stays there, for any reference and measurement. Entered by
    /// [`stop`](super::HybridController::stop).
    Stop,
}

/// The terms of the last sample that was acted upon: the first four in the unit of the measurement, the others in
/// volts.
///
/// `unlimited_drive` = `feedforward` + `proportional` + `integral` + `bumpless`. Two cases differ: at the start of a
/// motion it is the present drive, to the bit, and during a stop it is the next drive of the ramp. A change of gains,
/// model or source restates the terms for the new configuration.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let set = ControllerOptions::new(2.0, 5e3, 1e-4, (-10.0, 10.0));
/// let options = ControllerOptions { start_drive: Some(1.0), ..set };
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(3.0.into(), 1.0);
/// let terms = controller.terms();
/// assert_eq!((terms.error, terms.proportional, terms.integral), (2.0, 4.0, 0.0));
/// assert_eq!((terms.bumpless, terms.drive), (-3.0, 1.0)); // starts from the drive that the amplifier has
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Terms {
    /// The reference of the feedback. With a preview it is the one that came `ahead` samples before the newest.
    pub reference: f64,
    /// The target of the feed-forward.
    pub target: f64,
    /// Reference minus measurement. Without a usable measurement it is the last error there was.
    pub error: f64,
    /// The error behind the filters; the error itself without filters.
    #[cfg_attr(feature = "serde", serde(default))]
    pub filtered_error: f64,
    /// The output of the feed-forward, or the volts that came instead.
    pub feedforward: f64,
    /// kp times the filtered error.
    pub proportional: f64,
    /// The sum of ki dt times the filtered errors, this sample included, without the samples for which the integral
    /// rests.
    pub integral: f64,
    /// What keeps starts and switches from being jumps. It goes to zero in a straight line.
    pub bumpless: f64,
    /// The drive that the law asks for, before limits and slew.
    pub unlimited_drive: f64,
    /// The drive that goes out.
    pub drive: f64,
    /// Whether the unlimited drive lay beyond the limits.
    pub saturated: bool,
    /// Whether the unlimited drive, within the limits, was farther from the last drive than the slew allows.
    pub slewing: bool,
}

impl Terms {
    /// At rest at a drive.
    fn at(drive: f64) -> Self {
        Self { unlimited_drive: drive, drive, ..Self::default() }
    }
}

/// How many samples were unusual.
///
/// ```
/// use hysteresis_core::{ControllerOptions, Counters, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 5e3, 1e-4, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(f64::NAN.into(), 1.0);
/// controller.step(3.0.into(), f64::NAN);
/// assert_eq!(controller.counters(), Counters { rejected_count: 1, missing_count: 1, ..Counters::default() });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Counters {
    /// References, targets or feed-forwards that were not finite (or beyond 1e100), or feed-forwards that did not come
    /// though they must be given.
    pub rejected_count: u64,
    /// Measurements that were not finite (or beyond 1e100).
    pub missing_count: u64,
    /// Measurements that were finite but out of their range, or too far from the last one.
    pub implausible_count: u64,
    /// Unlimited drives beyond the limits.
    pub saturated_count: u64,
    /// Unlimited drives farther from the last drive than the slew allows.
    pub slewing_count: u64,
}

/// Counts events, never past the largest number.
#[inline]
pub(super) fn add(counter: &mut u64, events: u64) {
    *counter = counter.saturating_add(events);
}

/// A term of a saved state may be this large: products and sums of admissible numbers, over any number of samples, are
/// smaller, and sums of such terms stay finite.
#[cfg(feature = "alloc")]
const LARGEST_TERM: f64 = 1e250;

#[cfg(feature = "alloc")]
pub(super) fn check_terms(terms: &[f64]) -> Result<(), Error> {
    let expected = "finite terms, at most 1e250 in magnitude";
    if terms.iter().all(|term| term.abs() <= LARGEST_TERM) { Ok(()) } else { Err(Error::State { expected }) }
}

/// Where a stop goes, and how fast.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, StopRamp};
/// let options = ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.stop(100.0, 2.0)?;
/// assert_eq!(controller.state().feedback_loop.stop, Some(StopRamp { rate: 100.0, rest_drive: 2.0 }));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct StopRamp {
    /// How fast the drive moves, in volts per second. A slower slew bounds it.
    pub rate: f64,
    /// The drive at which it ends, in volts.
    pub rest_drive: f64,
}

impl StopRamp {
    pub(super) fn check(&self, names: [&'static str; 2], limits: (f64, f64)) -> Result<(), Error> {
        check_positive(names[0], self.rate)?;
        check_between(names[1], None, self.rest_drive, limits)?;
        Ok(())
    }
}

/// What the loop itself remembers from sample to sample.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// for _ in 0..7 {
///     controller.step(3.0.into(), 1.0); // the start, 5 samples of bumpless time, and one of which the error counts
/// }
/// assert_eq!(controller.state().feedback_loop.integral, 500.0 * 1e-3 * (3.0 - 1.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct LoopState {
    /// The terms of the last sample that was acted upon. Its drive is the present one.
    pub terms: Terms,
    /// The integral from which the next sample goes on, in volts: what anti-windup left of the one in `terms`.
    pub integral: f64,
    /// What the filters of the feedback remember.
    #[cfg_attr(feature = "serde", serde(default))]
    pub filter: FilterState,
    /// Whether a motion is under way. If not, the next sample starts one from the present drive.
    pub started: bool,
    /// For how many samples the bumpless term goes on.
    pub bumpless_samples: u32,
    /// For how many samples the integral still rests. A start shortens it to its bumpless time, and one after missing
    /// measurements counts as a sample of it.
    pub integral_rest_samples: u32,
    /// Whether the last sample had a proportional term.
    pub feedback_active: bool,
    /// Whether the volts of the feed-forward came with the last sample.
    pub feedforward_given: bool,
    /// What the controller does with its samples.
    pub mode: Mode,
    /// The mode to which a hold or a stop returns.
    pub resumes: Mode,
    /// Where a stop goes; none in the other modes.
    pub stop: Option<StopRamp>,
    /// The last plausible measurement since the start.
    pub last_measurement: Option<f64>,
    /// How many measurements in a row were missing or implausible.
    pub missing_in_a_row: u32,
    /// What was counted.
    pub counters: Counters,
}

impl LoopState {
    /// At rest at a drive.
    pub(super) fn at(drive: f64) -> Self {
        Self { terms: Terms::at(drive), integral_rest_samples: u32::MAX, ..Self::default() }
    }

    /// The last error, for a measurement that is missing while the drive comes back to that of the law after a hold in
    /// the midst of a motion or a switch, or that follows such a one. To hold the drive once more then, and again and
    /// again where every other measurement is missing, would let it stand still; and feedback that comes and goes would
    /// start its filters anew each time.
    pub(super) fn stand_in_error(&self) -> Option<f64> {
        let comes_back = self.terms.bumpless != 0.0 && self.integral_rest_samples == 0;
        let stood_in = self.missing_in_a_row > 0;
        let follows = self.started && self.feedback_active && self.last_measurement.is_some();
        (follows && (comes_back || stood_in)).then_some(self.terms.error)
    }

    /// Ends the motion: the next one starts from the present drive, with an integral that rests at first. The position
    /// may be anywhere then, so the next measurement is not compared with the last one.
    pub(super) fn end_motion(&mut self) {
        (self.started, self.integral_rest_samples, self.last_measurement) = (false, u32::MAX, None);
    }

    /// Lets the bumpless term take what a switch would make the drive jump by.
    pub(super) fn carry(&mut self, difference: f64, bumpless_samples: u32) {
        if difference != 0.0 {
            self.terms.bumpless += difference;
            self.bumpless_samples = bumpless_samples;
        }
    }

    /// Restates the last sample with a feed-forward that changes from `old` to `new`.
    pub(super) fn change_feedforward(&mut self, old: f64, new: f64, bumpless_samples: u32) {
        self.carry(old - new, bumpless_samples);
        self.terms.feedforward += new - old;
        self.feedforward_given = false;
    }

    /// Whether a controller with these limits can be in this state: only such a state is ever restored.
    #[cfg(feature = "alloc")]
    pub(super) fn check(&self, limits: (f64, f64), filters: &Sections) -> Result<(), Error> {
        let Terms { reference, target, error, filtered_error, feedforward, .. } = self.terms;
        let Terms { proportional, integral, bumpless, unlimited_drive, .. } = self.terms;
        filters.check(&self.filter)?;
        check_between("state.feedback_loop.terms.drive", None, self.terms.drive, limits)?;
        check_finite("state.feedback_loop.terms.target", None, target)?;
        check_finite("state.feedback_loop.last_measurement", None, self.last_measurement.unwrap_or(0.0))?;
        // A smoothed reference may lie beyond those that it is made of, by rounding.
        check_terms(&[reference, error, filtered_error, feedforward])?;
        check_terms(&[proportional, integral, bumpless, unlimited_drive, self.integral])?;
        if !matches!(self.resumes, Mode::Run | Mode::Feedforward)
            || ![self.resumes, Mode::Hold, Mode::Stop].contains(&self.mode)
        {
            return Err(Error::State { expected: "a mode that is the one it resumes, a hold or a stop" });
        }
        match (self.mode, &self.stop) {
            (Mode::Stop, Some(ramp)) => {
                ramp.check(["state.feedback_loop.stop.rate", "state.feedback_loop.stop.rest_drive"], limits)
            }
            (Mode::Run | Mode::Feedforward | Mode::Hold, None) => Ok(()),
            _ => Err(Error::State { expected: "a rate and a rest drive if, and only if, the mode is a stop" }),
        }
    }
}

/// What a measurement is taken for.
#[derive(Clone, Copy, Debug)]
pub(super) enum Reading {
    /// A measurement to work with.
    Plausible(f64),
    /// Not finite, or beyond 1e100.
    Missing,
    /// Finite, but out of range or too far from the last one.
    Implausible,
}

impl Reading {
    pub(super) fn is_plausible(self) -> bool {
        matches!(self, Self::Plausible(_))
    }
}

/// The bounds of plausible measurements, infinite where there are none.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gate {
    range: (f64, f64),
    /// The largest change in one sample.
    step: f64,
    /// After so many unusable measurements in a row the change is not looked at.
    patience: u32,
}

impl Gate {
    pub(super) fn new(options: &ControllerOptions) -> Result<Self, Error> {
        if let Some(range) = options.measurement_range {
            check_range("measurement_range", range, "the lowest measurement")?;
        }
        let step = match options.max_measurement_step {
            Some(step) => check_positive("max_measurement_step", step)?,
            None => f64::INFINITY,
        };
        let range = options.measurement_range.unwrap_or((f64::NEG_INFINITY, f64::INFINITY));
        // A single spike is never taken, even where no measurement may be missing.
        Ok(Self { range, step, patience: options.max_missing.max(1) })
    }

    /// Judges a measurement. It may have moved by a step for every sample since the last plausible one.
    #[inline]
    pub(super) fn read(&self, measurement: f64, now: &LoopState) -> Reading {
        if !is_admissible(measurement) {
            return Reading::Missing;
        }
        if measurement < self.range.0 || measurement > self.range.1 {
            return Reading::Implausible;
        }
        let allowed = self.step * (f64::from(now.missing_in_a_row) + 1.0);
        let far = now.last_measurement.is_some_and(|last| (measurement - last).abs() > allowed);
        if far && now.missing_in_a_row < self.patience { Reading::Implausible } else { Reading::Plausible(measurement) }
    }
}

impl LoopState {
    /// Remembers a reading, and counts one that is not plausible.
    #[inline]
    pub(super) fn take_reading(&mut self, reading: Reading) {
        let count = match reading {
            Reading::Plausible(measurement) => {
                (self.last_measurement, self.missing_in_a_row) = (Some(measurement), 0);
                return;
            }
            Reading::Missing => &mut self.counters.missing_count,
            Reading::Implausible => &mut self.counters.implausible_count,
        };
        add(count, 1);
        self.missing_in_a_row = self.missing_in_a_row.saturating_add(1);
    }
}

/// What the integral keeps of a sample.
#[derive(Clone, Copy, Debug)]
enum IntegratorUpdate {
    /// No error that pushes a limited drive further.
    Conditional,
    /// All errors, less a share of what the limiter cut off. Without a share, one sample over the integral time.
    BackCalculation { share: Option<f64> },
    /// All errors, less all that the limiter cut off. An incremental law starts from the drive that went out, which is
    /// the positional law with such an integral.
    Incremental,
}

/// What does not change from sample to sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Rules {
    pub(super) gains: Gains,
    pub(super) filters: Sections,
    update: IntegratorUpdate,
    dt: f64,
    /// How many samples the bumpless term takes to go to zero.
    pub(super) bumpless_samples: u32,
    pub(super) max_missing: u32,
}

/// Numbers that were found admissible.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) reference: f64,
    pub(super) target: f64,
    /// Whether the target comes from a preview whose window was filling until now.
    pub(super) window_filled: bool,
    pub(super) reading: Reading,
    /// What the feedback takes: the measurement, or what stands for it.
    pub(super) seen: Option<f64>,
    /// Volts instead of those of the source.
    pub(super) given: Option<f64>,
}

impl Rules {
    pub(super) fn new(options: &ControllerOptions) -> Result<Self, Error> {
        let dt = options.checked_dt()?;
        let filters = options.filters;
        let gains = Gains::new(options.kp, options.ki, dt, &filters)?;
        let update = match (options.law, options.anti_windup) {
            (Law::Incremental, _) => IntegratorUpdate::Incremental,
            (Law::Positional, AntiWindup::Conditional) => IntegratorUpdate::Conditional,
            (Law::Positional, AntiWindup::BackCalculation { tracking_time }) => {
                let share = |time| check_positive("tracking_time", time).map(|time| (dt / time).min(1.0));
                IntegratorUpdate::BackCalculation { share: tracking_time.map(share).transpose()? }
            }
        };
        let bumpless_samples = bumpless_samples(options.bumpless_time, dt)?;
        Ok(Self { gains, filters, update, dt, bumpless_samples, max_missing: options.max_missing })
    }

    /// The loop after a sample that is acted upon, whose feed-forward is `feedforward`.
    #[inline]
    pub(super) fn act(&self, before: &LoopState, limiter: &Limiter, sample: &Sample, feedforward: f64) -> LoopState {
        let feedback = sample.seen.is_some() && before.mode == Mode::Run;
        let error = sample.seen.map_or(before.terms.error, |seen| sample.reference - seen);
        let filter = self.filtered(before, feedback, error);
        let proportional = if feedback { self.gains.kp * filter.output } else { 0.0 };
        let integrates = feedback && before.integral_rest_samples == 0;
        let change = if integrates { self.gains.ki_dt * filter.output } else { 0.0 };
        let integral = before.integral + change;
        let wanted = feedforward + proportional + integral;
        let last = before.terms.drive;
        let mut after = LoopState { filter, ..*before };
        let (bumpless, unlimited_drive) = if before.started {
            let jump = jump(before, sample, feedback, proportional, feedforward);
            let bumpless = self.bumpless(&mut after, jump);
            after.integral_rest_samples = before.integral_rest_samples.saturating_sub(1);
            (bumpless, wanted + bumpless)
        } else {
            after.bumpless_samples = if last == wanted { 0 } else { self.bumpless_samples };
            // Where measurements are missing again and again, every sample that is acted upon may be a start.
            let waited = u32::from(before.missing_in_a_row > 0);
            let rest = before.integral_rest_samples.saturating_sub(waited);
            after.integral_rest_samples = rest.min(after.bumpless_samples);
            (last - wanted, last)
        };
        (after.started, after.feedback_active, after.feedforward_given) = (true, feedback, sample.given.is_some());
        let (Sample { reference, target, .. }, filtered_error) = (*sample, filter.output);
        after.terms = Terms {
            reference,
            target,
            error,
            filtered_error,
            feedforward,
            proportional,
            integral,
            bumpless,
            ..before.terms
        };
        after.put_out(unlimited_drive, limiter);
        if feedback {
            after.integral = self.updated(before.integral, change, unlimited_drive - after.terms.drive);
        }
        after.take_reading(sample.reading);
        after
    }

    /// The loop after a sample of a stop.
    #[inline]
    pub(super) fn ramp(&self, before: &LoopState, limiter: &Limiter, ramp: &StopRamp) -> LoopState {
        let mut after = *before;
        after.put_out(approach(ramp.rest_drive, before.terms.drive, ramp.rate * self.dt), limiter);
        after
    }

    /// The filters after an error. They are at rest where a motion begins or the feedback returns; they wait while
    /// there is none, and where single measurements are missing.
    #[inline]
    fn filtered(&self, before: &LoopState, feedback: bool, error: f64) -> FilterState {
        if !feedback {
            before.filter
        } else if before.feedback_active && before.last_measurement.is_some() {
            self.filters.next(&before.filter, error)
        } else {
            self.filters.at_rest(error)
        }
    }

    /// What is left of the bumpless term: it goes down by the same amount at every sample, and takes a jump.
    #[inline]
    fn bumpless(&self, after: &mut LoopState, jump: f64) -> f64 {
        let (bumpless, samples) = (after.terms.bumpless, after.bumpless_samples);
        let rest = bumpless_share(samples).map_or(0.0, |share| bumpless * share);
        after.bumpless_samples = if jump == 0.0 { samples.saturating_sub(1) } else { self.bumpless_samples };
        rest - jump
    }

    /// What the integral keeps, `excess` being what the limiter cut off.
    #[inline]
    fn updated(&self, integral: f64, change: f64, excess: f64) -> f64 {
        let sum = integral + change;
        match self.update {
            IntegratorUpdate::Conditional => {
                let pushes = (excess > 0.0 && change > 0.0) || (excess < 0.0 && change < 0.0);
                if pushes { integral } else { sum }
            }
            // Without integral action there is nothing that could wind up, nor bring back what is taken.
            IntegratorUpdate::BackCalculation { .. } if self.gains.ki_dt == 0.0 => sum,
            IntegratorUpdate::BackCalculation { share } => {
                sum - excess * share.unwrap_or_else(|| self.gains.integral_share())
            }
            IntegratorUpdate::Incremental => sum - excess,
        }
    }
}

/// What share of a bumpless term that goes on for so many samples is left after the next one, if any is: it goes down
/// by the same amount at each.
#[inline]
pub(super) fn bumpless_share(samples: u32) -> Option<f64> {
    let left = samples.saturating_sub(1);
    (left > 0).then(|| f64::from(left) / f64::from(samples))
}

/// What the wanted drive jumps by for other reasons than motion: the proportional term comes or goes with the feedback,
/// or the window of the preview is full and its target takes over from the first reference.
#[inline]
fn jump(before: &LoopState, sample: &Sample, feedback: bool, proportional: f64, feedforward: f64) -> f64 {
    let of_feedback = match (before.feedback_active, feedback) {
        (false, true) => proportional,
        (true, false) => -before.terms.proportional,
        _ => 0.0,
    };
    let taken_over = sample.window_filled && sample.given.is_none();
    let of_preview = if taken_over { feedforward - before.terms.feedforward } else { 0.0 };
    of_feedback + of_preview
}

impl LoopState {
    /// Limits a drive, makes it the present one and counts what was cut off.
    #[inline]
    fn put_out(&mut self, unlimited_drive: f64, limiter: &Limiter) {
        let limited = limiter.limit(unlimited_drive, self.terms.drive);
        (self.terms.unlimited_drive, self.terms.drive) = (unlimited_drive, limited.drive);
        (self.terms.saturated, self.terms.slewing) = (limited.saturated, limited.slewing);
        let Counters { saturated_count, slewing_count, .. } = &mut self.counters;
        add(saturated_count, limited.saturated.into());
        add(slewing_count, limited.slewing.into());
    }
}
