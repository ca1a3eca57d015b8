use super::motion::{Motion, ROUNDING, Trajectory, check_bounded};
use crate::sampling::{Error, check_finite, check_positive};

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
        if points.is_empty() {
            return Err(Error::whole("points", "at least one point", 0));
        }
        points.iter().try_for_each(|point| check_finite("points", *point))?;
        if !(0.0..=MAX_DWELL).contains(&dwell) {
            return Err(Error::domain("dwell", "a number of seconds, 0 or more (at most 1e9)", dwell));
        }
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
