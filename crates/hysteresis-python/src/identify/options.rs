//! What the options of an identification may be.

use hysteresis_control::oscillator::tables;
use hysteresis_core::Ratios;
use hysteresis_identify::{
    AmplifierModel, CreepModel, DuhemModel, DuhemTable, DynamicsModel, LoopShiftModel, Loss, MapModel, ModelKind,
    ModesModel, Order, RatiosModel, RelaxingPlaysModel, Setting, SlowGainModel, Thresholds, WeightLaw,
};
use hysteresis_python_macros::py;
use pyo3::IntoPyObjectExt;
use pyo3::prelude::*;
use pyo3::types::PyString;

use crate::argument::{Argument, AsArgument, Words};
use crate::convert::arguments::{count, is_word, unknown};
use crate::convert::arrays::numbers;
use crate::convert::errors::{self, unexpected};
use crate::convert::objects::shared;
use crate::model::duhem::Duhem;

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

/// How many operators there are: `operators`.
#[derive(Clone, Copy)]
pub(super) enum Operators {
    Auto,
    Number(usize),
}

#[py("int | Literal['auto']")]
impl Argument<'_> for Operators {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") { Ok(Self::Auto) } else { count(name, value).map(Self::Number) }
    }
}

/// Where they are placed: `thresholds`.
pub(super) enum Placing {
    Uniform,
    Quantiles,
    Geometric,
    Given(Vec<f64>),
}

#[py("Literal['uniform', 'quantiles', 'geometric'] | ArrayLike")]
impl Argument<'_> for Placing {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let Ok(word) = value.cast::<PyString>() else { return numbers(name, value).map(Self::Given) };
        match word.to_str()? {
            "uniform" => Ok(Self::Uniform),
            "quantiles" => Ok(Self::Quantiles),
            "geometric" => Ok(Self::Geometric),
            other => unknown(name, "\"uniform\", \"quantiles\", \"geometric\" or an array", other),
        }
    }
}

/// The operators with thresholds as given, or that many with uniform ones; as many as the records ask for without a
/// number.
pub(super) fn placed(thresholds: Option<Placing>, operators: Option<Operators>) -> PyResult<Thresholds> {
    let (refined, auto) = match thresholds {
        None | Some(Placing::Uniform) => (Thresholds::Refined, Thresholds::Auto),
        Some(Placing::Quantiles) => (Thresholds::RefinedQuantiles, Thresholds::AutoQuantiles),
        Some(Placing::Geometric) => (Thresholds::RefinedGeometric, Thresholds::AutoGeometric),
        Some(Placing::Given(thresholds)) => return given(thresholds, operators),
    };
    Ok(match operators {
        None => refined,
        Some(Operators::Auto) => auto,
        Some(Operators::Number(operators)) => refined.of(operators),
    })
}

fn given(thresholds: Vec<f64>, operators: Option<Operators>) -> PyResult<Thresholds> {
    match operators {
        Some(Operators::Auto) => {
            let error = "expected a number with thresholds that are given, got \"auto\"";
            Err(errors::value("operators", error))
        }
        Some(Operators::Number(operators)) if operators != thresholds.len() => {
            let expected = format!("{}, one for each of the thresholds", thresholds.len());
            Err(errors::value("operators", format_args!("expected {expected}, got {operators}")))
        }
        _ => Ok(Thresholds::Given(thresholds)),
    }
}

#[py("Literal['fit'] | float")]
impl Argument<'_> for Setting<f64> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        setting(name, "\"fit\" or a number", value)
    }
}

impl<'py> AsArgument<'py> for Setting<f64> {
    fn as_argument(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        match self {
            Setting::Fit => "fit".into_bound_py_any(py),
            Setting::Fixed(number) => number.into_bound_py_any(py),
        }
    }
}

#[py("Literal['fit'] | tuple[float, float, float]")]
impl Argument<'_> for Setting<Ratios> {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        ratios(name, "\"fit\" or three numbers (ra, rb, rc)", value)
    }
}

#[py("Literal['auto', 'fit'] | tuple[float, float, float]")]
impl Argument<'_> for RatiosModel {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if is_word(value, "auto") {
            return Ok(Self::Auto);
        }
        ratios(name, "\"auto\", \"fit\" or three numbers (ra, rb, rc)", value).map(Self::from)
    }
}

fn ratios(name: &str, expected: &str, value: &Bound<'_, PyAny>) -> PyResult<Setting<Ratios>> {
    match setting::<(f64, f64, f64)>(name, expected, value)? {
        Setting::Fixed((ra, rb, rc)) => Ok(Setting::Fixed(Ratios { ra, rb, rc })),
        Setting::Fit => Ok(Setting::Fit),
    }
}

/// "fit", or a value that is held.
pub(super) fn setting<'py, T: FromPyObjectOwned<'py>>(
    name: &str,
    expected: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<Setting<T>> {
    if is_word(value, "fit") {
        return Ok(Setting::Fit);
    }
    match value.extract::<T>() {
        Ok(value) => Ok(Setting::Fixed(value)),
        Err(_) => Err(unexpected(name, expected, value)),
    }
}

/// How smooth the weights should be.
pub(super) struct Smoothness(Setting<f64>);

impl From<Smoothness> for Setting<f64> {
    fn from(Smoothness(smoothness): Smoothness) -> Self {
        smoothness
    }
}

#[py("Literal['auto'] | float")]
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

#[py("Literal['auto', 1, 2] | None")]
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

#[py("Literal['auto', 1, 2, 3]")]
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

#[py("Literal[1, 2]")]
impl Argument<'_> for Order {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        order(name, "1 or 2", value)
    }
}

fn order(name: &str, expected: &str, order: &Bound<'_, PyAny>) -> PyResult<Order> {
    match order.extract::<i64>() {
        Ok(1) => Ok(Order::First),
        Ok(2) => Ok(Order::Second),
        Ok(order) => Err(errors::value(name, format_args!("expected {expected}, got {order}"))),
        Err(_) => Err(unexpected(name, expected, order)),
    }
}

/// What None or a word stands for; none where it is neither.
fn of_word<T, const N: usize>(value: &Bound<'_, PyAny>, none: T, words: [(&str, T); N]) -> Option<T> {
    if value.is_none() {
        return Some(none);
    }
    words.into_iter().find(|(word, _)| is_word(value, word)).map(|(_, model)| model)
}

#[py("Literal['auto', 'log'] | int | ArrayLike | None")]
impl Argument<'_> for CreepModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let log = Self::Logarithmic { terms: None };
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto), ("log", log)]) {
            return Ok(model);
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

#[py("Literal['auto'] | float | None")]
impl Argument<'_> for LoopShiftModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto)]) {
            return Ok(model);
        }
        match value.extract() {
            Ok(time_constant) => Ok(Self::Both(time_constant)),
            Err(_) => Err(unexpected(name, "None, \"auto\" or a time constant in seconds", value)),
        }
    }
}

#[py("Literal['auto', 'fit'] | float | None")]
impl Argument<'_> for SlowGainModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto), ("fit", Self::Fit)]) {
            return Ok(model);
        }
        match value.extract() {
            Ok(time_constant) => Ok(Self::TimeConstant(time_constant)),
            Err(_) => Err(unexpected(name, "None, \"auto\", \"fit\" or a time constant in seconds", value)),
        }
    }
}

#[py("Literal['auto', 'fit'] | float | ArrayLike | None")]
impl Argument<'_> for RelaxingPlaysModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto), ("fit", Self::Fit)]) {
            return Ok(model);
        }
        if value.is_instance_of::<PyString>() {
            return Err(unexpected(name, "None, \"auto\", \"fit\" or time constants in seconds", value));
        }
        let one = value.extract().map(|time_constant| vec![time_constant]);
        Ok(Self::TimeConstants(one.or_else(|_| numbers(name, value))?))
    }
}

#[py("Literal['auto', 'fit'] | Duhem | None")]
impl Argument<'_> for DuhemModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto), ("fit", Self::Fit)]) {
            return Ok(model);
        }
        let duhem =
            value.cast::<Duhem>().map_err(|_| unexpected(name, "None, \"auto\", \"fit\" or a mh.Duhem", value))?;
        let [knots, rising, falling] = tables(shared(duhem)?.0.duhem());
        Ok(Self::Near(DuhemTable { knots, rising, falling }))
    }
}

#[py("Literal['auto'] | float | None")]
impl Argument<'_> for AmplifierModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Some(model) = of_word(value, Self::None, [("auto", Self::Auto)]) {
            return Ok(model);
        }
        match value.extract() {
            Ok(bandwidth) => Ok(Self::Bandwidth(bandwidth)),
            Err(_) => Err(unexpected(name, "None, \"auto\" or a bandwidth in Hz", value)),
        }
    }
}

#[py("Literal['auto', 'smooth'] | None")]
impl Argument<'_> for MapModel {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        let known = of_word(value, Self::None, [("auto", Self::Auto), ("smooth", Self::Smooth)]);
        known.ok_or_else(|| unexpected(name, "None, \"auto\" or \"smooth\"", value))
    }
}

/// The name of a loop shift, with its time constant.
pub(super) fn loop_shift_name(shift: LoopShiftModel) -> String {
    match shift {
        LoopShiftModel::None => "none".to_owned(),
        LoopShiftModel::Auto => "auto".to_owned(),
        LoopShiftModel::Square(tau) => format!("c_1, {tau} s"),
        LoopShiftModel::Both(tau) => format!("c_1 and c_2, {tau} s"),
    }
}
