//! The linear model of a loop whose hysteresis is inverted.

use hysteresis_core::is_admissible;

use crate::linear::{Block, Delay, Dynamics, Error, LinearBlock, LinearDynamics, check_positive};

/// A response has died away when it stays below this share of its peak.
const DIED_AWAY: f64 = 1e-12;

/// A response that has not died away after that many samples never will.
const MAX_SAMPLES: usize = 20_000_000;

/// Proportional-integral feedback around linear dynamics, seen from the target of the feed-forward.
///
/// w(k) = v(k) + slope (kp e(k) + ki sum(e)), e(k) = -y(k), y(k + 1) = G w(k): G are the dynamics and the delay, for an
/// input that is held from sample to sample; `slope` is that of the actuator, in displacement per volt, where the
/// feedback acts on it (its hysteresis has one between `w_0` and the sum of all weights).
///
/// ```
/// use hysteresis_control::learning::FeedbackLoop;
/// use hysteresis_control::linear::SecondOrder;
/// let dynamics = SecondOrder::new(400.0, 0.95)?.into();
/// let feedback = FeedbackLoop { kp: 60.0, ki: 0.6, slope: 6e-3, dynamics, delay: 0.0, dt: 1e-4 };
/// let response = feedback.impulse_response(20_000)?;
/// assert!(response[0].abs() < 1e-9); // what is put out now is measured one sample later
/// assert!(response.iter().sum::<f64>().abs() < 1e-9); // the integral leaves no static error
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FeedbackLoop {
    /// Proportional gain, volts per unit of displacement.
    pub kp: f64,
    /// Integral gain, volts per unit of displacement and sample.
    pub ki: f64,
    /// The slope of the actuator, displacement per volt.
    pub slope: f64,
    /// The linear dynamics behind the hysteresis.
    pub dynamics: Dynamics,
    /// What the position lags besides, in samples.
    pub delay: f64,
    /// The sampling interval in seconds.
    pub dt: f64,
}

impl FeedbackLoop {
    /// The position after a correction of 1 at the first sample of every period of `period` samples.
    ///
    /// # Errors
    /// [`Error`] for a parameter outside its domain, or gains at which the loop is not stable.
    pub fn impulse_response(&self, period: usize) -> Result<Vec<f64>, Error> {
        let mut path = self.path()?;
        // A delay alone is silent for as long as it lasts, also between two echoes.
        let lull = period.max(1000) + path.samples();
        let mut folded = vec![0.0; period];
        let (mut y, mut integral, mut peak, mut quiet) = (0.0, 0.0, 0.0_f64, 0);
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
            integral -= self.ki * y;
            let feedback = self.slope * (integral - self.kp * y);
            y = path.advance(feedback + if k == 0 { 1.0 } else { 0.0 });
        }
        Err(Error { parameter: "kp", index: None, expected: "gains at which the loop is stable", got: self.kp })
    }

    fn path(&self) -> Result<LinearBlock, Error> {
        for (parameter, got) in [("kp", self.kp), ("ki", self.ki), ("slope", self.slope)] {
            if !(is_admissible(got) && got >= 0.0) {
                let expected = "a finite number >= 0 (at most 1e100)";
                return Err(Error { parameter, index: None, expected, got });
            }
        }
        let delay = Delay::new(self.delay * check_positive("dt", None, self.dt)?)?;
        LinearDynamics::from(self.dynamics).then(delay).block(self.dt)
    }
}
