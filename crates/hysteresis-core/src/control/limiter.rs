//! What stands between every number and the amplifier.

use super::options::ControllerOptions;
use crate::error::{Error, check_positive};
use crate::real::check_range;

/// The limits of the drive, and how far it may move in one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limiter {
    low: f64,
    high: f64,
    /// In volts per sample; infinite without a limit.
    slew: f64,
    /// The same for the next samples, which may have a bound of their own besides.
    step: f64,
}

/// What is left of an unlimited drive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limited {
    pub(super) drive: f64,
    /// Whether the unlimited drive lay beyond the limits.
    pub(super) saturated: bool,
    /// Whether the unlimited drive, within the limits, was too far from the last drive.
    pub(super) slewing: bool,
}

impl Limiter {
    pub(super) fn new(options: &ControllerOptions) -> Result<Self, Error> {
        check_range("limits", options.limits, "the low limit")?;
        let dt = options.checked_dt()?;
        let slew = options.slew.map(|slew| check_positive("slew", slew)).transpose()?;
        Ok(Self::of(options.limits, slew, dt))
    }

    /// A limiter of numbers that were checked.
    pub(super) fn of((low, high): (f64, f64), slew: Option<f64>, dt: f64) -> Self {
        let slew = slew.map_or(f64::INFINITY, |slew| slew * dt);
        Self { low, high, slew, step: slew }
    }

    /// From now on the drive moves by at most so many volts per sample, and no farther than the slew allows. NaN counts
    /// as 0.
    pub(super) fn bound_step(&mut self, volts: f64) {
        self.step = self.slew.min(volts.max(0.0));
    }

    /// The nearest to the unlimited drive that lies within the limits and within a step of the last drive `from`. A
    /// NaN, which the bounds on all inputs rule out, would leave the drive where it is.
    #[inline]
    pub(super) fn limit(&self, unlimited: f64, from: f64) -> Limited {
        let allowed = nearest(unlimited, self.low, self.high, from);
        let drive = approach(allowed, from, self.step);
        Limited { drive, saturated: allowed != unlimited, slewing: drive != allowed }
    }
}

/// The nearest to `to` that is at most `step` from `from`.
///
/// `from + step` may round away from `from`, by half a unit in the last place. It is rounded towards `from` then, so
/// that the difference of the two drives, computed in doubles, never exceeds `step`.
#[inline]
pub(super) fn approach(to: f64, from: f64, step: f64) -> f64 {
    let (below, above) = (from - step, from + step);
    let below = if from - below > step { below.next_up() } else { below };
    let above = if above - from > step { above.next_down() } else { above };
    nearest(to, below, above, from)
}

#[inline]
fn nearest(x: f64, low: f64, high: f64, otherwise: f64) -> f64 {
    if x > high {
        high
    } else if x < low {
        low
    } else if x.is_nan() {
        otherwise
    } else {
        x
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMITER: Limiter = Limiter { low: -20.0, high: 150.0, slew: 5.0, step: 5.0 };

    fn limit(unlimited: f64, from: f64) -> (f64, bool, bool) {
        let Limited { drive, saturated, slewing } = LIMITER.limit(unlimited, from);
        (drive, saturated, slewing)
    }

    #[test]
    fn limits_come_before_the_slew() {
        assert_eq!(limit(3.0, 0.0), (3.0, false, false));
        assert_eq!(limit(9.0, 0.0), (5.0, false, true));
        assert_eq!(limit(-99.0, -18.0), (-20.0, true, false));
        assert_eq!(limit(1e300, 0.0), (5.0, true, true));
    }

    #[test]
    fn a_nan_repeats_the_last_drive() {
        assert_eq!(limit(f64::NAN, 7.0), (7.0, true, false));
        assert_eq!(limit(f64::INFINITY, 149.0), (150.0, true, false));
        let free = Limiter { step: f64::INFINITY, ..LIMITER };
        assert_eq!(free.limit(f64::NEG_INFINITY, 150.0).drive, -20.0);
    }

    #[test]
    fn a_bound_only_makes_steps_shorter() {
        let mut limiter = LIMITER;
        for (bound, drive) in [(2.0, 2.0), (0.0, 0.0), (f64::NAN, 0.0), (-1.0, 0.0), (7.0, 5.0), (f64::INFINITY, 5.0)] {
            limiter.bound_step(bound);
            assert_eq!(limiter.limit(9.0, 0.0).drive, drive, "{bound}");
        }
    }

    #[test]
    fn a_step_is_never_exceeded_by_rounding() {
        let (from, step) = (0.4, 1.3);
        assert!(from + step - from > step, "the plain sum would exceed it");
        assert!(approach(9.0, from, step) - from <= step);
        assert!(-from - approach(-9.0, -from, step) <= step);
        assert!(approach(9.0, from, step) > 1.7 - 1e-15);
        // A step that the drive is too large for leaves it where it is.
        assert_eq!(approach(2e100, 1e100, 1.0), 1e100);
    }
}
