//! What recorded periods tell: of one harmonic, of all of them, and the correction that follows.

use hysteresis_core::is_admissible;
use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::feedback_loop::{
    FeedbackLoop, LoopUncertainty, MIN_RESPONSE, Prior, Spectra, learning_filter, low_pass, response,
};
use crate::as_f64;
use crate::checks::{check_number, check_positive};
use crate::linear::Error;

/// How to learn.
///
/// ```
/// use hysteresis_control::learning::LearningOptions;
/// let options = LearningOptions { target_limits: Some((-3.0, 3.0)), ..LearningOptions::default() };
/// assert_eq!((options.min_gain, options.bandwidth), (0.15, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there. Without one, wherever errors show
    /// above the noise and the loop is known well enough.
    pub bandwidth: Option<f64>,
    /// Old periods are forgotten so fast that the gain never falls below this. Less averages noise over more periods.
    pub min_gain: f64,
    /// The target never leaves (low, high), in the unit of the displacement.
    pub target_limits: Option<(f64, f64)>,
    /// The root mean square of the measurement noise, in the unit of the displacement. Without one, the upper half of
    /// the harmonics of the first period tells it.
    pub noise: Option<f64>,
    /// How far the true loop may be from the believed one.
    pub uncertainty: LoopUncertainty,
    /// So many periods pass before the first one that is learned from, and after each change of the target. A lightly
    /// damped loop needs one: what rings after a change belongs to no period.
    pub settle: u32,
    /// Whether the motion is repeated on demand, from rest to rest. If not, one period follows the other. Where the
    /// target rests at its ends, up to a tenth of it at each, the correction comes and goes smoothly: so nothing jumps
    /// there.
    pub on_demand: bool,
}

impl LearningOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth: Some(bandwidth), ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        self.bandwidth.map_or(Ok(0.0), |bandwidth| check_positive("bandwidth", None, bandwidth))?;
        let holds = self.min_gain > 0.0 && self.min_gain <= 1.0;
        check_number("min_gain", holds, "a number above 0, at most 1", self.min_gain)?;
        let noise = self.noise.unwrap_or_default();
        check_number("noise", is_admissible(noise) && noise >= 0.0, "a finite number >= 0", noise)?;
        if let Some((low, high)) = self.target_limits
            && !(is_admissible(low) && is_admissible(high) && low < high)
        {
            let (index, got) = if is_admissible(low) { (1, high) } else { (0, low) };
            let expected = "finite limits, the high one above the low one";
            return Err(Error::domain("target_limits", Some(index), expected, got));
        }
        Ok(())
    }
}

impl Default for LearningOptions {
    /// No bandwidth, a gain of at least 0.15, no limits, noise as the first period tells it, the usual uncertainty, no
    /// period to settle, periods that follow each other.
    fn default() -> Self {
        let uncertainty = LoopUncertainty::default();
        Self {
            bandwidth: None,
            min_gain: 0.15,
            target_limits: None,
            noise: None,
            uncertainty,
            settle: 0,
            on_demand: false,
        }
    }
}

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
            samples,
            padded,
        })
    }

    /// How many there are, the mean included.
    pub(super) fn len(&self) -> usize {
        self.priors.len()
    }

    /// Learns from the measured error of a period with the correction `run`, and returns the one that follows `from`.
    /// There are no beliefs before the first period; `noise` is its variance in a harmonic.
    pub(super) fn learn(
        &self,
        error: &[f64],
        [run, from]: [&[f64]; 2],
        options: &LearningOptions,
        (beliefs, noise): (&mut Vec<Belief>, &mut f64),
    ) -> Vec<f64> {
        let (error, correction, from) = (self.spectrum(error), self.spectrum(run), self.spectrum(from));
        if beliefs.is_empty() {
            *noise = options.noise.map_or_else(
                || if self.samples < MIN_SAMPLES { 0.0 } else { upper_half(&error) },
                |noise| noise * noise * as_f64(self.samples),
            );
            *beliefs = self.first_beliefs(&error, &correction, *noise);
        }
        let wander = *noise * wander(options.min_gain);
        let mut next = vec![Complex64::ZERO; error.len()];
        // The mean is left to a feedback that integrates.
        for j in 1..error.len() {
            beliefs[j].take(error[j], correction[j], *noise, wander);
            next[j] = beliefs[j].next_correction(from[j]) * self.low_pass[j];
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
    fn first_beliefs(&self, error: &[Complex64], correction: &[Complex64], noise: f64) -> Vec<Belief> {
        let expected = |j: usize| {
            let near = &error[j.saturating_sub(NEIGHBOURS).max(1).min(j)..(j + NEIGHBOURS + 1).min(error.len())];
            let power = near.iter().map(Complex64::norm_sqr).sum::<f64>() / as_f64(near.len());
            (power - noise).max(0.0) + UNSEEN * noise
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

/// By how much of the variance of the noise the error without a correction wanders from period to period where the gain
/// of a period never falls below `min_gain`: of a random walk P settles where q = R g^2 / (1 - g).
fn wander(min_gain: f64) -> f64 {
    min_gain * min_gain / (1.0 - min_gain).max(1e-6)
}

/// The variance of the noise in a harmonic, from the upper half of them: the median of an exponential distribution is
/// ln 2 of its mean.
fn upper_half(error: &[Complex64]) -> f64 {
    let mut powers: Vec<f64> = error[error.len() / 2..].iter().map(Complex64::norm_sqr).collect();
    let middle = powers.len() / 2;
    let (_, median, _) = powers.select_nth_unstable_by(middle, f64::total_cmp);
    *median / core::f64::consts::LN_2
}

/// A correction costs as much as an error of this share of it: where the loop passes less, it is not worth it.
const COST: f64 = 0.02;

/// By which share of itself the error without a correction may change from period to period: what corrections change in
/// a hysteresis that is not quite inverted.
const CHANGE: f64 = 0.1;

/// The error e0 of a harmonic without a correction, and the response M of the loop there, with their joint covariance.
///
/// A correction v leaves e = e0 - M v. What is believed of both is one Gaussian in the plane of complex numbers, and
/// every period one measurement of it: a Kalman filter of two states.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Belief {
    /// The real and the imaginary part of e0.
    error: (f64, f64),
    /// Of M.
    response: (f64, f64),
    error_variance: f64,
    response_variance: f64,
    /// The covariance of e0 with M, the latter conjugate.
    covariance: (f64, f64),
}

impl Belief {
    /// Before the first period, which is run with a correction: of the error that it leaves no more is known than how
    /// large it is expected to be.
    pub(super) fn new(Prior { response, variance }: Prior, correction: Complex64, left_variance: f64) -> Self {
        Self {
            error: parts(response * correction),
            response: parts(response),
            error_variance: left_variance + correction.norm_sqr() * variance,
            response_variance: variance,
            covariance: parts(correction * variance),
        }
    }

    /// Takes the measured error of a period with a correction, its noise of this variance; `wander` is the variance
    /// that the error without a correction gains from period to period.
    fn take(&mut self, measured: Complex64, correction: Complex64, noise: f64, wander: f64) {
        let (error, response, covariance) = (complex(self.error), complex(self.response), complex(self.covariance));
        self.error_variance += wander + CHANGE * CHANGE * error.norm_sqr();
        // The covariances of both with e = e0 - M v.
        let of_error = self.error_variance - covariance * correction.conj();
        let of_response = covariance.conj() - self.response_variance * correction.conj();
        let variance = (of_error - correction * of_response).re + noise;
        // Noise that is none and an error that is known leave nothing to be learned.
        if variance.is_nan() || variance <= 0.0 {
            return;
        }
        let innovation = measured - (error - response * correction);
        self.error = parts(error + of_error / variance * innovation);
        self.response = parts(response + of_response / variance * innovation);
        self.error_variance = (self.error_variance - of_error.norm_sqr() / variance).max(0.0);
        self.response_variance = (self.response_variance - of_response.norm_sqr() / variance).max(0.0);
        self.covariance = parts(covariance - of_error * of_response.conj() / variance);
    }

    /// The next correction, towards the one with the least mean square of the error to be expected: the less the
    /// response is known, the smaller that is.
    fn next_correction(&self, correction: Complex64) -> Complex64 {
        let (error, response) = (complex(self.error), complex(self.response));
        let left = response.conj() * (error - response * correction) + complex(self.covariance);
        let cost = self.response_variance + COST * COST;
        let power = response.norm_sqr() + cost;
        correction + (left - correction * cost) / (power + MIN_RESPONSE * MIN_RESPONSE)
    }

    /// Every number of it.
    pub(super) fn numbers(&self) -> [f64; 8] {
        let Self { error, response, covariance, .. } = *self;
        let (error_variance, response_variance) = (self.error_variance, self.response_variance);
        [error.0, error.1, response.0, response.1, covariance.0, covariance.1, error_variance, response_variance]
    }
}

fn complex((re, im): (f64, f64)) -> Complex64 {
    Complex64::new(re, im)
}

fn parts(number: Complex64) -> (f64, f64) {
    (number.re, number.im)
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRUE_RESPONSE: Complex64 = Complex64::new(-0.3, 1.4);

    /// A response that is believed to be somewhere around 1 is found from what corrections do.
    #[test]
    fn a_response_is_learned_that_is_far_from_the_believed_one() {
        let without = Complex64::new(3.0, -1.0);
        let mut belief = Belief::new(Prior { response: Complex64::ONE, variance: 1.0 }, Complex64::ZERO, 10.0);
        let (mut correction, mut last) = (Complex64::ZERO, without.norm());
        for _ in 0..12 {
            belief.take(without - TRUE_RESPONSE * correction, correction, 1e-6, 0.0);
            correction = belief.next_correction(correction);
            last = (without - TRUE_RESPONSE * correction).norm();
        }
        assert!(last < 0.02 * without.norm(), "{last}");
    }

    /// An error no larger than the noise asks for no correction.
    #[test]
    fn noise_is_not_learned() {
        let prior = Prior { response: Complex64::ONE, variance: 0.01 };
        let mut belief = Belief::new(prior, Complex64::ZERO, 1e-3);
        belief.take(Complex64::new(1.0, 0.0), Complex64::ZERO, 1.0, 0.0);
        assert!(belief.next_correction(Complex64::ZERO).norm() < 2e-3);
        let mut known = Belief::new(prior, Complex64::ZERO, 1.0);
        known.take(Complex64::new(1.0, 0.0), Complex64::ZERO, 1e-3, 0.0);
        assert!(known.next_correction(Complex64::ZERO).norm() > 0.95);
    }

    /// What was corrected before counts: an error that is gone stays gone.
    #[test]
    fn a_correction_that_works_stays() {
        let correction = Complex64::new(2.0, -3.0);
        let mut belief = Belief::new(Prior { response: Complex64::ONE, variance: 0.0 }, correction, 1e-6);
        belief.take(Complex64::ZERO, correction, 1e-6, 0.0);
        assert!((belief.next_correction(correction) - correction).norm() < 0.01 * correction.norm());
    }

    /// Nothing to learn, and no noise: nothing is divided by zero.
    #[test]
    fn no_error_and_no_noise_leave_it_as_it_is() {
        let mut belief = Belief::new(Prior { response: Complex64::ONE, variance: 0.0 }, Complex64::ZERO, 0.0);
        let before = belief;
        belief.take(Complex64::ZERO, Complex64::ZERO, 0.0, 0.0);
        assert_eq!(belief, before);
        assert_eq!(belief.next_correction(Complex64::ZERO), Complex64::ZERO);
    }
}
