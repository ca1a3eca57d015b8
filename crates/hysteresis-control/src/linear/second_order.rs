//! A resonance.

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::Error;
use super::error::check_positive;

/// Second-order dynamics of unit static gain: y'' + 2 zeta w y' + w^2 y = w^2 u, w = 2 pi f.
///
/// f is the undamped natural frequency in Hz and zeta the damping ratio. With zeta < 1 the step response rings at
/// f sqrt(1 - zeta^2); for zeta < 1/sqrt(2) the gain peaks, at f sqrt(1 - 2 zeta^2); with zeta >= 1 it creeps in like
/// two lags. The mass-spring-damper after the hysteresis in Remark 1 of the paper.
///
/// ```
/// use hysteresis_control::linear::{Block, SecondOrder};
/// let mut stage = SecondOrder::new(2000.0, 0.03)?.block(1e-5)?;
/// let peak = (0..100).map(|_| stage.step(1.0)).fold(0.0, f64::max);
/// let overshoot = (-core::f64::consts::PI * 0.03 / (1.0 - 0.03_f64.powi(2)).sqrt()).exp();
/// assert!((peak - (1.0 + overshoot)).abs() < 1e-3);
/// # Ok::<(), hysteresis_core::Error>(())
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

    /// w = 2 pi f, in radians per second.
    pub(super) fn radians(self) -> f64 {
        TAU * self.frequency
    }

    /// The two poles; far from each other without cancellation.
    pub(super) fn poles(self) -> [Complex<f64>; 2] {
        let (w, zeta) = (self.radians(), self.damping);
        // (1 - zeta)(1 + zeta) keeps its digits next to critical damping, where 1 - zeta^2 loses them.
        let distance = ((1.0 - zeta).abs() * (1.0 + zeta)).sqrt();
        if zeta < 1.0 {
            [Complex::new(-zeta * w, distance * w), Complex::new(-zeta * w, -distance * w)]
        } else {
            [Complex::from(-w / (zeta + distance)), Complex::from(-w * (zeta + distance))]
        }
    }

    /// (s/w)^2 + 2 zeta s/w + 1.
    pub(super) fn denominator(self, s: Complex<f64>) -> Complex<f64> {
        let x = s / self.radians();
        x * x + x * (2.0 * self.damping) + 1.0
    }
}
