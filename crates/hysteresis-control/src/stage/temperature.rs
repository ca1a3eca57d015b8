//! What a temperature adds to the position: a linear term behind a lag.

use hysteresis_core::{Biquad, Error as CoreError, Filter, Process, check_all_finite, is_admissible};
use serde::{Deserialize, Serialize};

use crate::checks::{check_number, check_positive};

/// What a second, slow input adds to the position behind all other parts of a stage: the temperature T, or any other.
///
/// ```text
/// y = stage(u) + kappa (theta - reference)        kappa: the sensitivity
/// theta' = (T - theta) / tau                      theta: what the part that expands has of T
/// ```
///
/// Streams of a stage know no temperature: they are at the reference. So the term is added behind a forward model, and
/// taken from the target of an inverse. Sampled, theta(k) = a theta(k-1) + (1 - a) T(k) with a = exp(-dt / tau).
/// Sensitivity in the unit of the position per kelvin, tau in seconds; 0 is no lag.
///
/// ```
/// use hysteresis_control::stage::TemperatureTerm;
/// let term = TemperatureTerm::new(0.02, 60.0, 25.0)?; // um per K, s, degrees C
/// let warm = term.response(&[35.0; 3], 1.0)?; // it has been at 35 for long
/// assert!(warm.iter().all(|added| (added - 0.2).abs() < 1e-12));
/// let later = term.response(&[[25.0; 1].as_slice(), &[35.0; 60]].concat(), 1.0)?;
/// assert!((later[60] - 0.2 * (1.0 - (-1.0_f64).exp())).abs() < 1e-9);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TemperatureTerm {
    sensitivity: f64,
    time_constant: f64,
    reference: f64,
}

/// The longest time constant, in seconds: thirty years.
const LONGEST: f64 = 1e9;

impl TemperatureTerm {
    /// From the sensitivity, the time constant in seconds, and the temperature at which nothing is added.
    ///
    /// # Errors
    /// [`CoreError::Domain`] that names the number: one that is not finite, a time constant below 0 or above 1e9 s.
    pub fn new(sensitivity: f64, time_constant: f64, reference: f64) -> Result<Self, CoreError> {
        for (name, value) in [("sensitivity", sensitivity), ("reference", reference)] {
            check_number(name, is_admissible(value), "a finite number", value)?;
        }
        if time_constant != 0.0 {
            check_positive("time_constant", None, time_constant)?;
            check_number("time_constant", time_constant <= LONGEST, "at most 1e9 s", time_constant)?;
        }
        Ok(Self { sensitivity, time_constant, reference })
    }

    /// The same, with its numbers checked again: what a file says.
    pub(super) fn checked(self) -> Result<Self, CoreError> {
        Self::new(self.sensitivity, self.time_constant, self.reference)
    }

    /// kappa, in the unit of the position per kelvin.
    #[must_use]
    pub fn sensitivity(&self) -> f64 {
        self.sensitivity
    }

    /// tau, in seconds.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        self.time_constant
    }

    /// The temperature at which nothing is added.
    #[must_use]
    pub fn reference(&self) -> f64 {
        self.reference
    }

    /// The lag from T to theta, at rest at the reference.
    ///
    /// # Errors
    /// [`CoreError::Domain`] unless `dt` is finite, above 0, and something beside the time constant.
    pub fn lag(&self, dt: f64) -> Result<Filter, CoreError> {
        check_positive("dt", None, dt)?;
        let intervals = if self.time_constant > 0.0 { dt / self.time_constant } else { f64::INFINITY };
        check_number("dt", intervals > f64::EPSILON, "an interval that is something beside the time constant", dt)?;
        let mut lag = Filter::new(&[Biquad::new([-(-intervals).exp_m1(), 0.0, 0.0], [-(-intervals).exp(), 0.0])?])?;
        lag.settle(self.reference)?;
        Ok(lag)
    }

    /// What is added at theta.
    #[must_use]
    pub fn at(&self, theta: f64) -> f64 {
        self.sensitivity * (theta - self.reference)
    }

    /// What is added along temperatures that were at their first value for long, sampled every `dt` seconds.
    ///
    /// # Errors
    /// [`CoreError::Domain`] for a temperature that is not finite, or unless `dt` is finite and above 0.
    pub fn response(&self, temperature: &[f64], dt: f64) -> Result<Vec<f64>, CoreError> {
        check_all_finite("temperature", temperature)?;
        let mut lag = self.lag(dt)?;
        if let Some(first) = temperature.first() {
            lag.settle(*first)?;
        }
        Ok(temperature.iter().map(|t| self.at(lag.step(*t))).collect())
    }
}
