use super::motion::{Motion, Trajectory, check_bounded};
use crate::sampling::{Error, check_finite, check_positive};

/// A triangle whose corners take a time of their own: straight sides, and at the turns a smooth change of velocity.
///
/// It first rises from its offset and reaches offset +- amplitude exactly. During a corner of the duration c the velocity
/// goes from v to -v along v (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5, s from 0 to 1. So derivatives up to the third
/// are continuous; with the period T
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
    /// [`Error`] unless all are finite, the derivatives too, frequency and corner above 0 and the corner at most half a period.
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
