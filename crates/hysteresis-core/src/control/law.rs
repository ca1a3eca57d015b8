//! Equation (8) for one sample: from one state of the loop to the next.

use super::command::Mode;
use super::gate::Reading;
use super::limiter::{Limiter, approach};
use super::loop_state::{LoopState, StopRamp};
use super::options::{AntiWindup, ControllerOptions, Gains, Law};
use super::terms::{Counters, Terms};
use crate::error::{Error, check_positive};
use crate::filter::{FilterState, Sections};

/// What the integral keeps of a sample.
#[derive(Clone, Copy, Debug)]
enum IntegratorUpdate {
    /// No error that pushes a limited drive further.
    Conditional,
    /// All errors, less a share of what the limiter cut off. Without a share, one sample over the integral time.
    BackCalculation { share: Option<f64> },
    /// All errors, less all that the limiter cut off. An incremental law starts from the drive that went out, which is the
    /// positional law with such an integral.
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
        let bumpless_samples = options.bumpless_samples()?;
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

    /// The filters after an error. They are at rest where a motion begins or the feedback returns; they wait while there is none,
    /// and where single measurements are missing.
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
        let left = samples.saturating_sub(1);
        let rest = if left > 0 { bumpless * (f64::from(left) / f64::from(samples)) } else { 0.0 };
        after.bumpless_samples = if jump == 0.0 { left } else { self.bumpless_samples };
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
        *saturated_count = saturated_count.saturating_add(limited.saturated.into());
        *slewing_count = slewing_count.saturating_add(limited.slewing.into());
    }
}
