use core::f64::consts::TAU;

use super::motion::{Motion, check_bounded};
use super::scan::{Axis, Scan};
use super::smooth::{GREATEST_SLOPE, Run};
use crate::sampling::{Error, check_finite, check_positive};

/// The lead-out brakes by this share of the acceleration that keeps the last turn round.
const BRAKING: f64 = 0.5;

/// What is constant along a spiral.
///
/// ```
/// use hysteresis_control::trajectory::SpiralRate;
/// assert_ne!(SpiralRate::Angular { frequency: 5.0 }, SpiralRate::Linear { speed: 5.0 });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum SpiralRate {
    /// The angular velocity: turns per second, in Hz. Both axes are sines of one frequency, whose amplitudes grow.
    Angular {
        /// Turns per second.
        frequency: f64,
    },
    /// The linear velocity: every part of the image is scanned equally fast.
    Linear {
        /// In the unit of the reference per second (um/s).
        speed: f64,
    },
}

/// An Archimedean spiral from the centre outwards: turns that are a pitch apart.
///
/// With p the pitch, the radius is r = p theta / (2 pi), and x = r cos theta, y = r sin theta. The angle theta, at a constant angular
/// velocity, or the length of the path
///
/// s = (p / (4 pi)) (theta sqrt(1 + theta^2) + asinh theta),
///
/// at a constant linear velocity, grows steadily between the inner radius and the end (Mahmood and Moheimani, Nanotechnology 20,
/// 365503, 2009). At the centre the path bends sharply, so it starts there at rest: the rate rises along
/// S(s) = 10 s^3 - 15 s^4 + 6 s^5 and is full at the inner radius r_i. The acceleration is at most 1.5 speed^2 / r_i, and 1.2 if r_i is
/// a pitch or more. It ends at rest on its radius, and does not go beyond.
/// Derivatives up to the third are continuous.
///
/// ```
/// use hysteresis_control::trajectory::{Motion, Scan, Spiral, SpiralRate, Trajectory};
/// let spiral = Spiral::new(5.0, 0.1, SpiralRate::Linear { speed: 100.0 }, 0.5, (0.0, 0.0))?;
/// let (begins, ends) = spiral.steady();
/// let (x, y) = (spiral.x().at(0.5 * (begins + ends)), spiral.y().at(0.5 * (begins + ends)));
/// assert!((x.velocity.hypot(y.velocity) - 100.0).abs() < 1e-9);
/// assert_eq!(spiral.x().at(0.0), Motion::rest(0.0));
/// assert!((spiral.x().at(spiral.duration()).position - 5.0).abs() < 1e-9); // after 50 whole turns
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spiral {
    radius: f64,
    pitch: f64,
    rate: SpiralRate,
    inner_radius: f64,
    center: (f64, f64),
    /// Along the angle, or along the path.
    run: Run,
}

impl Spiral {
    /// A spiral to a radius with turns a pitch apart, which runs at its full rate from the inner radius on, about a centre.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, radius, pitch and rate above 0, the pitch at most the radius and the inner radius above 0 and at
    /// most half of the radius, or where a derivative or the duration is not finite.
    pub fn new(
        radius: f64,
        pitch: f64,
        rate: SpiralRate,
        inner_radius: f64,
        center: (f64, f64),
    ) -> Result<Self, Error> {
        check_positive("radius", radius)?;
        check_positive("pitch", pitch)?;
        if pitch > radius {
            return Err(Error::domain("pitch", format!("at most the radius, {radius:?}"), pitch));
        }
        if !(inner_radius > 0.0 && inner_radius <= 0.5 * radius) {
            let expected = format!("above 0, at most half of the radius, {:?}", 0.5 * radius);
            return Err(Error::domain("inner_radius", expected, inner_radius));
        }
        check_finite("center", center.0)?;
        check_finite("center", center.1)?;
        let scale = pitch / TAU;
        // With |acceleration| = rate' r or speed' it brakes by the share of rate^2 r or speed^2 / r.
        let braking = 0.5 * GREATEST_SLOPE / BRAKING;
        let (parameter, got, run) = match rate {
            SpiralRate::Angular { frequency } => {
                check_positive("frequency", frequency)?;
                let run = Run::over(radius / scale, TAU * frequency, (inner_radius / scale, braking));
                ("frequency", frequency, run)
            }
            SpiralRate::Linear { speed } => {
                check_positive("speed", speed)?;
                let along = |radius: f64| scale * length(radius / scale);
                ("speed", speed, Run::over(along(radius), speed, (along(inner_radius), braking * radius)))
            }
        };
        let made = Self { radius, pitch, rate, inner_radius, center, run };
        // Nothing changes faster than the angle where it turns fastest or starts.
        let fastest = match rate {
            SpiralRate::Angular { frequency } => TAU * frequency,
            SpiralRate::Linear { speed } => speed / scale,
        };
        let fastest = fastest + 1.0 / run.lead_in + 1.0 / run.lead_out;
        check_bounded(parameter, got, run.duration() + radius * (1.0 + 1e3 * fastest.powi(3)))?;
        Ok(made)
    }

    /// Where it ends.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    /// How far its turns are apart.
    #[must_use]
    pub fn pitch(&self) -> f64 {
        self.pitch
    }

    /// What is constant.
    #[must_use]
    pub fn rate(&self) -> SpiralRate {
        self.rate
    }

    /// From which radius on.
    #[must_use]
    pub fn inner_radius(&self) -> f64 {
        self.inner_radius
    }

    /// Where it starts.
    #[must_use]
    pub fn center(&self) -> (f64, f64) {
        self.center
    }

    /// The times between which the rate is constant, in seconds.
    #[must_use]
    pub fn steady(&self) -> (f64, f64) {
        self.run.steady()
    }

    /// The angle and its derivatives.
    fn angle(&self, t: f64) -> Motion {
        let along = self.run.at(t);
        if matches!(self.rate, SpiralRate::Angular { .. }) {
            return along;
        }
        let scale = self.pitch / TAU;
        let angle = angle_of(along.position / scale);
        let (v, a, j) = (along.velocity / scale, along.acceleration / scale, along.jerk / scale);
        // d theta / d s = 1 / sqrt(1 + theta^2) in units of the scale, and what follows from it.
        let square = 1.0 + angle * angle;
        let first = 1.0 / square.sqrt();
        let second = -angle / (square * square);
        let third = (3.0 * angle * angle - 1.0) * first / square.powi(3);
        Motion {
            position: angle,
            velocity: first * v,
            acceleration: first * a + second * v * v,
            jerk: first * j + 3.0 * second * v * a + third * v * v * v,
        }
    }
}

impl Scan for Spiral {
    fn motion(&self, axis: Axis, t: f64) -> Motion {
        let Motion { position: angle, velocity: v, acceleration: a, jerk: j } = self.angle(t);
        let (sine, cosine) = angle.sin_cos();
        // The unit vector at this angle and its derivative.
        let (radial, tangential, center) = match axis {
            Axis::X => (cosine, -sine, self.center.0),
            Axis::Y => (sine, cosine, self.center.1),
        };
        let first = radial + angle * tangential;
        let second = 2.0 * tangential - angle * radial;
        let third = -3.0 * radial - angle * tangential;
        let path = Motion {
            position: angle * radial,
            velocity: first * v,
            acceleration: second * v * v + first * a,
            jerk: third * v * v * v + 3.0 * second * v * a + first * j,
        };
        path.scaled(self.pitch / TAU).moved(center)
    }

    fn duration(&self) -> f64 {
        self.run.duration()
    }
}

/// The length of the path up to an angle, where the radius is the angle.
fn length(angle: f64) -> f64 {
    0.5 * (angle * angle.hypot(1.0) + angle.asinh())
}

/// The angle at which the path has a length, where the radius is the angle: Newton's method from above on a convex function.
fn angle_of(path: f64) -> f64 {
    // The length is at least the angle, and at least half of its square.
    let mut angle = path.min((2.0 * path).sqrt());
    loop {
        let next = angle - (length(angle) - path) / angle.hypot(1.0);
        // It falls until rounding ends it.
        if next.is_nan() || next >= angle {
            return angle;
        }
        angle = next;
    }
}
