//! How a running loop is asked to end, what it shows of itself meanwhile, and what it did, in numbers that can be
//! quoted.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::available_parallelism;

use hdrhistogram::Histogram;
use hysteresis_control::learning::{LearningPhase, RepetitiveControl};
use hysteresis_core::Counters;
use serde::{Deserialize, Serialize};

use crate::io::UdpCounts;
use crate::privileges::InForce;
use crate::schedule::Deadlines;
use crate::settings::Settings;

/// Asks a loop to go to rest and end. Clones are the same flag.
///
/// ```
/// use hysteresis_realtime::StopFlag;
/// let flag = StopFlag::default();
/// let same = flag.clone();
/// same.request();
/// assert!(flag.is_requested());
/// ```
#[derive(Clone, Debug, Default)]
pub struct StopFlag(Arc<AtomicBool>);

impl StopFlag {
    /// Asks the loop to go to rest. It cannot be taken back.
    pub fn request(&self) {
        self.0.store(true, Ordering::Release);
    }

    /// Whether the loop was asked.
    #[must_use]
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Acquire)
    }

    /// The flag itself, for a handler of signals.
    #[must_use]
    pub fn shared(&self) -> Arc<AtomicBool> {
        Arc::clone(&self.0)
    }
}

/// What a loop shows while it runs. Each number is that of some recent sample; they need not belong to the same one.
#[derive(Debug, Default)]
pub struct Live {
    taken: AtomicU64,
    missed: AtomicU64,
    skipped: AtomicU64,
    stale: AtomicU64,
    measurement: AtomicU64,
    drive: AtomicU64,
}

impl Live {
    /// Samples taken.
    #[must_use]
    pub fn taken(&self) -> u64 {
        self.taken.load(Ordering::Relaxed)
    }

    /// Deadlines missed.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed.load(Ordering::Relaxed)
    }

    /// Deadlines at which no sample was taken.
    #[must_use]
    pub fn skipped(&self) -> u64 {
        self.skipped.load(Ordering::Relaxed)
    }

    /// Samples without a measurement.
    #[must_use]
    pub fn stale(&self) -> u64 {
        self.stale.load(Ordering::Relaxed)
    }

    /// The last measurement.
    #[must_use]
    pub fn measurement(&self) -> f64 {
        f64::from_bits(self.measurement.load(Ordering::Relaxed))
    }

    /// The present drive.
    #[must_use]
    pub fn drive(&self) -> f64 {
        f64::from_bits(self.drive.load(Ordering::Relaxed))
    }

    #[inline]
    pub(crate) fn show_sample(&self, measurement: f64, drive: f64, stale: u64) {
        self.measurement.store(measurement.to_bits(), Ordering::Relaxed);
        self.drive.store(drive.to_bits(), Ordering::Relaxed);
        self.stale.store(stale, Ordering::Relaxed);
    }

    #[inline]
    pub(crate) fn show_deadlines(&self, deadlines: &crate::schedule::Deadlines) {
        self.taken.store(deadlines.taken, Ordering::Relaxed);
        self.missed.store(deadlines.missed, Ordering::Relaxed);
        self.skipped.store(deadlines.skipped, Ordering::Relaxed);
    }
}

/// Why a loop went to rest, or ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum EndReason {
    /// The time that was asked for is over.
    TimeOver,
    /// The reference is over.
    ReferenceOver,
    /// It was asked to: Ctrl-C, or [`StopFlag`](crate::StopFlag).
    Requested,
    /// No fresh measurement came for too long.
    Watchdog,
    /// A deadline was missed, under [`MissPolicy::Stop`](crate::MissPolicy::Stop).
    DeadlineMissed,
    /// Input or output panicked, or raised an exception.
    Panicked,
    /// Too many writes in a row failed: the loop ended where it was.
    WriteFailed,
}

/// What was counted, besides the deadlines.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Counts {
    /// Samples with a fresh measurement.
    pub fresh: u64,
    /// Samples in which the last fresh measurement stood in.
    pub stood_in: u64,
    /// Samples in which no measurement was fresh enough.
    pub stale: u64,
    /// Of those, samples in which the loop held the drive, as the controller would have gone on without feedback.
    pub held: u64,
    /// Reads that failed.
    pub read_faults: u64,
    /// Writes that failed.
    pub write_faults: u64,
    /// Samples of the ramp to rest.
    pub rest_samples: u64,
    /// Rows that are not in the record: the recorder was too slow to take them or, as one of the warnings then says,
    /// could not write them.
    pub lost_rows: u64,
}

/// What became of learning in the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Learning {
    /// Whether it learned at the end.
    pub phase: LearningPhase,
    /// How often it had diverged, and stopped, since it was made or reset. One of the warnings says so where it has not
    /// begun anew.
    pub divergence_count: u64,
}

impl Learning {
    pub(crate) fn of(repetitive: &RepetitiveControl) -> Self {
        Self { phase: repetitive.phase(), divergence_count: repetitive.divergence_count() }
    }

    /// What is to be said if learning has ended, and has not been told to begin anew. Before the run it had diverged
    /// `before` times.
    pub(crate) fn warning(repetitive: &RepetitiveControl, before: u64) -> Option<String> {
        let what = if repetitive.divergence_count() > before {
            "it diverged and was stopped: the error grew from period to period, the stage is too far from its model"
        } else {
            "it had diverged before this run, and stays stopped until it is told to begin anew"
        };
        repetitive.has_ended().then(|| format!("learning: {what}"))
    }
}

/// What a loop did.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// Why it went to rest, or ended.
    pub end: EndReason,
    /// Whether the drive written last is the rest drive. False only if writing itself failed. Of datagrams nobody knows
    /// whether they arrive: see [`rest_refused`](Self::rest_refused).
    pub at_rest: bool,
    /// The drive written last.
    pub last_drive: f64,
    /// The last fault of input or output, in words.
    pub last_fault: Option<String>,
    /// From the first deadline to the end, in seconds.
    pub seconds: f64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// What became of the deadlines.
    pub deadlines: Deadlines,
    /// What was counted besides.
    pub counts: Counts,
    /// What became of the datagrams; None if the loop does not run over UDP.
    pub datagrams: Option<UdpCounts>,
    /// How often the other side said that nobody listens, since the last measurement came or since the rest drive was
    /// written first, whichever is longer ago. Above 0 the rest drive may have reached nobody, and one of the warnings
    /// says so. A computer that is off says nothing: 0 is no proof.
    pub rest_refused: u64,
    /// What the controller counted.
    pub controller: Counters,
    /// What became of learning in the loop; None without it.
    #[serde(default)]
    pub learning: Option<Learning>,
    /// How late samples began.
    pub latency: Summary,
    /// How long samples took: reading, computing and writing.
    pub compute: Summary,
    /// How far apart samples began.
    pub period: Summary,
    /// Rows in the record, as many as the file has; None without a record, and if the recorder panicked.
    pub recorded_rows: Option<u64>,
    /// What was asked for.
    pub settings: Settings,
    /// What of that is in force.
    pub in_force: InForce,
    /// What was refused, or failed without ending the loop.
    pub warnings: Vec<String>,
    /// Where it ran.
    pub machine: Machine,
}

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

/// What a latency depends on.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Machine {
    /// The processor by its name, or its architecture.
    pub cpu: String,
    /// How many processors there are for this process.
    pub processors: usize,
    /// The operating system, with the release of its kernel as far as known.
    pub system: String,
}

impl Machine {
    /// This one.
    ///
    /// ```
    /// assert!(hysteresis_realtime::Machine::here().processors >= 1);
    /// ```
    #[must_use]
    pub fn here() -> Self {
        Self {
            cpu: cpu().unwrap_or_else(|| std::env::consts::ARCH.into()),
            processors: available_parallelism().map_or(1, Into::into),
            system: system(),
        }
    }
}

#[cfg(target_os = "linux")]
fn cpu() -> Option<String> {
    let facts = std::fs::read_to_string("/proc/cpuinfo").ok()?;
    let line = facts.lines().find(|line| line.starts_with("model name"))?;
    Some(line.split_once(':')?.1.trim().to_owned())
}

#[cfg(target_os = "linux")]
fn system() -> String {
    let name = rustix::system::uname();
    [name.sysname(), name.release(), name.version()].map(|part| part.to_string_lossy()).join(" ")
}

#[cfg(not(target_os = "linux"))]
fn cpu() -> Option<String> {
    None
}

#[cfg(not(target_os = "linux"))]
fn system() -> String {
    std::env::consts::OS.into()
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
