//! What a loop did.

use hysteresis_python_macros::methods;
use hysteresis_realtime::{self as realtime, EndReason};
use pyo3::prelude::*;
use pythonize::pythonize;
use serde::{Deserialize, Serialize};

/// Times of a loop in seconds: how late samples began, how long they took, or how far apart they began.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.paper.plant("A1").stage
/// >>> plant = mh.plant.Plant(stage, dt=1e-3)
/// >>> report = mh.realtime.run(stage, plant, [0.0, 0.5], rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.05)
/// >>> report.latency.count > 0, report.latency.median <= report.latency.max  # s
/// (True, True)
#[pyclass(module = "mpi_hyst.realtime", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct LoopTimes(realtime::Summary);

#[methods]
impl LoopTimes {
    /// How many there were.
    #[getter]
    fn count(&self) -> u64 {
        self.0.count
    }

    /// Half of them were at most so long.
    #[getter]
    fn median(&self) -> f64 {
        self.0.median
    }

    /// 99 % of them were at most so long.
    #[getter]
    fn p99(&self) -> f64 {
        self.0.p99
    }

    /// 99.9 % of them were at most so long.
    #[getter]
    fn p999(&self) -> f64 {
        self.0.p999
    }

    /// 99.99 % of them were at most so long.
    #[getter]
    fn p9999(&self) -> f64 {
        self.0.p9999
    }

    /// The longest.
    #[getter]
    fn max(&self) -> f64 {
        self.0.max
    }

    /// Pairs (upper end, count) of classes, each a quarter wider than the one before.
    #[getter]
    fn histogram(&self) -> Vec<(f64, u64)> {
        self.0.histogram.clone()
    }

    fn __repr__(&self) -> String {
        let realtime::Summary { count, median, p99, p999, p9999, max, .. } = self.0;
        let [median, p99, p999, p9999, max] = [median, p99, p999, p9999, max].map(|time| 1e6 * time);
        format!(
            "<LoopTimes: {count}, median {median:.2} us, p99 {p99:.2}, p99.9 {p999:.2}, p99.99 {p9999:.2}, max {max:.2}>"
        )
    }
}

/// What a loop did, made by `run`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.paper.plant("A1").stage
/// >>> plant = mh.plant.Plant(stage, dt=1e-3)
/// >>> report = mh.realtime.run(stage, plant, [0.0, 0.5], rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.05)
/// >>> report.end, report.at_rest
/// ('time_over', True)
#[pyclass(module = "mpi_hyst.realtime", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct LoopReport(pub(super) realtime::Report);

#[methods]
impl LoopReport {
    /// Why it went to rest: "time_over", "reference_over", "requested", "watchdog", "deadline_missed", "panicked"; or
    /// why it ended where it was: "write_failed".
    #[getter]
    #[py(-> "Literal['time_over', 'reference_over', 'requested', 'watchdog', 'deadline_missed', 'panicked', 'write_failed']")]
    fn end(&self) -> &'static str {
        match self.0.end {
            EndReason::TimeOver => "time_over",
            EndReason::ReferenceOver => "reference_over",
            EndReason::Requested => "requested",
            EndReason::Watchdog => "watchdog",
            EndReason::DeadlineMissed => "deadline_missed",
            EndReason::Panicked => "panicked",
            EndReason::WriteFailed => "write_failed",
        }
    }

    /// Whether the drive written last is the rest drive: False only if writing itself failed. Over UDP nobody confirms
    /// that it arrived: see `rest_refused`.
    #[getter]
    fn at_rest(&self) -> bool {
        self.0.at_rest
    }

    /// How often the other side of UDP said that nobody listens, since the last measurement came or since the rest
    /// drive was written first, whichever is longer ago. Above 0 the rest drive may have reached nobody, and one of the
    /// `warnings` says so. A computer that is off says nothing: 0 is no proof.
    #[getter]
    fn rest_refused(&self) -> u64 {
        self.0.rest_refused
    }

    /// The drive written last, V.
    #[getter]
    fn last_drive(&self) -> f64 {
        self.0.last_drive
    }

    /// The last fault of input or output in words, or None.
    #[getter]
    fn last_fault(&self) -> Option<&str> {
        self.0.last_fault.as_deref()
    }

    /// From the first deadline to the end.
    #[getter]
    fn seconds(&self) -> f64 {
        self.0.seconds
    }

    /// Samples that were taken. With `skipped` they are all deadlines there were.
    #[getter]
    fn taken(&self) -> u64 {
        self.0.deadlines.taken
    }

    /// Of those, samples whose drive was written when the next one was due, or later: the missed deadlines.
    #[getter]
    fn missed(&self) -> u64 {
        self.0.deadlines.missed
    }

    /// Of those that were taken, samples that began only when the next one was due, or later: after a late wake-up, or
    /// to catch up.
    #[getter]
    fn late(&self) -> u64 {
        self.0.deadlines.late
    }

    /// Deadlines at which no sample was taken.
    #[getter]
    fn skipped(&self) -> u64 {
        self.0.deadlines.skipped
    }

    /// Samples without a fresh enough measurement.
    #[getter]
    fn stale(&self) -> u64 {
        self.0.counts.stale
    }

    /// How late samples began.
    #[getter]
    fn latency(&self) -> LoopTimes {
        LoopTimes(self.0.latency.clone())
    }

    /// How long samples took: reading, computing and writing.
    #[getter]
    fn compute(&self) -> LoopTimes {
        LoopTimes(self.0.compute.clone())
    }

    /// How far apart samples began.
    #[getter]
    fn period(&self) -> LoopTimes {
        LoopTimes(self.0.period.clone())
    }

    /// Whether learning in the loop went on: "learning", "fading" or "stopped"; None without learning.
    #[getter]
    #[py(-> "LearningPhase | None")]
    fn learning_phase(&self) -> Option<&'static str> {
        self.0.learning.map(|learning| learning.phase.name())
    }

    /// How often learning had diverged, and stopped, at the end. One of the `warnings` says so where it has not begun
    /// anew.
    #[getter]
    fn divergence_count(&self) -> u64 {
        self.0.learning.map_or(0, |learning| learning.divergence_count)
    }

    /// What was refused, or failed without ending the loop.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.0.warnings.clone()
    }

    /// Everything, also all counts, what was asked for, what of it was in force, and the machine, as plain values.
    /// "datagrams" has, over UDP, how many were received, lost, late, malformed and refused, else None.
    #[py(-> "dict[str, Any]")]
    fn to_dict<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(pythonize(py, self)?)
    }

    fn __repr__(&self) -> String {
        let realtime::Deadlines { taken, missed, skipped, .. } = self.0.deadlines;
        format!("<LoopReport: {}, {taken} samples, {missed} missed, {skipped} skipped>", self.end())
    }
}
