//! The linear model of a loop whose hysteresis is inverted.

use hysteresis_core::{Sections, is_admissible};

use crate::linear::{Block, Error, LinearBlock, LinearDynamics};

/// A response has died away when it stays below this share of its peak.
const DIED_AWAY: f64 = 1e-12;

/// A response that has not died away after that many samples never will.
const MAX_SAMPLES: usize = 20_000_000;

/// Proportional-integral feedback around linear dynamics, seen from the target of the feed-forward.
///
/// w(k) = v(k) + slope (kp e(k) + ki dt sum(e)), e = -F y with the filters F. The output w(k) of the hysteresis is held from t_k on,
/// and y(k + 1) is read at t_(k+1), just before the next one: y is what the dynamics, their dead time included, make of
/// w. `slope` is that of the actuator, in displacement per volt, where the feedback acts on it (its hysteresis has one
/// between `w_0` and the sum of all weights).
///
/// ```
/// use hysteresis_control::learning::FeedbackLoop;
/// use hysteresis_control::linear::{Delay, LinearDynamics, SecondOrder};
/// use hysteresis_core::Sections;
/// let dynamics = LinearDynamics::from(SecondOrder::new(400.0, 0.95)?).then(Delay::new(0.5e-4)?);
/// let filters = Sections::default(); // none
/// let feedback = FeedbackLoop { kp: 60.0, ki: 6e3, filters, slope: 6e-3, dynamics, dt: 1e-4 };
/// let response = feedback.impulse_response(20_000)?;
/// assert!(response[0].abs() < 1e-9); // what is put out now is measured one sample later
/// assert!(response.iter().sum::<f64>().abs() < 1e-9); // the integral leaves no static error
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct FeedbackLoop {
    /// Proportional gain, volts per unit of displacement (V/um).
    pub kp: f64,
    /// Integral gain, volts per unit of displacement and second (V/um/s).
    pub ki: f64,
    /// The filters before both gains.
    pub filters: Sections,
    /// The slope of the actuator, displacement per volt.
    pub slope: f64,
    /// The linear dynamics behind the hysteresis, with their dead time.
    pub dynamics: LinearDynamics,
    /// The sampling interval in seconds.
    pub dt: f64,
}

impl FeedbackLoop {
    /// The position after a correction of 1 at the first sample of every period of `period` samples.
    ///
    /// # Errors
    /// [`Error`] for a parameter outside its domain, or gains at which the loop is not stable.
    pub fn impulse_response(&self, period: usize) -> Result<Vec<f64>, Error> {
        let (mut path, ki_dt) = (self.path()?, self.ki * self.dt);
        // A dead time alone is silent for as long as it lasts, also between two echoes.
        let lull = period.max(1000) + path.samples();
        let mut folded = vec![0.0; period];
        let (mut y, mut integral, mut peak, mut quiet) = (0.0, 0.0, 0.0_f64, 0);
        let mut filter = self.filters.at_rest(0.0);
        for k in 0..MAX_SAMPLES {
            folded[k % period] += y;
            peak = peak.max(f64::abs(y));
            quiet = if f64::abs(y) <= DIED_AWAY * peak && k > 0 { quiet + 1 } else { 0 };
            if quiet > lull {
                return Ok(folded);
            }
            if !is_admissible(y) {
                break;
            }
            filter = self.filters.next(&filter, -y);
            integral += ki_dt * filter.output;
            let feedback = self.slope * (integral + self.kp * filter.output);
            y = path.advance(feedback + if k == 0 { 1.0 } else { 0.0 });
        }
        Err(Error::domain("kp", None, "gains at which the loop is stable", self.kp))
    }

    fn path(&self) -> Result<LinearBlock, Error> {
        let may_damp = !self.filters.as_slice().is_empty();
        for (parameter, got) in [("kp", self.kp), ("ki", self.ki), ("slope", self.slope)] {
            if !(is_admissible(got) && (got >= 0.0 || (may_damp && parameter == "kp"))) {
                let expected = "a finite number >= 0 (at most 1e100)";
                return Err(Error::domain(parameter, None, expected, got));
            }
        }
        self.dynamics.block(self.dt)
    }
}
