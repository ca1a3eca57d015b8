//! What stands between every number and the amplifier.

/// The limits of the drive, and how far it may move in one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limiter {
    pub(super) low: f64,
    pub(super) high: f64,
    /// In volts per sample; infinite without a limit.
    pub(super) step: f64,
}

/// What is left of a demand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Limited {
    pub(super) drive: f64,
    /// Whether the demand lay beyond the limits.
    pub(super) saturated: bool,
    /// Whether the demand, within the limits, was too far from the last drive.
    pub(super) slewing: bool,
}

impl Limiter {
    /// The nearest to the demand that lies within the limits and within a step of the last drive `from`. A demand that is
    /// no number, which the bounds on all that enters rule out, would leave the drive where it is.
    #[inline]
    pub(super) fn limit(&self, demanded: f64, from: f64) -> Limited {
        let allowed = nearest(demanded, self.low, self.high, from);
        let drive = nearest(allowed, from - self.step, from + self.step, from);
        Limited { drive, saturated: allowed != demanded, slewing: drive != allowed }
    }
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

    const LIMITER: Limiter = Limiter { low: -20.0, high: 150.0, step: 5.0 };

    fn limit(demanded: f64, from: f64) -> (f64, bool, bool) {
        let Limited { drive, saturated, slewing } = LIMITER.limit(demanded, from);
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
    fn no_demand_is_followed_that_is_no_number() {
        assert_eq!(limit(f64::NAN, 7.0), (7.0, true, false));
        assert_eq!(limit(f64::INFINITY, 149.0), (150.0, true, false));
        let free = Limiter { step: f64::INFINITY, ..LIMITER };
        assert_eq!(free.limit(f64::NEG_INFINITY, 150.0).drive, -20.0);
    }
}
