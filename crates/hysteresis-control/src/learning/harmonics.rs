//! What the periods so far tell of all harmonics, and the correction that follows.

use realfft::num_complex::Complex64;

use super::belief::{Belief, learning_filter};
use super::feedback_loop::FeedbackLoop;
use super::options::LearningOptions;
use super::spectra::{Spectra, as_f64, low_pass, response};
use super::uncertainty::Prior;
use crate::linear::Error;

/// Fewer samples have too few harmonics to tell the noise from them.
const MIN_SAMPLES: usize = 16;

/// Over that many neighbours to either side the power of the first error is averaged.
const NEIGHBOURS: usize = 2;

/// Of a harmonic that shows nothing but noise, so much of the variance of the noise may be error all the same.
const UNSEEN: f64 = 1e-3;

/// All harmonics of a period.
#[derive(Clone)]
pub(super) struct Harmonics {
    spectra: Spectra,
    low_pass: Vec<f64>,
    priors: Vec<Prior>,
    /// None before the first period.
    pub(super) beliefs: Vec<Belief>,
    /// The variance of the noise in a harmonic.
    pub(super) noise: f64,
    samples: usize,
    padded: usize,
}

impl Harmonics {
    /// Of periods of so many samples; on demand each is followed by a rest that is as long.
    pub(super) fn new(believed: &FeedbackLoop, samples: usize, options: &LearningOptions) -> Result<Self, Error> {
        let padded = if options.on_demand { 2 * samples } else { samples };
        Ok(Self {
            spectra: Spectra::new(padded),
            low_pass: low_pass(options.bandwidth, padded, believed.dt),
            priors: options.uncertainty.priors(believed, padded)?,
            beliefs: Vec::new(),
            noise: 0.0,
            samples,
            padded,
        })
    }

    /// How many there are, the mean included.
    pub(super) fn len(&self) -> usize {
        self.priors.len()
    }

    /// Learns from the measured error of a period with the correction `run`, and returns the one that follows `from`.
    pub(super) fn learn(&mut self, error: &[f64], [run, from]: [&[f64]; 2], options: &LearningOptions) -> Vec<f64> {
        let (error, correction, from) = (self.spectrum(error), self.spectrum(run), self.spectrum(from));
        if self.beliefs.is_empty() {
            self.noise = options.noise.map_or_else(
                || if self.samples < MIN_SAMPLES { 0.0 } else { upper_half(&error) },
                |noise| noise * noise * as_f64(self.samples),
            );
            self.beliefs = self.first_beliefs(&error, &correction);
        }
        let wander = self.noise * wander(options.min_gain);
        let mut next = vec![Complex64::ZERO; error.len()];
        // The mean is left to a feedback that integrates.
        for j in 1..error.len() {
            self.beliefs[j].take(error[j], correction[j], self.noise, wander);
            next[j] = self.beliefs[j].next_correction(from[j]) * self.low_pass[j];
        }
        let mut samples = self.spectra.samples(next);
        samples.truncate(self.samples);
        samples
    }

    fn spectrum(&self, samples: &[f64]) -> Vec<Complex64> {
        let mut padded = samples.to_vec();
        padded.resize(self.padded, 0.0);
        self.spectra.transform(&padded)
    }

    /// An error is expected to be as large as its neighbours show it above the noise.
    fn first_beliefs(&self, error: &[Complex64], correction: &[Complex64]) -> Vec<Belief> {
        let expected = |j: usize| {
            let near = &error[j.saturating_sub(NEIGHBOURS).max(1).min(j)..(j + NEIGHBOURS + 1).min(error.len())];
            let power = near.iter().map(Complex64::norm_sqr).sum::<f64>() / as_f64(near.len());
            (power - self.noise).max(0.0) + UNSEEN * self.noise
        };
        let first = |(j, prior): (usize, &Prior)| Belief::new(*prior, correction[j], expected(j));
        self.priors.iter().enumerate().map(first).collect()
    }

    /// max |Q (1 - L M')| with the filter L of the first period, the mean apart.
    pub(super) fn rate(&self, truth: &FeedbackLoop) -> Result<f64, Error> {
        let response = response(truth, self.padded)?;
        let filters = self.low_pass.iter().zip(&self.priors);
        let rates =
            response.iter().zip(filters).skip(1).map(|(m, (q, prior))| q * (1.0 - learning_filter(*prior) * m).norm());
        Ok(rates.fold(0.0, f64::max))
    }

    /// What tells one loop from another.
    pub(super) fn numbers(&self) -> impl Iterator<Item = f64> + '_ {
        let of_prior = |prior: &Prior| [prior.response.re, prior.response.im, prior.variance];
        self.low_pass.iter().copied().chain(self.priors.iter().flat_map(of_prior))
    }
}

/// By how much of the variance of the noise the error without a correction wanders from period to period where the gain of a period
/// never falls below `min_gain`: of a random walk P settles where q = R g^2 / (1 - g).
fn wander(min_gain: f64) -> f64 {
    min_gain * min_gain / (1.0 - min_gain).max(1e-6)
}

/// The variance of the noise in a harmonic, from the upper half of them: the median of an exponential distribution is ln 2 of its
/// mean.
fn upper_half(error: &[Complex64]) -> f64 {
    let mut powers: Vec<f64> = error[error.len() / 2..].iter().map(Complex64::norm_sqr).collect();
    let middle = powers.len() / 2;
    let (_, median, _) = powers.select_nth_unstable_by(middle, f64::total_cmp);
    *median / core::f64::consts::LN_2
}
