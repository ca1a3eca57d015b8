//! What is left of the identification of many actuators.

use hysteresis_core::{self as core, Model, Offsets, Ratios};
use hysteresis_identify::{self as identification, ActuatorFit, Error, ManyIdentifications as Found, Setting, Verdict};
use hysteresis_python_macros::methods;
use numpy::ndarray::Array2;
use numpy::{IntoPyArray, PyArray1, PyArray2};
use pyo3::exceptions::{PyIndexError, PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use serde::{Deserialize, Serialize};

use crate::argument::Words;
use crate::convert::errors::{self, raise, record};
use crate::model::models::{compiled_if_model, object};
use crate::stream::actuators::ActuatorArray;

/// So many actuators with red fits are named in a warning.
const MOST_NAMED: usize = 5;

/// Identified actuators: made by `identify_many`.
///
/// `found[i]` is the model of actuator i. Arrays have a row or a number for each of M actuators; those of an actuator
/// that could not be fitted are NaN, and `errors` says why. It is small: some numbers for each operator of each
/// actuator.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> import numpy as np
/// >>> u = mh.signals.decaying_triangle(500.0, 1.0, cycles=8, rate=100)
/// >>> y = mh.paper.table_1_recovered().forward().run(u)
/// >>> found = mh.identify_many(u, np.column_stack([y, 1.2 * y]), dt=0.01, weights="quadratic", smoothness=0.0)
/// >>> found.verdicts, len(found), found[1].operators
/// (['green', 'green'], 2, 20)
#[pyclass(module = "mpi_hyst.results", frozen, skip_from_py_object)]
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct ManyIdentifications {
    pub(super) is_modified: bool,
    pub(super) law: String,
    pub(super) smoothness: f64,
    pub(super) dt: Option<f64>,
    pub(super) actuators: usize,
    /// One number for each operator of each actuator.
    pub(super) weights: Vec<f64>,
    pub(super) weights_negative: Vec<f64>,
    pub(super) thresholds: Vec<f64>,
    /// Three for each actuator.
    pub(super) ratios: Vec<f64>,
    /// One for each actuator.
    pub(super) input_offsets: Vec<f64>,
    pub(super) output_offsets: Vec<f64>,
    pub(super) dead_times: Vec<f64>,
    pub(super) rmse: Vec<f64>,
    pub(super) max_errors: Vec<f64>,
    pub(super) ranges: Vec<f64>,
    pub(super) noise: Vec<f64>,
    pub(super) findings: Vec<Vec<(String, String, f64)>>,
    /// Which actuators could not be fitted, and why.
    pub(super) errors: Vec<(usize, String)>,
}

impl ManyIdentifications {
    pub(super) fn len(&self) -> usize {
        self.actuators
    }

    fn operator_count(&self) -> usize {
        self.weights.len() / self.actuators
    }

    fn reason_of(&self, actuator: usize) -> Option<&str> {
        self.errors.iter().find(|(place, _)| *place == actuator).map(|(_, reason)| reason.as_str())
    }

    /// The model of an actuator that was fitted.
    fn model_of(&self, actuator: usize) -> Result<Model, core::Error> {
        let n = self.operator_count();
        let of = |values: &[f64]| values[actuator * n..(actuator + 1) * n].to_vec();
        let (weights, thresholds) = (of(&self.weights), of(&self.thresholds));
        let offsets = Offsets { input: self.input_offsets[actuator], output: self.output_offsets[actuator] };
        if !self.is_modified {
            return Ok(core::PrandtlIshlinskii::new(&weights, &thresholds, offsets)?.into());
        }
        let [ra, rb, rc] = [0, 1, 2].map(|i| self.ratios[3 * actuator + i]);
        let model =
            core::ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios { ra, rb, rc }, offsets)?;
        Ok(model.with_negative_weights(&of(&self.weights_negative))?.into())
    }

    fn object(&self, py: Python<'_>, actuator: usize) -> PyResult<Py<PyAny>> {
        match self.reason_of(actuator) {
            Some(reason) => Err(PyValueError::new_err(reason.to_owned())),
            None => object(py, self.model_of(actuator).map_err(raise)?),
        }
    }

    fn rows<'py>(&self, py: Python<'py>, values: &[f64]) -> Bound<'py, PyArray2<f64>> {
        let shape = (self.actuators, values.len() / self.actuators);
        Array2::from_shape_vec(shape, values.to_vec()).expect("whole rows").into_pyarray(py)
    }

    /// Names the fits that an array takes although they are red; None if there are none.
    fn red_fits(&self) -> Option<String> {
        let is_red =
            |actuator: &usize| self.reason_of(*actuator).is_none() && self.verdict_of(*actuator) == Verdict::Red;
        let red: Vec<usize> = (0..self.actuators).filter(is_red).collect();
        let codes = |actuator: usize| {
            let found = self.findings[actuator].iter().filter(|(_, severity, _)| severity == Verdict::Red.name());
            found.map(|(code, ..)| code.as_str()).collect::<Vec<_>>().join(", ")
        };
        let named = red.iter().take(MOST_NAMED).map(|actuator| format!("{actuator} ({})", codes(*actuator)));
        let mut named = named.collect::<Vec<_>>().join(", ");
        if red.len() > MOST_NAMED {
            named.push_str(", ...");
        }
        let (count, all) = (red.len(), self.actuators);
        (count > 0).then(|| format!("{count} of {all} actuators have red fits, which are not to be used: {named}"))
    }

    fn verdict_of(&self, actuator: usize) -> Verdict {
        if self.reason_of(actuator).is_some() {
            return Verdict::Red;
        }
        let is = |name: &str| self.findings[actuator].iter().any(|(_, severity, _)| severity == name);
        [Verdict::Red, Verdict::Amber].into_iter().find(|verdict| is(verdict.name())).unwrap_or(Verdict::Green)
    }
}

/// Bits, so that what could not be fitted is equal to its copy.
fn same(one: &[f64], other: &[f64]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(p, q)| p.to_bits() == q.to_bits())
}

#[methods]
impl ManyIdentifications {
    /// The weights w_i, an array of shape (M, n); of split models those above zero.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.rows(py, &self.weights)
    }

    /// The weights v_i below zero, an array of shape (M, n): those of `weights` unless the models are split.
    #[getter]
    fn weights_negative<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.rows(py, &self.weights_negative)
    }

    /// The thresholds r_i, an array of shape (M, n), in the unit of the input. They move with the input offset.
    #[getter]
    fn thresholds<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.rows(py, &self.thresholds)
    }

    /// ra/r, rb/r and rc/r, an array of shape (M, 3).
    #[getter]
    fn ratios<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray2<f64>> {
        self.rows(py, &self.ratios)
    }

    /// The input offsets, in the unit of the input.
    #[getter]
    fn input_offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.input_offsets)
    }

    /// The output offsets, in the unit of the output.
    #[getter]
    fn output_offsets<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.output_offsets)
    }

    /// What each position lags its drive, in seconds; in samples where no dt was given.
    #[getter]
    fn dead_times<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.dead_times)
    }

    /// Root mean square errors over the fitted samples, in the unit of the output.
    #[getter]
    fn rmse<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.rmse)
    }

    /// `rmse` over the peak-to-peak of each measured position.
    #[getter]
    fn nrmse<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.rmse.iter().zip(&self.ranges).map(|(rmse, range)| rmse / range))
    }

    /// Largest absolute errors, in the unit of the output.
    #[getter]
    fn max_errors<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.max_errors)
    }

    /// Standard deviations of the noise, from the residuals, in the unit of the output.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, &self.noise)
    }

    /// Whether each result deserves trust: "green", "amber" or "red", the worst of its findings; "red" for one that
    /// could not be fitted.
    #[getter]
    #[py(-> "list[Literal['green', 'amber', 'red']]")]
    fn verdicts(&self) -> Vec<&'static str> {
        (0..self.actuators).map(|actuator| self.verdict_of(actuator).name()).collect()
    }

    /// What makes records or results doubtful: for each actuator a list of (code, severity, value). docs/findings.md
    /// explains the codes; `mpi_hyst.diagnose` of one actuator says more.
    #[getter]
    #[py(-> "list[list[tuple[str, Literal['amber', 'red'], float]]]")]
    fn findings(&self) -> Vec<Vec<(String, String, f64)>> {
        self.findings.clone()
    }

    /// The actuators that could not be fitted, each with the reason.
    #[getter]
    #[py(-> "dict[int, str]")]
    fn errors<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let errors = PyDict::new(py);
        for (place, reason) in &self.errors {
            errors.set_item(place, reason)?;
        }
        Ok(errors)
    }

    /// What the weights may be: as given, or as cross-validation chose for all actuators.
    #[getter]
    #[py(-> "Literal['free', 'quadratic', 'split']")]
    fn weights_law(&self) -> &str {
        &self.law
    }

    /// How smooth the weights were asked to be: as given, or as cross-validation chose for all actuators.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.smoothness
    }

    /// How many operators each model has.
    #[getter]
    fn operators(&self) -> usize {
        self.operator_count()
    }

    /// The sampling interval in seconds, or None.
    #[getter]
    fn dt(&self) -> Option<f64> {
        self.dt
    }

    /// The model of each actuator; None for one that could not be fitted.
    #[py(-> "list[Model | None]")]
    fn models(&self, py: Python<'_>) -> PyResult<Vec<Option<Py<PyAny>>>> {
        let model = |actuator| match self.reason_of(actuator) {
            Some(_) => Ok(None),
            None => self.object(py, actuator).map(Some),
        };
        (0..self.actuators).map(model).collect()
    }

    /// The models as one array of actuators, which runs forward or inverse.
    ///
    /// `missing` is a model that takes the place of those that could not be fitted. Without one, these raise ValueError
    /// that names the first. Red fits are taken as they are, and a UserWarning names them.
    fn actuator_array(
        &self,
        py: Python<'_>,
        #[py("Model | None" = None)] missing: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<ActuatorArray> {
        if let Some(missing) = missing.filter(|missing| compiled_if_model(missing).is_none()) {
            return Err(errors::unexpected("missing", "a PrandtlIshlinskii or ModifiedPrandtlIshlinskii", missing));
        }
        let model = |actuator| match (self.reason_of(actuator), missing) {
            (Some(_), Some(missing)) => Ok(missing.clone().unbind()),
            (Some(reason), None) => {
                Err(PyValueError::new_err(format!("{reason}: give `missing`, a model that takes its place")))
            }
            (None, _) => self.object(py, actuator),
        };
        let models = (0..self.actuators).map(model).collect::<PyResult<Vec<_>>>()?;
        if let Some(red) = self.red_fits() {
            errors::warn(py, &red)?;
        }
        ActuatorArray::new(PyList::new(py, models)?.as_any())
    }

    /// The model of one actuator. Raises ValueError for one that could not be fitted.
    #[py(-> "Model")]
    fn __getitem__(&self, py: Python<'_>, #[py("int", /)] actuator: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
        let Ok(index) = actuator.extract::<isize>() else {
            return Err(PyTypeError::new_err("actuators are counted by whole numbers"));
        };
        let counted = if index < 0 { index.checked_add_unsigned(self.actuators) } else { Some(index) };
        match counted.and_then(|index| usize::try_from(index).ok()).filter(|index| *index < self.actuators) {
            Some(index) => self.object(py, index),
            None => Err(PyIndexError::new_err(format!("actuator {index} of {}", self.actuators))),
        }
    }

    fn __len__(&self) -> usize {
        self.actuators
    }

    fn __eq__(&self, other: &Self) -> bool {
        let plain =
            |all: &Self| (all.is_modified, all.actuators, all.law.clone(), all.errors.clone(), all.findings.clone());
        let numbers = |all: &Self| {
            let kept = [
                &all.weights,
                &all.weights_negative,
                &all.thresholds,
                &all.ratios,
                &all.input_offsets,
                &all.output_offsets,
                &all.dead_times,
                &all.rmse,
                &all.max_errors,
                &all.ranges,
                &all.noise,
            ];
            kept.into_iter().flatten().copied().chain([all.smoothness]).chain(all.dt).collect::<Vec<f64>>()
        };
        plain(self) == plain(other) && same(&numbers(self), &numbers(other))
    }

    fn __repr__(&self) -> String {
        let count = |verdict| (0..self.actuators).filter(|actuator| self.verdict_of(*actuator) == verdict).count();
        let [green, amber, red] = [Verdict::Green, Verdict::Amber, Verdict::Red].map(count);
        let failed = match self.errors.len() {
            0 => String::new(),
            failed => format!(", {failed} of them not fitted"),
        };
        format!(
            "<ManyIdentifications of {} actuators, {} operators: {green} green, {amber} amber, {red} red{failed}>",
            self.actuators,
            self.operator_count(),
        )
    }
}

/// The operators of a model, as arrays.
struct Parts {
    weights: Vec<f64>,
    weights_negative: Vec<f64>,
    thresholds: Vec<f64>,
    offsets: Offsets,
}

impl Parts {
    fn of(model: &Model) -> Self {
        match model {
            Model::Conventional(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights().to_vec(),
                thresholds: model.operators().iter().map(core::Play::r).collect(),
                offsets: model.offsets(),
            },
            Model::Modified(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights_negative().to_vec(),
                thresholds: model.operators().iter().map(core::CoupledPlay::r).collect(),
                offsets: model.offsets(),
            },
        }
    }
}

impl ManyIdentifications {
    /// What was found in one call.
    pub(super) fn new(found: &Found, dt: Option<f64>) -> Self {
        let options = &found.options;
        let smoothness = match options.smoothness {
            Setting::Fixed(smoothness) => smoothness,
            Setting::Fit => 0.0,
        };
        let mut all =
            Self::empty(options.model == identification::ModelKind::Modified, options.weights.word(), smoothness, dt);
        for (place, fit) in found.actuators.iter().enumerate() {
            all.push(place, fit, options.operators());
        }
        all
    }

    fn empty(is_modified: bool, law: &str, smoothness: f64, dt: Option<f64>) -> Self {
        Self {
            is_modified,
            law: law.to_owned(),
            smoothness,
            dt,
            actuators: 0,
            weights: Vec::new(),
            weights_negative: Vec::new(),
            thresholds: Vec::new(),
            ratios: Vec::new(),
            input_offsets: Vec::new(),
            output_offsets: Vec::new(),
            dead_times: Vec::new(),
            rmse: Vec::new(),
            max_errors: Vec::new(),
            ranges: Vec::new(),
            noise: Vec::new(),
            findings: Vec::new(),
            errors: Vec::new(),
        }
    }

    fn push(&mut self, place: usize, fit: &Result<ActuatorFit, Error>, operators: usize) {
        self.actuators += 1;
        let nothing = || vec![f64::NAN; operators];
        let (parts, numbers, findings) = match fit {
            Ok(fit) => {
                let Ratios { ra, rb, rc } = fit.ratios;
                let brief = |found: &identification::BriefFinding| {
                    (found.code.name().to_owned(), found.severity.name().to_owned(), found.value)
                };
                let numbers = [ra, rb, rc, fit.dead_time, fit.rmse, fit.max_error, fit.range, fit.noise];
                (Parts::of(&fit.model), numbers, fit.findings.iter().map(brief).collect())
            }
            Err(error) => {
                self.errors.push((place, reason(place, *error)));
                let offsets = Offsets { input: f64::NAN, output: f64::NAN };
                let parts = Parts { weights: nothing(), weights_negative: nothing(), thresholds: nothing(), offsets };
                (parts, [f64::NAN; 8], Vec::new())
            }
        };
        self.weights.extend(parts.weights);
        self.weights_negative.extend(parts.weights_negative);
        self.thresholds.extend(parts.thresholds);
        self.input_offsets.push(parts.offsets.input);
        self.output_offsets.push(parts.offsets.output);
        let [ra, rb, rc, dead_time, rmse, max_error, range, noise] = numbers;
        self.ratios.extend([ra, rb, rc]);
        self.dead_times.push(dead_time);
        self.rmse.push(rmse);
        self.max_errors.push(max_error);
        self.ranges.push(range);
        self.noise.push(noise);
        self.findings.push(findings);
    }

    /// The same with the actuators of another result behind its own.
    pub(super) fn followed_by(mut self, other: &Self) -> Self {
        self.errors.extend(other.errors.iter().map(|(place, reason)| {
            let there = self.actuators + place;
            (there, reason.replacen(&named(*place), &named(there), 1))
        }));
        self.actuators += other.actuators;
        self.weights.extend(&other.weights);
        self.weights_negative.extend(&other.weights_negative);
        self.thresholds.extend(&other.thresholds);
        self.ratios.extend(&other.ratios);
        self.input_offsets.extend(&other.input_offsets);
        self.output_offsets.extend(&other.output_offsets);
        self.dead_times.extend(&other.dead_times);
        self.rmse.extend(&other.rmse);
        self.max_errors.extend(&other.max_errors);
        self.ranges.extend(&other.ranges);
        self.noise.extend(&other.noise);
        self.findings.extend(other.findings.iter().cloned());
        self
    }
}

fn named(actuator: usize) -> String {
    format!("actuator {actuator}: ")
}

/// Why an actuator could not be fitted, in the words of Python.
fn reason(actuator: usize, error: Error) -> String {
    match error {
        Error::Record { error, .. } => format!("{}{}", named(actuator), record(error)),
        error => format!("{}{error}", named(actuator)),
    }
}
