//! Loops of several axes.

use hysteresis_core::check_all_finite;
use hysteresis_simulate::driven::DrivenAxes;
use hysteresis_simulate::metrics;
use hysteresis_simulate::multi_axis::MultiAxisTask;
use numpy::ndarray::Ix2;
use numpy::{PyArray1, PyUntypedArrayMethods};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyList;

use super::foreign::ForeignAxes;
use super::multi_axis::MultiAxisPlant;
use super::plant::Plant;
use super::run::Run;
use super::simulate::{check_limits, watch};
use crate::control::controller::HybridController;
use crate::control::multi_axis::MultiAxisController;
use crate::control::shared_by_controllers::check_interval;
use crate::convert::arrays::{array, numbers};
use crate::convert::errors::{self, Place, raise, unexpected};
use crate::convert::objects::{exclusive, shared};

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
    progress: Option<&Bound<'py, PyAny>>,
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
            let got = shared(hybrid)?.controller.controllers().len();
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
    let watch = watch(py, reference.len() / axes.max(1), progress)?;
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
        for (i, controller) in axes.controllers().iter().enumerate() {
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
