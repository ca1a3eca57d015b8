//! The preview of a controller.

use hysteresis_core::{self as core};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arguments::whole;
use crate::arrays::{read_only, vector};
use crate::errors;

/// Makes the target of a `HybridController` of references known beforehand, by a fixed window.
///
/// target(k) = sum_j c_j r(k + ahead - j), j = 0 the newest. References then enter `step` `ahead` samples early; the
/// feedback uses r(k), from the same window, which at the start is full of the first reference.
///
/// Parameters
/// ----------
/// coefficients : array of shape (taps,)
///     c_j, that of the newest reference first.
/// ahead : int
///     How many samples the references are early: less than there are taps.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> half_a_sample = mh.Preview([0.5, 0.5], 1)
/// >>> controller = mh.HybridController(None, kp=5.0, ki=0.6, limits=(-500, 500), preview=half_a_sample)
/// >>> for reference in (1.0, 2.0, 3.0):
/// ...     drive = controller.step(reference, 0.0)
/// >>> controller.terms.reference, controller.terms.target
/// (2.0, 2.5)
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct Preview(pub(crate) core::Preview);

#[pymethods]
impl Preview {
    #[new]
    fn new(coefficients: &Bound<'_, PyAny>, ahead: &Bound<'_, PyAny>) -> PyResult<Self> {
        let coefficients = vector("coefficients", coefficients)?;
        core::Preview::new(coefficients.as_slice()?, whole("ahead", ahead)?).map(Self).map_err(errors::core)
    }

    /// The coefficients c_j, read-only.
    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.coefficients().iter().copied())
    }

    /// How many samples the references are early.
    #[getter]
    fn ahead(&self) -> usize {
        self.0.ahead()
    }

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyArray1<f64>>, usize)> {
        Ok((self.coefficients(py)?, self.ahead()))
    }

    fn __repr__(&self) -> String {
        format!("<Preview of {} taps, ahead {}>", self.0.coefficients().len(), self.0.ahead())
    }
}
