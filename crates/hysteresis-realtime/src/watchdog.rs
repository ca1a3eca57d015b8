//! Whether there is still a measurement to work with.

use serde::{Deserialize, Serialize};

/// For how long measurements may be missing, in seconds.
///
/// A fresh measurement is one that the input says is new, and that the controller believes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct WatchdogTimes {
    /// For so long the last fresh measurement stands in for one that does not come. With 0 it never does. From then on the
    /// controller is told that there is none: it holds the drive, unless it is still coming back from the last loss.
    pub stale_after: f64,
    /// After so long without a fresh measurement the drive goes to rest, for good.
    pub rest_after: f64,
}

/// What the watchdog makes of a sample.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Judged {
    /// What the controller is given: NaN for nothing.
    pub(crate) measurement: f64,
    /// Whether the last fresh measurement is too old to stand in.
    pub(crate) stale: bool,
    /// Whether it is time to go to rest.
    pub(crate) rest: bool,
}

/// The age of the last fresh measurement, in nanoseconds.
#[derive(Clone, Debug)]
pub(crate) struct Watchdog {
    /// None for a loop that waits for ever: (stale after, rest after).
    times: Option<(u64, u64)>,
    last: f64,
    last_at: u64,
}

impl Watchdog {
    /// The time for the first measurement runs from `start`.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
    pub(crate) fn new(times: Option<WatchdogTimes>, start: u64) -> Self {
        let nanoseconds = |time: f64| (time * 1e9).round() as u64;
        let times = times.map(|times| (nanoseconds(times.stale_after), nanoseconds(times.rest_after)));
        Self { times, last: f64::NAN, last_at: start }
    }

    /// `came` is what the input gave, fresh if it is also to be believed.
    #[inline]
    pub(crate) fn judge(&mut self, now: u64, came: Option<f64>, believed: bool) -> Judged {
        if let (Some(measurement), true) = (came, believed) {
            (self.last, self.last_at) = (measurement, now);
            return Judged { measurement, stale: false, rest: false };
        }
        // What is not believed goes on to the controller, which counts it.
        let missing = came.unwrap_or(f64::NAN);
        let Some((stale_after, rest_after)) = self.times else {
            return Judged { measurement: missing, stale: true, rest: false };
        };
        let age = now.saturating_sub(self.last_at);
        let stale = age >= stale_after || self.last.is_nan();
        let measurement = if stale { missing } else { self.last };
        Judged { measurement, stale, rest: age >= rest_after }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn watchdog() -> Watchdog {
        Watchdog::new(Some(WatchdogTimes { stale_after: 2e-6, rest_after: 5e-6 }), 1000)
    }

    fn judge(watchdog: &mut Watchdog, now: u64, came: Option<f64>, believed: bool) -> (f64, bool, bool) {
        let Judged { measurement, stale, rest } = watchdog.judge(now, came, believed);
        (if measurement.is_nan() { -1.0 } else { measurement }, stale, rest)
    }

    #[test]
    fn the_last_one_stands_in_then_there_is_none_then_rest() {
        let mut watchdog = watchdog();
        assert_eq!(judge(&mut watchdog, 2000, Some(3.0), true), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 3999, None, false), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 4000, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 6999, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 7000, None, false), (-1.0, true, true));
    }

    #[test]
    fn a_fresh_one_starts_the_time_anew() {
        let mut watchdog = watchdog();
        judge(&mut watchdog, 5000, Some(3.0), true);
        assert_eq!(judge(&mut watchdog, 9999, Some(4.0), true), (4.0, false, false));
        assert_eq!(judge(&mut watchdog, 11_000, None, false), (4.0, false, false));
    }

    #[test]
    fn before_the_first_one_nothing_stands_in() {
        let mut watchdog = watchdog();
        assert_eq!(judge(&mut watchdog, 1001, None, false), (-1.0, true, false));
        assert_eq!(judge(&mut watchdog, 6000, None, false), (-1.0, true, true));
    }

    #[test]
    fn what_is_not_believed_is_not_fresh_and_is_passed_on_when_stale() {
        let mut watchdog = watchdog();
        judge(&mut watchdog, 2000, Some(3.0), true);
        assert_eq!(judge(&mut watchdog, 3000, Some(99.0), false), (3.0, false, false));
        assert_eq!(judge(&mut watchdog, 4000, Some(99.0), false), (99.0, true, false));
        assert_eq!(judge(&mut watchdog, 7000, Some(99.0), false), (99.0, true, true));
    }

    #[test]
    fn without_times_it_waits_for_ever() {
        let mut watchdog = Watchdog::new(None, 0);
        assert_eq!(judge(&mut watchdog, u64::MAX, None, false), (-1.0, true, false));
    }
}
