//! What the arguments of `identify` may be.

use hysteresis_identify::{Form, Setting, Thresholds, Weights};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::arguments::count;
use crate::arrays::vector;

pub(crate) fn form(model: &str) -> PyResult<Form> {
    match model {
        "modified" => Ok(Form::Modified),
        "conventional" => Ok(Form::Conventional),
        _ => Err(PyValueError::new_err(format!("model: expected \"modified\" or \"conventional\", got \"{model}\""))),
    }
}

pub(crate) fn law(weights: &str) -> PyResult<Weights> {
    match weights {
        "auto" => Ok(Weights::Auto),
        "free" => Ok(Weights::Free),
        "quadratic" => Ok(Weights::Quadratic),
        "split" => Ok(Weights::Split),
        _ => Err(PyValueError::new_err(format!(
            "weights: expected \"auto\", \"free\", \"quadratic\" or \"split\", got \"{weights}\""
        ))),
    }
}

pub(crate) fn law_name(weights: Weights) -> &'static str {
    match weights {
        Weights::Auto => "auto",
        Weights::Free => "free",
        Weights::Quadratic => "quadratic",
        Weights::Split => "split",
    }
}

/// The operators with thresholds as given, or that many with uniform ones: 20 unless told.
pub(crate) fn placed(
    thresholds: Option<&Bound<'_, PyAny>>,
    operators: Option<&Bound<'_, PyAny>>,
) -> PyResult<Thresholds> {
    let auto = operators.is_some_and(|operators| operators.cast::<PyString>().is_ok_and(|name| *name == "auto"));
    let named = |wanted: &str| thresholds.is_some_and(|name| name.cast::<PyString>().is_ok_and(|name| *name == wanted));
    if auto && (thresholds.is_none() || named("uniform")) {
        return Ok(Thresholds::Auto);
    }
    if auto && named("quantiles") {
        return Ok(Thresholds::AutoQuantiles);
    }
    if auto && thresholds.is_some_and(|thresholds| !thresholds.is_instance_of::<PyString>()) {
        let error = "operators: expected a number with thresholds that are given, got \"auto\"";
        return Err(PyValueError::new_err(error));
    }
    let operators = operators.filter(|_| !auto);
    let operators = operators.map(|operators| count("operators", operators)).transpose()?;
    let count = operators.unwrap_or(20);
    let Some(thresholds) = thresholds else { return Ok(Thresholds::Uniform(count)) };
    if let Ok(name) = thresholds.cast::<PyString>() {
        return match name.to_str()? {
            "uniform" => Ok(Thresholds::Uniform(count)),
            "quantiles" => Ok(Thresholds::Quantiles(count)),
            other => Err(PyValueError::new_err(format!(
                "thresholds: expected \"uniform\", \"quantiles\" or an array, got \"{other}\""
            ))),
        };
    }
    let thresholds = vector("thresholds", thresholds)?.as_slice()?.to_vec();
    match operators {
        Some(operators) if operators != thresholds.len() => Err(PyValueError::new_err(format!(
            "operators: expected {}, one for each of the thresholds, got {operators}",
            thresholds.len()
        ))),
        _ => Ok(Thresholds::Given(thresholds)),
    }
}

/// A number, 0 unless told, or "auto".
pub(crate) fn smooth(value: Option<&Bound<'_, PyAny>>) -> PyResult<Setting<f64>> {
    let Some(value) = value else { return Ok(Setting::Fixed(0.0)) };
    if value.cast::<PyString>().is_ok_and(|text| *text == "auto") {
        return Ok(Setting::Fit);
    }
    if let Ok(smoothness) = value.extract::<f64>() {
        return Ok(Setting::Fixed(smoothness));
    }
    let got = value.repr()?;
    Err(PyTypeError::new_err(format!("smoothness: expected a number >= 0 or \"auto\", got {got}")))
}

/// "fit", or a value.
pub(crate) fn setting<'py, T: FromPyObjectOwned<'py>>(
    name: &str,
    expected: &str,
    value: Option<&Bound<'py, PyAny>>,
) -> PyResult<Setting<T>> {
    let Some(value) = value else { return Ok(Setting::Fit) };
    if value.cast::<PyString>().is_ok_and(|text| *text == "fit") {
        return Ok(Setting::Fit);
    }
    let wrong = || {
        Ok::<_, PyErr>(PyTypeError::new_err(format!("{name}: expected \"fit\" or {expected}, got {}", value.repr()?)))
    };
    match value.extract::<T>() {
        Ok(value) => Ok(Setting::Fixed(value)),
        Err(_) => Err(wrong()?),
    }
}
