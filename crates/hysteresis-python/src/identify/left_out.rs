//! Loops that were left out of a fit.

use hysteresis_identify as identification;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::quality::Quality;

/// One loop of a record, predicted with weights that all loops asked for, and with those of all other loops.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=4, rate=100)
/// >>> y = mh.paper.table_1_recovered().forward().run(u)
/// >>> found = mh.identify(u, y, operators=6, weights="quadratic", input_offset=0.0, dead_time=0.0)
/// >>> loops = found.leave_one_loop_out(u, y)
/// >>> len(loops), loops[0].left_out.rmse >= loops[0].fitted.rmse
/// (3, True)
#[pyclass(module = "mpi_hyst.results", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct LeftOutLoop {
    /// The number of its record.
    record: usize,
    /// Its first sample in that record.
    start: usize,
    /// The sample after its last.
    stop: usize,
    /// Half the peak-to-peak of the input in it, in the unit of the input.
    amplitude: f64,
    /// The errors with the weights of all loops; range is that of the whole record.
    fitted: Quality,
    /// The errors with the weights of all other loops; range is that of the whole record.
    left_out: Quality,
}

impl From<&identification::LeftOutLoop> for LeftOutLoop {
    fn from(row: &identification::LeftOutLoop) -> Self {
        Self {
            record: row.record,
            start: row.samples.start,
            stop: row.samples.end,
            amplitude: row.amplitude,
            fitted: Quality::from(&row.fitted),
            left_out: Quality::from(&row.left_out),
        }
    }
}

#[methods]
impl LeftOutLoop {
    fn __repr__(&self) -> String {
        let (fitted, left_out) = (self.fitted.rmse, self.left_out.rmse);
        format!(
            "<LeftOutLoop: record {}, samples {} to {}, amplitude {:.4}: rms {fitted:.4e} fitted, {left_out:.4e} left out>",
            self.record, self.start, self.stop, self.amplitude
        )
    }
}
