//! What may be said of the errors of a drive before it is put out.

use hysteresis_control::stage;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convert::arrays::read_only;

/// By how much a reference will be missed, said before anything is driven: of
/// `Stage.precompensate(..., return_error=True)`.
///
/// The errors are position minus reference, without the noise of a sensor and without the offset that every record has
/// of its own. What they rest on is in the explanation of uncertainty.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=12, rate=200)
/// >>> y = mh.paper.table_1_recovered().forward().run(u)
/// >>> stage = mh.identify(u, y, dt=5e-3, operators=8, dead_time=0.0).stage
/// >>> reference = mh.signals.sine(0.2, 1.0, seconds=2.0, rate=200)  # um
/// >>> drive, error = stage.precompensate(reference, 5e-3, lead_in=1.0, return_error=True)
/// >>> error.low.shape == drive.shape, bool((error.low < error.high).all()), error.within > 0.0
/// (True, True, True)
#[pyclass(module = "mpi_hyst.results", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct ErrorBounds {
    low: Vec<f64>,
    high: Vec<f64>,
    within: f64,
    interval: f64,
}

impl ErrorBounds {
    pub(crate) fn new(bounds: stage::ErrorBounds, interval: f64) -> Self {
        let stage::ErrorBounds { low, high, within } = bounds;
        Self { low, high, within, interval }
    }
}

#[methods]
impl ErrorBounds {
    /// The lower bound of the error for every drive, the lead-in included: it holds for each by itself with this
    /// probability.
    #[getter]
    fn low<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.low.iter().copied())
    }

    /// The upper bound of the error for every drive.
    #[getter]
    fn high<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.high.iter().copied())
    }

    /// With this probability the whole reference is missed by no more: one number, in the unit of the position.
    #[getter]
    fn within(&self) -> f64 {
        self.within
    }

    /// The probability that was asked for.
    #[getter]
    fn interval(&self) -> f64 {
        self.interval
    }

    fn __repr__(&self) -> String {
        format!("<ErrorBounds: within {:.4e} with {:.4} %>", self.within, 100.0 * self.interval)
    }
}
