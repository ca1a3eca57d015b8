//! An array of actuators, and its file.

use std::path::PathBuf;

use hysteresis_core::{self as core, ActuatorError, CompiledModel, Error, Method, Model, StreamArray};
use hysteresis_python_macros::methods;
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::IxDyn;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice, PyTuple};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::stream_arrays::{ForwardArray, InverseArray, MadeOf};
use crate::convert::arrays::array;
use crate::convert::errors::{self, Place, raise, wrong_type};
use crate::convert::files::{read, write_file};
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::model::methods::{forward_at_rest, inverse_at_rest, method_asked_for};
use crate::model::models::{compiled_if_model, compiled_of, model_of, object};

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
pub(crate) enum Limits {
    Shared(Option<(f64, f64)>),
    Individual(Vec<(f64, f64)>),
}

impl Limits {
    pub(crate) fn from_python(limits: Option<&Bound<'_, PyAny>>, actuators: usize) -> PyResult<Self> {
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

    pub(crate) fn of(&self, actuator: usize) -> Option<(f64, f64)> {
        match self {
            Self::Shared(limits) => *limits,
            Self::Individual(limits) => Some(limits[actuator]),
        }
    }

    /// Limits that all actuators share are wrong for no one in particular.
    pub(crate) fn error(&self, actuator: usize, error: Error) -> PyErr {
        match (self, error.parameter()) {
            (Self::Shared(_), Some("limits")) => raise(error),
            _ => raise(ActuatorError { actuator, error }),
        }
    }
}

impl ActuatorArray {
    /// The compiled models.
    pub(crate) fn compiled(&self) -> &[CompiledModel] {
        &self.compiled
    }

    /// The exact inverses at rest, within `limits`, by `method` if one is asked for.
    pub(crate) fn inverses(&self, limits: &Limits, method: Option<Method>) -> PyResult<StreamArray<core::Inverse>> {
        let stream =
            |(m, compiled)| inverse_at_rest(compiled, limits.of(m), method).map_err(|error| limits.error(m, error));
        self.compiled.iter().enumerate().map(stream).collect()
    }
}

#[methods]
impl ActuatorArray {
    #[new]
    pub(crate) fn new(#[py("Iterable[Model]")] models: &Bound<'_, PyAny>) -> PyResult<Self> {
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
    #[py(-> "tuple[Model, ...]")]
    fn models(&self, py: Python<'_>) -> Py<PyTuple> {
        self.models.clone_ref(py)
    }

    /// The forward models as one stream of arrays, at rest.
    ///
    /// `method` for all actuators, as for a single model: "bank" where every command jumps by about a tenth of the range or more
    /// and operators are few. None chooses for each one.
    ///
    /// Raises ValueError that names the first actuator whose thresholds are not nested if "turning_points" is asked for.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> mirror = mh.ActuatorArray([mh.PrandtlIshlinskii([1.0, 0.5], [0.0, 2.0])] * 3)
    /// >>> forward = mirror.forward(method="bank")
    /// >>> forward.step([4.0, -4.0, 1.0])
    /// array([ 5., -5.,  1.])
    /// >>> forward.method
    /// ['bank', 'bank', 'bank']
    fn forward(
        slf: &Bound<'_, Self>,
        #[py(*, "Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ForwardArray> {
        let method = method_asked_for(method, false)?;
        let stream = |(actuator, compiled)| {
            forward_at_rest(compiled, method).map_err(|error| raise(ActuatorError { actuator, error }))
        };
        let stream = slf.get().compiled.iter().enumerate().map(stream).collect::<PyResult<_>>()?;
        Ok(ForwardArray { stream, made: MadeOf::new(slf.as_any(), None).by(method) })
    }

    /// The exact inverses as one stream of arrays, at rest.
    ///
    /// `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator.
    ///
    /// `method` as in `forward`. Inverses gain by "bank" only where thousands of actuators, each with a model of its own, jump over
    /// the whole range.
    ///
    /// Raises NotInvertibleError that names the first actuator whose model may not be invertible.
    fn inverse(
        slf: &Bound<'_, Self>,
        #[py("ArrayLike | None" = None)] limits: Option<&Bound<'_, PyAny>>,
        #[py(*, "Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<InverseArray> {
        let given = Limits::from_python(limits, slf.get().compiled.len())?;
        let method = method_asked_for(method, false)?;
        let stream = slf.get().inverses(&given, method)?;
        Ok(InverseArray { stream, made: MadeOf::new(slf.as_any(), limits).by(method) })
    }

    /// An array like this one, with another model for one actuator. The array itself never changes.
    ///
    /// `actuator` counts from the end if it is negative.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> soft, stiff = (mh.PrandtlIshlinskii([w, 0.5], [0.0, 2.0]) for w in (2.0, 1.0))
    /// >>> mirror = mh.ActuatorArray([soft] * 3)
    /// >>> repaired = mirror.set_model(-1, stiff)
    /// >>> repaired.models == (soft, soft, stiff), mirror.models == (soft,) * 3
    /// (True, True)
    fn set_model(
        &self,
        py: Python<'_>,
        #[py("int")] actuator: &Bound<'_, PyAny>,
        #[py("Model")] model: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (count, place) = (self.compiled.len().cast_signed(), actuator.extract::<isize>());
        let Some(place) = place.ok().filter(|place| (-count..count).contains(place)) else {
            let expected = format!("a whole number from {} to {}", -count, count - 1);
            return Err(errors::value("actuator", format_args!("expected {expected}, got {}", actuator.repr()?)));
        };
        compiled_of("model", model)?;
        let models = self.models.bind(py).to_list();
        models.as_any().set_item(place, model)?;
        Self::new(models.as_any())
    }

    /// Writes the models to a JSON file, each model once; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let models =
            self.models.bind(py).iter().map(|model| model_of("models", &model)).collect::<PyResult<Vec<_>>>()?;
        write_file(py, path, &file_text(&models))
    }

    /// Reads what `save` wrote.
    ///
    /// Raises OSError if the file cannot be read, ValueError if it is no such file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let models = models_of(&read(&path)?).map_err(|message| errors::file(&path, &message))?;
        let models = models.into_iter().map(|model| object(py, model)).collect::<PyResult<Vec<_>>>()?;
        Self::new(PyTuple::new(py, models)?.as_any())
    }

    /// The model of one actuator, which counts from the end if it is negative; an array of those that a slice names.
    #[overload("(self, actuator: SupportsIndex, /) -> Model")]
    #[overload("(self, actuator: slice, /) -> ActuatorArray")]
    fn __getitem__<'py>(&self, py: Python<'py>, actuator: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyAny>> {
        let found = self.models.bind(py).as_any().get_item(actuator)?;
        if actuator.is_instance_of::<PySlice>() {
            Ok(Bound::new(py, Self::new(&found)?)?.into_any())
        } else {
            Ok(found)
        }
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

/// The schema of such a file.
pub(crate) const SCHEMA: &str = "mpi_hyst/array/1";

/// The file of an array: each model once, and which of them each actuator has.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    models: Vec<Value>,
    /// The place of each actuator's model among the models.
    actuators: Vec<usize>,
}

/// The text of a file.
fn file_text(models: &[Model]) -> String {
    let (mut kept, mut texts, mut actuators) = (Vec::<&Model>::new(), Vec::new(), Vec::new());
    for model in models {
        let place = kept.iter().position(|other| *other == model).unwrap_or_else(|| {
            kept.push(model);
            texts.push(serde_json::from_str(&model.to_json()).expect("a model's own file"));
            kept.len() - 1
        });
        actuators.push(place);
    }
    let file = File { schema: SCHEMA.to_owned(), models: texts, actuators };
    serde_json::to_string(&file).expect("numbers and names") + "\n"
}

/// The models of the actuators in a file, or what is wrong with it.
fn models_of(text: &str) -> Result<Vec<Model>, String> {
    let file: File = serde_json::from_str(text).map_err(|error| format!("not a file of an array: {error}"))?;
    if file.schema != SCHEMA {
        return Err(format!("schema: expected {SCHEMA:?}, got {:?}", file.schema));
    }
    let models = file
        .models
        .iter()
        .enumerate()
        .map(|(m, model)| Model::from_json(&model.to_string()).map_err(|error| format!("models[{m}]: {error}")));
    let models = models.collect::<Result<Vec<_>, _>>()?;
    let of = |(m, place): (usize, &usize)| {
        let model = models.get(*place).cloned();
        model.ok_or_else(|| format!("actuators[{m}]: expected a number below {}, got {place}", models.len()))
    };
    file.actuators.iter().enumerate().map(of).collect()
}
