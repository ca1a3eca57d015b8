//! Motions of one axis: a sine, a triangle with rounded corners, and from point to point.

use core::f64::consts::TAU;

use super::{Motion, ROUNDING, Trajectory, check_bounded};
use crate::sampling::{Error, check_finite, check_number, check_positive, check_whole};

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

/// A triangle whose corners take a time of their own: straight sides, and at the turns a smooth change of velocity.
///
/// It first rises from its offset and reaches offset +- amplitude exactly. During a corner of the duration c the
/// velocity goes from v to -v along v (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5, s from 0 to 1. So derivatives up to
/// the third are continuous; with the period T
///
/// v = amplitude / (T / 4 - 5 c / 32), greatest acceleration 15 v / (4 c).
///
/// ```
/// use hysteresis_control::trajectory::{RoundedTriangle, Trajectory};
/// let scan = RoundedTriangle::new(3.0, 1.0, 0.1, 0.0)?;
/// assert_eq!((scan.at(0.0).position, scan.at(0.25).position, scan.at(0.75).position), (0.0, 3.0, -3.0));
/// assert_eq!(scan.at(0.1).velocity, scan.at(-0.1).velocity); // both on the rising side
/// assert!((scan.at(0.25).acceleration + 3.75 * scan.at(0.0).velocity / 0.1).abs() < 1e-9);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedTriangle {
    amplitude: f64,
    frequency: f64,
    corner: f64,
    offset: f64,
    /// On the sides.
    speed: f64,
}

impl RoundedTriangle {
    /// From amplitude and offset in the unit of the reference, the frequency in Hz, and the duration of a corner in
    /// seconds.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, the derivatives too, frequency and corner above 0 and the corner at most half a
    /// period.
    pub fn new(amplitude: f64, frequency: f64, corner: f64, offset: f64) -> Result<Self, Error> {
        check_finite("amplitude", amplitude)?;
        check_positive("frequency", frequency)?;
        check_positive("corner", corner)?;
        check_finite("offset", offset)?;
        let period = 1.0 / frequency;
        if corner > 0.5 * period {
            return Err(Error::domain("corner", format!("at most half a period, {:?} s", 0.5 * period), corner));
        }
        let speed = amplitude / (0.25 * period - 5.0 / 32.0 * corner);
        check_bounded(
            "corner",
            corner,
            offset.abs() + amplitude.abs() + 20.0 * speed.abs() * (1.0 + (1.0 / corner).powi(2)),
        )?;
        Ok(Self { amplitude, frequency, corner, offset, speed })
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

    /// The duration of a corner in seconds.
    #[must_use]
    pub fn corner(&self) -> f64 {
        self.corner
    }

    /// The value around which it swings.
    #[must_use]
    pub fn offset(&self) -> f64 {
        self.offset
    }
}

impl Trajectory for RoundedTriangle {
    fn at(&self, t: f64) -> Motion {
        // Time from the middle of a side on, then until the next turn, which all sides share but for the sign.
        let sides = 2.0 * self.frequency * t + 0.5;
        let sign = if sides.floor().rem_euclid(2.0) == 0.0 { 1.0 } else { -1.0 };
        let half = 0.5 * (sides - sides.floor()) - 0.25;
        let since_centre = half / self.frequency;
        let until_turn = (0.25 - half.abs()) / self.frequency;
        let (side, turned) = (since_centre.signum(), 0.5 - until_turn / self.corner);
        if turned <= 0.0 {
            let position = self.offset + sign * self.speed * since_centre;
            return Motion { position, velocity: sign * self.speed, ..Motion::default() };
        }
        let s = turned;
        let step = s * s * s * (10.0 - 15.0 * s + 6.0 * s * s);
        // The integral of 1 - 2 S from s to the turn at s = 1/2, where it is 11/32.
        let before_turn = 11.0 / 32.0 - (s - s.powi(4) * (5.0 - 6.0 * s + 2.0 * s * s));
        Motion {
            position: self.offset + sign * side * (self.amplitude - self.speed * self.corner * before_turn),
            velocity: sign * self.speed * (1.0 - 2.0 * step),
            acceleration: -sign * side * 60.0 * (self.speed / self.corner) * (s * (1.0 - s)).powi(2),
            jerk: -sign * 120.0 * (self.speed / self.corner / self.corner) * s * (1.0 - s) * (1.0 - 2.0 * s),
        }
    }

    fn duration(&self) -> f64 {
        1.0 / self.frequency
    }

    fn is_periodic(&self) -> bool {
        true
    }
}

/// The longest rest in seconds: in 30 years, times are still told apart to 0.1 us.
const MAX_DWELL: f64 = 1e9;

/// What a move may not exceed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MotionLimits {
    /// Largest speed, in the unit of the reference per second.
    pub velocity: f64,
    /// Largest acceleration, per second squared.
    pub acceleration: f64,
    /// Largest jerk, per second cubed.
    pub jerk: f64,
}

impl MotionLimits {
    fn check(&self) -> Result<(), Error> {
        check_positive("velocity", self.velocity)?;
        check_positive("acceleration", self.acceleration)?;
        check_positive("jerk", self.jerk)
    }
}

/// Moves from point to point and rests between them: S-curves, the fastest within the limits.
///
/// Each move starts and ends at rest and has constant jerk on up to seven pieces, the double-S profile (Biagiotti and
/// Melchiorri, Trajectory Planning for Automatic Machines and Robots, 2008, section 3.4). It never overshoots, and it
/// ends on its point exactly, at rest: the last of its [`samples`](Trajectory::samples) too, whatever the interval.
///
/// ```
/// use hysteresis_control::trajectory::{MotionLimits, PointToPoint, Trajectory};
/// let limits = MotionLimits { velocity: 100.0, acceleration: 1e4, jerk: 1e7 }; // um/s, um/s^2, um/s^3
/// let moves = PointToPoint::new(&[0.0, 3.0, 1.0], limits, 0.05)?;
/// assert_eq!(moves.at(0.0).position, 0.0);
/// assert_eq!((moves.at(0.06).position, moves.at(0.06).velocity), (3.0, 0.0)); // rests
/// assert_eq!(moves.at(moves.duration()).position, 1.0);
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PointToPoint {
    points: Box<[f64]>,
    limits: MotionLimits,
    dwell: f64,
    legs: Box<[Leg]>,
    duration: f64,
}

/// One move, with the times at which it starts and ends.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Leg {
    begins: f64,
    ends: f64,
    from: f64,
    to: f64,
    profile: Profile,
}

impl PointToPoint {
    /// From the first point through all others, with a rest of `dwell` seconds at each between the first and the last.
    ///
    /// # Errors
    /// [`Error`] without a point, unless all numbers are finite, the limits above 0 and the dwell not below, or where a
    /// move is too long or too short for its times to be told apart.
    pub fn new(points: &[f64], limits: MotionLimits, dwell: f64) -> Result<Self, Error> {
        limits.check()?;
        check_whole("points", !points.is_empty(), "at least one point", 0)?;
        points.iter().try_for_each(|point| check_finite("points", *point))?;
        let holds = (0.0..=MAX_DWELL).contains(&dwell);
        check_number("dwell", holds, "a number of seconds, 0 or more (at most 1e9)", dwell)?;
        let (mut begins, mut duration) = (0.0, 0.0);
        let mut legs = Vec::with_capacity(points.len());
        for pair in points.windows(2) {
            let (from, to) = (pair[0], pair[1]);
            let profile = Profile::new((to - from).abs(), limits);
            check_bounded("points", to, profile.duration() + (to - from).abs())?;
            duration = begins + profile.duration();
            legs.push(Leg { begins, ends: duration, from, to, profile });
            begins = duration + dwell;
        }
        Ok(Self { points: points.into(), limits, dwell, legs: legs.into(), duration })
    }

    /// Where it starts, and where each move ends.
    #[must_use]
    pub fn points(&self) -> &[f64] {
        &self.points
    }

    /// What no move exceeds.
    #[must_use]
    pub fn limits(&self) -> MotionLimits {
        self.limits
    }

    /// How many seconds it rests at each point between the first and the last.
    #[must_use]
    pub fn dwell(&self) -> f64 {
        self.dwell
    }
}

impl Trajectory for PointToPoint {
    fn at(&self, t: f64) -> Motion {
        let begun = self.legs.partition_point(|leg| leg.begins <= t);
        match begun.checked_sub(1).and_then(|last| self.legs.get(last)) {
            None => Motion::rest(self.points[0]),
            // The time of the last sample may be a rounding short of the end.
            Some(leg) if t < leg.ends * (1.0 - 2.0 * ROUNDING) => leg.at(t - leg.begins),
            Some(leg) => Motion::rest(leg.to),
        }
    }

    fn duration(&self) -> f64 {
        self.duration
    }

    fn is_periodic(&self) -> bool {
        false
    }
}

impl Leg {
    fn at(&self, t: f64) -> Motion {
        let remaining = self.profile.duration() - t;
        if remaining <= 0.0 || t <= 0.0 {
            return Motion::rest(if t <= 0.0 { self.from } else { self.to });
        }
        // The second half is the first one backwards, so both ends are exact.
        let direction = (self.to - self.from).signum();
        if t <= remaining {
            let begun = self.profile.at(t);
            Motion {
                position: self.from + direction * begun.position,
                velocity: direction * begun.velocity,
                acceleration: direction * begun.acceleration,
                jerk: direction * begun.jerk,
            }
        } else {
            let left = self.profile.at(remaining);
            Motion {
                position: self.to - direction * left.position,
                velocity: direction * left.velocity,
                acceleration: -direction * left.acceleration,
                jerk: direction * left.jerk,
            }
        }
    }
}

/// The first half of a move from rest to rest, from zero on.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Profile {
    jerk: f64,
    /// How long the jerk lasts, at the start and at the end of the acceleration.
    jerk_time: f64,
    /// How long the acceleration lasts, both jerks included.
    acceleration_time: f64,
    /// How long the velocity is constant.
    cruise_time: f64,
}

impl Profile {
    /// The fastest over a distance: every piece is as short as the limit that it meets allows.
    fn new(distance: f64, limits: MotionLimits) -> Self {
        let MotionLimits { velocity, acceleration, jerk } = limits;
        let full_jerk = acceleration / jerk;
        // To the full velocity and back to rest, if the distance suffices.
        let jerk_time = full_jerk.min((velocity / jerk).sqrt());
        let acceleration_time = jerk_time + velocity / (jerk * jerk_time);
        let cruise_time = distance / velocity - acceleration_time;
        if cruise_time >= 0.0 {
            return Self { jerk, jerk_time, acceleration_time, cruise_time };
        }
        let jerk_time = full_jerk.min((0.5 * distance / jerk).cbrt());
        let acceleration_time = if jerk_time < full_jerk {
            2.0 * jerk_time
        } else {
            0.5 * (full_jerk + (full_jerk * full_jerk + 4.0 * distance / acceleration).sqrt())
        };
        Self { jerk, jerk_time, acceleration_time, cruise_time: 0.0 }
    }

    fn duration(&self) -> f64 {
        2.0 * self.acceleration_time + self.cruise_time
    }

    /// For t from 0 to half of the duration.
    fn at(&self, t: f64) -> Motion {
        let Self { jerk, jerk_time, acceleration_time, .. } = *self;
        let (peak, end) = (jerk * jerk_time, acceleration_time);
        // The acceleration is symmetric about its middle, where half of the velocity is reached.
        let speed = peak * (end - jerk_time);
        if t < jerk_time {
            let acceleration = jerk * t;
            Motion { position: acceleration * t * t / 6.0, velocity: 0.5 * acceleration * t, acceleration, jerk }
        } else if t <= end - jerk_time {
            let since = t - 0.5 * jerk_time;
            let position = 0.5 * peak * (since * since + jerk_time * jerk_time / 12.0);
            Motion { position, velocity: peak * since, acceleration: peak, jerk: 0.0 }
        } else if t < end {
            let until = end - t;
            let acceleration = jerk * until;
            let position = speed * (t - 0.5 * end) + acceleration * until * until / 6.0;
            Motion { position, velocity: speed - 0.5 * acceleration * until, acceleration, jerk: -jerk }
        } else {
            Motion { position: speed * (t - 0.5 * end), velocity: speed, ..Motion::default() }
        }
    }
}
