//! Streams of arrays: many streams side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::num::NonZeroUsize;

use hysteresis_core::{self as core, ActuatorError, Method, StreamArray};
use hysteresis_python_macros::methods;
use numpy::ndarray::{Array2, Dimension, Ix2};
use numpy::{
    IntoPyArray, PyArray1, PyArray2, PyReadonlyArray, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods,
};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList, PyTuple};
use pythonize::pythonize;

use super::blocks::{Peek, Rows, Step, apply};
use super::streams::{from_python, method_name};
use crate::convert::arrays::array;
use crate::convert::errors::{self, Place, raise};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::model::models::compiled_of;

/// The outputs of many models, sample by sample: made by `array.forward()`.
///
/// Bit for bit what M streams of the single models give. A sample that is not finite holds its own actuator only.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> soft, stiff = (mh.PrandtlIshlinskii([w, 0.5], [0.0, 2.0]) for w in (2.0, 1.0))
/// >>> forward = mh.ActuatorArray([soft, stiff]).forward()
/// >>> forward.step([4.0, 4.0])
/// array([9., 5.])
/// >>> forward.run([[3.0, 3.0], [-4.0, float("nan")]], threads=2)
/// array([[ 7.,  4.],
///        [-9.,  4.]])
/// >>> forward.rejected
/// array([0, 1], dtype=uint64)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct ForwardArray {
    pub(crate) stream: StreamArray<core::Forward>,
    pub(crate) made: MadeOf,
}

/// The exact inverses of many models, sample by sample: made by `array.inverse(limits)`.
///
/// Bit for bit what M streams of the single models give. A target out of reach puts the drive of its actuator at the
/// limit and sets its `saturated`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
/// >>> inverse = mirror.inverse(limits=[(-10.0, 10.0), (-10.0, 10.0), (0.0, 4.0)])
/// >>> inverse.step([5.0, -5.0, 99.0])
/// array([ 4., -4.,  4.])
/// >>> inverse.saturated
/// array([False, False,  True])
/// >>> saved = inverse.state
/// >>> inverse.step([3.0, -3.0, 3.0])
/// array([ 2., -2.,  2.])
/// >>> inverse.state = saved
/// >>> inverse.step([3.0, -3.0, 3.0])
/// array([ 2., -2.,  2.])
#[pyclass(module = "mpi_hyst")]
pub(crate) struct InverseArray {
    pub(crate) stream: StreamArray<core::Inverse>,
    pub(crate) made: MadeOf,
}

/// What a stream of an array was made of: enough to make another one.
pub(crate) struct MadeOf {
    array: Py<PyAny>,
    limits: Option<Py<PyAny>>,
    method: Option<Method>,
    /// The models that took over since.
    models: BTreeMap<usize, Py<PyAny>>,
}

impl MadeOf {
    pub(crate) fn new(array: &Bound<'_, PyAny>, limits: Option<&Bound<'_, PyAny>>) -> Self {
        let limits = limits.map(|limits| limits.clone().unbind());
        Self { array: array.clone().unbind(), limits, method: None, models: BTreeMap::new() }
    }

    /// The same, but for the method that was asked for.
    pub(crate) fn by(self, method: Option<Method>) -> Self {
        Self { method, ..self }
    }

    /// Another model took over.
    pub(crate) fn set_model(&mut self, actuator: usize, model: &Bound<'_, PyAny>) {
        self.models.insert(actuator, model.clone().unbind());
    }

    /// How the present array and then `state` make the stream; `maker` is a method of the array.
    pub(crate) fn reduce<'py>(&self, py: Python<'py>, maker: &str, state: Bound<'py, PyAny>) -> Reduced<'py> {
        self.reduce_with(py, maker, keywords!(py), state)
    }

    /// The same with keywords beside limits and method.
    pub(crate) fn reduce_with<'py>(
        &self,
        py: Python<'py>,
        maker: &str,
        keywords: Bound<'py, PyDict>,
        state: Bound<'py, PyAny>,
    ) -> Reduced<'py> {
        let mut array = self.array.bind(py).clone();
        if !self.models.is_empty() {
            let mut models: Vec<Py<PyAny>> = array.getattr(intern!(py, "models"))?.extract()?;
            for (actuator, model) in &self.models {
                models[*actuator] = model.clone_ref(py);
            }
            array = array.get_type().call1((models,))?;
        }
        if let Some(limits) = &self.limits {
            keywords.set_item("limits", limits)?;
        }
        if let Some(method) = self.method {
            keywords.set_item("method", method_name(method))?;
        }
        reduce(array.getattr(maker)?, PyTuple::empty(py), keywords, Some(state))
    }
}

/// One sample for each of M actuators.
fn one_each<'py>(input: &Bound<'py, PyAny>, actuators: usize) -> PyResult<PyReadonlyArray1<'py, f64>> {
    columns("input", input, actuators, format_args!("an array of shape ({actuators},)"))
}

/// Rows of one sample for each of M actuators.
fn rows<'py>(input: &Bound<'py, PyAny>, actuators: usize) -> PyResult<PyReadonlyArray2<'py, f64>> {
    columns("input", input, actuators, format_args!("an array of shape (samples, {actuators})"))
}

/// Samples of as many dimensions as D has, the last of which counts M actuators.
pub(crate) fn columns<'py, D: Dimension>(
    name: &str,
    input: &Bound<'py, PyAny>,
    actuators: usize,
    expected: fmt::Arguments<'_>,
) -> PyResult<PyReadonlyArray<'py, f64, D>> {
    let samples = array::<D>(name, input, expected)?;
    if samples.shape().last() == Some(&actuators) {
        Ok(samples)
    } else {
        let shape = samples.getattr(intern!(input.py(), "shape"))?;
        Err(errors::value(name, format_args!("expected {expected}, got shape {shape}")))
    }
}

/// The states of M actuators, each as its own stream would take it.
pub(crate) fn states<'py>(states: &Bound<'py, PyAny>, actuators: usize) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let wrong = |got: String| errors::value("state", format_args!("expected a list of {actuators} states, got {got}"));
    let Ok(states) = states.cast::<PyList>() else { return Err(wrong(states.get_type().name()?.to_string())) };
    if states.len() == actuators { Ok(states.iter().collect()) } else { Err(wrong(states.len().to_string())) }
}

/// An error about the state of one actuator, which is then named.
pub(crate) fn in_state(py: Python<'_>, actuator: usize, error: PyErr) -> PyErr {
    let message = error.value(py).to_string();
    errors::value(Place::part("state", &format!("actuator {actuator}")), message)
}

// What both streams of arrays offer.
#[methods(ForwardArray, InverseArray)]
#[allow(clippy::redundant_closure_for_method_calls, reason = "the streams of two classes")]
impl Each {
    /// Takes one sample for each actuator, an array of shape (M,), and gives the outputs in `out` or a new array.
    ///
    /// A C-contiguous float64 array is read in place; with `out` no array is allocated then.
    fn step<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] input: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let actuators = shared(slf)?.stream.len();
        let samples = one_each(input, actuators)?;
        apply(samples, out, |block| block.through(slf.py(), &mut Step(&mut exclusive(slf)?.stream)))
    }

    /// What `step` would give, without taking the samples.
    fn peek<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] input: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let actuators = shared(slf)?.stream.len();
        let samples = one_each(input, actuators)?;
        apply(samples, out, |block| block.through(slf.py(), &mut Peek(&shared(slf)?.stream)))
    }

    /// Takes rows of samples, an array of shape (samples, M), bit for bit like `step` in a loop, into `out` or a
    /// new array.
    ///
    /// With `threads` > 1 that many threads share out the actuators: the same bits, sooner, where many samples
    /// are known beforehand.
    fn run<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] input: &Bound<'py, PyAny>,
        #[py("Matrix | None" = None)] out: Option<&Bound<'py, PyAny>>,
        #[py(not_none = 1)] threads: NonZeroUsize,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let actuators = shared(slf)?.stream.len();
        let samples = rows(input, actuators)?;
        apply(samples, out, |block| block.through(slf.py(), &mut Rows::new(&mut exclusive(slf)?.stream, threads.get())))
    }

    /// Takes over rows of drives that were put out before, oldest row first.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut restored = shared(slf)?.stream.clone();
        let rows = columns::<Ix2>(
            "drives",
            drives,
            restored.len(),
            format_args!("an array of shape (samples, {})", restored.len()),
        )?;
        let rows = rows.as_array();
        for (actuator, stream) in restored.streams_mut().iter_mut().enumerate() {
            let drives = rows.column(actuator).to_vec();
            stream.follow(&drives).map_err(|error| raise(ActuatorError { actuator, error }))?;
        }
        exclusive(slf)?.stream = restored;
        Ok(())
    }

    /// Every actuator back to rest.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        exclusive(slf)?.stream.reset();
        Ok(())
    }

    /// Everything that the streams remember, as a list of M dictionaries to keep; set it to continue from there
    /// bit for bit. Each is the `state` of a single stream of its model, of either `method`.
    #[getter]
    #[py(-> "list[dict[str, Any]]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyList>> {
        let states: Vec<_> = shared(slf)?.stream.streams().iter().map(|stream| stream.state()).collect();
        let states = states.iter().map(|state| Ok(pythonize(slf.py(), state)?));
        PyList::new(slf.py(), states.collect::<PyResult<Vec<_>>>()?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("list[dict[str, Any]]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let (py, actuators) = (slf.py(), shared(slf)?.stream.len());
        let states = states(state, actuators)?.into_iter().enumerate();
        let states = states.map(|(m, state)| from_python(&state).map_err(|error| in_state(py, m, error)));
        let states = states.collect::<PyResult<Vec<_>>>()?;
        let mut restored = shared(slf)?.stream.clone();
        for (m, (stream, state)) in restored.streams_mut().iter_mut().zip(states).enumerate() {
            stream.set_state(&state).map_err(|error| in_state(py, m, raise(error)))?;
        }
        exclusive(slf)?.stream = restored;
        Ok(())
    }

    /// How each actuator is evaluated, "turning_points" or "bank": a list of M words.
    #[getter]
    #[py(-> "list[Literal['turning_points', 'bank']]")]
    fn method(&self) -> Vec<&'static str> {
        self.stream.streams().iter().map(|stream| method_name(stream.method())).collect()
    }

    /// How many samples of each actuator were not finite, or beyond 1e100.
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        PyArray1::from_iter(py, self.stream.streams().iter().map(|stream| stream.rejected()))
    }

    /// One actuator goes on with the weights and the output offset of another model of the same thresholds and
    /// input offset, as a stream of it would.
    ///
    /// Raises ValueError that names what differs; the stream is as before then.
    fn set_model(slf: &Bound<'_, Self>, actuator: usize, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let compiled = compiled_of("model", model)?;
        let mut this = exclusive(slf)?;
        let actuators = this.stream.len();
        let Some(stream) = this.stream.streams_mut().get_mut(actuator) else {
            let expected = format!("a number below {actuators}");
            return Err(errors::value("actuator", format_args!("expected {expected}, got {actuator}")));
        };
        stream.set_model(&compiled).map_err(raise)?;
        this.made.set_model(actuator, model);
        Ok(())
    }

    fn __len__(&self) -> usize {
        self.stream.len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let methods = BTreeSet::from_iter(self.method()).into_iter().collect::<Vec<_>>().join(" and ");
        Ok(format!("<{} of {} actuators by {methods}>", py.get_type::<Self>().name()?, self.stream.len()))
    }
}

#[methods]
impl ForwardArray {
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce(slf.py(), "forward", Self::state(slf)?.into_any())
    }
}

#[methods]
impl InverseArray {
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce(slf.py(), "inverse", Self::state(slf)?.into_any())
    }

    /// Whether the last target of each actuator was out of reach and its drive is at a limit.
    #[getter]
    fn saturated<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        PyArray1::from_iter(py, self.stream.streams().iter().map(core::Inverse::saturated))
    }

    /// The limits of the drives as an array of shape (M, 2), or None.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let limits: Option<Vec<(f64, f64)>> = self.stream.streams().iter().map(core::Inverse::limits).collect();
        let rows: Vec<[f64; 2]> = limits?.into_iter().map(<[f64; 2]>::from).collect();
        Some(Array2::from(rows).into_pyarray(py))
    }
}
