//! The filters of repetitive control, as far as the loop is known.

use realfft::num_complex::Complex64;

use super::belief::learning_filter;
use super::feedback_loop::FeedbackLoop;
use super::options::RepetitiveOptions;
use super::spectra::{Spectra, as_f64, low_pass};
use super::taps::{half_width, taps};
use super::uncertainty::priors;
use crate::linear::Error;

/// Rates are looked for at that many frequencies between two harmonics: the filters turn slower than that.
pub(super) const FREQUENCIES_PER_HARMONIC: usize = 4;

/// A bandwidth is tried from this share of the sampling rate down, each lower than the one before by a sixth root of two.
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
    pub(super) fn new(believed: &FeedbackLoop, period: usize, options: &RepetitiveOptions) -> Result<Self, Error> {
        let responses = options.uncertainty.responses(believed, FREQUENCIES_PER_HARMONIC * period)?;
        let at_harmonics: Vec<Vec<Complex64>> = responses
            .iter()
            .map(|member| member.iter().step_by(FREQUENCIES_PER_HARMONIC).take(period / 2 + 1).copied().collect())
            .collect();
        let learning = priors(&at_harmonics, believed, period)?.into_iter().map(learning_filter).collect();
        let (dt, gain) = (believed.dt, options.gain);
        Ok(Self { spectra: Spectra::new(period), learning, responses, period, dt, gain })
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
