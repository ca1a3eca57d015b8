//! How uncertain the output of a model is when its history is unknown.

use hysteresis_core::{self as core, CompiledModel};
use hysteresis_python_macros::methods;
use numpy::PyReadonlyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pythonize::pythonize;

use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, saved, shared};
use crate::stage::stage::Stage;

/// How uncertain the output is when its history is unknown: made by `model.bracket(limits)` or
/// `stage.bracket()`.
///
/// Two streams bracket the truth: one that came down from the upper limit, one that came up from the lower. The width
/// shrinks as the motion wipes history out; after a full stroke it is zero. All weights must be 0 or more. Maps of a
/// stage are part of it, its loop shift, creep and dynamics are not.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> bracket = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]).bracket(limits=(-10.0, 10.0))
/// >>> bracket.step(3.0), bracket.width
/// ((3.5, 5.5), 2.0)
/// >>> bracket.step(10.0), bracket.width  # a full stroke
/// ((14.0, 14.0), 0.0)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct Bracket {
    bracket: core::Bracket,
    /// The model or stage that made it.
    made_of: Py<PyAny>,
}

impl Bracket {
    /// The bracket of `model`, compiled beforehand.
    pub(crate) fn of(model: &Bound<'_, PyAny>, compiled: &CompiledModel, limits: (f64, f64)) -> PyResult<Self> {
        Ok(Self::made(model, core::Bracket::new(compiled, limits).map_err(raise)?))
    }

    /// A bracket that `made_of` has made.
    pub(crate) fn made(made_of: &Bound<'_, PyAny>, bracket: core::Bracket) -> Self {
        Self { bracket, made_of: made_of.clone().unbind() }
    }
}

#[methods]
impl Bracket {
    /// Takes a drive; the lowest and the highest output that there can be.
    fn step(slf: &Bound<'_, Self>, drive: f64) -> PyResult<(f64, f64)> {
        Ok(exclusive(slf)?.bracket.step(drive))
    }

    /// Takes over what was driven before, oldest drive first.
    fn follow(slf: &Bound<'_, Self>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.bracket.follow(drives.as_slice()?).map_err(raise)
    }

    /// The lowest and the highest output that there can be now.
    #[getter]
    fn outputs(&self) -> (f64, f64) {
        self.bracket.outputs()
    }

    /// The highest minus the lowest output.
    #[getter]
    fn width(&self) -> f64 {
        self.bracket.width()
    }

    /// The limits (low, high) between which the unknown history lies.
    #[getter]
    fn limits(&self) -> (f64, f64) {
        self.bracket.limits()
    }

    /// Nothing is known of the history.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.bracket.reset();
        Ok(())
    }

    /// Everything that is remembered, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.bracket.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = saved(state)?;
        exclusive(slf)?.bracket.set_state(&state).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let (py, this) = (slf.py(), shared(slf)?);
        let made_of = this.made_of.bind(py);
        let name = if made_of.is_instance_of::<Stage>() { intern!(py, "_bracket") } else { intern!(py, "bracket") };
        let make = made_of.getattr(name)?;
        reduce(make, (this.limits(),), keywords!(py), Some(Self::state(slf)?))
    }

    fn __repr__(&self) -> String {
        let (low, high) = self.bracket.outputs();
        format!("<Bracket: output from {low} to {high}>")
    }
}
