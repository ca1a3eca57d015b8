//! Streams of arrays: many streams side by side.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::num::NonZeroUsize;

use hysteresis_control::binary::Sampled;
use hysteresis_control::stage;
use hysteresis_core::{self as core, ActuatorError, CompiledModel, Method, Process, QuasiStaticInverse, StreamArray};
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
use super::of_kind::{OfKind, map_kind, of_kind};
use super::streams::{from_python, method_name};
use crate::convert::arrays::array;
use crate::convert::errors::{self, Place, raise};
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::model::models::compiled_of;
use crate::stage::stage::Stage;
use crate::stage::streams::{state_at, with_hysteresis};

/// The outputs of many models, sample by sample: made by `array.forward()`.
///
/// Bit for bit what M streams of the single models, or stages, give. A sample that is not finite holds its own actuator
/// only.
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
    pub(crate) stream: OfKind<StreamArray<core::Forward>, StreamArray<stage::StageForward>>,
    pub(crate) made: MadeOf,
}

/// The exact inverses of many models, sample by sample: made by `array.inverse(limits)`.
///
/// Bit for bit what M streams of the single models, or stages, give. A target out of reach puts the drive of its
/// actuator at the limit and sets its `saturated`.
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
    pub(crate) stream: Inverses,
    pub(crate) made: MadeOf,
}

/// The inverses of an array.
pub(crate) type Inverses = OfKind<StreamArray<core::Inverse>, StreamArray<QuasiStaticInverse>>;

/// What a stream of an array was made of: enough to make another one.
pub(crate) struct MadeOf {
    array: Py<PyAny>,
    limits: Option<Py<PyAny>>,
    method: Option<Method>,
    /// The sampling interval of stages.
    dt: Option<f64>,
    /// The models, or stages with these, that took over since.
    models: BTreeMap<usize, Py<PyAny>>,
}

impl MadeOf {
    pub(crate) fn new(array: &Bound<'_, PyAny>, limits: Option<&Bound<'_, PyAny>>) -> Self {
        let limits = limits.map(|limits| limits.clone().unbind());
        Self { array: array.clone().unbind(), limits, method: None, dt: None, models: BTreeMap::new() }
    }

    /// The same, but for the method that was asked for and the sampling interval that was given.
    pub(crate) fn by(self, method: Option<Method>, dt: Option<f64>) -> Self {
        Self { method, dt, ..self }
    }

    /// The sampling interval of stages; models have none.
    fn interval(&self) -> f64 {
        self.dt.unwrap_or(f64::NAN)
    }

    /// Another model takes over if `take` does not fail: in place of the one that is there, or in its stage.
    pub(crate) fn set_model(
        &mut self,
        actuator: usize,
        model: &Bound<'_, PyAny>,
        take: impl FnOnce(&CompiledModel) -> Result<(), core::Error>,
    ) -> PyResult<()> {
        let (py, compiled, actuators) = (model.py(), compiled_of("model", model)?, self.array.bind(model.py()).len()?);
        if actuator >= actuators {
            let expected = format!("a number below {actuators}");
            return Err(errors::value("actuator", format_args!("expected {expected}, got {actuator}")));
        }
        let before = match self.models.get(&actuator) {
            Some(other) => other.bind(py).clone(),
            None => self.array.bind(py).get_item(actuator)?,
        };
        let after = match before.cast::<Stage>() {
            Ok(stage) => Py::new(py, Stage(with_hysteresis(&stage.get().0, model)?))?.into_any(),
            Err(_) => model.clone().unbind(),
        };
        take(&compiled).map_err(raise)?;
        self.models.insert(actuator, after);
        Ok(())
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
        let array = self.array.bind(py);
        let mut models: Vec<Py<PyAny>> = array.getattr(intern!(py, "models"))?.extract()?;
        for (actuator, model) in &self.models {
            models[*actuator] = model.clone_ref(py);
        }
        let array = array.get_type().call_method1(intern!(py, "_of_copies"), (models,))?;
        if let Some(limits) = &self.limits {
            keywords.set_item("limits", limits)?;
        }
        if let Some(method) = self.method {
            keywords.set_item("method", method_name(method))?;
        }
        if let Some(dt) = self.dt {
            keywords.set_item("dt", dt)?;
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

/// What reads the states of actuators one by one; an error names the first that cannot be one.
fn each_read<T>(states: &[Bound<'_, PyAny>], read: impl Fn(&Bound<'_, PyAny>) -> PyResult<T>) -> PyResult<Vec<T>> {
    let one = |(m, state): (usize, &Bound<'_, PyAny>)| read(state).map_err(|error| in_state(state.py(), m, error));
    states.iter().enumerate().map(one).collect()
}

/// An array with a change of every stream.
fn changed<P: Process>(
    mut array: StreamArray<P>,
    mut change: impl FnMut(usize, &mut P) -> PyResult<()>,
) -> PyResult<StreamArray<P>> {
    for (actuator, stream) in array.streams_mut().iter_mut().enumerate() {
        change(actuator, stream)?;
    }
    Ok(array)
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
        let actuators = of_kind!(&shared(slf)?.stream, stream => stream.len());
        let samples = one_each(input, actuators)?;
        apply(
            samples,
            out,
            |block| of_kind!(&mut exclusive(slf)?.stream, stream => block.through(slf.py(), &mut Step(stream))),
        )
    }

    /// What `step` would give, without taking the samples.
    fn peek<'py>(
        slf: &Bound<'py, Self>,
        #[py("ArrayLike")] input: &Bound<'py, PyAny>,
        #[py("Vector | None" = None)] out: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let actuators = of_kind!(&shared(slf)?.stream, stream => stream.len());
        let samples = one_each(input, actuators)?;
        apply(
            samples,
            out,
            |block| of_kind!(&shared(slf)?.stream, stream => block.through(slf.py(), &mut Peek(stream))),
        )
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
        let actuators = of_kind!(&shared(slf)?.stream, stream => stream.len());
        let samples = rows(input, actuators)?;
        apply(samples, out, |block| {
            let threads = threads.get();
            of_kind!(&mut exclusive(slf)?.stream, stream => block.through(slf.py(), &mut Rows::new(stream, threads)))
        })
    }

    /// Takes over rows of drives that were put out before, oldest row first.
    fn follow(slf: &Bound<'_, Self>, #[py("ArrayLike")] drives: &Bound<'_, PyAny>) -> PyResult<()> {
        let actuators = of_kind!(&shared(slf)?.stream, stream => stream.len());
        let expected = format!("an array of shape (samples, {actuators})");
        let rows = columns::<Ix2>("drives", drives, actuators, format_args!("{expected}"))?;
        let rows = rows.as_array();
        let restored = map_kind!(&shared(slf)?.stream, stream => changed(stream.clone(), |actuator, stream| {
            let drives = rows.column(actuator).to_vec();
            stream.follow(&drives).map_err(|error| raise(ActuatorError { actuator, error }))
        })?);
        exclusive(slf)?.stream = restored;
        Ok(())
    }

    /// Every actuator back to rest.
    fn reset(slf: &Bound<'_, Self>) -> PyResult<()> {
        of_kind!(&mut exclusive(slf)?.stream, stream => stream.reset());
        Ok(())
    }

    /// Everything that the streams remember, as a list of M dictionaries to keep; set it to continue from there
    /// bit for bit. Each is the `state` of a single stream of its model, of either `method`, or of its stage.
    #[getter]
    #[py(-> "list[dict[str, Any]]")]
    fn state<'py>(slf: &Bound<'py, Self>) -> PyResult<Bound<'py, PyList>> {
        let (py, dt) = (slf.py(), shared(slf)?.made.interval());
        // What Python makes of them may let other threads in.
        let states = map_kind!(
            &shared(slf)?.stream,
            array => array.streams().iter().map(|stream| stream.state()).collect::<Vec<_>>()
        );
        let states: Result<Vec<_>, _> = match states {
            OfKind::Models(states) => states.iter().map(|state| pythonize(py, state)).collect(),
            OfKind::Stages(states) => states.into_iter().map(|stream| pythonize(py, &Sampled { dt, stream })).collect(),
        };
        PyList::new(py, states?)
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, #[py("list[dict[str, Any]]")] state: &Bound<'_, PyAny>) -> PyResult<()> {
        let (py, actuators) = (slf.py(), of_kind!(&shared(slf)?.stream, stream => stream.len()));
        let states = states(state, actuators)?;
        let (dt, before) = (shared(slf)?.made.interval(), map_kind!(&shared(slf)?.stream, array => array.clone()));
        let restored = match before {
            OfKind::Models(array) => {
                let states = each_read(&states, from_python)?;
                OfKind::Models(changed(array, |m, stream| {
                    stream.set_state(&states[m]).map_err(|error| in_state(py, m, raise(error)))
                })?)
            }
            OfKind::Stages(array) => {
                let states = each_read(&states, |state| state_at(state, dt))?;
                OfKind::Stages(changed(array, |m, stream| {
                    stream.set_state(&states[m]).map_err(|error| in_state(py, m, raise(error)))
                })?)
            }
        };
        exclusive(slf)?.stream = restored;
        Ok(())
    }

    /// How each actuator is evaluated, "turning_points" or "bank": a list of M words.
    #[getter]
    #[py(-> "list[Literal['turning_points', 'bank']]")]
    fn method(&self) -> Vec<&'static str> {
        match &self.stream {
            OfKind::Models(array) => array.streams().iter().map(|stream| method_name(stream.method())).collect(),
            OfKind::Stages(array) => {
                array.streams().iter().map(|stream| method_name(stream.hysteresis().method())).collect()
            }
        }
    }

    /// How many samples of each actuator were not finite, or beyond 1e100.
    #[getter]
    fn rejected<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u64>> {
        of_kind!(&self.stream, array => PyArray1::from_iter(py, array.streams().iter().map(|each| each.rejected())))
    }

    /// One actuator goes on with the weights and the output offset of another model of the same thresholds and
    /// input offset, as a stream of it would. In an array of stages the model is the hysteresis of the stage.
    ///
    /// Raises ValueError that names what differs; the stream is as before then.
    fn set_model(slf: &Bound<'_, Self>, actuator: usize, #[py("Model")] model: &Bound<'_, PyAny>) -> PyResult<()> {
        let mut this = exclusive(slf)?;
        let Self { stream, made } = &mut *this;
        made.set_model(
            actuator,
            model,
            |compiled| of_kind!(stream, stream => stream.streams_mut()[actuator].set_model(compiled)),
        )
    }

    fn __len__(&self) -> usize {
        of_kind!(&self.stream, stream => stream.len())
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let methods = BTreeSet::from_iter(self.method()).into_iter().collect::<Vec<_>>().join(" and ");
        Ok(format!("<{} of {} actuators by {methods}>", py.get_type::<Self>().name()?, self.__len__()))
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
#[allow(clippy::redundant_closure_for_method_calls, reason = "the path of a method would name one of two kinds")]
impl InverseArray {
    fn __reduce__<'py>(slf: &Bound<'py, Self>) -> Reduced<'py> {
        let this = shared(slf)?;
        this.made.reduce(slf.py(), "inverse", Self::state(slf)?.into_any())
    }

    /// Whether the last target of each actuator was out of reach and its drive is at a limit.
    #[getter]
    fn saturated<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<bool>> {
        of_kind!(&self.stream, array => PyArray1::from_iter(py, array.streams().iter().map(|each| each.saturated())))
    }

    /// The limits of the drives as an array of shape (M, 2), or None.
    #[getter]
    fn limits<'py>(&self, py: Python<'py>) -> Option<Bound<'py, PyArray2<f64>>> {
        let limits: Option<Vec<(f64, f64)>> =
            of_kind!(&self.stream, array => array.streams().iter().map(|each| each.limits()).collect());
        let rows: Vec<[f64; 2]> = limits?.into_iter().map(<[f64; 2]>::from).collect();
        Some(Array2::from(rows).into_pyarray(py))
    }
}
