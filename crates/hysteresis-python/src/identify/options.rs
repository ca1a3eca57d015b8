//! What the arguments of `identify` may be.

use hysteresis_identify::{CreepModel, ModelKind, Options, Order, Setting, Thresholds, WeightLaw};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::convert::arguments::{count, is_word};
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, unexpected};

pub(crate) fn kind(model: &str) -> PyResult<ModelKind> {
    match model {
        "modified" => Ok(ModelKind::Modified),
        "conventional" => Ok(ModelKind::Conventional),
        _ => Err(errors::value("model", format_args!("expected \"modified\" or \"conventional\", got \"{model}\""))),
    }
}

pub(crate) fn law(weights: &str) -> PyResult<WeightLaw> {
    match weights {
        "auto" => Ok(WeightLaw::Auto),
        "free" => Ok(WeightLaw::Free),
        "quadratic" => Ok(WeightLaw::Quadratic),
        "split" => Ok(WeightLaw::Split),
        _ => {
            let expected = "\"auto\", \"free\", \"quadratic\" or \"split\"";
            Err(errors::value("weights", format_args!("expected {expected}, got \"{weights}\"")))
        }
    }
}

pub(crate) fn law_name(weights: WeightLaw) -> &'static str {
    match weights {
        WeightLaw::Auto => "auto",
        WeightLaw::Free => "free",
        WeightLaw::Quadratic => "quadratic",
        WeightLaw::Split => "split",
    }
}

/// The operators with thresholds as given, or that many with uniform ones.
pub(crate) fn placed(
    thresholds: Option<&Bound<'_, PyAny>>,
    operators: Option<&Bound<'_, PyAny>>,
) -> PyResult<Thresholds> {
    let auto = operators.is_some_and(|operators| is_word(operators, "auto"));
    let named = |wanted: &str| thresholds.is_some_and(|name| is_word(name, wanted));
    if auto && (thresholds.is_none() || named("uniform")) {
        return Ok(Thresholds::Auto);
    }
    if auto && named("quantiles") {
        return Ok(Thresholds::AutoQuantiles);
    }
    if auto && thresholds.is_some_and(|thresholds| !thresholds.is_instance_of::<PyString>()) {
        let error = "expected a number with thresholds that are given, got \"auto\"";
        return Err(errors::value("operators", error));
    }
    let operators = operators.filter(|_| !auto);
    let operators = operators.map(|operators| count("operators", operators)).transpose()?;
    let count = operators.unwrap_or_else(|| Options::default().operators());
    let Some(thresholds) = thresholds else { return Ok(Thresholds::Uniform(count)) };
    if let Ok(name) = thresholds.cast::<PyString>() {
        return match name.to_str()? {
            "uniform" => Ok(Thresholds::Uniform(count)),
            "quantiles" => Ok(Thresholds::Quantiles(count)),
            other => {
                let expected = "\"uniform\", \"quantiles\" or an array";
                Err(errors::value("thresholds", format_args!("expected {expected}, got \"{other}\"")))
            }
        };
    }
    let thresholds = numbers("thresholds", thresholds)?;
    match operators {
        Some(operators) if operators != thresholds.len() => {
            let expected = format!("{}, one for each of the thresholds", thresholds.len());
            Err(errors::value("operators", format_args!("expected {expected}, got {operators}")))
        }
        _ => Ok(Thresholds::Given(thresholds)),
    }
}

/// A number, 0 unless told, or "auto".
pub(crate) fn smooth(value: Option<&Bound<'_, PyAny>>) -> PyResult<Setting<f64>> {
    let Some(value) = value else { return Ok(Setting::Fixed(0.0)) };
    if is_word(value, "auto") {
        return Ok(Setting::Fit);
    }
    match value.extract() {
        Ok(smoothness) => Ok(Setting::Fixed(smoothness)),
        Err(_) => Err(unexpected("smoothness", "a number >= 0 or \"auto\"", value)),
    }
}

/// "fit", or a value.
pub(crate) fn setting<'py, T: FromPyObjectOwned<'py>>(
    name: &str,
    expected: &str,
    value: Option<&Bound<'py, PyAny>>,
) -> PyResult<Setting<T>> {
    let Some(value) = value else { return Ok(Setting::Fit) };
    if is_word(value, "fit") {
        return Ok(Setting::Fit);
    }
    match value.extract::<T>() {
        Ok(value) => Ok(Setting::Fixed(value)),
        Err(_) => Err(unexpected(name, format_args!("\"fit\" or {expected}"), value)),
    }
}

/// The linear dynamics to fit: none, of second order, or a lag.
pub(crate) fn dynamics_order(dynamics: Option<&Bound<'_, PyAny>>) -> PyResult<Option<Order>> {
    match dynamics {
        None => Ok(None),
        Some(dynamics) if is_word(dynamics, "auto") => Ok(Some(Order::Second)),
        Some(dynamics) => order("dynamics", "None, \"auto\", 1 or 2", dynamics).map(Some),
    }
}

/// The order of linear dynamics, which the argument `name` is.
pub(crate) fn order(name: &str, expected: &str, order: &Bound<'_, PyAny>) -> PyResult<Order> {
    match order.extract::<i64>() {
        Ok(1) => Ok(Order::First),
        Ok(2) => Ok(Order::Second),
        Ok(order) => Err(errors::value(name, format_args!("expected {expected}, got {order}"))),
        Err(_) => Err(unexpected(name, expected, order)),
    }
}

/// The creep to fit: none, log-type, a number of terms, or their time constants.
pub(crate) fn creep_model(creep: Option<&Bound<'_, PyAny>>) -> PyResult<CreepModel> {
    let Some(creep) = creep else { return Ok(CreepModel::None) };
    if is_word(creep, "auto") {
        return Ok(CreepModel::Logarithmic { terms: None });
    }
    if creep.is_instance_of::<PyString>() {
        return Err(unexpected("creep", "None, \"auto\", a number of terms, or their time constants", creep));
    }
    match creep.extract::<usize>() {
        Ok(terms) => Ok(CreepModel::Decades(terms)),
        Err(_) => Ok(CreepModel::TimeConstants(numbers("creep", creep)?)),
    }
}
