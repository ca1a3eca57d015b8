//! Learning sample by sample, one period later.

use hysteresis_core::{Fingerprint, check_model, is_admissible};
use serde::{Deserialize, Serialize};

use super::feedback_loop::{FeedbackLoop, LoopUncertainty, response};
use super::repetitive_filters::{FREQUENCIES_PER_HARMONIC, Filters, Past, RepetitiveDesign};
use super::supervisor::{Supervisor, SupervisorState};
use crate::as_f64;
use crate::checks::{
    check_number, check_numbers, check_positive, check_same, check_same_count, check_terms, check_whole,
};
use crate::linear::{Error, dot};

/// The longest period, in samples.
const MAX_PERIOD: usize = 1 << 22;

/// Repetitive control: the correction of the target, learned in the running loop.
///
/// v(k) = sum_i q_i v(k - N + i) + gamma sum_i l_i e(k - N + i) - mean of v over the last period, i = -m..m, N samples
/// a period: Q and L of the [module](super) as finite impulse responses, Tukey windows (flat, the outer half a raised
/// cosine) around the present place of the last period: Q within 0.2 % of what it should be where it passes. Taking the
/// mean away leaves the static error to a feedback that integrates; without one, use
/// [`IterativeLearning`](super::IterativeLearning).
///
/// **Supervision.** On a loop that is too far from the model learning diverges: the error grows from period to period.
/// So its root mean square in a window, a period or as many as make 64 samples, is compared with the best one, of four
/// windows together. Above three times the best, each window whose error is larger than the one before counts once, by
/// a half or more twice; a smaller one counts back. Five counts are divergence, and so is one such error that has grown
/// by a half, beyond half the swing of the reference. What changes of the reference explain is no divergence. Noise or
/// vibration that stays above three times the best error for long may come to five counts by chance. Divergence is
/// [counted](Self::divergence_count), nothing more is learned, and the correction fades out within one period. From
/// then on it is zero, until [`restart`](Self::restart) or [`reset`](Self::reset).
///
/// [`step`](Self::step) does not allocate, lock, panic, log or read a clock, and costs 4 m + 5 multiplications.
///
/// ```
/// use hysteresis_control::learning::{FeedbackLoop, RepetitiveControl, RepetitiveOptions};
/// use hysteresis_control::linear::{Block, FirstOrder};
/// let lag = FirstOrder::new(50.0)?;
/// let open = (0.0, 0.0, hysteresis_core::Sections::default());
/// let feedback = FeedbackLoop { kp: open.0, ki: open.1, filters: open.2, slope: 1.0, dynamics: lag.into(), dt: 1e-3 };
/// let mut repetitive = RepetitiveControl::new(&feedback, 100, &RepetitiveOptions::new(100.0))?;
/// let (mut plant, mut y, mut worst) = (lag.block(1e-3)?, 0.0, 0.0);
/// for k in 0..3000 {
///     let r = (core::f64::consts::TAU * k as f64 / 100.0).sin();
///     worst = if k % 100 == 0 { 0.0 } else { f64::max(worst, f64::abs(r - y)) };
///     y = plant.advance(r + repetitive.step(r - y));
/// }
/// assert!(worst < 2e-3); // 0.4 without learning
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct RepetitiveControl {
    filters: Filters,
    bandwidth: f64,
    corrections: Past,
    errors: Past,
    references: Past,
    supervisor: Supervisor,
    /// For how many samples the correction fades out, and then stays at zero until nothing is remembered.
    fading: usize,
    /// Whether that is, or was, the end of learning.
    stopped: bool,
    divergences: u64,
    /// The sum of the corrections of the last period.
    sum: f64,
    waited: u64,
    period: usize,
    dt: f64,
    options: RepetitiveOptions,
    rejected: u64,
}

/// Whether learning goes on.
///
/// ```
/// use hysteresis_control::learning::LearningPhase;
/// assert_eq!(LearningPhase::Fading.name(), "fading");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum LearningPhase {
    /// It learns, or lets the periods pass before the first one that it learns from.
    Learning,
    /// What was learned fades out.
    Fading,
    /// It has diverged, and corrects nothing.
    Stopped,
}

impl LearningPhase {
    /// The word for it.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Learning => "learning",
            Self::Fading => "fading",
            Self::Stopped => "stopped",
        }
    }
}

impl RepetitiveControl {
    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Learns a period of `period` samples, with a model of the loop it works in.
    ///
    /// # Errors
    /// [`Error`] for a loop that is not stable, an option outside its domain, or a period that is not 8 to 2^22
    /// samples.
    pub fn new(feedback: &FeedbackLoop, period: usize, options: &RepetitiveOptions) -> Result<Self, Error> {
        options.check()?;
        check_whole("period", (8..=MAX_PERIOD).contains(&period), "8 to 2^22 samples", period)?;
        let design = RepetitiveDesign::new(feedback, period, options.uncertainty, options.gain)?;
        let (bandwidth, filters) = match options.bandwidth {
            Some(bandwidth) => (bandwidth, design.filters(bandwidth, 1.0)),
            None => design.widest()?,
        };
        let samples = period + filters.low_pass.len() / 2;
        Ok(Self {
            filters,
            bandwidth,
            corrections: Past::new(samples),
            errors: Past::new(samples),
            references: Past::new(period),
            supervisor: Supervisor::new(period),
            fading: 0,
            stopped: false,
            divergences: 0,
            sum: 0.0,
            waited: 0,
            period,
            dt: feedback.dt,
            options: *options,
            rejected: 0,
        })
    }

    /// Takes the measured error of this sample, reference minus measurement, and returns the correction that this
    /// sample's target wants. An error that is not finite teaches nothing and is counted.
    ///
    /// The reference counts as one that repeats: where it may change, use [`step_with`](Self::step_with).
    pub fn step(&mut self, error: f64) -> f64 {
        self.step_with(f64::NAN, error)
    }

    /// As [`step`](Self::step), with the reference of this sample: errors that come from its changes are not taken for
    /// divergence.
    pub fn step_with(&mut self, reference: f64, error: f64) -> f64 {
        if !is_admissible(error) {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.go_on(reference, error)
    }

    /// A sample passes from which nothing is learned.
    pub fn wait(&mut self) {
        self.go_on(f64::NAN, f64::NAN);
    }

    #[inline]
    fn go_on(&mut self, reference: f64, error: f64) -> f64 {
        let correction = self.peek();
        if self.phase() == LearningPhase::Stopped {
            return correction;
        }
        self.sum += correction - self.corrections.before(self.period);
        self.corrections.push(correction);
        let settled = self.waited >= u64::from(self.options.settle).saturating_mul(self.period as u64);
        self.waited = self.waited.saturating_add(1);
        let error = Some(error).filter(|error| is_admissible(*error));
        let learns = settled && self.fading == 0;
        self.errors.push(error.filter(|_| learns).unwrap_or_default());
        let before = self.references.before(self.period);
        let reference = Some(reference).filter(|reference| is_admissible(*reference));
        self.references.push(reference.unwrap_or(before));
        if self.fading > 0 {
            self.fade();
        } else if self.supervisor.diverges(error, reference, before) {
            self.divergences = self.divergences.saturating_add(1);
            self.stopped = true;
            self.fading = self.longest_fade();
        }
        correction
    }

    /// A period in which the correction goes to zero, and as long as anything of it is remembered.
    fn longest_fade(&self) -> usize {
        self.period + self.corrections.length()
    }

    fn fade(&mut self) {
        self.fading -= 1;
        if self.fading == 0 {
            // Exactly that is left, but for rounding.
            (self.sum, self.waited) = (0.0, 0);
            self.supervisor.forget();
        }
    }

    /// The correction that [`step`](Self::step) would return: it comes from the past alone.
    #[must_use]
    pub fn peek(&self) -> f64 {
        let share = if self.phase() == LearningPhase::Learning {
            1.0
        } else {
            as_f64(self.fading.saturating_sub(self.corrections.length())) / as_f64(self.period + 1)
        };
        if share == 0.0 {
            return 0.0;
        }
        let Filters { low_pass, learning } = &self.filters;
        let half_width = low_pass.len() / 2;
        // The window around the sample one period before the one to come.
        let (first, count) = (self.period + half_width, low_pass.len());
        let kept = dot(low_pass, self.corrections.window(first, count));
        let learned = dot(learning, self.errors.window(first, count));
        let mean = self.sum / as_f64(self.period);
        // The errors of the last period count to the end, or the correction would jump where it begins to fade.
        let correction = share * (kept + self.options.gain * learned - mean);
        let limit = self.options.limit.unwrap_or(f64::INFINITY);
        if is_admissible(correction) { correction.max(-limit).min(limit) } else { 0.0 }
    }

    /// Whether it learns.
    #[must_use]
    pub fn phase(&self) -> LearningPhase {
        match (self.fading, self.stopped) {
            (0, false) => LearningPhase::Learning,
            (0, true) => LearningPhase::Stopped,
            _ => LearningPhase::Fading,
        }
    }

    /// Whether divergence has ended learning: it is fading out or stopped, and does not begin anew by itself.
    #[must_use]
    pub fn has_ended(&self) -> bool {
        self.stopped
    }

    /// How often learning has diverged, and stopped, since it was made or [`reset`](Self::reset).
    #[must_use]
    pub fn divergence_count(&self) -> u64 {
        self.divergences
    }

    /// Learns anew: at once after it has stopped, else as soon as what was learned has faded out, so that nothing
    /// jumps.
    pub fn restart(&mut self) {
        if self.phase() == LearningPhase::Learning {
            self.fading = self.longest_fade();
        }
        self.stopped = false;
    }

    /// Up to which frequency it learns, in Hz.
    #[must_use]
    pub fn bandwidth(&self) -> f64 {
        self.bandwidth
    }

    /// How many errors were not finite.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The number of samples of a period.
    #[must_use]
    pub fn period(&self) -> usize {
        self.period
    }

    /// Everything that it remembers and what it belongs to. Allocates.
    #[must_use]
    pub fn state(&self) -> RepetitiveState {
        RepetitiveState {
            model: self.fingerprint(),
            dt: self.dt,
            period: self.period,
            options: self.options,
            corrections: self.corrections.oldest_first().to_vec(),
            errors: self.errors.oldest_first().to_vec(),
            sum: self.sum,
            waited: self.waited,
            rejected: self.rejected,
            supervision: Supervision {
                references: self.references.oldest_first().to_vec(),
                supervisor: self.supervisor.state().clone(),
                fading: self.fading,
                stopped: self.stopped,
                divergences: self.divergences,
            },
        }
    }

    /// Goes on from a state of the same loop, period and options, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what differs, or a number that is not finite; nothing changes then.
    pub fn set_state(&mut self, state: &RepetitiveState) -> Result<(), Error> {
        check_same("state.dt", self.dt, state.dt)?;
        check_same_count("state.period", self.period, state.period)?;
        let (own, saved) = (&self.options, &state.options);
        let or_none = |number: Option<f64>| number.unwrap_or(f64::INFINITY);
        check_same("state.bandwidth", or_none(own.bandwidth), or_none(saved.bandwidth))?;
        check_same("state.gain", own.gain, saved.gain)?;
        check_same_count("state.settle", own.settle as usize, saved.settle as usize)?;
        check_same("state.limit", or_none(own.limit), or_none(saved.limit))?;
        check_model(self.fingerprint(), state.model)?;
        let samples = self.corrections.oldest_first().len();
        check_numbers("state.corrections", samples, &state.corrections)?;
        check_numbers("state.errors", samples, &state.errors)?;
        check_terms("state.sum", 1, &[state.sum])?;
        self.supervise_as(&state.supervision, &state.corrections)?;
        self.corrections.restore(&state.corrections);
        self.errors.restore(&state.errors);
        (self.sum, self.waited, self.rejected) = (state.sum, state.waited, state.rejected);
        Ok(())
    }

    fn supervise_as(&mut self, saved: &Supervision, corrections: &[f64]) -> Result<(), Error> {
        let expected = "at most as many samples as the correction fades out here";
        check_whole("state.supervision.fading", saved.fading <= self.longest_fade(), expected, saved.fading)?;
        let faded = if saved.stopped || saved.fading > 0 { corrections.len().saturating_sub(saved.fading) } else { 0 };
        if let Some(index) = corrections.iter().rev().take(faded).position(|correction| *correction != 0.0) {
            let index = corrections.len() - 1 - index;
            let expected = "0, as learning has faded out by then";
            return Err(Error::domain("state.corrections", Some(index), expected, corrections[index]));
        }
        self.supervisor.check(&saved.supervisor)?;
        check_numbers("state.supervision.references", self.period, &saved.references)?;
        self.references.restore(&saved.references);
        self.supervisor.restore(&saved.supervisor);
        (self.fading, self.stopped, self.divergences) = (saved.fading, saved.stopped, saved.divergences);
        Ok(())
    }

    /// Of the filters, and so of the loop.
    fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(&self.filters.low_pass);
        fingerprint.numbers(&self.filters.learning);
        fingerprint.finish()
    }

    /// Forgets everything, the counters too.
    pub fn reset(&mut self) {
        self.corrections.clear();
        self.errors.clear();
        self.references.clear();
        self.supervisor.forget();
        (self.fading, self.stopped, self.divergences) = (0, false, 0);
        (self.sum, self.waited, self.rejected) = (0.0, 0, 0);
    }

    /// By how much the error shrinks from period to period if `truth` is the loop, at the worst frequency from the
    /// first harmonic up: max |Q - gamma L M'| with the filters as they are, cut short. Below 1 the loop is stable with
    /// learning.
    ///
    /// # Errors
    /// As [`FeedbackLoop::impulse_response`], and for another sampling interval.
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        check_same("dt", self.dt, truth.dt)?;
        let response = response(truth, FREQUENCIES_PER_HARMONIC * self.period)?;
        Ok(self.filters.rate(self.options.gain, &[response]))
    }
}

/// How to learn in the loop.
///
/// ```
/// use hysteresis_control::learning::RepetitiveOptions;
/// let options = RepetitiveOptions { settle: 3, ..RepetitiveOptions::default() };
/// assert_eq!((options.gain, options.bandwidth), (0.3, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there. Without one, as far as learning
    /// converges on every loop that the true one may be.
    pub bandwidth: Option<f64>,
    /// The gain gamma: less averages noise over more periods.
    pub gain: f64,
    /// So many periods pass before the first one that is learned from.
    pub settle: u32,
    /// The correction never exceeds this magnitude, in the unit of the displacement.
    pub limit: Option<f64>,
    /// How far the true loop may be from the believed one.
    pub uncertainty: LoopUncertainty,
}

impl RepetitiveOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth: Some(bandwidth), ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        self.bandwidth.map_or(Ok(0.0), |bandwidth| check_positive("bandwidth", None, bandwidth))?;
        check_number("gain", self.gain > 0.0 && self.gain <= 1.0, "a number above 0, at most 1", self.gain)?;
        let limit = self.limit.unwrap_or_default();
        check_number("limit", limit >= 0.0, "a number >= 0", limit)
    }
}

impl Default for RepetitiveOptions {
    /// A bandwidth that suits the loop, a gain of 0.3, one period to settle, no limit, the usual uncertainty.
    fn default() -> Self {
        Self { bandwidth: None, gain: 0.3, settle: 1, limit: None, uncertainty: LoopUncertainty::default() }
    }
}

/// Everything that a [`RepetitiveControl`](super::RepetitiveControl) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveState {
    /// The fingerprint of the loop.
    pub model: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The number of samples of a period.
    pub period: usize,
    /// How it learns.
    pub options: RepetitiveOptions,
    /// The last corrections, the oldest first.
    pub corrections: Vec<f64>,
    /// The last errors, the oldest first.
    pub errors: Vec<f64>,
    /// The sum of the corrections of the last period.
    pub sum: f64,
    /// How many samples came.
    pub waited: u64,
    /// How many errors were not finite.
    pub rejected: u64,
    /// Whether learning goes on, and what there is to tell.
    pub supervision: Supervision,
}

/// Whether learning goes on, and what there is to tell.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supervision {
    /// The references of the last period, the oldest first.
    pub references: Vec<f64>,
    /// What tells divergence.
    pub supervisor: SupervisorState,
    /// For how many samples the correction fades out, and then stays at zero until nothing is remembered.
    pub fading: usize,
    /// Whether that is, or was, the end of learning.
    pub stopped: bool,
    /// How often learning has diverged.
    pub divergences: u64,
}
