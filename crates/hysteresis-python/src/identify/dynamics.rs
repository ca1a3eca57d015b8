//! Identification of dynamics: arguments in, a linear part with its uncertainty out.

use hysteresis_identify::{self as identification, CreepModel, DynamicsOptions, Order, Record, Setting};
use hysteresis_python_macros::{function, methods, py};
use numpy::{PyArray1, PyArray2, PyReadonlyArray1};
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use pythonize::{depythonize, pythonize};

use super::diagnose::Finding;
use super::options::setting;
use super::quality::Quality;
use super::watch::Watch;
use crate::argument::{Argument, SampleCount};
use crate::convert::arrays::{FIT, check_room, numbers, read_only};
use crate::convert::errors::{self, one_record};
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::linear::creep::Creep;
use crate::linear::dynamics::dynamics;
use crate::model::models::compiled_of;

/// What `identify_dynamics` found: the linear part behind a hysteresis model, and how far to trust it.
///
/// Standard deviations allow for coloured noise and for lags that are not in the model (docs/standard_errors.md);
/// `warnings` tells what makes the numbers doubtful, by these codes:
///
/// - "resonance_not_excited": the standard deviation of the frequency exceeds 5 %, the search ended at the edge of its
///   domain, or a plain dead time fits as well up to what noise may pretend: the record does not tell the dynamics, and
///   `dynamics` is None or critically damped then. Drive with a chirp or step that reaches the resonance.
/// - "damping_undetermined": the same, of the damping, at 25 %.
/// - "dead_time_confounded": the record tells the sum of dead time and lag of the dynamics alone: the standard
///   deviation of the dead time exceeds a quarter of a sample.
/// - "negative_dead_time": the output leads the drive by more than half a sample: a row holds a position that was read
///   later. Nothing can run that: the result has a dead time of 0.
/// - "creep_undetermined": the standard deviation of the creep exceeds half of it, and a thousandth of a move.
/// - "gain_not_one": the gain differs from 1 by more than 5 %: the hysteresis model is not that of this record.
/// - "residual_coloured": what is left is correlated in time, by more than a thousandth of the range: the noise is
///   coloured, or something is not modelled. The standard deviations allow for it.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> model = mh.paper.table_1_recovered()
/// >>> u = np.where(np.arange(500) < 10, 0.0, 400.0)  # V, a step
/// >>> y = mh.plant.SecondOrder(800.0, 0.05).response(model.forward().run(u), dt=1e-4)  # um
/// >>> found = mh.identify_dynamics(u, y, model, dt=1e-4)
/// >>> found.verdict, round(found.dynamics.frequency)
/// ('green', 800)
#[pyclass(module = "mpi_hyst.results", frozen)]
pub(crate) struct DynamicsIdentification {
    pub(crate) found: identification::DynamicsIdentification,
    model: Py<PyAny>,
}

#[methods]
impl DynamicsIdentification {
    /// The hysteresis model that was given.
    #[getter]
    #[py(-> "Model")]
    fn model(&self, py: Python<'_>) -> Py<PyAny> {
        self.model.clone_ref(py)
    }

    /// The sampling interval in seconds.
    #[getter]
    fn dt(&self) -> f64 {
        self.found.dt
    }

    /// The SecondOrder or FirstOrder that was fitted, of unit static gain.
    #[getter]
    #[py(-> "Lag | None")]
    fn dynamics(&self, py: Python<'_>) -> PyResult<Option<Py<PyAny>>> {
        self.found.dynamics.map(|found| dynamics(py, found)).transpose()
    }

    /// What the output lags the input besides, in seconds.
    #[getter]
    fn dead_time(&self) -> f64 {
        self.found.dead_time
    }

    /// How much later slow motion is seen: dead time and lag of the dynamics together, in seconds. Without dynamics the
    /// dead time makes up for the held input, too: half a sampling interval.
    #[getter]
    fn lag(&self) -> f64 {
        self.found.lag
    }

    /// The Creep, or None if none was asked for.
    #[getter]
    fn creep(&self) -> Option<Creep> {
        self.found.creep.clone().map(Creep)
    }

    /// What multiplies the model's output: 1 if the model is right.
    #[getter]
    fn gain(&self) -> f64 {
        self.found.gain
    }

    /// What is added to gain times the model's output, in the unit of the output.
    #[getter]
    fn output_offset(&self) -> f64 {
        self.found.output_offset
    }

    /// Standard error of the frequency in Hz.
    #[getter]
    fn frequency_std(&self) -> f64 {
        self.found.standard_errors.frequency
    }

    /// Standard error of the damping ratio; 0 for a first-order lag.
    #[getter]
    fn damping_std(&self) -> f64 {
        self.found.standard_errors.damping
    }

    /// Standard error of the dead time in seconds; 0 if it was given.
    #[getter]
    fn dead_time_std(&self) -> f64 {
        self.found.standard_errors.dead_time
    }

    /// Standard error of the lag in seconds.
    #[getter]
    fn lag_std(&self) -> f64 {
        self.found.standard_errors.lag
    }

    /// Standard errors of the searched amplitudes of creep.
    #[getter]
    fn creep_std<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.found.standard_errors.creep.iter().copied())
    }

    /// The names of what was estimated, in the order of `covariance`: the gain first.
    #[getter]
    fn parameters(&self) -> Vec<String> {
        self.found.covariance.parameters.clone()
    }

    /// The covariance of `parameters`: what was given or lies at a bound is left out.
    #[getter]
    fn covariance<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        Ok(PyArray2::from_vec2(py, &self.found.covariance.matrix)?)
    }

    /// Standard deviation of the measurement noise, estimated from the residuals, in the unit of the output.
    #[getter]
    fn noise(&self) -> f64 {
        self.found.noise
    }

    /// Whether the result deserves trust: "green", "amber" or "red", the worst of `warnings`.
    #[getter]
    #[py(-> "Literal['green', 'amber', 'red']")]
    fn verdict(&self) -> &'static str {
        self.found.verdict().name()
    }

    /// What makes the numbers doubtful; empty if nothing does.
    #[getter]
    fn warnings(&self) -> Vec<Finding> {
        self.found.warnings.iter().cloned().map(Finding::from).collect()
    }

    /// The errors over the fitted samples.
    #[getter]
    fn fit(&self) -> Quality {
        self.found.fit.into()
    }

    /// How many passes over the record the search took.
    #[getter]
    fn evaluations(&self) -> usize {
        self.found.evaluations
    }

    /// The output for the input `u` of the whole cascade, from the virgin state and at rest at its first value.
    fn predict<'py>(&self, py: Python<'py>, u: PyReadonlyArray1<'py, f64>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let predicted = self.found.predict(u.as_slice()?);
        predicted.map(|y| PyArray1::from_vec(py, y)).map_err(|error| one_record(error, None))
    }

    #[classmethod]
    fn _restored(_: &Bound<'_, PyType>, model: &Bound<'_, PyAny>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        let mut found: identification::DynamicsIdentification = depythonize(values)?;
        found.model = compiled_of("model", model)?;
        Ok(Self { found, model: model.clone().unbind() })
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        reduce(make, (&self.model, pythonize(py, &self.found)?), keywords!(py), None)
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        let dynamics = self.dynamics(py)?.into_pyobject(py)?.repr()?;
        let warnings: Vec<_> = self.found.warnings.iter().map(|warning| warning.code.name()).collect();
        let (dead_time, fit) = (self.found.dead_time, self.fit().__repr__());
        Ok(format!(
            "<DynamicsIdentification: {dynamics}, dead time {dead_time:.3e} s, warnings {warnings:?}, fit {fit}>"
        ))
    }
}

/// Fits the linear part behind a known hysteresis model to a measured record: the cascade of Remark 1 of the paper.
///
/// y = output_offset + gain G[creep[v]], v = model.forward().run(u), G of second order or a first-order lag, with a
/// dead time, discretised exactly. y[k] is read at the moment at which u[k] is put out. v is at rest at its first value
/// before the record, so start a step record a sample or more before the step.
///
/// Parameters
/// ----------
/// u, y : arrays of n floats
///     Input (V) and measured output (um): a chirp or a step that reaches the resonance.
/// model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///     From a slow record, by `identify`.
/// dt : float
///     Sampling interval in seconds.
/// order : 2 or 1
///     Second-order dynamics or a first-order lag. Searched up to half the sampling rate.
/// dead_time : "fit" or float
///     What y lags u besides, in seconds: searched up to a tenth of the record.
/// creep : None, "auto", int or array
///     Log-type creep with one amplitude, so many terms a decade apart, or these time constants in seconds.
/// skip : int
///     Leading samples that set the memory but are not fitted.
///
/// Returns
/// -------
/// DynamicsIdentification
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> model = mh.paper.table_1_recovered()
/// >>> u = np.where(np.arange(500) < 10, 0.0, 400.0)  # V, a step
/// >>> y = mh.plant.SecondOrder(800.0, 0.05).response(model.forward().run(u), dt=1e-4)  # um, a record: yours is measured
/// >>> found = mh.identify_dynamics(u, y, model, dt=1e-4)
/// >>> round(found.dynamics.frequency, 3), round(found.dynamics.damping, 5), found.warnings
/// (800.0, 0.05, [])
#[function]
#[gather(options: DynamicsOptions = DynamicsOptions::new(dt))]
pub(crate) fn identify_dynamics(
    py: Python<'_>,
    #[py("ArrayLike")] u: &Bound<'_, PyAny>,
    #[py("ArrayLike")] y: &Bound<'_, PyAny>,
    #[py("Model")] model: &Bound<'_, PyAny>,
    #[py(*)] dt: f64,
    #[py(field = 2)] order: Order,
    #[py(field = "fit")] dead_time: DeadTime,
    #[py(field = None)] creep: CreepModel,
    #[py(= 0)] skip: SampleCount,
) -> PyResult<DynamicsIdentification> {
    let compiled = compiled_of("model", model)?;
    // A copy: other threads may change the arrays while the interpreter is let go.
    let (u, y) = (numbers("u", u)?, numbers("y", y)?);
    check_room("u", u.len(), FIT)?;
    // There is one record: it needs no number.
    let alone = |error| one_record(error, None);
    let record = Record::new(&u, &y, skip.0).map_err(alone)?;
    let mut watch = Watch::new(None);
    let found = py.detach(|| identification::identify_dynamics(&record, &compiled, &options, &mut || watch.look(())));
    watch.check()?;
    let found = found.map_err(|error| errors::of_records(error, 1))?;
    Ok(DynamicsIdentification { found, model: model.clone().unbind() })
}

/// A dead time in seconds, or "fit".
struct DeadTime(Setting<f64>);

impl From<DeadTime> for Setting<f64> {
    fn from(DeadTime(dead_time): DeadTime) -> Self {
        dead_time
    }
}

#[py("Literal['fit'] | float")]
impl Argument<'_> for DeadTime {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        setting(name, "\"fit\" or a number of seconds", value).map(Self)
    }
}
