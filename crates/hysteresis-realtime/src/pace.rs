//! The slew in time: samples that are caught up come closer together than the sampling interval.

/// Deadlines and clocks are rounded to nanoseconds: so much less than an interval is one.
const ROUNDING: f64 = 2.0;

/// How much of the time that the slew gives the drive has used up. Times are in nanoseconds.
///
/// In any time T the drive moves by at most slew (T + dt). The dt is that of a sample right behind one that was late. A sample that is
/// late itself by dt or more has no such grace: there the drive moves by at most slew T.
#[derive(Clone, Debug)]
pub(crate) struct Pace {
    /// In volts per nanosecond; None for a drive that may jump.
    slew: Option<f64>,
    dt: f64,
    start: u64,
    /// The time after `start` that the moves until now have used.
    used: f64,
}

impl Pace {
    /// `slew` in volts per second, `dt` in seconds. Until `start` the drive has rested.
    pub(crate) fn new(slew: Option<f64>, dt: f64, start: u64) -> Self {
        Self { slew: slew.map(|slew| slew * 1e-9), dt: dt * 1e9, start, used: 0.0 }
    }

    /// How far the drive may move in a sample that began `late`: infinitely far where only the slew of a sample bounds it.
    #[inline]
    pub(crate) fn step(&self, now: u64, late: u64) -> f64 {
        let Some(slew) = self.slew else { return f64::INFINITY };
        let grace = if nanoseconds(late) < self.dt { self.dt } else { 0.0 };
        let free = self.since_start(now) + grace - self.used;
        if free >= self.dt - ROUNDING { f64::INFINITY } else { slew * free }
    }

    /// A drive that is `step` volts away has been written until `now`.
    #[inline]
    pub(crate) fn moved(&mut self, step: f64, now: u64) {
        let takes = self.slew.map_or(0.0, |slew| step.abs() / slew);
        self.used = (self.used + takes).max(self.since_start(now));
    }

    #[inline]
    fn since_start(&self, now: u64) -> f64 {
        nanoseconds(now.saturating_sub(self.start))
    }
}

#[expect(clippy::cast_precision_loss, reason = "exact for 104 days")]
fn nanoseconds(time: u64) -> f64 {
    time as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 100 us, 1 V/ms: 0.1 V per sample.
    const DT: f64 = 1e-4;
    const SLEW: Option<f64> = Some(1e3);

    fn near(volts: f64, expected: f64) -> bool {
        (volts - expected).abs() < 1e-12
    }

    #[test]
    fn a_late_sample_moves_by_what_the_time_since_the_last_one_gives() {
        let mut pace = Pace::new(SLEW, DT, 500);
        pace.moved(0.1, 350_500);
        assert!(near(pace.step(350_500, 250_000), 0.0));
        assert!(near(pace.step(380_500, 100_000), 0.03));
        assert_eq!(pace.step(450_500, 250_000), f64::INFINITY);
        pace.moved(0.03, 380_500);
        assert!(near(pace.step(385_500, 100_000), 0.005));
    }

    #[test]
    fn one_sample_right_behind_a_late_one_is_free_and_no_other() {
        let mut pace = Pace::new(SLEW, DT, 0);
        pace.moved(0.1, 399_999);
        assert_eq!(pace.step(400_000, 0), f64::INFINITY);
        pace.moved(0.1, 400_000);
        assert!(near(pace.step(420_000, 20_000), 0.020_001));
        assert_eq!(pace.step(500_000, 0), f64::INFINITY);
    }

    #[test]
    fn without_a_slew_nothing_is_bounded() {
        let mut pace = Pace::new(None, DT, 0);
        pace.moved(100.0, 350_000);
        assert_eq!(pace.step(350_000, 300_000), f64::INFINITY);
    }
}
