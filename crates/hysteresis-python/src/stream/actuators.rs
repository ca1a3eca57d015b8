//! Arrays of actuators: the models, each compiled once for all its streams.

use std::path::PathBuf;

use hysteresis_core::{self as core, ActuatorError, CompiledModel, Error, StreamArray};
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::IxDyn;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

use super::array_file;
use super::stream_arrays::{ForwardArray, InverseArray, MadeOf};
use crate::convert::arrays::array;
use crate::convert::errors::{self, Place, raise, wrong_type};
use crate::convert::files::{read, write_file};
use crate::convert::pickling::{Reduced, keywords, reduce};
use crate::model::object::{compiled_if_model, model_of, object};

/// Many actuators side by side, as in a deformable mirror: actuator m has the model models[m] and its own memory.
///
/// Equal models are kept once, so `[model] * 4096` costs little more than one.
///
/// Parameters
/// ----------
/// models : sequence of M models
///     PrandtlIshlinskii or ModifiedPrandtlIshlinskii, mixed as you like.
///
/// Raises
/// ------
/// ValueError, TypeError
///     Without a model, or that name the one that is none.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> mirror = mh.ActuatorArray([mh.paper.table_1_recovered()] * 4096)
/// >>> mirror
/// <ActuatorArray of 4096 actuators, 1 model>
/// >>> inverse, plant = mirror.inverse(limits=(-500.0, 500.0)), mirror.forward()
/// >>> target = np.linspace(-3.0, 3.0, len(mirror))  # um
/// >>> drive = np.empty(len(mirror))  # V
/// >>> _ = inverse.step(target, out=drive)  # writes into drive, allocates nothing
/// >>> bool(abs(plant.step(drive) - target).max() < 1e-13)
/// True
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct ActuatorArray {
    models: Py<PyTuple>,
    compiled: Box<[CompiledModel]>,
    distinct: usize,
}

/// The limits of the drives: none, the same for all, or each its own.
enum Limits {
    Shared(Option<(f64, f64)>),
    Individual(Vec<(f64, f64)>),
}

impl Limits {
    fn from_python(limits: Option<&Bound<'_, PyAny>>, actuators: usize) -> PyResult<Self> {
        let Some(limits) = limits else { return Ok(Self::Shared(None)) };
        let expected = format!("two numbers (low, high) or an array of shape ({actuators}, 2)");
        let limits = array::<IxDyn>("limits", limits, format_args!("{expected}"))?;
        let pairs: Vec<_> = limits.as_slice()?.chunks_exact(2).map(|pair| (pair[0], pair[1])).collect();
        match limits.shape() {
            [2] => Ok(Self::Shared(Some(pairs[0]))),
            [rows, 2] if *rows == actuators => Ok(Self::Individual(pairs)),
            _ => {
                let shape = limits.getattr(intern!(limits.py(), "shape"))?;
                Err(errors::value("limits", format_args!("expected {expected}, got shape {shape}")))
            }
        }
    }

    fn of(&self, actuator: usize) -> Option<(f64, f64)> {
        match self {
            Self::Shared(limits) => *limits,
            Self::Individual(limits) => Some(limits[actuator]),
        }
    }

    /// Limits that all actuators share are wrong for no one in particular.
    fn error(&self, actuator: usize, error: Error) -> PyErr {
        match (self, error) {
            (Self::Shared(_), Error::Domain { .. }) => raise(error),
            _ => raise(ActuatorError { actuator, error }),
        }
    }
}

#[pymethods]
impl ActuatorArray {
    #[new]
    pub(crate) fn new(models: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = models.py();
        let Ok(items) = models.try_iter() else {
            let got = models.get_type().name()?;
            let expected = "a sequence of models ([model] * M for M actuators of one model)";
            return Err(wrong_type("models", format_args!("expected {expected}, got {got}")));
        };
        let (known, mut kept, mut compiled) = (PyDict::new(py), Vec::new(), Vec::new());
        for (m, item) in items.enumerate() {
            let item = item?;
            if compiled_if_model(&item).is_none() {
                let got = item.get_type().name()?;
                let expected = "a PrandtlIshlinskii or ModifiedPrandtlIshlinskii";
                let place = format!("models[{m}]");
                return Err(wrong_type(Place::part("models", &place), format_args!("expected {expected}, got {got}")));
            }
            let first = known.call_method1("setdefault", (&item, &item))?;
            compiled.extend(compiled_if_model(&first));
            kept.push(first);
        }
        if kept.is_empty() {
            return Err(errors::value("models", "expected at least one model, got none"));
        }
        Ok(Self { models: PyTuple::new(py, kept)?.unbind(), compiled: compiled.into(), distinct: known.len() })
    }

    /// The model of every actuator.
    #[getter]
    fn models(&self, py: Python<'_>) -> Py<PyTuple> {
        self.models.clone_ref(py)
    }

    /// The forward models as one stream of arrays, at rest.
    fn forward(slf: &Bound<'_, Self>) -> ForwardArray {
        ForwardArray { stream: StreamArray::forward(&slf.get().compiled), made: MadeOf::new(slf.as_any(), None) }
    }

    /// The exact inverses as one stream of arrays, at rest.
    ///
    /// `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator.
    ///
    /// Raises NotInvertibleError that names the first actuator whose model may not be invertible.
    #[pyo3(signature = (limits=None))]
    fn inverse(slf: &Bound<'_, Self>, limits: Option<&Bound<'_, PyAny>>) -> PyResult<InverseArray> {
        let compiled = &slf.get().compiled;
        let given = Limits::from_python(limits, compiled.len())?;
        let stream = |(m, compiled)| core::Inverse::new(compiled, given.of(m)).map_err(|error| given.error(m, error));
        let stream = compiled.iter().enumerate().map(stream).collect::<PyResult<_>>()?;
        Ok(InverseArray { stream, made: MadeOf::new(slf.as_any(), limits) })
    }

    /// Writes the models to a JSON file, each model once; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let models =
            self.models.bind(py).iter().map(|model| model_of("models", &model)).collect::<PyResult<Vec<_>>>()?;
        write_file(path, &array_file::text(&models))
    }

    /// Reads what `save` wrote.
    ///
    /// Raises OSError if the file cannot be read, ValueError if it is no such file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let models = array_file::models(&read(&path)?).map_err(|message| errors::file(&path, &message))?;
        let models = models.into_iter().map(|model| object(py, model)).collect::<PyResult<Vec<_>>>()?;
        Self::new(PyTuple::new(py, models)?.as_any())
    }

    /// The model of one actuator.
    fn __getitem__<'py>(&self, py: Python<'py>, actuator: isize) -> PyResult<Bound<'py, PyAny>> {
        self.models.bind(py).as_any().get_item(actuator)
    }

    fn __len__(&self) -> usize {
        self.compiled.len()
    }

    fn __eq__(&self, py: Python<'_>, other: &Self) -> PyResult<bool> {
        self.models.bind(py).eq(&other.models)
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.models.bind(py).hash()
    }

    fn __repr__(&self) -> String {
        let models = if self.distinct == 1 { "model" } else { "models" };
        format!("<ActuatorArray of {} actuators, {} {models}>", self.compiled.len(), self.distinct)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.models.bind(py).clone(),), keywords!(py), None)
    }
}
