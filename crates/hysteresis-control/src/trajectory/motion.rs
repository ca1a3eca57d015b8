use crate::sampling::{Error, check_count, check_positive, reserve};

/// What the quotient of a duration and a sampling interval, and the product of the interval and a number of samples, may
/// be off by.
pub(super) const ROUNDING: f64 = 4.0 * f64::EPSILON;

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
    /// [`Error`] unless `dt` is finite and above 0, `seconds` not negative, and there are at most
    /// [`MAX_SAMPLES`](crate::sampling::MAX_SAMPLES).
    fn samples(&self, dt: f64, seconds: Option<f64>) -> Result<u32, Error> {
        check_positive("dt", dt)?;
        match seconds {
            Some(seconds) if seconds >= 0.0 => check_count("seconds", (seconds / dt).round()),
            Some(seconds) => Err(Error::domain("seconds", "a number of seconds, 0 or more", seconds)),
            None if self.is_periodic() => check_count("dt", (self.duration() / dt).round()),
            // A duration of whole samples may be a rounding longer.
            None => check_count("dt", (self.duration() / dt * (1.0 - ROUNDING)).ceil() + 1.0),
        }
    }

    /// The [`samples`](Self::samples): sample k is at t = k `dt`.
    ///
    /// # Errors
    /// As for [`samples`](Self::samples), and [`Error::OutOfMemory`].
    fn sample(&self, dt: f64, seconds: Option<f64>) -> Result<Vec<Motion>, Error> {
        let count = self.samples(dt, seconds)?;
        let mut motions = reserve(if seconds.is_some() { "seconds" } else { "dt" }, count)?;
        motions.extend((0..count).map(|k| self.at(f64::from(k) * dt)));
        Ok(motions)
    }
}

/// Nothing, if the greatest of the derivatives is a number.
pub(super) fn check_bounded(parameter: &'static str, got: f64, derivative: f64) -> Result<(), Error> {
    let expected = "a number that leaves all derivatives finite";
    if derivative.is_finite() { Ok(()) } else { Err(Error::domain(parameter, expected, got)) }
}
