//! What a loop did, in numbers that can be quoted.

use hysteresis_control::learning::{LearningPhase, RepetitiveControl};
use hysteresis_core::Counters;
use serde::{Deserialize, Serialize};

use crate::io::UdpCounts;
use crate::latency::Summary;
use crate::machine::Machine;
use crate::policy::Deadlines;
use crate::privileges::InForce;
use crate::settings::Settings;

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
    /// Rows that are not in the record: the recorder was too slow to take them or, as one of the warnings then says, could not write them.
    pub lost_rows: u64,
}

/// What became of learning in the loop.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Learning {
    /// Whether it learned at the end.
    pub phase: LearningPhase,
    /// How often it had diverged, and stopped, since it was made or reset. One of the warnings says so where it has not begun anew.
    pub divergence_count: u64,
}

impl Learning {
    pub(crate) fn of(repetitive: &RepetitiveControl) -> Self {
        Self { phase: repetitive.phase(), divergence_count: repetitive.divergence_count() }
    }

    /// What is to be said if learning has ended, and has not been told to begin anew. Before the run it had diverged `before` times.
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
    /// Whether the drive written last is the rest drive. False only if writing itself failed. Of datagrams nobody knows whether they
    /// arrive: see [`rest_refused`](Self::rest_refused).
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
    /// How often the other side said that nobody listens, since the last measurement came or since the rest drive was written first,
    /// whichever is longer ago. Above 0 the rest drive may have reached nobody, and one of the warnings says so. A computer that is off
    /// says nothing: 0 is no proof.
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
