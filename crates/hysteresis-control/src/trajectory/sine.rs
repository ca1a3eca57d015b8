use core::f64::consts::TAU;

use super::motion::{Motion, Trajectory, check_bounded};
use crate::sampling::{Error, check_finite, check_positive};

/// r(t) = offset + amplitude sin(2 pi f t).
///
/// ```
/// use hysteresis_control::trajectory::{Sine, Trajectory};
/// let sine = Sine::new(3.0, 2.0, 1.0)?;
/// let quarter = sine.at(0.125);
/// assert!((quarter.position - 4.0).abs() < 1e-15 && quarter.velocity.abs() < 1e-14);
/// assert_eq!(sine.duration(), 0.5);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sine {
    amplitude: f64,
    frequency: f64,
    offset: f64,
}

impl Sine {
    /// From amplitude and offset in the unit of the reference and the frequency in Hz.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, the derivatives too, and the frequency is above 0.
    pub fn new(amplitude: f64, frequency: f64, offset: f64) -> Result<Self, Error> {
        check_finite("amplitude", amplitude)?;
        check_positive("frequency", frequency)?;
        check_finite("offset", offset)?;
        check_bounded("frequency", frequency, offset.abs() + amplitude.abs() * (1.0 + (TAU * frequency).powi(3)))?;
        Ok(Self { amplitude, frequency, offset })
    }

    /// Half of the peak-to-peak swing.
    #[must_use]
    pub fn amplitude(&self) -> f64 {
        self.amplitude
    }

    /// Cycles per second, in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// The value around which it swings.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }
}

impl Trajectory for Sine {
    fn at(&self, t: f64) -> Motion {
        let w = TAU * self.frequency;
        // Whole cycles are taken off first: sines of large angles are inexact.
        let (sine, cosine) = (TAU * (self.frequency * t).fract()).sin_cos();
        Motion {
            position: self.offset + self.amplitude * sine,
            velocity: self.amplitude * w * cosine,
            acceleration: -self.amplitude * w * w * sine,
            jerk: -self.amplitude * w * w * w * cosine,
        }
    }

    fn duration(&self) -> f64 {
        1.0 / self.frequency
    }

    fn is_periodic(&self) -> bool {
        true
    }
}
