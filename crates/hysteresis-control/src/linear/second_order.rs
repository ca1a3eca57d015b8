//! A resonance.

use core::f64::consts::TAU;

use nalgebra::{Matrix2, Vector2};

use super::error::check_positive;
use super::{Block, Error};

/// Second-order dynamics of unit static gain: y'' + 2 zeta w y' + w^2 y = w^2 u, w = 2 pi f.
///
/// f is the undamped natural frequency in Hz and zeta the damping ratio. With zeta < 1 the step response rings at
/// f sqrt(1 - zeta^2); for zeta < 1/sqrt(2) the gain peaks, at f sqrt(1 - 2 zeta^2); with zeta >= 1 it creeps in like
/// two lags. The mass-spring-damper after the hysteresis in Remark 1 of the paper.
///
/// Exactly discretised for an input that is held from sample to sample, see [`block`](Self::block).
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_control::linear::{SecondOrder, Stream};
/// let mut stage = Stream::new(SecondOrder::new(2000.0, 0.03)?.block(1e-5)?, 0.0);
/// let peak = (0..100).map(|_| stage.step(1.0)).fold(0.0, f64::max);
/// let overshoot = (-core::f64::consts::PI * 0.03 / (1.0 - 0.03_f64.powi(2)).sqrt()).exp();
/// assert!((peak - (1.0 + overshoot)).abs() < 1e-3);
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrder {
    frequency: f64,
    damping: f64,
}

impl SecondOrder {
    /// From the undamped natural frequency in Hz and the damping ratio.
    ///
    /// # Errors
    /// [`Error`] unless both are finite and above 0.
    pub fn new(frequency: f64, damping: f64) -> Result<Self, Error> {
        Ok(Self {
            frequency: check_positive("frequency", None, frequency)?,
            damping: check_positive("damping", None, damping)?,
        })
    }

    /// The undamped natural frequency in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// The damping ratio.
    #[must_use]
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// The block for a sampling interval T in seconds, at rest at zero.
    ///
    /// Its state is the distance from rest, e = (y - u, y' / w). While u is held, e(k+1) = exp(w T M) e(k) with
    /// M = \[0, 1; -1, -2 zeta\]. M + zeta has the square zeta^2 - 1, so with x = w T sqrt(|1 - zeta^2|)
    ///
    /// exp(w T M) = exp(-zeta w T) (C + S (M + zeta)), C = cos x, S = w T sin x / x,
    ///
    /// for zeta < 1, cosh and sinh for zeta > 1, and at zeta = 1 the common limit C = 1, S = w T.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn block(&self, dt: f64) -> Result<SecondOrderBlock, Error> {
        Ok(SecondOrderBlock { transition: self.transition(dt)?, position: 0.0, velocity: 0.0 })
    }

    /// exp(w T M).
    pub(super) fn transition(&self, dt: f64) -> Result<Matrix2<f64>, Error> {
        Ok(self.exponential(TAU * self.frequency * check_positive("dt", None, dt)?))
    }

    /// exp(angle M).
    fn exponential(&self, angle: f64) -> Matrix2<f64> {
        let zeta = self.damping;
        // (1 - zeta)(1 + zeta) keeps its digits next to critical damping, where 1 - zeta^2 loses them.
        let distance = ((1.0 - zeta).abs() * (1.0 + zeta)).sqrt();
        let x = angle * distance;
        let (c, s) = if x == 0.0 {
            let decay = (-zeta * angle).exp();
            (decay, decay * angle)
        } else if zeta < 1.0 {
            let decay = (-zeta * angle).exp();
            (decay * x.cos(), decay * x.sin() / distance)
        } else {
            // The slower of both decays, exp(x - zeta angle) without cancellation and without the overflow of cosh.
            let slow = (-angle / (zeta + distance)).exp();
            (0.5 * slow * (1.0 + (-2.0 * x).exp()), -0.5 * slow * (-2.0 * x).exp_m1() / distance)
        };
        Matrix2::new(c + zeta * s, s, -s, c - zeta * s)
    }
}

/// The block of a [`SecondOrder`].
#[derive(Clone, Debug, PartialEq)]
pub struct SecondOrderBlock {
    transition: Matrix2<f64>,
    pub(super) position: f64,
    /// y' / w.
    pub(super) velocity: f64,
}

impl SecondOrderBlock {
    /// Position and velocity at the end of the interval.
    #[inline]
    fn next(&self, input: f64) -> (f64, f64) {
        let distance = self.transition * Vector2::new(self.position - input, self.velocity);
        (input + distance.x, distance.y)
    }
}

impl Block for SecondOrderBlock {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        (self.position, self.velocity) = self.next(input);
        self.position
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.next(input).0
    }

    fn settle(&mut self, level: f64) -> f64 {
        (self.position, self.velocity) = (level, 0.0);
        level
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::Matrix2;

    use super::*;

    /// The closed form is the matrix exponential, far from critical damping and next to it on both sides.
    #[test]
    fn the_closed_form_is_the_matrix_exponential() {
        for zeta in [1e-4, 0.02, 0.5, 0.99, 1.0 - 1e-9, 1.0 - 1e-15, 1.0, 1.0 + 1e-15, 1.0 + 1e-9, 1.01, 2.0, 30.0] {
            for angle in [1e-3, 0.25, 1.0, 3.0] {
                let closed = SecondOrder::new(1.0, zeta).unwrap().exponential(angle);
                let series = (Matrix2::new(0.0, 1.0, -1.0, -2.0 * zeta) * angle).exp();
                // The general algorithm squares a Padé approximant: it loses a few digits for large norms.
                let tolerance = 1e-14 * (1.0 + zeta * angle);
                assert!((closed - series).abs().max() < tolerance, "{zeta} {angle}: {closed} {series}");
            }
        }
    }

    #[test]
    fn heavy_damping_does_not_overflow() {
        let transition = SecondOrder::new(1.0, 1e8).unwrap().exponential(100.0);
        // Two lags: the slow one of rate w / (2 zeta), the fast one gone.
        assert!((transition.m11 - (-100.0 / 2e8_f64).exp()).abs() < 1e-12 && transition.m12.is_finite());
    }
}
