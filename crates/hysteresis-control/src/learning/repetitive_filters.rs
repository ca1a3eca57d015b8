//! The filters of repetitive control: designed as far as the loop is known, as taps around the present sample, and what
//! they remember.

use core::f64::consts::TAU;

use realfft::num_complex::Complex64;

use super::feedback_loop::{FeedbackLoop, LoopUncertainty, Spectra, learning_filter, low_pass, priors};
use crate::as_f64;
use crate::linear::Error;

/// Rates are looked for at that many frequencies between two harmonics: the filters turn slower than that.
pub(super) const FREQUENCIES_PER_HARMONIC: usize = 4;

/// A bandwidth is tried from this share of the sampling rate down, each lower than the one before by a sixth root of
/// two.
const WIDEST: f64 = 0.4;
const STEP: f64 = 0.890_898_718_140_339_3;

/// How far filters reach, in shares of what the bandwidth alone asks for: the inverse of a lightly damped mode is long.
const REACHES: [f64; 4] = [1.0, 2.0, 4.0, 8.0];

/// The error must shrink to this share in a period on every loop that the true one may be.
const CONVERGES: f64 = 0.98;

/// Q and gamma-free Q L of the module as finite impulse responses.
#[derive(Clone, Debug)]
pub(super) struct Filters {
    pub(super) low_pass: Box<[f64]>,
    pub(super) learning: Box<[f64]>,
}

impl Filters {
    /// max |Q - gamma L M'| over loops M', from the first harmonic up.
    pub(super) fn rate(&self, gain: f64, responses: &[Vec<Complex64>]) -> f64 {
        let points = 2 * (responses[0].len() - 1);
        let spectra = Spectra::new(points);
        let (low_pass, learning) = (around_zero(&spectra, &self.low_pass), around_zero(&spectra, &self.learning));
        let rate = |m: &Vec<Complex64>| {
            let filters = low_pass.iter().zip(&learning).zip(m).skip(FREQUENCIES_PER_HARMONIC);
            filters.map(|((q, l), m)| (q - l * m * gain).norm()).fold(0.0, f64::max)
        };
        responses.iter().map(rate).fold(0.0, f64::max)
    }
}

/// The response of taps around the present sample.
fn around_zero(spectra: &Spectra, taps: &[f64]) -> Vec<Complex64> {
    let (half_width, mut samples) = (taps.len() / 2, vec![0.0; spectra.period()]);
    let points = samples.len();
    for (i, tap) in taps.iter().enumerate() {
        // The tap i of the window lags the middle by half_width - i.
        samples[(points + half_width - i) % points] += tap;
    }
    spectra.transform(&samples)
}

/// What filters are made from.
pub(super) struct RepetitiveDesign {
    spectra: Spectra,
    learning: Vec<Complex64>,
    /// Of all members of the loop, the believed one first, between the harmonics too.
    responses: Vec<Vec<Complex64>>,
    period: usize,
    dt: f64,
    gain: f64,
}

impl RepetitiveDesign {
    pub(super) fn new(
        believed: &FeedbackLoop,
        period: usize,
        uncertainty: LoopUncertainty,
        gain: f64,
    ) -> Result<Self, Error> {
        let responses = uncertainty.responses(believed, FREQUENCIES_PER_HARMONIC * period)?;
        let at_harmonics: Vec<Vec<Complex64>> = responses
            .iter()
            .map(|member| member.iter().step_by(FREQUENCIES_PER_HARMONIC).take(period / 2 + 1).copied().collect())
            .collect();
        let learning = priors(&at_harmonics, believed, period)?.into_iter().map(learning_filter).collect();
        Ok(Self { spectra: Spectra::new(period), learning, responses, period, dt: believed.dt, gain })
    }

    /// The filters of a bandwidth, `reach` times as long as it alone asks for.
    pub(super) fn filters(&self, bandwidth: f64, reach: f64) -> Filters {
        let low_pass = low_pass(Some(bandwidth), self.period, self.dt);
        let half_width = half_width(self.period, bandwidth * self.dt / reach);
        let filtered = low_pass.iter().zip(&self.learning).map(|(q, l)| l * *q).collect();
        let low_pass = low_pass.iter().map(|q| (*q).into()).collect();
        Filters {
            low_pass: taps(&self.spectra.samples(low_pass), half_width),
            learning: taps(&self.spectra.samples(filtered), half_width),
        }
    }

    /// The widest bandwidth with which learning converges on every member, and the shortest filters that do.
    pub(super) fn widest(&self) -> Result<(f64, Filters), Error> {
        let lowest = 1.0 / (4.0 * as_f64(self.period) * self.dt);
        let mut bandwidth = WIDEST / self.dt;
        while bandwidth > lowest {
            for reach in REACHES {
                let filters = self.filters(bandwidth, reach);
                if filters.rate(self.gain, &self.responses) < CONVERGES {
                    return Ok((bandwidth, filters));
                }
            }
            bandwidth *= STEP;
        }
        let expected = "a gain at which some bandwidth converges on every loop that the true one may be";
        Err(Error::domain("gain", None, expected, self.gain))
    }
}

/// The filters reach that many periods of the bandwidth to either side, if the period has room for them.
const REACH: f64 = 1.5;

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

/// The last so many samples, each stored twice so that any window of them is one slice.
#[derive(Clone, Debug)]
pub(super) struct Past {
    samples: Box<[f64]>,
    next: usize,
}

impl Past {
    pub(super) fn new(length: usize) -> Self {
        Self { samples: vec![0.0; 2 * length].into(), next: 0 }
    }

    pub(super) fn length(&self) -> usize {
        self.samples.len() / 2
    }

    pub(super) fn push(&mut self, sample: f64) {
        let length = self.length();
        for index in [self.next, self.next + length] {
            if let Some(entry) = self.samples.get_mut(index) {
                *entry = sample;
            }
        }
        self.next = if self.next + 1 == length { 0 } else { self.next + 1 };
    }

    /// `count` samples, oldest first, the first of them `first` samples before the one to come.
    pub(super) fn window(&self, first: usize, count: usize) -> &[f64] {
        let start = self.next + self.length() - first;
        self.samples.get(start..start + count).unwrap_or_default()
    }

    /// The sample that came `steps` before the one to come.
    pub(super) fn before(&self, steps: usize) -> f64 {
        self.window(steps, 1).first().copied().unwrap_or_default()
    }

    pub(super) fn clear(&mut self) {
        self.samples.fill(0.0);
        self.next = 0;
    }

    /// All samples, the oldest first.
    pub(super) fn oldest_first(&self) -> &[f64] {
        self.window(self.length(), self.length())
    }

    /// Goes on from as many samples, the oldest first.
    pub(super) fn restore(&mut self, samples: &[f64]) {
        let (first, second) = self.samples.split_at_mut(samples.len());
        first.copy_from_slice(samples);
        second.copy_from_slice(samples);
        self.next = 0;
    }
}
