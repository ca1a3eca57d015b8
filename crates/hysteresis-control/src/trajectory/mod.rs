//! References with their derivatives: where to be, how fast, and how that changes, at any time.
//!
//! What inverts dynamics needs the derivatives of the reference (see [`feedforward`](crate::feedforward)). These
//! trajectories have them in closed form, and all up to the acceleration are continuous.

mod one_axis;
mod raster;
mod scans;

pub use one_axis::{MotionLimits, PointToPoint, RoundedTriangle, Sine};
pub use raster::{Raster, RasterOptions};
pub use scans::{Axis, Lissajous, Scan, ScanAxis, Spiral, SpiralRate};

use crate::sampling::{Error, check_count, check_number, check_positive, reserve};

/// What the quotient of a duration and a sampling interval, and the product of the interval and a number of samples,
/// may be off by.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

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

    /// How many samples `dt` apart it has from t = 0 on: in `seconds`, else in a period, else until it has come to
    /// rest.
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
fn check_bounded(parameter: &'static str, got: f64, derivative: f64) -> Result<(), Error> {
    check_number(parameter, derivative.is_finite(), "a number that leaves all derivatives finite", got)
}

impl Motion {
    /// The same elsewhere.
    fn moved(self, by: f64) -> Self {
        Self { position: self.position + by, ..self }
    }

    /// The same in other units, or the other way round.
    pub(super) fn scaled(self, factor: f64) -> Self {
        // Adding 0 makes 0 of -0.
        let scaled = |value: f64| factor * value + 0.0;
        Self {
            position: scaled(self.position),
            velocity: scaled(self.velocity),
            acceleration: scaled(self.acceleration),
            jerk: scaled(self.jerk),
        }
    }
}

/// S(s) = 10 s^3 - 15 s^4 + 6 s^5, which leads from 0 at s = 0 to 1 at s = 1, where its first two derivatives vanish.
#[derive(Clone, Copy, Debug)]
struct Smooth {
    /// The integral of S from 0 to s.
    integral: f64,
    value: f64,
    /// S' of s, and so on.
    first: f64,
    second: f64,
    third: f64,
}

/// The greatest S'.
const GREATEST_SLOPE: f64 = 15.0 / 8.0;

impl Smooth {
    /// For s from 0 to 1.
    pub(super) fn at(s: f64) -> Self {
        let rest = 1.0 - s;
        Self {
            integral: s.powi(4) * (2.5 - 3.0 * s + s * s),
            value: s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s),
            first: 30.0 * (s * rest).powi(2),
            second: 60.0 * s * rest * (rest - s),
            third: 60.0 * (1.0 - 6.0 * s * rest),
        }
    }
}

/// A run along a line, from rest at 0 to rest: the rate rises along S, stays, and falls along S.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    rate: f64,
    /// How many seconds the rate rises, stays, and falls.
    lead_in: f64,
    steady: f64,
    lead_out: f64,
}

impl Run {
    /// A run of a length, with a rate that rises over the first part of it and falls over the last.
    fn over(length: f64, rate: f64, (first, last): (f64, f64)) -> Self {
        // The mean of a rate that rises along S is half of it.
        Self { rate, lead_in: 2.0 * first / rate, steady: (length - first - last) / rate, lead_out: 2.0 * last / rate }
    }

    pub(super) fn length(&self) -> f64 {
        self.rate * (0.5 * self.lead_in + self.steady + 0.5 * self.lead_out)
    }

    fn duration(&self) -> f64 {
        self.lead_in + self.steady + self.lead_out
    }

    /// When the rate is the stated one, from and to.
    fn steady(&self) -> (f64, f64) {
        (self.lead_in, self.lead_in + self.steady)
    }

    pub(super) fn at(&self, t: f64) -> Motion {
        let Self { rate, lead_in, lead_out, .. } = *self;
        // The time of the last sample may be a rounding short of the end.
        let remaining = self.duration() * (1.0 - 2.0 * ROUNDING) - t;
        if t <= 0.0 || remaining <= 0.0 {
            return Motion::rest(if t <= 0.0 { 0.0 } else { self.length() });
        }
        if t < lead_in {
            return rise(rate, lead_in, t);
        }
        if remaining < lead_out {
            // The end is the beginning backwards, which changes the sign of even derivatives.
            let end = rise(rate, lead_out, remaining);
            return Motion { position: self.length() - end.position, acceleration: -end.acceleration, ..end };
        }
        Motion { position: rate * (t - 0.5 * lead_in), velocity: rate, ..Motion::default() }
    }
}

/// A way from rest on whose rate rises along S over so many seconds.
fn rise(rate: f64, seconds: f64, t: f64) -> Motion {
    let smooth = Smooth::at(t / seconds);
    Motion {
        position: rate * seconds * smooth.integral,
        velocity: rate * smooth.value,
        acceleration: rate * smooth.first / seconds,
        jerk: rate * smooth.second / seconds / seconds,
    }
}
