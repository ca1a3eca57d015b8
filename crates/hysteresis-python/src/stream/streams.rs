//! Streams of a model: forward and inverse, sample by sample.

use hysteresis_core::{self as core, Method, Process, StreamState};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyTuple};
use pythonize::{depythonize, pythonize};

use super::single_argument::Stepper;
use crate::convert::errors::{self, raise};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::model::models::compiled_of;

/// The output of a model, sample by sample: made by `model.forward()`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> forward = mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]).forward()
/// >>> forward.step(4.0), forward.step(3.0)
/// (5.0, 4.0)
/// >>> forward.memory  # the reversal at 4 still matters
/// array([4.])
/// >>> saved = forward.state
/// >>> forward.step(-9.0)
/// -12.5
/// >>> forward.state = saved
/// >>> forward.step(-9.0)
/// -12.5
#[pyclass(module = "mpi_hyst")]
pub(crate) struct Forward {
    pub(crate) stream: core::Forward,
    pub(crate) made: Made,
}

/// The exact inverse of a model, sample by sample: made by `model.inverse(limits)`.
///
/// A target out of reach puts the drive at the limit and sets `saturated`; the drive leaves the limit without a jump
/// when the target comes back.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> inverse = actuator.inverse(limits=(-500.0, 500.0))
/// >>> drive = inverse.run([0.0, 1.0, 2.0, 1.5])
/// >>> bool(abs(actuator.forward().run(drive) - [0.0, 1.0, 2.0, 1.5]).max() < 1e-14)
/// True
/// >>> inverse.step(99.0), inverse.saturated
/// (500.0, True)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct Inverse {
    pub(crate) stream: core::Inverse,
    pub(crate) made: Made,
}

pub(crate) fn method_name(method: Method) -> &'static str {
    match method {
        Method::TurningPoints => "turning_points",
        Method::Bank => "bank",
    }
}

pub(crate) fn from_python(state: &Bound<'_, PyAny>) -> PyResult<StreamState> {
    let wrong = |what: &str| errors::value("state", format_args!("expected what .state returned; {what}"));
    let plain = depythonize(state).map_err(|error| wrong(&error.to_string()))?;
    // The conversion takes anything for a truth value.
    if !state.get_item("saturated")?.is_instance_of::<PyBool>() {
        return Err(wrong("saturated is neither True nor False"));
    }
    Ok(plain)
}

// What both streams of a model offer.
#[methods(Forward, Inverse)]
impl Each {
    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for
    /// bit.
    ///
    /// A stream of the other `method` takes it too, and goes on with the same outputs to 1e-12 of the range. Turning
    /// points cannot tell operator outputs that no drive leads to, as `initial` may be: then ValueError is raised, and
    /// the stream is as before.
    #[getter]
    #[py(-> "dict[str, Any]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyAny>> {
        let state = shared(slf)?.stream.state();
        Ok(pythonize(slf.py(), &state)?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("dict[str, Any]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let state = from_python(state)?;
        exclusive(slf)?.stream.set_state(&state).map_err(raise)
    }

    /// The reversals of the model's input that still determine its output, oldest first; empty for a bank.
    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.stream.turning_points())
    }

    /// "turning_points" (nested thresholds, from rest) or "bank" (anything else, or if asked for).
    #[getter]
    #[py(-> "Literal['turning_points', 'bank']")]
    fn method(&self) -> &'static str {
        method_name(self.stream.method())
    }
}

impl Stepper for Forward {
    fn process(&self) -> &impl Process {
        &self.stream
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.stream
    }

    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }
}

#[methods]
impl Forward {
    /// Goes on with the weights and the output offset of another model of the same thresholds and input offset: input
    /// and memory stay, the output is that of the new model.
    ///
    /// Raises ValueError that names what differs; the stream is as before then.
    fn set_model(
        slf: &Bound<'_, Self>,
        #[py("PrandtlIshlinskii | ModifiedPrandtlIshlinskii")] model: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        this.stream.set_model(&compiled).map_err(raise)?;
        this.made.model = model.clone().unbind();
        Ok(())
    }

    /// Takes over what was put in before, oldest input first.
    fn follow(slf: &Bound<'_, Self>, inputs: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.stream.follow(inputs.as_slice()?).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce_forward(Self::state(slf)?)
    }

    fn __repr__(&self) -> String {
        format!("<Forward by {}>", self.method())
    }
}

impl Stepper for Inverse {
    fn process(&self) -> &impl Process {
        &self.stream
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.stream
    }

    fn rejected(&self) -> u64 {
        self.stream.rejected()
    }
}

#[methods]
impl Inverse {
    /// Goes on with the weights and the output offset of another model of the same thresholds and input offset, without
    /// a jump of the drive: the drive and the memory stay, the next target is met by the new model.
    ///
    /// The output of the new model at the present drive, as a target, gives the present drive.
    ///
    /// Raises ValueError that names what differs, NotInvertibleError if the new model may not be invertible; the stream
    /// is as before then.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> inverse = mh.PrandtlIshlinskii([1.0, 1.0], [0.0, 2.0]).inverse()
    /// >>> inverse.step(6.0)
    /// 4.0
    /// >>> inverse.set_model(mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0]))
    /// >>> inverse.step(5.0), inverse.step(4.0)  # 5.0 is the new output at the drive 4.0
    /// (4.0, 3.0)
    fn set_model(
        slf: &Bound<'_, Self>,
        #[py("PrandtlIshlinskii | ModifiedPrandtlIshlinskii")] model: &Bound<'_, PyAny>,
    ) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        this.stream.set_model(&compiled).map_err(raise)?;
        this.made.model = model.clone().unbind();
        Ok(())
    }

    /// Takes over what was driven before, oldest drive first.
    fn follow(slf: &Bound<'_, Self>, drives: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.stream.follow(drives.as_slice()?).map_err(raise)
    }

    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce_inverse(Self::state(slf)?)
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[getter]
    fn saturated(&self) -> bool {
        self.stream.saturated()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.stream.limits()
    }

    fn __repr__(&self) -> String {
        match self.limits() {
            Some((low, high)) => format!("<Inverse by {}, limits ({low}, {high})>", self.method()),
            None => format!("<Inverse by {}>", self.method()),
        }
    }
}

/// The model, and the arguments of its `forward` or `inverse`.
pub(crate) struct Made {
    pub(crate) model: Py<PyAny>,
    pub(crate) limits: Option<(f64, f64)>,
    pub(crate) initial: Option<Vec<f64>>,
    pub(crate) method: Option<Method>,
}

impl Made {
    /// How `model.forward(initial, method=method)` and then `state` make the stream.
    pub(crate) fn reduce_forward<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "forward"))?;
        reduce(make, PyTuple::empty(py), keywords!(py, initial = &self.initial, method = self.method()), Some(state))
    }

    /// How `model.inverse(limits, initial, method=method)` and then `state` make the stream.
    pub(crate) fn reduce_inverse<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "inverse"))?;
        let keywords = keywords!(py, limits = self.limits, initial = &self.initial, method = self.method());
        reduce(make, PyTuple::empty(py), keywords, Some(state))
    }

    fn method(&self) -> Option<&'static str> {
        self.method.map(method_name)
    }
}
