//! The simulation of a closed loop: of one axis, and of several.

use std::num::NonZeroUsize;

use hysteresis_control::StageController;
use hysteresis_core::{
    CompiledModel, HybridController as Controller, Model, ModifiedPrandtlIshlinskii, check_all_finite,
};
use hysteresis_python_macros::function;
use hysteresis_simulate::closed_loop::{Tracking, TrackingTask};
use hysteresis_simulate::driven::{Driven, DrivenAxes};
use hysteresis_simulate::metrics;
use hysteresis_simulate::multi_axis::MultiAxisTask;
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyList;

use super::foreign::{ForeignAxes, ForeignPlant};
use super::plant::{MultiAxisPlant, Plant};
use super::run::Run;
use crate::argument::Callable;
use crate::control::controller::HybridController;
use crate::control::learning::RepetitiveControl;
use crate::control::multi_axis::MultiAxisController;
use crate::control::observer::Observer;
use crate::control::shared_by_controllers::check_interval;
use crate::convert::arrays::{PASS, array, check_room, numbers};
use crate::convert::errors::{self, Place, raise, unexpected};
use crate::convert::objects::{exclusive, shared};
use crate::identify::recursive::RecursiveIdentifier;

/// Lets a plant follow a reference under a controller, from the state in which both are.
///
/// At sample k the controller sees reference[k] and the plant's measurement, and gives the drive, which the plant holds
/// for one sampling interval. With a `HybridController` and a `Plant` the loop runs in compiled code. With
/// any other controller its `step(reference, measurement)` is called. A reference that is not finite is refused before
/// anything moves. An exception ends the run and leaves controller and plant where they are. A controller or a plant in
/// Python cannot use the other one itself meanwhile.
///
/// A plant may be any object with `read() -> float` and `write(drive)`: hardware, another process, a model of your own.
/// At every sample its measurement is read, and the drive is written. `write` holds the drive for one sampling
/// interval, and `read` waits for its end if time passes. Where it has these attributes they are used too: `position`,
/// where it really is (else what was measured); `drive`, what it really puts out (else what was written); `limits`
/// (low, high) of the drive and `dt` in seconds, to which the controller is compared. What it raises passes through
/// unchanged. If `write` raises, a `HybridController` with its observer and learning, and an `identifier`, have not
/// taken that sample: the next one starts from the drive before. Such a plant gets finite drives only: a controller
/// that gives another number is refused.
///
/// A reading of NaN is a missing measurement. The controller counts it and goes on as its `max_missing` says: with the
/// estimate of an observer, if it has one. In the run `measured` is NaN there, and `missing_count` of the metrics
/// counts it. The measured errors are those of the other samples.
///
/// Several axes: a `MultiAxisController`, or an object whose `step(references, measurements)` takes and returns arrays
/// of N numbers, with a `MultiAxisPlant` or an object whose `read` returns and whose `write` takes N numbers. The
/// reference is an array of shape (samples, N). Then the result is a list of N runs: run i has reference, measurement
/// and position of axis i, and drive and limits of actuator i. Of the keywords `target` (an array as the reference),
/// `period` and `progress` can be used.
///
/// Parameters
/// ----------
/// controller : HybridController, MultiAxisController or object
///     With a method step(reference, measurement) -> drive. A preview gets its references early: before the run, the
///     plant stands at reference[0] for as many samples.
/// plant : Plant, MultiAxisPlant or object
///     What is driven: with read() -> measurement and write(drive).
/// reference : array of n floats, or of shape (n, N)
///     Where the position should be, um, at the plant's sampling interval.
/// target : array of n floats, optional
///     Of the feed-forward, if it is not the reference: what `invert_dynamics` makes of it.
/// correction : array of n floats, optional
///     What is added to the target at every sample: `IterativeLearning.correction`, period after period.
/// observer, repetitive : Observer, RepetitiveControl, optional
///     As parts of the controller for this run: see `HybridController`. They remember it.
/// identifier : RecursiveIdentifier, optional
///     Follows drive and measurement; its model is taken into the controller every `model_update_interval` samples,
///     without a jump. For an exact inverse as feed-forward, of a stage without a Duhem operator.
/// model_update_interval : int
///     Samples between two swaps.
/// period : float, optional
///     Of the reference, in samples: `settled` of the run leaves out the first.
/// progress : callable, optional
///     Called with the fraction done, now and then.
///
/// Returns
/// -------
/// Run, or a list of N of them
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came; of a plant that is an object also the sample.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> kp, ki = mh.paper.gains("A1")
/// >>> reference = mh.signals.sine(3.3, 20.0, seconds=0.2)  # um
/// >>> inverse = mh.paper.table_1_recovered().inverse((-560, 560))
/// >>> controller = mh.control.HybridController(inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560))
/// >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
/// >>> run.settled.max_position_error > 0.2  # um: the dynamics lag
/// True
/// >>> controller = mh.control.HybridController(
/// ...     inverse, kp=kp, ki=ki, dt=1e-4, limits=(-560, 560),
/// ...     preview=mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
/// ... )
/// >>> run = mh.plant.simulate(controller, mh.paper.plant("A1"), reference, period=500)
/// >>> run.settled.max_position_error < 0.01
/// True
/// >>> class Bench:  # hardware, another process or, as here, a lag of 5 nm/V
/// ...     position = 0.0
/// ...     def read(self) -> float:
/// ...         return self.position
/// ...     def write(self, drive: float) -> None:
/// ...         self.position += 0.2 * (5e-3 * drive - self.position)
/// >>> gains = {"kp": 20.0, "ki": 2e4, "dt": 1e-4, "limits": (-500.0, 500.0)}
/// >>> feedback = mh.control.HybridController(None, **gains)
/// >>> run = mh.plant.simulate(feedback, Bench(), mh.signals.sine(1.0, 5.0, seconds=0.2))
/// >>> run.metrics.max_position_error < 0.4, run.metrics.missing_count
/// (True, 0)
#[function]
#[overload(
    "(controller: MultiAxisController, plant: MultiAxisPlant | AnyAxesPlant, reference: ArrayLike, *, target: ArrayLike | None=None, period: float | None=None, progress: Callable[[float], object] | None=None) -> list[Run]  # type: ignore[overload-overlap]"
)]
#[overload(
    "(controller: AnyAxesController, plant: MultiAxisPlant | AnyAxesPlant, reference: ArrayLike, *, target: ArrayLike | None=None, period: float | None=None, progress: Callable[[float], object] | None=None) -> list[Run]"
)]
#[overload(
    "(controller: AnyController, plant: AnyPlant, reference: ArrayLike, *, target: ArrayLike | None=None, correction: ArrayLike | None=None, observer: Observer | None=None, repetitive: RepetitiveControl | None=None, identifier: RecursiveIdentifier | None=None, model_update_interval: int=1000, period: float | None=None, progress: Callable[[float], object] | None=None) -> Run"
)]
pub(crate) fn simulate<'py>(
    #[py("AnyController")] controller: &Bound<'py, PyAny>,
    #[py("AnyPlant")] plant: &Bound<'py, PyAny>,
    #[py("ArrayLike")] reference: &Bound<'py, PyAny>,
    #[py(*, "ArrayLike | None" = None)] target: Option<&Bound<'py, PyAny>>,
    #[py("ArrayLike | None" = None)] correction: Option<&Bound<'py, PyAny>>,
    #[py(= None)] observer: Option<Bound<'py, Observer>>,
    #[py(= None)] repetitive: Option<Bound<'py, RepetitiveControl>>,
    #[py(= None)] identifier: Option<Bound<'py, RecursiveIdentifier>>,
    #[py(= 1000)] model_update_interval: NonZeroUsize,
    #[py(= None)] period: Option<f64>,
    #[py("Callable[[float], object] | None" = None)] progress: Option<Callable>,
) -> PyResult<Bound<'py, PyAny>> {
    if has_axes(controller, plant, reference) {
        if correction.is_some() || observer.is_some() || repetitive.is_some() || identifier.is_some() {
            let expected = "a HybridController of one axis beside correction, observer, repetitive or identifier";
            return Err(unexpected("controller", expected, controller));
        }
        return simulate_axes(controller, plant, (reference, target), period, progress);
    }
    // Copies: a controller or a progress function may change the arrays.
    let reference = numbers("reference", reference)?;
    check_room("reference", reference.len(), PASS)?;
    let task = TrackingTask::new(&reference, period).map_err(raise)?;
    let one_each = |name, given: Option<&Bound<'py, PyAny>>| {
        given.map(|given| checked_samples(name, given, reference.len())).transpose()
    };
    let (target, correction) = (one_each("target", target)?, one_each("correction", correction)?);
    let watch = watch(plant.py(), reference.len(), progress);
    let observer = observer.as_ref().map(exclusive).transpose()?;
    let repetitive = repetitive.as_ref().map(exclusive).transpose()?;
    let identifier = identifier.as_ref().map(exclusive).transpose()?;
    let around = Around { target, correction, observer, repetitive, identifier, model_update_interval };
    let run = if let Ok(plant) = plant.cast::<Plant>() {
        let plant = &mut exclusive(plant)?.plant;
        let dt = Some(plant.dt());
        around.run_any(controller, &task, (plant, dt), watch)
    } else {
        let mut plant = ForeignPlant::new(plant)?.with_limits()?;
        let dt = plant.dt()?;
        around.run_any(controller, &task, (&mut plant, dt), watch)
    };
    Ok(Bound::new(plant.py(), Run(run?))?.into_any())
}

/// What may surround a hybrid controller.
struct Around<'py> {
    target: Option<Vec<f64>>,
    correction: Option<Vec<f64>>,
    observer: Option<PyRefMut<'py, Observer>>,
    repetitive: Option<PyRefMut<'py, RepetitiveControl>>,
    identifier: Option<PyRefMut<'py, RecursiveIdentifier>>,
    model_update_interval: NonZeroUsize,
}

impl Around<'_> {
    fn is_empty(&self) -> bool {
        let alone = self.observer.is_none() && self.repetitive.is_none() && self.identifier.is_none();
        alone && self.target.is_none() && self.correction.is_none()
    }

    /// With a controller of any kind.
    fn run_any<P: Driven<PyErr>>(
        self,
        controller: &Bound<'_, PyAny>,
        task: &TrackingTask<'_>,
        plant: (&mut P, Option<f64>),
        watch: impl FnMut(usize) -> PyResult<()>,
    ) -> PyResult<metrics::Run> {
        match controller.cast::<HybridController>() {
            Ok(hybrid) => self.run(&mut exclusive(hybrid)?.stage_controller, task, plant, watch),
            Err(_) if self.is_empty() => run_object(controller, task, plant.0, watch),
            Err(_) => {
                let expected = "a HybridController beside target, correction, observer, repetitive or identifier";
                Err(unexpected("controller", expected, controller))
            }
        }
    }

    /// With a hybrid controller, and a plant whose sampling interval may be known.
    fn run<P: Driven<PyErr>>(
        mut self,
        controller: &mut StageController,
        task: &TrackingTask<'_>,
        (plant, dt): (&mut P, Option<f64>),
        watch: impl FnMut(usize) -> PyResult<()>,
    ) -> PyResult<metrics::Run> {
        let own = controller.controller().options().dt;
        check_interval("controller", Some(own), dt.unwrap_or(own))?;
        let dt = dt.unwrap_or(own);
        check_interval("observer", self.observer.as_ref().map(|observer| observer.observer.dt()), dt)?;
        check_interval("repetitive", self.repetitive.as_ref().map(|repetitive| repetitive.control.dt()), dt)?;
        check_limits(controller.controller().options().limits, plant.limits())?;
        if let Some(identifier) = &self.identifier {
            if controller.controller().duhem().is_some() {
                let message =
                    "expected None for a stage with a Duhem operator: plays alone would take up what that puts out";
                return Err(errors::value("identifier", message));
            }
            // What it would be refused for in the run is found out before.
            let mut task = controller.controller().clone();
            task.set_model(&compiled(&identifier.0.model())).map_err(raise)?;
        }
        let mut joined = self.joined_to(controller)?;
        let tracking = Tracking {
            controller: &mut joined,
            targets: self.target.as_deref(),
            corrections: self.correction.as_deref(),
        };
        let (identifier, model_update_interval, mut updates) = (&mut self.identifier, self.model_update_interval, 0);
        let adapt = |controller: &mut Controller, drive: f64, measured: f64| {
            let Some(identifier) = identifier.as_mut() else { return Ok(()) };
            identifier.0.update(drive, measured);
            updates += 1;
            if updates % model_update_interval.get() == 0 {
                controller.set_model(&compiled(&identifier.0.model())).map_err(raise)?;
            }
            Ok(())
        };
        let run = tracking.run_with(task, plant, adapt, watch);
        *controller = self.taken_from(joined);
        run
    }

    /// The controller with copies of an observer and learning that are not its own.
    fn joined_to(&self, controller: &StageController) -> PyResult<StageController> {
        let twice = |name, given: bool, own: bool| {
            let message = "expected None for a controller that has one of its own";
            if given && own { Err(errors::value(name, message)) } else { Ok(()) }
        };
        twice("observer", self.observer.is_some(), controller.observer().is_some())?;
        twice("repetitive", self.repetitive.is_some(), controller.repetitive().is_some())?;
        let mut joined = controller.clone();
        if let Some(observer) = &self.observer {
            joined = joined.with_observer(observer.observer.clone()).map_err(raise)?;
        }
        if let Some(repetitive) = &self.repetitive {
            joined = joined.with_repetitive(repetitive.control.clone()).map_err(raise)?;
        }
        Ok(joined)
    }

    /// The controller after the run. Observer and learning that are not its own get what they came to.
    fn taken_from(&mut self, mut joined: StageController) -> StageController {
        if let Some(given) = &mut self.observer
            && let Some(now) = joined.take_observer()
        {
            given.observer = now;
        }
        if let Some(given) = &mut self.repetitive
            && let Some(now) = joined.take_repetitive()
        {
            given.control = now;
        }
        joined
    }
}

/// Limits of the controller beyond those of the plant would wind up what the plant never gets.
pub(super) fn check_limits(got: (f64, f64), plant: Option<(f64, f64)>) -> PyResult<()> {
    match plant {
        Some((low, high)) if got.0 < low || got.1 > high => {
            let expected = format!("limits within those of the plant, ({low:?}, {high:?})");
            Err(errors::value("controller", format_args!("expected {expected}, got {got:?}")))
        }
        _ => Ok(()),
    }
}

fn compiled(model: &Model) -> CompiledModel {
    match model {
        Model::Conventional(model) => CompiledModel::new(&ModifiedPrandtlIshlinskii::from(model)),
        Model::Modified(model) => CompiledModel::new(model),
    }
}

/// The loop with a controller of any kind.
fn run_object<P: Driven<PyErr>>(
    controller: &Bound<'_, PyAny>,
    task: &TrackingTask<'_>,
    plant: &mut P,
    watch: impl FnMut(usize) -> PyResult<()>,
) -> PyResult<metrics::Run> {
    let Ok(step) = controller.getattr(intern!(controller.py(), "step")) else {
        return Err(unexpected("controller", "an object with step(reference, measurement) -> drive", controller));
    };
    let drive = |k: usize, measured: f64| {
        let drive = step.call1((task.reference()[k], measured))?;
        let place = Place::part("controller", "controller.step");
        drive.extract::<f64>().map_err(|_| unexpected(place, format_args!("a number at sample {k}"), &drive))
    };
    task.run(plant, drive, watch)
}

/// As many finite numbers as there are samples.
fn checked_samples(name: &'static str, given: &Bound<'_, PyAny>, samples: usize) -> PyResult<Vec<f64>> {
    let given = numbers(name, given)?;
    if given.len() != samples {
        let got = given.len();
        return Err(errors::value(name, format_args!("expected {samples} samples as in the reference, got {got}")));
    }
    check_all_finite(name, &given).map_err(raise)?;
    Ok(given)
}

/// Looks at signals and tells the fraction done.
#[expect(clippy::cast_precision_loss, reason = "a fraction for the eye")]
pub(crate) fn watch(
    py: Python<'_>,
    samples: usize,
    progress: Option<Callable>,
) -> impl FnMut(usize) -> PyResult<()> + '_ {
    move |k| {
        py.check_signals()?;
        let Some(Callable(progress)) = &progress else { return Ok(()) };
        progress.call1(py, (k as f64 / samples as f64,)).map(drop)
    }
}

/// Whether a loop has several axes: by its controller or plant, or by the reference where these tell nothing.
pub(super) fn has_axes(controller: &Bound<'_, PyAny>, plant: &Bound<'_, PyAny>, reference: &Bound<'_, PyAny>) -> bool {
    if controller.is_instance_of::<MultiAxisController>() || plant.is_instance_of::<MultiAxisPlant>() {
        return true;
    }
    if controller.is_instance_of::<HybridController>() || plant.is_instance_of::<Plant>() {
        return false;
    }
    let py = reference.py();
    let dimensions = py.import(intern!(py, "numpy")).and_then(|numpy| numpy.call_method1("ndim", (reference,)));
    dimensions.and_then(|dimensions| dimensions.extract::<usize>()).is_ok_and(|dimensions| dimensions == 2)
}

/// Rows of N numbers, as a copy, and N.
fn rows(name: &str, value: &Bound<'_, PyAny>, axes: Option<usize>) -> PyResult<(Vec<f64>, usize)> {
    let expected =
        axes.map_or("an array of shape (samples, axes)".to_owned(), |n| format!("an array of shape (samples, {n})"));
    let rows = array::<Ix2>(name, value, format_args!("{expected}"))?;
    let shape = rows.shape();
    if axes.is_some_and(|axes| axes != shape[1]) {
        return Err(errors::value(name, format_args!("expected {expected}, got shape ({}, {})", shape[0], shape[1])));
    }
    Ok((rows.as_slice()?.to_vec(), shape[1]))
}

/// `simulate` for several axes: a list of runs.
pub(super) fn simulate_axes<'py>(
    controller: &Bound<'py, PyAny>,
    plant: &Bound<'py, PyAny>,
    (reference, target): (&Bound<'py, PyAny>, Option<&Bound<'py, PyAny>>),
    period: Option<f64>,
    progress: Option<Callable>,
) -> PyResult<Bound<'py, PyAny>> {
    let py = plant.py();
    if plant.is_instance_of::<Plant>() {
        return Err(unexpected("plant", "a MultiAxisPlant, or an object with read() and write(drives)", plant));
    }
    let own = plant.cast::<MultiAxisPlant>().ok();
    let axes = own.map(|plant| Ok::<_, PyErr>(shared(plant)?.plant.plants().len())).transpose()?;
    let hybrid = controller.cast::<MultiAxisController>().ok();
    let axes = match hybrid {
        Some(hybrid) => {
            let got = shared(hybrid)?.axes();
            if axes.is_some_and(|axes| axes != got) {
                let expected = format!("one for {} axes, as the plant has", axes.unwrap_or_default());
                return Err(errors::value("controller", format_args!("expected {expected}, got one for {got}")));
            }
            Some(got)
        }
        None => axes,
    };
    let (reference, axes) = rows("reference", reference, axes)?;
    let task = MultiAxisTask::new(&reference, axes, period).map_err(raise)?;
    let target = target.map(|target| checked_target(target, &reference, axes)).transpose()?;
    let watch = watch(py, reference.len() / axes.max(1), progress);
    let parts = Parts { controller, hybrid, task, axes, target };
    let runs = if let Some(plant) = own {
        let plant = &mut exclusive(plant)?.plant;
        let dt = Some(plant.dt());
        parts.run(plant, dt, watch)?
    } else {
        let mut plant = ForeignAxes::new(plant, axes)?;
        let dt = plant.plant.dt()?;
        parts.run(&mut plant, dt, watch)?
    };
    Ok(PyList::new(py, runs.into_iter().map(Run).map(|run| Bound::new(py, run)).collect::<PyResult<Vec<_>>>()?)?
        .into_any())
}

/// A target for each reference.
fn checked_target(target: &Bound<'_, PyAny>, reference: &[f64], axes: usize) -> PyResult<Vec<f64>> {
    let (target, _) = rows("target", target, Some(axes))?;
    if target.len() != reference.len() {
        let (expected, got) = (reference.len() / axes, target.len() / axes);
        return Err(errors::value(
            "target",
            format_args!("expected {expected} samples as in the reference, got {got}"),
        ));
    }
    check_all_finite("target", &target).map_err(raise)?;
    Ok(target)
}

/// All of a loop but its plant.
struct Parts<'a, 'py> {
    controller: &'a Bound<'py, PyAny>,
    hybrid: Option<&'a Bound<'py, MultiAxisController>>,
    task: MultiAxisTask<'a>,
    axes: usize,
    target: Option<Vec<f64>>,
}

impl Parts<'_, '_> {
    fn run<P: DrivenAxes<PyErr>>(
        self,
        plant: &mut P,
        dt: Option<f64>,
        watch: impl FnMut(usize) -> PyResult<()>,
    ) -> PyResult<Vec<metrics::Run>> {
        let Some(hybrid) = self.hybrid else { return self.run_object(plant, watch) };
        let axes = &mut exclusive(hybrid)?.controller;
        for (i, controller) in axes.controller().controllers().iter().enumerate() {
            let own = controller.options().dt;
            check_interval("controller", Some(own), dt.unwrap_or(own))?;
            check_limits(controller.options().limits, plant.limits(i))?;
        }
        self.task.track(plant, axes, self.target.as_deref(), watch)
    }

    /// With a controller of any kind, which gets and gives arrays.
    fn run_object<P: DrivenAxes<PyErr>>(
        self,
        plant: &mut P,
        watch: impl FnMut(usize) -> PyResult<()>,
    ) -> PyResult<Vec<metrics::Run>> {
        let (py, controller) = (self.controller.py(), self.controller);
        if self.target.is_some() {
            return Err(unexpected("controller", "a MultiAxisController beside target", controller));
        }
        if controller.is_instance_of::<HybridController>() {
            return Err(unexpected("controller", "a MultiAxisController for a plant of several axes", controller));
        }
        let Some(step) = controller.getattr_opt(intern!(py, "step"))? else {
            let expected = "an object with step(references, measurements) -> drives";
            return Err(unexpected("controller", expected, controller));
        };
        let act = |k: usize, measured: &[f64], drives: &mut [f64]| {
            let reference = PyArray1::from_slice(py, self.task.row(k));
            let given = step.call1((reference, PyArray1::from_slice(py, measured)))?;
            let place = Place::part("controller", "controller.step");
            match numbers(place, &given) {
                Ok(found) if found.len() == drives.len() => drives.copy_from_slice(&found),
                _ => return Err(unexpected(place, format_args!("{} numbers at sample {k}", self.axes), &given)),
            }
            Ok(())
        };
        self.task.run(plant, act, watch)
    }
}
