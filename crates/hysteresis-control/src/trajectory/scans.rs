//! Paths of two axes, and those that cover an area without a raster: Lissajous figures and spirals.

use core::f64::consts::TAU;

use super::{GREATEST_SLOPE, Motion, ROUNDING, Run, Smooth, Trajectory, check_bounded};
use crate::sampling::{Error, check_finite, check_number, check_positive};

/// One of the two axes of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Axis {
    /// The fast axis of a raster.
    X,
    /// The slow axis of a raster.
    Y,
}

/// A path in the plane from rest to rest: its two axes take equally long, so they have equally many samples.
///
/// ```
/// use hysteresis_control::trajectory::{Lissajous, Motion, Scan, Trajectory};
/// let circle = Lissajous::new((3.0, 3.0), (10.0, 10.0), 0.5 * std::f64::consts::PI, 1.0, 0.2, (0.0, 0.0))?;
/// let (x, y) = (circle.x().sample(1e-3, None)?, circle.y().sample(1e-3, None)?);
/// assert_eq!((x.len(), y.len()), (1401, 1401)); // 1 s, twice 0.2 s, and the sample at the end
/// assert_eq!((x[0], x[1400]), (Motion::rest(0.0), Motion::rest(0.0)));
/// assert!((x[700].position.hypot(y[700].position) - 3.0).abs() < 1e-12);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
pub trait Scan: Copy {
    /// Position and derivatives of one axis at the time t in seconds; finite for every finite t.
    fn motion(&self, axis: Axis, t: f64) -> Motion;

    /// How many seconds it takes until both axes have come to rest.
    fn duration(&self) -> f64;

    /// Its x axis.
    fn x(self) -> ScanAxis<Self> {
        ScanAxis { scan: self, axis: Axis::X }
    }

    /// Its y axis.
    fn y(self) -> ScanAxis<Self> {
        ScanAxis { scan: self, axis: Axis::Y }
    }
}

/// One axis of a scan, as a trajectory. Made by [`Scan::x`] and [`Scan::y`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ScanAxis<S> {
    scan: S,
    axis: Axis,
}

impl<S: Scan> ScanAxis<S> {
    /// The scan to which it belongs.
    #[must_use]
    pub fn scan(&self) -> S {
        self.scan
    }

    /// Which one.
    #[must_use]
    pub fn axis(&self) -> Axis {
        self.axis
    }
}

impl<S: Scan> Trajectory for ScanAxis<S> {
    fn at(&self, t: f64) -> Motion {
        self.scan.motion(self.axis, t)
    }

    fn duration(&self) -> f64 {
        self.scan.duration()
    }

    fn is_periodic(&self) -> bool {
        false
    }
}

/// A Lissajous figure: a sine on each axis, whose amplitudes grow from rest and fade to rest.
///
/// x = e(t) a_x sin(2 pi f_x (t - t_0) + phase), y = e(t) a_y sin(2 pi f_y (t - t_0)), about the centre. The envelope e
/// goes from 0 to 1 along S(s) = 10 s^3 - 15 s^4 + 6 s^5 until the lead-in ends at t_0, and back to 0 behind the
/// figure. So derivatives up to the second are continuous, and all are 0 at both ends. With a lead-in of at least two
/// periods of the slower sine nothing is faster than in the figure itself, and no acceleration is more than 4 %
/// greater.
///
/// ```
/// use hysteresis_control::trajectory::{Lissajous, Motion, Scan, Trajectory};
/// let figure = Lissajous::new((5.0, 4.0), (30.0, 29.0), 0.0, 1.0, 0.1, (0.0, 0.0))?;
/// assert_eq!(figure.x().at(0.0), Motion::rest(0.0));
/// let quarter = 0.1 + 0.25 / 30.0;
/// assert!((figure.x().at(quarter).position - 5.0).abs() < 1e-9);
/// assert_eq!(figure.duration(), 1.2);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lissajous {
    amplitudes: (f64, f64),
    frequencies: (f64, f64),
    phase: f64,
    seconds: f64,
    lead_in: f64,
    center: (f64, f64),
}

impl Lissajous {
    /// From the amplitudes of x and y, their frequencies in Hz, the phase of x in radians, the seconds of the figure
    /// without its lead-in and lead-out, those of the lead-in, and a centre.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, the frequencies and the lead-in above 0 and the seconds not below, or where a
    /// derivative or the duration is not finite.
    pub fn new(
        amplitudes: (f64, f64),
        frequencies: (f64, f64),
        phase: f64,
        seconds: f64,
        lead_in: f64,
        center: (f64, f64),
    ) -> Result<Self, Error> {
        check_finite("amplitudes", amplitudes.0)?;
        check_finite("amplitudes", amplitudes.1)?;
        check_positive("frequencies", frequencies.0)?;
        check_positive("frequencies", frequencies.1)?;
        check_finite("phase", phase)?;
        check_number("seconds", (0.0..f64::INFINITY).contains(&seconds), "a finite number, 0 or more", seconds)?;
        check_positive("lead_in", lead_in)?;
        check_finite("center", center.0)?;
        check_finite("center", center.1)?;
        let amplitude = amplitudes.0.abs().max(amplitudes.1.abs());
        let greatest = |rate: f64| amplitude * (1.0 + 1e2 * rate.powi(3));
        check_bounded("frequencies", frequencies.0, greatest(TAU * frequencies.0))?;
        check_bounded("frequencies", frequencies.1, greatest(TAU * frequencies.1))?;
        check_bounded("lead_in", lead_in, 2.0 * lead_in + greatest(1.0 / lead_in))?;
        Ok(Self { amplitudes, frequencies, phase, seconds, lead_in, center })
    }

    /// A lead-in of two periods of the slower sine, in seconds.
    #[must_use]
    pub fn default_lead_in(frequencies: (f64, f64)) -> f64 {
        2.0 / frequencies.0.min(frequencies.1)
    }

    /// Half of the swing of x and of y.
    #[must_use]
    pub fn amplitudes(&self) -> (f64, f64) {
        self.amplitudes
    }

    /// Cycles per second of x and of y, in Hz.
    #[must_use]
    pub fn frequencies(&self) -> (f64, f64) {
        self.frequencies
    }

    /// The phase of x where the lead-in ends, in radians; that of y is 0 there.
    #[must_use]
    pub fn phase(&self) -> f64 {
        self.phase
    }

    /// How many seconds the figure takes, without its lead-in and lead-out.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// How many seconds the amplitudes grow, and fade.
    #[must_use]
    pub fn lead_in(&self) -> f64 {
        self.lead_in
    }

    /// Where it starts and ends.
    #[must_use]
    pub fn center(&self) -> (f64, f64) {
        self.center
    }

    /// The times between which the amplitudes are constant, in seconds.
    #[must_use]
    pub fn steady(&self) -> (f64, f64) {
        (self.lead_in, self.lead_in + self.seconds)
    }

    /// e and its derivatives; none where it is 0.
    fn envelope(&self, t: f64) -> Option<Motion> {
        // The time of the last sample may be a rounding short of the end.
        let remaining = self.duration() * (1.0 - 2.0 * ROUNDING) - t;
        let (since, sign) = if t <= remaining { (t, 1.0) } else { (remaining, -1.0) };
        if since <= 0.0 {
            return None;
        }
        if since >= self.lead_in {
            return Some(Motion::rest(1.0));
        }
        let smooth = Smooth::at(since / self.lead_in);
        let rate = sign / self.lead_in;
        Some(Motion {
            position: smooth.value,
            velocity: smooth.first * rate,
            acceleration: smooth.second * rate * rate,
            jerk: smooth.third * rate * rate * rate,
        })
    }
}

impl Scan for Lissajous {
    fn motion(&self, axis: Axis, t: f64) -> Motion {
        let (amplitude, frequency, phase, center) = match axis {
            Axis::X => (self.amplitudes.0, self.frequencies.0, self.phase, self.center.0),
            Axis::Y => (self.amplitudes.1, self.frequencies.1, 0.0, self.center.1),
        };
        let Some(e) = self.envelope(t) else {
            return Motion::rest(center);
        };
        let w = TAU * frequency;
        // Whole cycles are taken off first: sines of large angles are inexact.
        let (sine, cosine) = (TAU * (frequency * (t - self.lead_in)).fract() + phase).sin_cos();
        let (s0, s1, s2, s3) = (sine, w * cosine, -w * w * sine, -w * w * w * cosine);
        let product = Motion {
            position: e.position * s0,
            velocity: e.velocity * s0 + e.position * s1,
            acceleration: e.acceleration * s0 + 2.0 * e.velocity * s1 + e.position * s2,
            jerk: e.jerk * s0 + 3.0 * (e.acceleration * s1 + e.velocity * s2) + e.position * s3,
        };
        product.scaled(amplitude).moved(center)
    }

    fn duration(&self) -> f64 {
        2.0 * self.lead_in + self.seconds
    }
}

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
/// With p the pitch, the radius is r = p theta / (2 pi), and x = r cos theta, y = r sin theta. The angle theta, at a
/// constant angular velocity, or the length of the path
///
/// s = (p / (4 pi)) (theta sqrt(1 + theta^2) + asinh theta),
///
/// at a constant linear velocity, grows steadily between the inner radius and the end (Mahmood and Moheimani,
/// Nanotechnology 20, 365503, 2009). At the centre the path bends sharply, so it starts there at rest: the rate rises
/// along S(s) = 10 s^3 - 15 s^4 + 6 s^5 and is full at the inner radius r_i. The acceleration is at most 1.5 speed^2 /
/// r_i, and 1.2 if r_i is a pitch or more. It ends at rest on its radius, and does not go beyond. Derivatives up to the
/// third are continuous.
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
    /// A spiral to a radius with turns a pitch apart, which runs at its full rate from the inner radius on, about a
    /// centre.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, radius, pitch and rate above 0, the pitch at most the radius and the inner
    /// radius above 0 and at most half of the radius, or where a derivative or the duration is not finite.
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

/// The angle at which the path has a length, where the radius is the angle: Newton's method from above on a convex
/// function.
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
