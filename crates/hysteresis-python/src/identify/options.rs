//! What the arguments of `identify` may be.

use hysteresis_identify::{
    AmplifierModel, CreepModel, DynamicsModel, LoopShiftModel, Loss, MapModel, ModelKind, ModesModel, Order, Setting,
    Thresholds, WeightLaw,
};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::convert::arguments::{count, is_word, unknown, word};
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, unexpected};

pub(crate) fn kind(model: &Bound<'_, PyAny>) -> PyResult<ModelKind> {
    let expected = "\"modified\" or \"conventional\"";
    match word("model", expected, model)?.as_str() {
        "modified" => Ok(ModelKind::Modified),
        "conventional" => Ok(ModelKind::Conventional),
        got => unknown("model", expected, got),
    }
}

pub(crate) fn law(weights: &Bound<'_, PyAny>) -> PyResult<WeightLaw> {
    let expected = "\"auto\", \"free\", \"quadratic\" or \"split\"";
    match word("weights", expected, weights)?.as_str() {
        "auto" => Ok(WeightLaw::Auto),
        "free" => Ok(WeightLaw::Free),
        "quadratic" => Ok(WeightLaw::Quadratic),
        "split" => Ok(WeightLaw::Split),
        got => unknown("weights", expected, got),
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

pub(crate) fn loss(loss: &Bound<'_, PyAny>) -> PyResult<Loss> {
    let expected = "\"auto\", \"squares\" or \"robust\"";
    match word("loss", expected, loss)?.as_str() {
        "auto" => Ok(Loss::Auto),
        "squares" => Ok(Loss::Squares),
        "robust" => Ok(Loss::Robust),
        got => unknown("loss", expected, got),
    }
}

/// The operators with thresholds as given, or that many with uniform ones; as many as the records ask for without a number.
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
    if auto && named("geometric") {
        return Ok(Thresholds::AutoGeometric);
    }
    if auto && thresholds.is_some_and(|thresholds| !thresholds.is_instance_of::<PyString>()) {
        let error = "expected a number with thresholds that are given, got \"auto\"";
        return Err(errors::value("operators", error));
    }
    let operators = operators.filter(|_| !auto);
    let operators = operators.map(|operators| count("operators", operators)).transpose()?;
    let placed = |uniform: Thresholds| operators.map_or_else(|| uniform.clone(), |count| uniform.of(count));
    let Some(thresholds) = thresholds else { return Ok(placed(Thresholds::Refined)) };
    if let Ok(name) = thresholds.cast::<PyString>() {
        return match name.to_str()? {
            "uniform" => Ok(placed(Thresholds::Refined)),
            "quantiles" => Ok(placed(Thresholds::RefinedQuantiles)),
            "geometric" => Ok(placed(Thresholds::RefinedGeometric)),
            other => {
                let expected = "\"uniform\", \"quantiles\", \"geometric\" or an array";
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

/// A number, or "auto".
pub(crate) fn smooth(value: Option<&Bound<'_, PyAny>>) -> PyResult<Setting<f64>> {
    let Some(value) = value else { return Ok(Setting::Fit) };
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

/// The linear dynamics to fit: none, of second order, a lag, or as the records tell.
pub(crate) fn dynamics_model(dynamics: Option<&Bound<'_, PyAny>>) -> PyResult<DynamicsModel> {
    match dynamics {
        None => Ok(DynamicsModel::None),
        Some(dynamics) if is_word(dynamics, "auto") => Ok(DynamicsModel::Auto),
        Some(dynamics) => order("dynamics", "None, \"auto\", 1 or 2", dynamics).map(DynamicsModel::Order),
    }
}

/// How many modes: a number, or as the records tell.
pub(crate) fn modes_model(modes: &Bound<'_, PyAny>) -> PyResult<ModesModel> {
    if is_word(modes, "auto") {
        return Ok(ModesModel::Auto);
    }
    match modes.extract::<usize>() {
        Ok(number) => Ok(ModesModel::Number(number)),
        Err(_) => Err(unexpected("modes", "\"auto\", 1, 2 or 3", modes)),
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

/// The creep to fit: none, log-type, a number of terms, their time constants, or as the records tell.
pub(crate) fn creep_model(creep: Option<&Bound<'_, PyAny>>) -> PyResult<CreepModel> {
    let Some(creep) = creep else { return Ok(CreepModel::None) };
    if is_word(creep, "auto") {
        return Ok(CreepModel::Auto);
    }
    if is_word(creep, "log") {
        return Ok(CreepModel::Logarithmic { terms: None });
    }
    if creep.is_instance_of::<PyString>() {
        let expected = "None, \"auto\", \"log\", a number of terms, or their time constants";
        return Err(unexpected("creep", expected, creep));
    }
    match creep.extract::<usize>() {
        Ok(terms) => Ok(CreepModel::Decades(terms)),
        Err(_) => Ok(CreepModel::TimeConstants(numbers("creep", creep)?)),
    }
}

/// The loop shift to fit: none, of a time constant, or as the records tell.
pub(crate) fn loop_shift_model(shift: Option<&Bound<'_, PyAny>>) -> PyResult<LoopShiftModel> {
    match shift {
        None => Ok(LoopShiftModel::None),
        Some(shift) if is_word(shift, "auto") => Ok(LoopShiftModel::Auto),
        Some(shift) => match shift.extract() {
            Ok(time_constant) => Ok(LoopShiftModel::Both(time_constant)),
            Err(_) => Err(unexpected("loop_shift", "None, \"auto\" or a time constant in seconds", shift)),
        },
    }
}

/// The amplifier to fit: none, of a bandwidth, or as the records tell.
pub(crate) fn amplifier_model(amplifier: Option<&Bound<'_, PyAny>>) -> PyResult<AmplifierModel> {
    match amplifier {
        None => Ok(AmplifierModel::None),
        Some(amplifier) if is_word(amplifier, "auto") => Ok(AmplifierModel::Auto),
        Some(amplifier) => match amplifier.extract() {
            Ok(bandwidth) => Ok(AmplifierModel::Bandwidth(bandwidth)),
            Err(_) => Err(unexpected("amplifier", "None, \"auto\" or a bandwidth in Hz", amplifier)),
        },
    }
}

/// The map to fit, which the argument `name` is: none, a smooth one, or as the records tell.
pub(crate) fn map_model(name: &str, map: Option<&Bound<'_, PyAny>>) -> PyResult<MapModel> {
    match map {
        None => Ok(MapModel::None),
        Some(map) if is_word(map, "auto") => Ok(MapModel::Auto),
        Some(map) if is_word(map, "smooth") => Ok(MapModel::Smooth),
        Some(map) => Err(unexpected(name, "None, \"auto\" or \"smooth\"", map)),
    }
}

/// The name of a loop shift, with its time constant.
pub(crate) fn loop_shift_name(shift: LoopShiftModel) -> String {
    match shift {
        LoopShiftModel::None => "none".to_owned(),
        LoopShiftModel::Auto => "auto".to_owned(),
        LoopShiftModel::Square(tau) => format!("c_1, {tau} s"),
        LoopShiftModel::Both(tau) => format!("c_1 and c_2, {tau} s"),
    }
}
