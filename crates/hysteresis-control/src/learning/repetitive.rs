//! Learning sample by sample, one period later.

use hysteresis_core::{Fingerprint, is_admissible};

use super::feedback_loop::FeedbackLoop;
use super::options::RepetitiveOptions;
use super::past::Past;
use super::repetitive_design::{FREQUENCIES_PER_HARMONIC, Filters, RepetitiveDesign};
use super::spectra::{as_f64, response};
use super::state::RepetitiveState;
use super::taps::dot;
use crate::linear::Error;
use crate::saved::{check_model, check_numbers, check_same, check_same_count, check_terms};

/// The longest period, in samples.
const MAX_PERIOD: usize = 1 << 22;

/// Repetitive control: the correction of the target, learned in the running loop.
///
/// v(k) = sum_i q_i v(k - N + i) + gamma sum_i l_i e(k - N + i) - mean of v over the last period, i = -m..m, N samples a
/// period: Q and L of the [module](super) as finite impulse responses, Tukey windows (flat, the outer half a
/// raised cosine) around the present place of the last period: Q within 0.2 % of what it should be where it passes. Taking the mean away leaves the static error to a feedback that integrates; without one, use
/// [`IterativeLearning`](super::IterativeLearning).
///
/// [`step`](Self::step) does not allocate, lock, panic, log or read a clock, and costs 4 m + 2 multiplications.
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
    /// The sum of the corrections of the last period.
    sum: f64,
    waited: u64,
    period: usize,
    dt: f64,
    options: RepetitiveOptions,
    rejected: u64,
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
    /// [`Error`] for a loop that is not stable, an option outside its domain, or a period that is not 8 to 2^22 samples.
    pub fn new(feedback: &FeedbackLoop, period: usize, options: &RepetitiveOptions) -> Result<Self, Error> {
        options.check()?;
        if !(8..=MAX_PERIOD).contains(&period) {
            return Err(Error::whole("period", None, "8 to 2^22 samples", period));
        }
        let design = RepetitiveDesign::new(feedback, period, options)?;
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
            sum: 0.0,
            waited: 0,
            period,
            dt: feedback.dt,
            options: *options,
            rejected: 0,
        })
    }

    /// Takes the measured error of this sample, reference minus measurement, and returns the correction that this sample's
    /// target wants. An error that is not finite teaches nothing and is counted.
    pub fn step(&mut self, error: f64) -> f64 {
        if !is_admissible(error) {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.go_on(error)
    }

    /// A sample passes from which nothing is learned.
    pub fn wait(&mut self) {
        self.go_on(f64::NAN);
    }

    #[inline]
    fn go_on(&mut self, error: f64) -> f64 {
        let correction = self.peek();
        self.sum += correction - self.corrections.before(self.period);
        self.corrections.push(correction);
        let settled = self.waited >= u64::from(self.options.settle).saturating_mul(self.period as u64);
        self.waited = self.waited.saturating_add(1);
        self.errors.push(if settled && is_admissible(error) { error } else { 0.0 });
        correction
    }

    /// The correction that [`step`](Self::step) would return: it comes from the past alone.
    #[must_use]
    pub fn peek(&self) -> f64 {
        let Filters { low_pass, learning } = &self.filters;
        let half_width = low_pass.len() / 2;
        // The window around the sample one period before the one to come.
        let (first, count) = (self.period + half_width, low_pass.len());
        let kept = dot(low_pass, self.corrections.window(first, count));
        let learned = dot(learning, self.errors.window(first, count));
        let mean = self.sum / as_f64(self.period);
        let correction = kept + self.options.gain * learned - mean;
        let limit = self.options.limit.unwrap_or(f64::INFINITY);
        if is_admissible(correction) { correction.max(-limit).min(limit) } else { 0.0 }
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
        self.corrections.restore(&state.corrections);
        self.errors.restore(&state.errors);
        (self.sum, self.waited, self.rejected) = (state.sum, state.waited, state.rejected);
        Ok(())
    }

    /// Of the filters, and so of the loop.
    fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(&self.filters.low_pass);
        fingerprint.numbers(&self.filters.learning);
        fingerprint.finish()
    }

    /// Forgets everything learned.
    pub fn reset(&mut self) {
        self.corrections.clear();
        self.errors.clear();
        (self.sum, self.waited, self.rejected) = (0.0, 0, 0);
    }

    /// By how much the error shrinks from period to period if `truth` is the loop, at the worst frequency from the first
    /// harmonic up: max |Q - gamma L M'| with the filters as they are, cut short. Below 1 the loop is stable with learning.
    ///
    /// # Errors
    /// As [`FeedbackLoop::impulse_response`], and for another sampling interval.
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        check_same("dt", self.dt, truth.dt)?;
        let response = response(truth, FREQUENCIES_PER_HARMONIC * self.period)?;
        Ok(self.filters.rate(self.options.gain, &[response]))
    }
}
