//! How late samples begin, how long they take, and how far apart they are.

use hdrhistogram::Histogram;
use serde::{Deserialize, Serialize};

/// Longer times are counted as a minute.
const LONGEST: u64 = 60_000_000_000;
/// Two values that the histogram tells apart differ by a thousandth.
const DIGITS: u8 = 3;

/// Times of a loop, in seconds.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// How many there were.
    pub count: u64,
    /// The mean.
    pub mean: f64,
    /// Half of them were at most so long.
    pub median: f64,
    /// 99 % of them were at most so long.
    pub p99: f64,
    /// 99.9 %.
    pub p999: f64,
    /// 99.99 %.
    pub p9999: f64,
    /// The longest.
    pub max: f64,
    /// The histogram: `(upper end, count)`, each class a quarter wider than the one before.
    pub histogram: Vec<(f64, u64)>,
}

/// A histogram that never allocates once it was made.
#[derive(Clone, Debug)]
pub(crate) struct Times(Histogram<u64>);

impl Times {
    pub(crate) fn new() -> Self {
        Self(Histogram::new_with_bounds(1, LONGEST, DIGITS).expect("the bounds are valid"))
    }

    /// In nanoseconds.
    #[inline]
    pub(crate) fn record(&mut self, time: u64) {
        self.0.saturating_record(time);
    }

    pub(crate) fn summary(&self) -> Summary {
        let at = |quantile| seconds(self.0.value_at_quantile(quantile));
        let classes = self.0.iter_log(100, 1.25).filter(|class| class.count_since_last_iteration() > 0);
        Summary {
            count: self.0.len(),
            mean: self.0.mean() * 1e-9,
            median: at(0.5),
            p99: at(0.99),
            p999: at(0.999),
            p9999: at(0.9999),
            max: seconds(self.0.max()),
            histogram: classes
                .map(|class| (seconds(class.value_iterated_to()), class.count_since_last_iteration()))
                .collect(),
        }
    }
}

#[expect(clippy::cast_precision_loss, reason = "at most a minute in nanoseconds")]
pub(crate) fn seconds(nanoseconds: u64) -> f64 {
    nanoseconds as f64 * 1e-9
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_has_the_quantiles() {
        let mut times = Times::new();
        (1..=10_000).for_each(|k| times.record(k * 1000));
        let found = times.summary();
        // The histogram tells values apart that differ by a thousandth.
        let near = |value: f64, expected: f64| (value / expected - 1.0).abs() <= 1e-3;
        assert_eq!(found.count, 10_000);
        assert!(near(found.median, 5e-3) && near(found.p99, 9.9e-3) && near(found.p999, 9.99e-3), "{found:?}");
        assert!(near(found.p9999, 9.999e-3) && near(found.max, 1e-2) && near(found.mean, 5.0005e-3), "{found:?}");
        assert_eq!(found.histogram.iter().map(|(_, count)| count).sum::<u64>(), 10_000);
        assert!(found.histogram.is_sorted_by(|a, b| a.0 < b.0));
    }

    #[test]
    fn nothing_is_lost_beyond_a_minute() {
        let mut times = Times::new();
        times.record(0);
        times.record(u64::MAX);
        assert_eq!(times.summary().count, 2);
        assert!((times.summary().max / 60.0 - 1.0).abs() <= 1e-3);
    }
}
