//! Streams of models: forward and exact inverse.

use hysteresis_core::{self as core, Method, Process, StreamState};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyBool;
use pythonize::{depythonize, pythonize};

use crate::{arrays, errors};

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
pub(crate) struct Forward(pub(crate) core::Forward);

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
pub(crate) struct Inverse(pub(crate) core::Inverse);

fn method_name(method: Method) -> &'static str {
    match method {
        Method::TurningPoints => "turning_points",
        Method::Bank => "bank",
    }
}

fn to_python<'py>(py: Python<'py>, state: &StreamState) -> PyResult<Bound<'py, PyAny>> {
    Ok(pythonize(py, state)?)
}

fn from_python(state: &Bound<'_, PyAny>) -> PyResult<StreamState> {
    let wrong = |what: &str| PyValueError::new_err(format!("state: expected what .state returned; {what}"));
    let plain = depythonize(state).map_err(|error| wrong(&error.to_string()))?;
    // The conversion takes anything for a truth value.
    if !state.get_item("saturated")?.is_instance_of::<PyBool>() {
        return Err(wrong("saturated is neither True nor False"));
    }
    Ok(plain)
}

#[pymethods]
impl Forward {
    /// Takes one sample: the displacement at this input. An input that is not finite leaves everything as it is.
    #[pyo3(signature = (input, /))]
    fn step(&mut self, input: f64) -> f64 {
        self.0.step(input)
    }

    /// What `step` would return, without taking the sample.
    #[pyo3(signature = (input, /))]
    fn peek(&self, input: f64) -> f64 {
        self.0.peek(input)
    }

    /// Takes an array of samples, bit for bit like `step` in a loop, into `out` or a new array.
    #[pyo3(signature = (input, out=None))]
    fn run<'py>(
        &mut self,
        input: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        arrays::run(&mut self.0, input, out)
    }

    /// Back to the start: at rest, or at the initial outputs that were given.
    fn reset(&mut self) {
        self.0.reset();
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.state())
    }

    #[setter]
    fn set_state(&mut self, state: &Bound<'_, PyAny>) -> PyResult<()> {
        self.0.set_state(&from_python(state)?).map_err(errors::core)
    }

    /// The reversals of the input that still determine the output, oldest first; empty for a bank.
    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.turning_points())
    }

    /// "turning_points" (nested thresholds, from rest) or "bank" (anything else).
    #[getter]
    fn method(&self) -> &'static str {
        method_name(self.0.method())
    }

    /// How many inputs were not finite.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.rejected()
    }

    fn __repr__(&self) -> String {
        format!("<Forward by {}>", self.method())
    }
}

#[pymethods]
impl Inverse {
    /// Takes one target: the drive that brings the model there, or the limit that comes closest.
    #[pyo3(signature = (target, /))]
    fn step(&mut self, target: f64) -> f64 {
        self.0.step(target)
    }

    /// What `step` would return, without taking the target.
    #[pyo3(signature = (target, /))]
    fn peek(&self, target: f64) -> f64 {
        self.0.peek(target)
    }

    /// Takes an array of targets, bit for bit like `step` in a loop, into `out` or a new array.
    #[pyo3(signature = (input, out=None))]
    fn run<'py>(
        &mut self,
        input: &Bound<'py, PyAny>,
        out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        arrays::run(&mut self.0, input, out)
    }

    /// Back to the start: at rest, or at the initial outputs that were given.
    fn reset(&mut self) {
        self.0.reset();
    }

    /// Everything that the stream remembers, as a dictionary to keep; set it to continue from there bit for bit.
    #[getter]
    fn state<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        to_python(py, &self.0.state())
    }

    #[setter]
    fn set_state(&mut self, state: &Bound<'_, PyAny>) -> PyResult<()> {
        self.0.set_state(&from_python(state)?).map_err(errors::core)
    }

    /// The reversals of the drive that still determine the output, oldest first; empty for a bank.
    #[getter]
    fn memory<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_vec(py, self.0.turning_points())
    }

    /// Whether the last target was out of reach and the drive is at a limit.
    #[getter]
    fn saturated(&self) -> bool {
        self.0.saturated()
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.0.limits()
    }

    /// "turning_points" (nested thresholds, from rest) or "bank" (anything else).
    #[getter]
    fn method(&self) -> &'static str {
        method_name(self.0.method())
    }

    /// How many targets were not finite.
    #[getter]
    fn rejected(&self) -> u64 {
        self.0.rejected()
    }

    fn __repr__(&self) -> String {
        match self.limits() {
            Some((low, high)) => format!("<Inverse by {}, limits ({low}, {high})>", self.method()),
            None => format!("<Inverse by {}>", self.method()),
        }
    }
}
