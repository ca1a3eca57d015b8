//! Line by line over a field, with smooth turns.

use super::scans::{Axis, Scan};
use super::{GREATEST_SLOPE, Motion, ROUNDING, Run, Smooth, Trajectory, check_bounded, rise};
use crate::sampling::{Error, MAX_SAMPLES, check_finite, check_number, check_positive, check_whole, reserve};

/// The lead-in takes this share of a turn: then it begins where turns reach, at rest, and accelerates less than they
/// do.
const LEAD_IN: f64 = 11.0 / 16.0;

/// How far a turn reaches, in units of the speed on the lines times its duration: the integral of 1 - 2 S up to the
/// turn.
const REACH: f64 = 11.0 / 32.0;

/// What a raster scans, and how.
///
/// ```
/// use hysteresis_control::trajectory::RasterOptions;
/// let options = RasterOptions::new(10.0, 8.0, 64, 5.0);
/// assert_eq!((options.turnaround, options.is_bidirectional, options.has_steps), (0.2, false, false));
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RasterOptions {
    /// How long the lines are, without the turns, in the unit of the reference (um).
    pub width: f64,
    /// What the lines cover: they are height / lines apart, each in the middle of its strip. 0 repeats one line.
    pub height: f64,
    /// How many.
    pub lines: u32,
    /// Lines per second, in Hz.
    pub line_rate: f64,
    /// The share of the time that goes into turning round.
    pub turnaround: f64,
    /// Whether the way back is the next line. Else every line is traced and retraced.
    pub is_bidirectional: bool,
    /// Whether the slow axis rests during a line, and steps to the next one during the turn. Else it is a ramp.
    pub has_steps: bool,
    /// The centre of the image.
    pub center: (f64, f64),
}

impl RasterOptions {
    /// Lines that are traced and retraced beside a ramp, about (0, 0), with a fifth of the time for turns.
    #[must_use]
    pub fn new(width: f64, height: f64, lines: u32, line_rate: f64) -> Self {
        let (is_bidirectional, has_steps) = (false, false);
        Self { width, height, lines, line_rate, turnaround: 0.2, is_bidirectional, has_steps, center: (0.0, 0.0) }
    }

    fn check(&self) -> Result<(), Error> {
        check_positive("width", self.width)?;
        check_number("height", (0.0..f64::INFINITY).contains(&self.height), "a finite number, 0 or more", self.height)?;
        check_whole("lines", (1..=MAX_SAMPLES).contains(&self.lines), "1 to 2^27", self.lines)?;
        check_positive("line_rate", self.line_rate)?;
        let holds = self.turnaround > 0.0 && self.turnaround < 1.0;
        check_number("turnaround", holds, "a share above 0 and below 1", self.turnaround)?;
        check_finite("center", self.center.0)?;
        check_finite("center", self.center.1)
    }
}

/// A raster: the fast axis x goes to and fro at a constant speed, the slow axis y advances.
///
/// A sweep of the duration T has a straight part, on which x crosses the width at the constant speed v = width / ((1 -
/// a) T), and a turn of the duration c = a T, a being `turnaround`. In the turn the velocity goes from v to -v along v
/// (1 - 2 S(s)), S(s) = 10 s^3 - 15 s^4 + 6 s^5. So x reaches 11/32 v c beyond the image, the overscan, and accelerates
/// by at most 15/4 v / c. All derivatives of x up to the third are continuous, those of y up to the second.
///
/// Both axes begin and end at rest: x at the end of its overscan. So a drive needs a lead-in to where they begin, but
/// no run-up.
///
/// ```
/// use hysteresis_control::trajectory::{Motion, Raster, RasterOptions, Scan, Trajectory};
/// let raster = Raster::new(RasterOptions::new(10.0, 8.0, 64, 5.0))?;
/// assert_eq!(raster.speed(), 125.0); // 10 um in 0.8 of 0.1 s
/// assert!((raster.duration() - 64.0 / 5.0).abs() < 0.02);
/// let (begins, ends) = raster.sweep(0).unwrap();
/// assert!((raster.x().at(begins).position + 5.0).abs() < 1e-12 && (raster.x().at(ends).position - 5.0).abs() < 1e-12);
/// assert_eq!(raster.x().at(0.0), Motion::rest(-5.0 - raster.overscan()));
/// # Ok::<(), hysteresis_control::sampling::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Raster {
    options: RasterOptions,
    /// How often x crosses the width.
    sweeps: u32,
    /// Seconds from the beginning of one sweep to that of the next.
    sweep: f64,
    /// Seconds of a turn, and until the first line.
    turn: f64,
    lead_in: f64,
    /// Of x on the lines.
    speed: f64,
}

impl Raster {
    /// # Errors
    /// [`Error`] unless width and line rate are finite and above 0, the height not below, there are 1 to 2^27 lines,
    /// the share of the turns is between 0 and 1 and the centre finite, or where a derivative or the duration is not
    /// finite.
    pub fn new(options: RasterOptions) -> Result<Self, Error> {
        options.check()?;
        let (sweeps, sweep) = if options.is_bidirectional {
            (options.lines, 1.0 / options.line_rate)
        } else {
            (2 * options.lines, 0.5 / options.line_rate)
        };
        let turn = options.turnaround * sweep;
        let speed = options.width / (sweep - turn);
        let made = Self { options, sweeps, sweep, turn, lead_in: LEAD_IN * turn, speed };
        let extent = options.width + options.height;
        check_bounded("line_rate", options.line_rate, made.duration() + extent * (1.0 + 120.0 / turn.powi(3)))?;
        check_bounded("turnaround", options.turnaround, 120.0 * speed / turn / turn)?;
        Ok(made)
    }

    /// What it scans, and how.
    #[must_use]
    pub fn options(&self) -> RasterOptions {
        self.options
    }

    /// The speed of x on the lines.
    #[must_use]
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// The greatest acceleration of x, in the middle of a turn.
    #[must_use]
    pub fn acceleration(&self) -> f64 {
        2.0 * GREATEST_SLOPE * self.speed / self.turn
    }

    /// How far x reaches beyond the image on either side.
    #[must_use]
    pub fn overscan(&self) -> f64 {
        REACH * self.speed * self.turn
    }

    /// How many seconds a line takes, without the turn.
    #[must_use]
    pub fn line_duration(&self) -> f64 {
        self.sweep - self.turn
    }

    /// When x crosses the width for the k-th time, from and to: in the positive direction for even k. None behind the
    /// last.
    #[must_use]
    pub fn sweep(&self, k: u32) -> Option<(f64, f64)> {
        (k < self.sweeps).then(|| {
            let begins = self.lead_in + f64::from(k) * self.sweep;
            (begins, begins + self.line_duration())
        })
    }

    /// The line on which each of the [`samples`](Trajectory::samples) lies, counted from 0; none in a turn. With
    /// `retrace` it is the line that is retraced, else the one that is traced. A bidirectional raster retraces none.
    ///
    /// # Errors
    /// As for [`samples`](Trajectory::samples).
    pub fn line_index(&self, dt: f64, retrace: bool) -> Result<Vec<Option<u32>>, Error> {
        let count = self.x().samples(dt, None)?;
        let mut lines = reserve("dt", count)?;
        lines.extend((0..count).map(|k| self.line_at(f64::from(k) * dt, retrace)));
        Ok(lines)
    }

    fn line_at(&self, t: f64, retrace: bool) -> Option<u32> {
        // A sample at the beginning or end of a line may be a rounding beside it.
        let rounding = ROUNDING * t;
        let (sweep, since) = self.place(t + rounding)?;
        if since > self.line_duration() + 2.0 * rounding {
            return None;
        }
        match (self.options.is_bidirectional, retrace) {
            (true, false) => Some(sweep),
            (true, true) => None,
            (false, _) => ((sweep % 2 == 1) == retrace).then_some(sweep / 2),
        }
    }

    /// The sweep to which a time belongs, with the turn behind it, and how long it has lasted; none before the first.
    fn place(&self, t: f64) -> Option<(u32, f64)> {
        let since = t - self.lead_in;
        if since < 0.0 {
            return None;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
        let sweep = ((since / self.sweep) as u32).min(self.sweeps - 1);
        Some((sweep, since - f64::from(sweep) * self.sweep))
    }

    /// About the centre.
    fn fast(&self, t: f64) -> Motion {
        let Self { speed, turn, lead_in, .. } = *self;
        let half = 0.5 * self.options.width;
        let Some((sweep, since)) = self.place(t) else {
            return self.end(t).scaled(-1.0);
        };
        let direction = if sweep % 2 == 0 { 1.0 } else { -1.0 };
        let turning = since - self.line_duration();
        let motion = if turning <= 0.0 {
            Motion { position: speed * since - half, velocity: speed, ..Motion::default() }
        } else if sweep + 1 < self.sweeps {
            let smooth = Smooth::at((turning / turn).min(1.0));
            Motion {
                position: half + speed * (turning.min(turn) - 2.0 * turn * smooth.integral),
                velocity: speed * (1.0 - 2.0 * smooth.value),
                acceleration: -2.0 * speed * smooth.first / turn,
                jerk: -2.0 * speed * smooth.second / turn / turn,
            }
        } else {
            // The end is the beginning backwards, which changes the sign of odd derivatives.
            let end = self.end(lead_in - turning);
            Motion { velocity: -end.velocity, jerk: -end.jerk, ..end }
        };
        motion.scaled(direction)
    }

    /// The lead-in of x, mirrored: from rest at the end of the overscan on the positive side to the image.
    fn end(&self, t: f64) -> Motion {
        let Self { speed, lead_in, .. } = *self;
        let reach = 0.5 * self.options.width + self.overscan();
        // The time of the last sample may be a rounding short of the end.
        if t <= 2.0 * ROUNDING * self.duration() {
            return Motion::rest(reach);
        }
        let Motion { position, velocity, acceleration, jerk } = rise(speed, lead_in, t);
        Motion { position: reach - position, velocity: -velocity, acceleration: -acceleration, jerk: -jerk }
    }

    /// About the centre.
    fn slow(&self, t: f64) -> Motion {
        if self.options.has_steps { self.steps(t) } else { self.ramp(t) }
    }

    fn ramp(&self, t: f64) -> Motion {
        let lines = f64::from(self.sweeps) * self.sweep;
        let run = Run {
            rate: self.options.height / lines,
            lead_in: self.lead_in,
            steady: lines - self.turn,
            lead_out: self.lead_in,
        };
        run.at(t).moved(-0.5 * run.length())
    }

    fn steps(&self, t: f64) -> Motion {
        let Self { turn, options: RasterOptions { height, lines, is_bidirectional, .. }, .. } = *self;
        let pitch = height / f64::from(lines);
        let (sweep, since) = self.place(t).unwrap_or_default();
        let line = if is_bidirectional { sweep } else { sweep / 2 };
        let position = pitch * (f64::from(line) + 0.5) - 0.5 * height;
        let is_retraced = is_bidirectional || sweep % 2 == 1;
        let turning = since - self.line_duration();
        if turning <= 0.0 || !is_retraced || sweep + 1 == self.sweeps {
            return Motion::rest(position);
        }
        let smooth = Smooth::at((turning / turn).min(1.0));
        Motion {
            position: position + pitch * smooth.value,
            velocity: pitch * smooth.first / turn,
            acceleration: pitch * smooth.second / turn / turn,
            jerk: pitch * smooth.third / turn / turn / turn,
        }
    }
}

impl Scan for Raster {
    fn motion(&self, axis: Axis, t: f64) -> Motion {
        match axis {
            Axis::X => self.fast(t).moved(self.options.center.0),
            Axis::Y => self.slow(t).moved(self.options.center.1),
        }
    }

    fn duration(&self) -> f64 {
        f64::from(self.sweeps) * self.sweep - self.turn + 2.0 * self.lead_in
    }
}
