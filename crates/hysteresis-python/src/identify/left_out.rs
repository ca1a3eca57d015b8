//! Loops that were left out of a fit.

use hysteresis_identify as identification;
use pyo3::prelude::*;

use super::quality::Quality;

/// One loop of a record, predicted with weights that all loops asked for, and with those of all other loops.
#[pyclass(module = "mpi_hyst.results", frozen, get_all)]
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
    fitted: Py<Quality>,
    /// The errors with the weights of all other loops; range is that of the whole record.
    left_out: Py<Quality>,
}

impl LeftOutLoop {
    pub(crate) fn new(py: Python<'_>, row: &identification::LeftOutLoop) -> PyResult<Self> {
        Ok(Self {
            record: row.record,
            start: row.samples.start,
            stop: row.samples.end,
            amplitude: row.amplitude,
            fitted: Py::new(py, Quality::from(&row.fitted))?,
            left_out: Py::new(py, Quality::from(&row.left_out))?,
        })
    }
}

#[pymethods]
impl LeftOutLoop {
    fn __repr__(&self) -> String {
        let (fitted, left_out) = (self.fitted.get().rmse, self.left_out.get().rmse);
        format!(
            "<LeftOutLoop: record {}, samples {} to {}, amplitude {:.4}: rms {fitted:.4e} fitted, {left_out:.4e} left out>",
            self.record, self.start, self.stop, self.amplitude
        )
    }
}
