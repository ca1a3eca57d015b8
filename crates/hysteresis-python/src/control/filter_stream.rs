//! A filter of the feedback that runs by itself.

use hysteresis_core::{self as core, Process};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use pythonize::pythonize;

use super::filters::{as_tuple, sections};
use crate::convert::errors::raise;
use crate::convert::objects::{exclusive, shared};
use crate::convert::pickling::{Reduced, keywords, reduce, saved};
use crate::stream::single_argument::Stepper;

/// Filters that run, sample by sample, from rest at zero: of a measurement, say, before anything else sees it.
///
/// Parameters
/// ----------
/// filters : Notch, LowPass, Lead, Biquad, or a list of them
///     At most 6.
/// dt : float
///     Sampling interval in seconds.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> slow = mh.control.Filter(mh.control.LowPass(500.0), dt=1e-4)
/// >>> slow.run([1.0, 1.0, 1.0]).round(4)
/// array([0.1367, 0.3728, 0.5443])
/// >>> slow.settle(1.0)
/// >>> round(slow.step(1.0), 12)
/// 1.0
#[pyclass(module = "mpi_hyst.control")]
pub(crate) struct Filter {
    filter: core::Filter,
    dt: f64,
}

impl Stepper for Filter {
    fn process(&self) -> &impl Process {
        &self.filter
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.filter
    }

    fn rejected(&self) -> u64 {
        self.filter.rejected()
    }
}

#[methods]
impl Filter {
    #[new]
    fn new(#[py("AnyFilter | Sequence[AnyFilter]")] filters: &Bound<'_, PyAny>, dt: f64) -> PyResult<Self> {
        let filter = core::Filter::new(sections(filters, dt)?.as_slice()).map_err(raise)?;
        Ok(Self { filter, dt })
    }

    /// The filters, as sections.
    #[getter]
    #[py(-> "tuple[Biquad, ...]")]
    fn filters<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        as_tuple(py, self.filter.sections())
    }

    /// Changes the filters without a jump: with the same input the output stays as it was, and goes on from there.
    fn set_filters(
        slf: &Bound<'_, Self>,
        #[py("AnyFilter | Sequence[AnyFilter]")] filters: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let sections = sections(filters, this.dt)?;
        this.filter.set_sections(sections.as_slice()).map_err(raise)
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.dt
    }

    /// Comes to rest at an input, as if it had always been the same.
    fn settle(slf: &Bound<'_, Self>, input: f64) -> PyResult<()> {
        exclusive(slf)?.filter.settle(input).map_err(raise)
    }

    /// Everything that the filters remember, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.filter.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.filter.set_state(&state).map_err(raise)
    }

    fn __setstate__(slf: &Bound<'_, Self>, state: &Bound<'_, PyAny>) -> PyResult<()> {
        Self::set_state(slf, state)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let made = (as_tuple(py, this.filter.sections())?, this.dt);
        reduce(py.get_type::<Self>().into_any(), made, keywords!(py), Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        format!("<Filter: {} sections, dt {:?} s>", self.filter.sections().as_slice().len(), self.dt)
    }
}
