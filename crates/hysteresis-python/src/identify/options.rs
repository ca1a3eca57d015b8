//! What the options of an identification may be.

use hysteresis_core::Ratios;
use hysteresis_identify::{
    AmplifierModel, CreepModel, DynamicsModel, LoopShiftModel, Loss, MapModel, ModelKind, ModesModel, Order, Setting,
    Thresholds, WeightLaw,
};
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::argument::{Argument, Words};
use crate::convert::arguments::{count, is_word};
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, unexpected};

impl Words for ModelKind {
    const WORDS: &'static [(&'static str, Self)] =
        &[("modified", Self::Modified), ("conventional", Self::Conventional)];
}

impl Words for WeightLaw {
    const WORDS: &'static [(&'static str, Self)] =
        &[("auto", Self::Auto), ("free", Self::Free), ("quadratic", Self::Quadratic), ("split", Self::Split)];
}

impl Words for Loss {
    const WORDS: &'static [(&'static str, Self)] =
        &[("auto", Self::Auto), ("squares", Self::Squares), ("robust", Self::Robust)];
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

impl Argument<'_> for Setting<f64> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        setting(name, "a number", value)
    }
}

impl Argument<'_> for Setting<Ratios> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        match setting::<(f64, f64, f64)>(name, "three numbers (ra, rb, rc)", value)? {
            Setting::Fixed((ra, rb, rc)) => Ok(Setting::Fixed(Ratios { ra, rb, rc })),
            Setting::Fit => Ok(Setting::Fit),
        }
    }
}

/// "fit", or a value that is held.
pub(crate) fn setting<'py, T: FromPyObjectOwned<'py>>(
    name: &str,
    expected: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Setting<T>> {
    if is_word(value, "fit") {
        return Ok(Setting::Fit);
    }
    match value.extract::<T>() {
        Ok(value) => Ok(Setting::Fixed(value)),
        Err(_) => Err(unexpected(name, format_args!("\"fit\" or {expected}"), value)),
    }
}

/// How smooth the weights should be.
pub(crate) struct Smoothness(pub(crate) Setting<f64>);

impl Argument<'_> for Smoothness {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") {
            return Ok(Self(Setting::Fit));
        }
        match value.extract() {
            Ok(smoothness) => Ok(Self(Setting::Fixed(smoothness))),
            Err(_) => Err(unexpected(name, "a number >= 0 or \"auto\"", value)),
        }
    }
}

impl Argument<'_> for DynamicsModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            Ok(Self::None)
        } else if is_word(value, "auto") {
            Ok(Self::Auto)
        } else {
            order(name, "None, \"auto\", 1 or 2", value).map(Self::Order)
        }
    }
}

impl Argument<'_> for ModesModel {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") {
            return Ok(Self::Auto);
        }
        match value.extract::<usize>() {
            Ok(number) => Ok(Self::Number(number)),
            Err(_) => Err(unexpected(name, "\"auto\", 1, 2 or 3", value)),
        }
    }
}

/// The order of dynamics.
pub(crate) fn order(name: &str, expected: &str, order: &Bound<'_, PyAny>) -> PyResult<Order> {
    match order.extract::<i64>() {
        Ok(1) => Ok(Order::First),
        Ok(2) => Ok(Order::Second),
        Ok(order) => Err(errors::value(name, format_args!("expected {expected}, got {order}"))),
        Err(_) => Err(unexpected(name, expected, order)),
    }
}

impl Argument<'_> for CreepModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(Self::None);
        }
        if is_word(value, "auto") {
            return Ok(Self::Auto);
        }
        if is_word(value, "log") {
            return Ok(Self::Logarithmic { terms: None });
        }
        if value.is_instance_of::<PyString>() {
            let expected = "None, \"auto\", \"log\", a number of terms, or their time constants";
            return Err(unexpected(name, expected, value));
        }
        match value.extract::<usize>() {
            Ok(terms) => Ok(Self::Decades(terms)),
            Err(_) => Ok(Self::TimeConstants(numbers(name, value)?)),
        }
    }
}

impl Argument<'_> for LoopShiftModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(Self::None);
        }
        if is_word(value, "auto") {
            return Ok(Self::Auto);
        }
        match value.extract() {
            Ok(time_constant) => Ok(Self::Both(time_constant)),
            Err(_) => Err(unexpected(name, "None, \"auto\" or a time constant in seconds", value)),
        }
    }
}

impl Argument<'_> for AmplifierModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(Self::None);
        }
        if is_word(value, "auto") {
            return Ok(Self::Auto);
        }
        match value.extract() {
            Ok(bandwidth) => Ok(Self::Bandwidth(bandwidth)),
            Err(_) => Err(unexpected(name, "None, \"auto\" or a bandwidth in Hz", value)),
        }
    }
}

impl Argument<'_> for MapModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            Ok(Self::None)
        } else if is_word(value, "auto") {
            Ok(Self::Auto)
        } else if is_word(value, "smooth") {
            Ok(Self::Smooth)
        } else {
            Err(unexpected(name, "None, \"auto\" or \"smooth\"", value))
        }
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
