//! What the periods so far tell of one harmonic.

use realfft::num_complex::Complex64;
use serde::{Deserialize, Serialize};

use super::uncertainty::Prior;

/// Where the loop passes less than this of a correction, it is learned in small steps: the feedback does most of it.
pub(super) const MIN_RESPONSE: f64 = 0.05;

/// A correction costs as much as an error of this share of it: where the loop passes less, it is not worth it.
const COST: f64 = 0.02;

/// By which share of itself the error without a correction may change from period to period: what corrections change in a
/// hysteresis that is not quite inverted.
const CHANGE: f64 = 0.1;

/// The error e0 of a harmonic without a correction, and the response M of the loop there, with their joint covariance.
///
/// A correction v leaves e = e0 - M v. What is believed of both is one Gaussian in the plane of complex numbers, and every period
/// one measurement of it: a Kalman filter of two states.
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
    /// Before the first period, which is run with a correction: of the error that it leaves no more is known than how large it is
    /// expected to be.
    pub(super) fn new(Prior { response, variance }: Prior, correction: Complex64, left_variance: f64) -> Self {
        Self {
            error: parts(response * correction),
            response: parts(response),
            error_variance: left_variance + correction.norm_sqr() * variance,
            response_variance: variance,
            covariance: parts(correction * variance),
        }
    }

    /// Takes the measured error of a period with a correction, its noise of this variance; `wander` is the variance that the error
    /// without a correction gains from period to period.
    pub(super) fn take(&mut self, measured: Complex64, correction: Complex64, noise: f64, wander: f64) {
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

    /// The next correction, towards the one with the least mean square of the error to be expected: the less the response is known, the
    /// smaller that is.
    pub(super) fn next_correction(&self, correction: Complex64) -> Complex64 {
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

/// The correction that belongs to an error of a linear loop: conj(M) / (|M|^2 + its variance + 0.05^2).
pub(super) fn learning_filter(Prior { response, variance }: Prior) -> Complex64 {
    response.conj() / (response.norm_sqr() + variance + MIN_RESPONSE * MIN_RESPONSE)
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
