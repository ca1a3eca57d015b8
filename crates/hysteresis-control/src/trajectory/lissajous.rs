use core::f64::consts::TAU;

use super::motion::{Motion, ROUNDING, check_bounded};
use super::scan::{Axis, Scan};
use super::smooth::Smooth;
use crate::sampling::{Error, check_finite, check_positive};

/// A Lissajous figure: a sine on each axis, whose amplitudes grow from rest and fade to rest.
///
/// x = e(t) a_x sin(2 pi f_x (t - t_0) + phase), y = e(t) a_y sin(2 pi f_y (t - t_0)), about the centre. The envelope e goes from 0 to 1
/// along S(s) = 10 s^3 - 15 s^4 + 6 s^5 until the lead-in ends at t_0, and back to 0 behind the figure. So derivatives up to the
/// second are continuous, and all are 0 at both ends. With a lead-in of at least two periods of the slower sine nothing is faster than
/// in the figure itself, and no acceleration is more than 4 % greater.
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
    /// From the amplitudes of x and y, their frequencies in Hz, the phase of x in radians, the seconds of the figure without its
    /// lead-in and lead-out, those of the lead-in, and a centre.
    ///
    /// # Errors
    /// [`Error`] unless all are finite, the frequencies and the lead-in above 0 and the seconds not below, or where a derivative or the
    /// duration is not finite.
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
        if !(0.0..f64::INFINITY).contains(&seconds) {
            return Err(Error::domain("seconds", "a finite number, 0 or more", seconds));
        }
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
