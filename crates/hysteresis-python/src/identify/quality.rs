//! The errors of a fit, and those of loops that were left out of it.

use hysteresis_identify as identification;
use hysteresis_python_macros::{copies, methods};
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

/// The errors of a fit, each with its unit or base.
///
/// `max_error` and `rmse` are in the unit of the output, `mse` in its square. Percentages are of `range`, the
/// peak-to-peak of the measured output over the fitted samples, or where they say so of `amplitude`, half of it.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=200)
/// >>> y = mh.paper.table_1_recovered().forward().run(u)
/// >>> quality = mh.identify(u, y, operators=12, input_offset=0.0, dead_time=0.0).fit
/// >>> bool(abs(quality.rmse_percent - 100.0 * quality.rmse / quality.range) < 1e-12)
/// True
#[copies(identification::Quality)]
#[pyclass(module = "mpi_hyst.results", frozen, get_all, skip_from_py_object)]
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct Quality {
    /// Largest absolute error, in the unit of the output.
    max_error: f64,
    /// Root mean square error, in the unit of the output.
    pub(crate) rmse: f64,
    /// Mean square error, in the unit of the output squared.
    mse: f64,
    /// Peak-to-peak of the measured output over the fitted samples: the base of the percentages.
    range: f64,
    /// Half of range.
    amplitude: f64,
    /// Largest absolute error in % of range.
    max_error_percent: f64,
    /// Root mean square error in % of range.
    rmse_percent: f64,
    /// Largest absolute error in % of amplitude.
    max_error_percent_of_amplitude: f64,
    /// Root mean square error in % of amplitude.
    rmse_percent_of_amplitude: f64,
    /// Normalised root mean square error (NRMSE), rmse / range: sqrt(mean(e**2)) / (max(y) - min(y)).
    ///
    /// Some tools divide by the standard deviation of y instead; this does not.
    nrmse: f64,
    /// Width of the measured loops, by `loop_width`, in the unit of the output; None without full strokes.
    loop_width: Option<f64>,
    /// How much wider the modelled loops are; of several records, for the one where it is most.
    loop_width_error: Option<f64>,
    /// How many samples were fitted.
    samples: usize,
}

#[methods]
impl Quality {
    pub(crate) fn __repr__(&self) -> String {
        format!(
            "<Quality: max {:.4e} ({:.3} %), rms {:.4e} ({:.3} %) of range {:.4e}, {} samples>",
            self.max_error, self.max_error_percent, self.rmse, self.rmse_percent, self.range, self.samples
        )
    }
}

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
            fitted: row.fitted.into(),
            left_out: row.left_out.into(),
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
