//! When samples are due, what becomes of deadlines that are missed, and how far the drive may go in that time.

use serde::{Deserialize, Serialize};

use crate::settings::MissPolicy;

/// What became of deadlines: `taken + skipped` is the number of deadlines that there were.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Deadlines {
    /// Samples that were taken.
    pub taken: u64,
    /// Of those, samples whose drive was written when the next sample was due or later: the missed deadlines.
    pub missed: u64,
    /// Of those that were taken, samples that began only when the next one was due, or later: after a late wake-up, or
    /// to catch up.
    pub late: u64,
    /// Deadlines at which no sample was taken.
    pub skipped: u64,
}

/// The deadlines of a loop: deadline k is at `start + k dt`, without accumulated rounding.
#[derive(Clone, Debug)]
pub(crate) struct Schedule {
    /// Sampling interval in nanoseconds.
    dt: f64,
    start: u64,
    /// The deadline that comes next, counted from 0.
    index: u64,
    deadlines: Deadlines,
}

impl Schedule {
    /// `dt` in seconds; deadline 0 is at `start`.
    pub(crate) fn new(dt: f64, start: u64) -> Self {
        Self { dt: dt * 1e9, start, index: 0, deadlines: Deadlines::default() }
    }

    pub(crate) fn index(&self) -> u64 {
        self.index
    }

    pub(crate) fn deadlines(&self) -> Deadlines {
        self.deadlines
    }

    /// The moment of deadline `index`.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "an interval is at least a microsecond, so a double has all indices of 285 years, and times within a nanosecond for 104 days"
    )]
    fn at(&self, index: u64) -> u64 {
        self.start + (index as f64 * self.dt).round() as u64
    }

    /// The moment of the next sample.
    pub(crate) fn deadline(&self) -> u64 {
        self.at(self.index)
    }

    /// Moves on from a sample that began at `began` and whose drive was written at `done`. Returns whether a deadline
    /// was missed.
    pub(crate) fn advance(&mut self, began: u64, done: u64, policy: MissPolicy) -> bool {
        let next = self.index + 1;
        let missed = done >= self.at(next);
        self.deadlines.taken += 1;
        self.deadlines.missed += u64::from(missed);
        self.deadlines.late += u64::from(began >= self.at(next));
        self.index = next;
        if missed {
            let ahead = self.first_after(done);
            let resume = match policy {
                MissPolicy::Skip | MissPolicy::Stop => ahead,
                // The deadlines that are due are those below `ahead`.
                MissPolicy::CatchUp { at_most } => next.max(ahead.saturating_sub(u64::from(at_most))),
            };
            self.deadlines.skipped += resume - next;
            self.index = resume;
        }
        missed
    }

    /// The first deadline after `time`, which is not before the next one.
    #[expect(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "as for `at`"
    )]
    fn first_after(&self, time: u64) -> u64 {
        let guess = ((time - self.start) as f64 / self.dt) as u64;
        // The quotient may be off by a rounding to either side.
        let mut index = guess.saturating_sub(1).max(self.index);
        while self.at(index) <= time {
            index += 1;
        }
        index
    }
}

/// Deadlines and clocks are rounded to nanoseconds: so much less than an interval is one.
const ROUNDING: f64 = 2.0;

/// How much of the time that the slew gives the drive has used up. Times are in nanoseconds.
///
/// In any time T the drive moves by at most slew (T + dt). The dt is that of a sample right behind one that was late. A
/// sample that is late itself by dt or more has no such grace: there the drive moves by at most slew T.
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

    /// How far the drive may move in a sample that began `late`: infinitely far where only the slew of a sample bounds
    /// it.
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

    /// 100 us.
    const DT: f64 = 1e-4;

    #[test]
    fn deadlines_do_not_drift() {
        let schedule = Schedule::new(1.0 / 30_000.0, 7);
        assert_eq!(schedule.at(30_000 * 86_400), 7 + 86_400_000_000_000);
        assert_eq!([1, 2, 3].map(|k| schedule.at(k)), [33_340, 66_674, 100_007]);
    }

    #[test]
    fn a_sample_that_ends_in_time_is_no_miss() {
        let mut schedule = Schedule::new(DT, 0);
        assert!(!schedule.advance(5, 99_999, MissPolicy::Skip));
        assert_eq!((schedule.index(), schedule.deadline()), (1, 100_000));
        assert_eq!(schedule.deadlines(), Deadlines { taken: 1, ..Deadlines::default() });
    }

    #[test]
    fn one_that_ends_when_the_next_is_due_skips_it() {
        let mut schedule = Schedule::new(DT, 0);
        assert!(schedule.advance(5, 100_000, MissPolicy::Skip));
        assert_eq!(schedule.index(), 2);
        assert!(schedule.advance(200_000, 450_000, MissPolicy::Skip));
        assert_eq!(schedule.index(), 5);
        assert_eq!(schedule.deadlines(), Deadlines { taken: 2, missed: 2, late: 0, skipped: 3 });
    }

    #[test]
    fn what_was_missed_is_caught_up() {
        let mut schedule = Schedule::new(DT, 0);
        let policy = MissPolicy::CatchUp { at_most: 10 };
        assert!(schedule.advance(0, 350_000, policy));
        assert_eq!((schedule.index(), schedule.deadlines().skipped), (1, 0));
        assert!(schedule.advance(350_000, 350_010, policy));
        assert!(schedule.advance(350_010, 350_020, policy));
        assert!(!schedule.advance(350_020, 350_030, policy), "on time again: the next one is due at 400 us");
        assert_eq!(schedule.deadlines(), Deadlines { taken: 4, missed: 3, late: 2, skipped: 0 });
    }

    #[test]
    fn only_so_many_are_caught_up() {
        let mut schedule = Schedule::new(DT, 0);
        assert!(schedule.advance(0, 1_050_000, MissPolicy::CatchUp { at_most: 3 }));
        assert_eq!((schedule.index(), schedule.deadlines().skipped), (8, 7), "8, 9 and 10 are taken");
    }

    #[test]
    fn every_deadline_is_taken_or_skipped() {
        for policy in [MissPolicy::Skip, MissPolicy::Stop, MissPolicy::CatchUp { at_most: 2 }] {
            let mut schedule = Schedule::new(1.0 / 3e4, 12_345);
            let (mut random, mut now) = (fastrand::Rng::with_seed(1), 0);
            for _ in 0..10_000 {
                let began = schedule.deadline().max(now) + random.u64(..20_000);
                now = began + if random.u8(..10) == 0 { random.u64(..300_000) } else { random.u64(..10_000) };
                schedule.advance(began, now, policy);
                let Deadlines { taken, skipped, missed, late } = schedule.deadlines();
                assert_eq!(taken + skipped, schedule.index());
                assert!(missed <= taken && late <= missed);
                if !matches!(policy, MissPolicy::CatchUp { .. }) {
                    assert!(schedule.deadline() > now && schedule.deadline() <= now + 33_335);
                }
            }
        }
    }

    /// 100 us, 1 V/ms: 0.1 V per sample.
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
