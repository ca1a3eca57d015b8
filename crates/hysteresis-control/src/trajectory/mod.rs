//! References with their derivatives: where to be, how fast, and how that changes, at any time.
//!
//! What inverts dynamics needs the derivatives of the reference (see [`feedforward`](crate::feedforward)). These trajectories
//! have them in closed form, and all up to the acceleration are continuous.

mod point_to_point;
mod rounded_triangle;
mod sine;

pub use point_to_point::{MotionLimits, PointToPoint};
pub use rounded_triangle::RoundedTriangle;
pub use sine::Sine;

use crate::sampling::{Error, MAX_SAMPLES, positive};

/// A reference and its derivatives at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Motion {
    /// r, in the unit of the reference (um).
    pub position: f64,
    /// r', per second.
    pub velocity: f64,
    /// r'', per second squared.
    pub acceleration: f64,
    /// r''', per second cubed.
    pub jerk: f64,
}

impl Motion {
    /// Rest at a position.
    #[must_use]
    pub fn rest(position: f64) -> Self {
        Self { position, ..Self::default() }
    }
}

/// A reference r(t) with its derivatives.
pub trait Trajectory {
    /// Position and derivatives at the time t in seconds; finite for every finite t.
    fn at(&self, t: f64) -> Motion;

    /// How long it takes in seconds: of a periodic one, a period.
    fn duration(&self) -> f64;

    /// Whether it starts again after its duration; else it rests before its start and after its end.
    fn is_periodic(&self) -> bool;

    /// How many samples `dt` apart it has from t = 0 on: in `seconds`, else in a period, else until it has come to rest.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0 and there are at most 2^30 samples.
    fn samples(&self, dt: f64, seconds: Option<f64>) -> Result<u32, Error> {
        positive("dt", dt)?;
        let count = match seconds {
            Some(seconds) => (seconds / dt).round(),
            None if self.is_periodic() => (self.duration() / dt).round(),
            // A duration of whole samples may be a rounding longer.
            None => (self.duration() / dt * (1.0 - 4.0 * f64::EPSILON)).ceil() + 1.0,
        };
        if (0.0..=MAX_SAMPLES).contains(&count) {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked")]
            return Ok(count as u32);
        }
        match seconds {
            Some(seconds) => Err(Error::new("seconds", "a duration of 0 to 2^30 samples", seconds)),
            None => Err(Error::new("dt", "a sampling interval that gives at most 2^30 samples", dt)),
        }
    }
}

/// Nothing, if the greatest of the derivatives is a number.
fn bounded(parameter: &'static str, got: f64, derivative: f64) -> Result<(), Error> {
    let expected = "a number that leaves all derivatives finite";
    if derivative.is_finite() { Ok(()) } else { Err(Error::new(parameter, expected, got)) }
}
