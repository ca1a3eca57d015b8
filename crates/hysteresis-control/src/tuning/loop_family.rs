use core::f64::consts::{PI, TAU};

use hysteresis_core::Bound;
use nalgebra::Complex;

use super::family::family;
use super::feedback::{Gains, Slopes};
use super::open_loop::OpenLoop;
use super::options::{Tuning, TuningOptions};
use super::response::FrequencyPoint;
use crate::filters::sections;
use crate::linear::{Error, LinearDynamics, check_positive};

/// The loops of a tuning over frequency, with the dynamics as they are known and with all that may be.
///
/// L(z) = (kp + ki dt / (1 - 1/z)) slope F P(z) at z = exp(2 pi i f dt), as [`tune`](super::tune) has it: P is the pulse transfer
/// function, dead time included. S = 1 / (1 + L) is what the loop leaves of a disturbance, T = L / (1 + L) what it follows of a
/// reference and of the noise of the sensor.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::tuning::{LoopFamily, TuningOptions, tune};
/// let (stage, options) = (SecondOrder::new(800.0, 0.02)?.into(), TuningOptions::new((0.7, 1.0), 1e-4, 1.7));
/// let tuning = tune(&stage, &options)?;
/// let family = LoopFamily::new(&stage, &options, &tuning)?;
/// let margins = tuning.at_max_slope;
/// let l = family.open_loop(&[margins.crossover], margins.slope)?[0];
/// assert!((l.norm() - 1.0).abs() < 1e-9);
/// let (s, t) = (family.sensitivity(&[50.0], 1.0)?[0], family.complementary_sensitivity(&[50.0], 1.0)?[0]);
/// assert!((s + t - 1.0).norm() < 1e-12 && s.norm() <= family.worst_sensitivity(&[50.0])?[0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct LoopFamily {
    gains: Gains,
    slopes: Slopes,
    dt: f64,
    /// With the dynamics as they are known, and with all that may be.
    members: Vec<OpenLoop>,
}

impl LoopFamily {
    /// The loops of a tuning that [`tune`](super::tune) made of the same dynamics and options.
    ///
    /// # Errors
    /// As for [`tune`](super::tune).
    pub fn new(dynamics: &LinearDynamics, options: &TuningOptions, tuning: &Tuning) -> Result<Self, Error> {
        let dt = options.dt;
        let filters = sections(&tuning.filters, dt)?;
        let members = family(dynamics, options.uncertainty)?
            .iter()
            .map(|member| Ok(OpenLoop { filters, transfer: member.pulse_transfer(dt)? }))
            .collect::<Result<_, Error>>()?;
        let (min, max) = options.slopes;
        let gains = Gains { kp: tuning.kp, ki_dt: tuning.ki * dt };
        Ok(Self { gains, slopes: Slopes { min, max }, dt, members })
    }

    /// L at frequencies in Hz for a slope of the hysteresis, with the dynamics as they are known.
    ///
    /// # Errors
    /// [`Error`] for a frequency that is not above 0 and at most half of the sampling rate, or a slope that is not above 0.
    pub fn open_loop(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        check_positive("slope", None, slope)?;
        let at = |point| self.gains.at(&point) * slope;
        Ok(self.points(&self.members[0], frequencies)?.into_iter().map(at).collect())
    }

    /// S = 1 / (1 + L) likewise.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn sensitivity(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        Ok(self.open_loop(frequencies, slope)?.into_iter().map(|l| (1.0 + l).inv()).collect())
    }

    /// T = L / (1 + L) likewise.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn complementary_sensitivity(&self, frequencies: &[f64], slope: f64) -> Result<Vec<Complex<f64>>, Error> {
        Ok(self.open_loop(frequencies, slope)?.into_iter().map(|l| l / (1.0 + l)).collect())
    }

    /// The greatest |S| over all slopes between the least and the greatest, and all dynamics that may be.
    ///
    /// # Errors
    /// As for [`open_loop`](Self::open_loop).
    pub fn worst_sensitivity(&self, frequencies: &[f64]) -> Result<Vec<f64>, Error> {
        let mut worst = vec![0.0; frequencies.len()];
        for member in &self.members {
            for (worst, point) in worst.iter_mut().zip(self.points(member, frequencies)?) {
                *worst = f64::max(*worst, 1.0 / self.slopes.min_distance(self.gains.at(&point)));
            }
        }
        Ok(worst)
    }

    fn points(&self, open: &OpenLoop, frequencies: &[f64]) -> Result<Vec<FrequencyPoint>, Error> {
        let highest = 0.5 / self.dt;
        let point = |(i, f): (usize, &f64)| {
            check_positive("frequencies", Some(i), *f)?;
            // Half of the sampling rate itself may come a rounding higher.
            if *f <= highest * (1.0 + 1e-12) {
                return Ok(FrequencyPoint::new(open, (TAU * f * self.dt).min(PI)));
            }
            let expected = Bound::Between { low: 0.0, high: highest };
            Err(Error::Domain { parameter: "frequencies", index: Some(i), expected, got: *f })
        };
        frequencies.iter().enumerate().map(point).collect()
    }
}
