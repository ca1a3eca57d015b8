//! Learning sample by sample, one period later.

use core::f64::consts::TAU;

use hysteresis_core::is_admissible;
use realfft::num_complex::Complex64;

use super::FeedbackLoop;
use super::spectra::{Spectra, as_f64, response};
use crate::linear::{Error, check_positive};

/// The filters reach that many periods of the bandwidth to either side, if the period has room for them.
const REACH: f64 = 1.5;

/// The longest period, in samples.
const MAX_PERIOD: usize = 1 << 22;

/// The rate is looked for at that many frequencies between two harmonics: the filters turn slower than that.
const FREQUENCIES_PER_HARMONIC: usize = 4;

/// How to learn in the loop.
///
/// ```
/// use hysteresis_control::learning::RepetitiveOptions;
/// let options = RepetitiveOptions { settle: 3, ..RepetitiveOptions::new(150.0) };
/// assert_eq!((options.gain, options.limit), (0.3, f64::INFINITY));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RepetitiveOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there.
    pub bandwidth: f64,
    /// The gain gamma: less averages noise over more periods.
    pub gain: f64,
    /// So many periods pass before the first one that is learned from.
    pub settle: usize,
    /// The correction never exceeds this magnitude, in the unit of the displacement; infinity for no limit.
    pub limit: f64,
}

impl RepetitiveOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth, gain: 0.3, settle: 1, limit: f64::INFINITY }
    }
}

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
/// let feedback = FeedbackLoop { kp: 0.0, ki: 0.0, slope: 1.0, dynamics: lag.into(), delay: 0.0, dt: 1e-3 };
/// let mut repetitive = RepetitiveControl::new(&feedback, 100, &RepetitiveOptions::new(100.0))?;
/// let (mut plant, mut y, mut worst) = (lag.block(1e-3)?, 0.0, 0.0);
/// for k in 0..3000 {
///     let r = (core::f64::consts::TAU * k as f64 / 100.0).sin();
///     worst = if k % 100 == 0 { 0.0 } else { f64::max(worst, f64::abs(r - y)) };
///     y = plant.advance(r + repetitive.step(r - y));
/// }
/// assert!(worst < 2e-3); // 0.4 without learning
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct RepetitiveControl {
    low_pass: Box<[f64]>,
    learning: Box<[f64]>,
    corrections: Past,
    errors: Past,
    /// The sum of the corrections of the last period.
    sum: f64,
    waited: usize,
    period: usize,
    options: RepetitiveOptions,
    rejected: u64,
}

impl RepetitiveControl {
    /// Learns a period of `period` samples, with a model of the loop it works in.
    ///
    /// # Errors
    /// [`Error`] for a loop that is not stable, an option outside its domain, or a period that is not 8 to 2^22 samples.
    pub fn new(feedback: &FeedbackLoop, period: usize, options: &RepetitiveOptions) -> Result<Self, Error> {
        let error = |parameter, expected, got| Err(Error { parameter, index: None, expected, got });
        check_positive("bandwidth", None, options.bandwidth)?;
        if !(options.gain > 0.0 && options.gain <= 1.0) {
            return error("gain", "a number above 0, at most 1", options.gain);
        }
        if options.limit.is_nan() || options.limit < 0.0 {
            return error("limit", "a number >= 0", options.limit);
        }
        if !(8..=MAX_PERIOD).contains(&period) {
            return error("period", "8 to 2^22 samples", as_f64(period));
        }
        let spectra = Spectra::new(feedback, period, options.bandwidth)?;
        let half_width = half_width(period, options.bandwidth * feedback.dt);
        let filtered = spectra.low_pass.iter().zip(&spectra.learning).map(|(q, l)| l * *q).collect();
        let low_pass = spectra.low_pass.iter().map(|q| (*q).into()).collect();
        Ok(Self {
            low_pass: taps(&spectra.samples(low_pass), half_width),
            learning: taps(&spectra.samples(filtered), half_width),
            corrections: Past::new(period + half_width),
            errors: Past::new(period + half_width),
            sum: 0.0,
            waited: 0,
            period,
            options: *options,
            rejected: 0,
        })
    }

    /// Takes the measured error of this sample, reference minus measurement, and returns the correction that this sample's
    /// target wants. An error that is not finite teaches nothing and is counted.
    pub fn step(&mut self, error: f64) -> f64 {
        let correction = self.correction();
        self.sum += correction - self.corrections.before(self.period);
        self.corrections.push(correction);
        let settled = self.waited >= self.options.settle.saturating_mul(self.period);
        self.waited = self.waited.saturating_add(1);
        if !is_admissible(error) {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.errors.push(if settled && is_admissible(error) { error } else { 0.0 });
        correction
    }

    fn correction(&self) -> f64 {
        let half_width = self.low_pass.len() / 2;
        // The window around the sample one period before the one to come.
        let (first, count) = (self.period + half_width, self.low_pass.len());
        let kept = dot(&self.low_pass, self.corrections.window(first, count));
        let learned = dot(&self.learning, self.errors.window(first, count));
        let mean = self.sum / as_f64(self.period);
        let correction = kept + self.options.gain * learned - mean;
        let limit = self.options.limit;
        if correction.is_finite() { correction.clamp(-limit, limit) } else { 0.0 }
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
    /// As [`FeedbackLoop::impulse_response`].
    pub fn convergence_rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        let points = FREQUENCIES_PER_HARMONIC * self.period;
        let response = response(truth, points)?;
        let rates = response.iter().enumerate().skip(FREQUENCIES_PER_HARMONIC).map(|(j, m)| {
            let angle = TAU * as_f64(j) / as_f64(points);
            let (q, l) = (at(&self.low_pass, angle), at(&self.learning, angle));
            (q - l * m * self.options.gain).norm()
        });
        Ok(rates.fold(0.0, f64::max))
    }
}

/// The frequency response of taps around zero.
fn at(taps: &[f64], angle: f64) -> Complex64 {
    let half_width = as_f64(taps.len() / 2);
    let term = |(i, c): (usize, &f64)| Complex64::from_polar(*c, -angle * (half_width - as_f64(i)));
    taps.iter().enumerate().map(term).sum()
}

/// From a periodic impulse response the part around zero, windowed: taps for a window of samples that begins
/// `half_width` samples before its middle.
fn taps(impulse_response: &[f64], half_width: usize) -> Box<[f64]> {
    let period = impulse_response.len();
    let width = as_f64(half_width + 1);
    let tap = |i: usize| {
        // The sample i of the window lags the middle by half_width - i.
        let lag = as_f64(half_width) - as_f64(i);
        let place = lag.abs() / width;
        let window = if place < 0.5 { 1.0 } else { 0.5 * (1.0 - (TAU * place).cos()) };
        window * impulse_response[(period + half_width - i) % period]
    };
    (0..=2 * half_width).map(tap).collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the period")]
fn half_width(period: usize, bandwidth_per_sample: f64) -> usize {
    let wanted = (REACH / bandwidth_per_sample).ceil().max(1.0);
    let most = (period - 1) / 2;
    if wanted < as_f64(most) { wanted as usize } else { most }
}

fn dot(taps: &[f64], samples: &[f64]) -> f64 {
    taps.iter().zip(samples).map(|(c, x)| c * x).sum()
}

/// The last so many samples, each stored twice so that any window of them is one slice.
#[derive(Clone, Debug)]
struct Past {
    samples: Box<[f64]>,
    next: usize,
}

impl Past {
    fn new(length: usize) -> Self {
        Self { samples: vec![0.0; 2 * length].into(), next: 0 }
    }

    fn length(&self) -> usize {
        self.samples.len() / 2
    }

    fn push(&mut self, sample: f64) {
        let length = self.length();
        for place in [self.next, self.next + length] {
            if let Some(place) = self.samples.get_mut(place) {
                *place = sample;
            }
        }
        self.next = if self.next + 1 == length { 0 } else { self.next + 1 };
    }

    /// `count` samples, oldest first, the first of them `first` samples before the one to come.
    fn window(&self, first: usize, count: usize) -> &[f64] {
        let start = self.next + self.length() - first;
        self.samples.get(start..start + count).unwrap_or_default()
    }

    /// The sample that came `steps` before the one to come.
    fn before(&self, steps: usize) -> f64 {
        self.window(steps, 1).first().copied().unwrap_or_default()
    }

    fn clear(&mut self) {
        self.samples.fill(0.0);
        self.next = 0;
    }
}
