//! An array of actuators, and its file.

use std::fmt::Display;
use std::path::PathBuf;

use hysteresis_control::stage;
use hysteresis_core::{ActuatorError, CompiledModel, Method, Model};
use hysteresis_python_macros::methods;
use numpy::PyUntypedArrayMethods;
use numpy::ndarray::IxDyn;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PySlice, PyTuple, PyType};
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::of_kind::{OfKind, of_kind};
use super::stream_arrays::{ForwardArray, InverseArray, Inverses, MadeOf};
use super::streams::method_name;
use crate::convert::arrays::array;
use crate::convert::errors::{self, Place, Refusal, raise, wrong_type};
use crate::convert::files::{read, write_file};
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::model::methods::{forward_at_rest, inverse_at_rest, method_asked_for};
use crate::model::models::{compiled_if_model, model_of, object};
use crate::stage::stage::{Stage, checked_limits};

/// Many actuators side by side, as in a deformable mirror: actuator m is models[m], with its own memory.
///
/// Equal ones are kept once, so `[model] * 4096` costs little more than one. Stages are for actuators with a Duhem
/// operator, maps, creep, loop shift, relaxing plays or slow gain: what runs then goes by time, and asks for `dt`.
///
/// Parameters
/// ----------
/// models : sequence of M models, or of M stages
///     PrandtlIshlinskii or ModifiedPrandtlIshlinskii, mixed as you like. Or Stage, all of them.
///
/// Raises
/// ------
/// ValueError, TypeError
///     Without a model, or that name the one that is none, or of another kind than the first.
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
///
/// Actuators whose loops have a Duhem operator beside the plays, and which creep:
///
/// >>> duhem = mh.Duhem.from_bouc_wen(2e-3, 0.01, 0.9, 0.4)
/// >>> creep = mh.plant.Creep.logarithmic(0.012, 0.01, 100.0, 8)
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), duhem=duhem, creep=creep, limits=(-500.0, 500.0))
/// >>> mirror = mh.ActuatorArray([stage] * 3)
/// >>> inverse, plant = mirror.inverse(dt=1e-3), mirror.forward(dt=1e-3)
/// >>> targets = np.linspace([0.0, 0.0, 0.0], [1.0, -2.0, 0.5], 50)  # um
/// >>> bool(abs(plant.run(inverse.run(targets)) - targets).max() < 1e-13)
/// True
#[pyclass(module = "mpi_hyst", frozen)]
pub(crate) struct ActuatorArray {
    models: Py<PyTuple>,
    actuators: OfKind<Box<[CompiledModel]>, Box<[Py<Stage>]>>,
    distinct: usize,
    /// Whether it is there for copies of what another one made, whose user has been warned.
    of_copies: bool,
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
    pub(crate) fn error(&self, actuator: usize, error: impl Refusal) -> PyErr {
        match (self, error.parameter()) {
            (Self::Shared(_), Some("limits")) => raise(error),
            _ => raise(ActuatorError { actuator, error }),
        }
    }
}

/// An error of the stream of a stage. A sampling interval is wrong for no one in particular.
fn of_stage(actuator: usize, error: stage::Error) -> PyErr {
    if error.parameter() == Some("dt") { raise(error) } else { raise(ActuatorError { actuator, error }) }
}

impl ActuatorArray {
    /// The compiled models, or the stages.
    pub(crate) fn actuators(&self) -> &OfKind<Box<[CompiledModel]>, Box<[Py<Stage>]>> {
        &self.actuators
    }

    /// The number of actuators.
    pub(crate) fn count(&self) -> usize {
        of_kind!(&self.actuators, each => each.len())
    }

    /// The exact inverses at rest, within `limits`: of models by `method` if one is asked for, of stages at `dt`.
    pub(crate) fn inverses(
        &self,
        py: Python<'_>,
        limits: &Limits,
        method: Option<Method>,
        dt: Option<f64>,
    ) -> PyResult<Inverses> {
        match (&self.actuators, self.checked_dt(dt, method)?) {
            (OfKind::Models(models), _) => {
                let stream =
                    |(m, model)| inverse_at_rest(model, limits.of(m), method).map_err(|error| limits.error(m, error));
                models.iter().enumerate().map(stream).collect::<PyResult<_>>().map(OfKind::Models)
            }
            (OfKind::Stages(stages), dt) => {
                self.warn_of(py, stages, limits)?;
                let stream = |(actuator, stage): (usize, &Py<Stage>)| {
                    stage.get().0.inverse(dt, limits.of(actuator)).map_err(|error| of_stage(actuator, error))
                };
                stages.iter().enumerate().map(stream).collect::<PyResult<_>>().map(OfKind::Stages)
            }
        }
    }

    /// The sampling interval of what has one anyway, as far as the actuators need it.
    pub(crate) fn interval(&self, dt: f64) -> Option<f64> {
        matches!(self.actuators, OfKind::Stages(_)).then_some(dt)
    }

    /// The sampling interval of stages, which have no choice of a method; models go by samples alone.
    fn checked_dt(&self, dt: Option<f64>, method: Option<Method>) -> PyResult<f64> {
        match (&self.actuators, dt) {
            (OfKind::Models(_), None) => Ok(f64::NAN),
            (OfKind::Models(_), Some(got)) => {
                Err(errors::value("dt", format_args!("expected none for an array of models, got {got:?}")))
            }
            (OfKind::Stages(_), None) => {
                Err(wrong_type("dt", "expected the sampling interval in seconds for an array of stages, got None"))
            }
            (OfKind::Stages(_), Some(dt)) => match method.map(method_name) {
                Some(got) => Err(errors::value("method", format_args!("expected None for stages, got {got:?}"))),
                None => Ok(dt),
            },
        }
    }

    /// Warns of limits that were given, beyond what was identified of the first stage that they are for.
    fn warn_of(&self, py: Python<'_>, stages: &[Py<Stage>], limits: &Limits) -> PyResult<()> {
        let beyond =
            |(m, stage): &(usize, &Stage)| limits.of(*m).is_some_and(|pair| stage.0.extrapolates(pair).is_some());
        match stages.iter().map(Py::get).enumerate().find(beyond) {
            Some((m, stage)) if !self.of_copies => checked_limits(py, &stage.0, limits.of(m)).map(drop),
            _ => Ok(()),
        }
    }
}

#[methods]
impl ActuatorArray {
    #[new]
    pub(crate) fn new(#[py("Iterable[Model] | Iterable[Stage]")] models: &Bound<'_, PyAny>) -> PyResult<Self> {
        let py = models.py();
        let Ok(items) = models.try_iter() else {
            let got = models.get_type().name()?;
            let expected = "a sequence of models ([model] * M for M actuators of one model)";
            return Err(wrong_type("models", format_args!("expected {expected}, got {got}")));
        };
        let (known, mut kept) = (PyDict::new(py), Vec::new());
        let (mut compiled, mut stages) = (Vec::new(), Vec::new());
        for (m, item) in items.enumerate() {
            let item = item?;
            let (is_model, is_stage) = (compiled_if_model(&item).is_some(), item.is_instance_of::<Stage>());
            if !(is_model && stages.is_empty() || is_stage && compiled.is_empty()) {
                let got = item.get_type().name()?;
                let expected = match (compiled.is_empty(), stages.is_empty()) {
                    (true, true) => "a PrandtlIshlinskii, ModifiedPrandtlIshlinskii or Stage",
                    (_, true) => "a PrandtlIshlinskii or ModifiedPrandtlIshlinskii, as models[0] is one",
                    (..) => "a Stage, as models[0] is one",
                };
                let place = format!("models[{m}]");
                return Err(wrong_type(Place::part("models", &place), format_args!("expected {expected}, got {got}")));
            }
            let first = known.call_method1("setdefault", (&item, &item))?;
            compiled.extend(compiled_if_model(&first));
            stages.extend(first.cast::<Stage>().ok().map(|stage| stage.clone().unbind()));
            kept.push(first);
        }
        if kept.is_empty() {
            return Err(errors::value("models", "expected at least one model, got none"));
        }
        let is_of_models = stages.is_empty();
        let actuators = if is_of_models { OfKind::Models(compiled.into()) } else { OfKind::Stages(stages.into()) };
        Ok(Self { models: PyTuple::new(py, kept)?.unbind(), actuators, distinct: known.len(), of_copies: false })
    }

    /// The array for copies of what another one made.
    #[classmethod]
    fn _of_copies(_: &Bound<'_, PyType>, models: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self { of_copies: true, ..Self::new(models)? })
    }

    /// The model, or stage, of every actuator.
    #[getter]
    #[py(-> "tuple[Model, ...] | tuple[Stage, ...]")]
    fn models(&self, py: Python<'_>) -> Py<PyTuple> {
        self.models.clone_ref(py)
    }

    /// The forward models as one stream of arrays, at rest.
    ///
    /// `dt`, the sampling interval in seconds, is for stages, and needed there: each is its whole chain, as
    /// `stage.forward(dt)`.
    ///
    /// `method` for all actuators, as for a single model: "bank" where every command jumps by about a tenth of the
    /// range or more and operators are few. None chooses for each one, as stages do.
    ///
    /// Raises ValueError that names the first actuator whose thresholds are not nested if "turning_points" is asked
    /// for.
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
        #[py(*, = None)] dt: Option<f64>,
        #[py("Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ForwardArray> {
        let (this, method) = (slf.get(), method_asked_for(method, false)?);
        let stream = match (&this.actuators, this.checked_dt(dt, method)?) {
            (OfKind::Models(models), _) => {
                let stream = |(actuator, model)| {
                    forward_at_rest(model, method).map_err(|error| raise(ActuatorError { actuator, error }))
                };
                OfKind::Models(models.iter().enumerate().map(stream).collect::<PyResult<_>>()?)
            }
            (OfKind::Stages(stages), dt) => {
                let stream = |(actuator, stage): (usize, &Py<Stage>)| {
                    stage.get().0.forward(dt).map_err(|error| of_stage(actuator, error))
                };
                OfKind::Stages(stages.iter().enumerate().map(stream).collect::<PyResult<_>>()?)
            }
        };
        Ok(ForwardArray { stream, made: MadeOf::new(slf.as_any(), None).by(method, dt) })
    }

    /// The exact inverses as one stream of arrays, at rest.
    ///
    /// `limits` of the drives: (low, high) for all, or an array of shape (M, 2), a row for each actuator. Stages have
    /// theirs by default, their `drive_range`. Others must lie within those of the stages.
    ///
    /// `dt`, the sampling interval in seconds, is for stages, and needed there: each is inverted without amplifier,
    /// modes and dead time, as by `stage.inverse(dt, limits)`.
    ///
    /// `method` as in `forward`. Inverses gain by "bank" only where thousands of actuators, each with a model of its
    /// own, jump over the whole range.
    ///
    /// Raises NotInvertibleError that names the first actuator whose model may not be invertible.
    fn inverse(
        slf: &Bound<'_, Self>,
        #[py("ArrayLike | None" = None)] limits: Option<&Bound<'_, PyAny>>,
        #[py(*, = None)] dt: Option<f64>,
        #[py("Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<InverseArray> {
        let this = slf.get();
        let given = Limits::from_python(limits, this.count())?;
        let method = method_asked_for(method, false)?;
        let stream = this.inverses(slf.py(), &given, method, dt)?;
        Ok(InverseArray { stream, made: MadeOf::new(slf.as_any(), limits).by(method, dt) })
    }

    /// An array like this one, with another model, or stage, for one actuator. The array itself never changes.
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
        #[py("Model | Stage")] model: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (count, place) = (self.count().cast_signed(), actuator.extract::<isize>());
        let Some(place) = place.ok().filter(|place| (-count..count).contains(place)) else {
            let expected = format!("a whole number from {} to {}", -count, count - 1);
            return Err(errors::value("actuator", format_args!("expected {expected}, got {}", actuator.repr()?)));
        };
        let (expected, is_of_kind) = match &self.actuators {
            OfKind::Models(_) => {
                ("a PrandtlIshlinskii or a ModifiedPrandtlIshlinskii", compiled_if_model(model).is_some())
            }
            OfKind::Stages(_) => ("a Stage, as the others are", model.is_instance_of::<Stage>()),
        };
        if !is_of_kind {
            return Err(errors::unexpected("model", expected, model));
        }
        let models = self.models.bind(py).to_list();
        models.as_any().set_item(place, model)?;
        Self::new(models.as_any())
    }

    /// Writes the models, or stages, to a JSON file, each once; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        let text = match &self.actuators {
            OfKind::Models(_) => {
                let models = self.models.bind(py).iter().map(|model| model_of("models", &model));
                file_text(&models.collect::<PyResult<Vec<_>>>()?, Model::to_json)
            }
            OfKind::Stages(stages) => {
                file_text(&stages.iter().map(|stage| &stage.get().0).collect::<Vec<_>>(), |stage| stage.to_json())
            }
        };
        write_file(py, path, &text)
    }

    /// Reads what `save` wrote.
    ///
    /// Raises OSError if the file cannot be read, ValueError if it is no such file.
    #[staticmethod]
    fn load(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let (models, actuators) = models_of(&read(&path)?).map_err(|message| errors::file(&path, &message))?;
        let models = models.into_iter().map(|model| match model {
            OfKind::Models(model) => object(py, model),
            OfKind::Stages(stage) => Ok(Py::new(py, Stage(stage))?.into_any()),
        });
        let models = models.collect::<PyResult<Vec<_>>>()?;
        let each = PyTuple::new(py, actuators.into_iter().map(|place| &models[place]))?;
        Self::new(each.as_any()).map_err(|error| errors::file(&path, error.value(py)))
    }

    /// The model, or stage, of one actuator, from the end if it is negative; an array of those that a slice names.
    #[overload("(self, actuator: SupportsIndex, /) -> Model | Stage")]
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
        self.count()
    }

    fn __eq__(&self, py: Python<'_>, other: &Self) -> PyResult<bool> {
        self.models.bind(py).eq(&other.models)
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        self.models.bind(py).hash()
    }

    fn __repr__(&self) -> String {
        let kind = if matches!(self.actuators, OfKind::Models(_)) { "model" } else { "stage" };
        let plural = if self.distinct == 1 { "" } else { "s" };
        format!("<ActuatorArray of {} actuators, {} {kind}{plural}>", self.count(), self.distinct)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let class = py.get_type::<Self>().into_any();
        let make = if self.of_copies { class.getattr(intern!(py, "_of_copies"))? } else { class };
        reduce(make, (self.models.bind(py).clone(),), keywords!(py), None)
    }
}

/// The schema of such a file.
pub(crate) const SCHEMA: &str = "mpi_hyst/array/1";

/// The file of an array: each model, or stage, once, and which of them each actuator has.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    schema: String,
    models: Vec<Value>,
    /// The place of each actuator's model among the models.
    actuators: Vec<usize>,
}

/// The text of a file.
fn file_text<M: PartialEq>(models: &[M], to_json: impl Fn(&M) -> String) -> String {
    let (mut kept, mut texts, mut actuators) = (Vec::<&M>::new(), Vec::new(), Vec::new());
    for model in models {
        let place = kept.iter().position(|other| *other == model).unwrap_or_else(|| {
            kept.push(model);
            texts.push(serde_json::from_str(&to_json(model)).expect("a model's own file"));
            kept.len() - 1
        });
        actuators.push(place);
    }
    let file = File { schema: SCHEMA.to_owned(), models: texts, actuators };
    serde_json::to_string(&file).expect("numbers and names") + "\n"
}

/// What a file keeps once.
type Kept = OfKind<Model, stage::Stage>;

/// What a file has of models and stages, and the place of that of each actuator among them; or what is wrong with it.
fn models_of(text: &str) -> Result<(Vec<Kept>, Vec<usize>), String> {
    let file: File = serde_json::from_str(text).map_err(|error| format!("not a file of an array: {error}"))?;
    if file.schema != SCHEMA {
        return Err(format!("schema: expected {SCHEMA:?}, got {:?}", file.schema));
    }
    let model = |(m, model): (usize, &Value)| {
        let (text, named) = (model.to_string(), |error: &dyn Display| format!("models[{m}]: {error}"));
        if model.get("schema").and_then(Value::as_str) == Some(stage::SCHEMA) {
            stage::Stage::from_json(&text).map(OfKind::Stages).map_err(|error| named(&error))
        } else {
            Model::from_json(&text).map(OfKind::Models).map_err(|error| named(&error))
        }
    };
    let models = file.models.iter().enumerate().map(model).collect::<Result<Vec<_>, _>>()?;
    let wrong = file.actuators.iter().enumerate().find(|(_, place)| **place >= models.len());
    match wrong {
        Some((m, got)) => Err(format!("actuators[{m}]: expected a number below {}, got {got}", models.len())),
        None => Ok((models, file.actuators)),
    }
}
