//! The methods that both models have.

use std::path::PathBuf;

use hysteresis_core::{self as core, CompiledModel, Error, Method, Model};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use super::models::{ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
use crate::convert::arguments::{unknown, word};
use crate::convert::errors::raise;
use crate::convert::files::write_json;
use crate::stream::bracket::Bracket;
use crate::stream::streams::{Forward, Inverse, Made, method_name};

/// The forward model of `model`, compiled beforehand.
fn forward(
    model: &Bound<'_, PyAny>,
    compiled: &CompiledModel,
    initial: Option<Vec<f64>>,
    method: Option<&Bound<'_, PyAny>>,
) -> PyResult<Forward> {
    let method = method_asked_for(method, initial.is_some())?;
    let stream = initial
        .as_ref()
        .map_or_else(|| forward_at_rest(compiled, method), |initial| core::Forward::with_initial(compiled, initial));
    let made = Made { model: model.clone().unbind(), limits: None, initial, method };
    Ok(Forward { stream: stream.map_err(raise)?, made })
}

/// The exact inverse of `model`, compiled beforehand.
fn inverse(
    model: &Bound<'_, PyAny>,
    compiled: &CompiledModel,
    limits: Option<(f64, f64)>,
    initial: Option<Vec<f64>>,
    method: Option<&Bound<'_, PyAny>>,
) -> PyResult<Inverse> {
    let method = method_asked_for(method, initial.is_some())?;
    let stream = initial.as_ref().map_or_else(
        || inverse_at_rest(compiled, limits, method),
        |initial| core::Inverse::with_initial(compiled, limits, initial),
    );
    let made = Made { model: model.clone().unbind(), limits, initial, method };
    Ok(Inverse { stream: stream.map_err(raise)?, made })
}

/// The forward model at rest, by `method` if one is asked for.
pub(crate) fn forward_at_rest(compiled: &CompiledModel, method: Option<Method>) -> Result<core::Forward, Error> {
    let usual = || Ok(core::Forward::new(compiled));
    method.map_or_else(usual, |method| core::Forward::with_method(compiled, method))
}

/// The exact inverse at rest, by `method` if one is asked for.
pub(crate) fn inverse_at_rest(
    compiled: &CompiledModel,
    limits: Option<(f64, f64)>,
    method: Option<Method>,
) -> Result<core::Inverse, Error> {
    let usual = || core::Inverse::new(compiled, limits);
    method.map_or_else(usual, |method| core::Inverse::with_method(compiled, limits, method))
}

/// The method that an argument names; with initial outputs only the bank is possible.
pub(crate) fn method_asked_for(method: Option<&Bound<'_, PyAny>>, has_initial: bool) -> PyResult<Option<Method>> {
    let Some(method) = method else { return Ok(None) };
    let expected = if has_initial { "\"bank\" or None beside initial" } else { "\"turning_points\", \"bank\" or None" };
    let possible: &[Method] = if has_initial { &[Method::Bank] } else { &[Method::TurningPoints, Method::Bank] };
    let got = word("method", expected, method)?;
    let found = possible.iter().find(|method| method_name(**method) == got);
    found.map_or_else(|| unknown("method", expected, &got), |method| Ok(Some(*method)))
}

fn save(py: Python<'_>, model: &Model, path: PathBuf) -> PyResult<()> {
    write_json(py, path, model.to_json())
}

// What both models offer.
#[methods(PrandtlIshlinskii, ModifiedPrandtlIshlinskii)]
impl Each {
    /// The number of operators n.
    #[getter]
    fn operators(&self) -> usize {
        self.model.weights().len()
    }

    /// Subtracted from the input.
    #[getter]
    fn input_offset(&self) -> f64 {
        self.model.offsets().input
    }

    /// Added to the output.
    #[getter]
    fn output_offset(&self) -> f64 {
        self.model.offsets().output
    }

    /// The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) if no weight is negative.
    ///
    /// Of a split operator the smaller weight counts for the least, the greater for the greatest.
    #[getter]
    fn slope_range(&self) -> (f64, f64) {
        self.model.slope_range()
    }

    /// Whether the weight of the identity operators (all thresholds zero) outweighs all negative weights together.
    #[getter]
    fn invertible(&self) -> bool {
        self.model.check_invertible().is_ok()
    }

    /// Why the model is not invertible, or None.
    #[getter]
    fn not_invertible_because(&self) -> Option<String> {
        self.model.check_invertible().err().map(|error| error.to_string())
    }

    /// The forward model as a stream, at rest or from the operator outputs `initial`.
    ///
    /// `method` None takes "turning_points" where it can: what a sample costs hardly hangs on the number of operators.
    /// "bank" computes all operators for a sample that leaves the line: with AVX2 it is several times faster for some
    /// tens of operators where every sample is a jump, and slower on a smooth drive. Both give the same outputs, to
    /// 1e-12 of the range, and either goes on from a `state` of the other.
    ///
    /// Raises ValueError for thresholds that are not nested if "turning_points" is asked for.
    fn forward(
        slf: &Bound<'_, Self>,
        #[py(= None)] initial: Option<Vec<f64>>,
        #[py(*, "Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Forward> {
        forward(slf.as_any(), &slf.get().compiled, initial, method)
    }

    /// The exact inverse as a stream, the drive within `limits` (low, high).
    ///
    /// `method` as in `forward`; an inverse gains nothing by "bank".
    ///
    /// Raises NotInvertibleError if the model may not be invertible.
    fn inverse(
        slf: &Bound<'_, Self>,
        #[py("Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(= None)] initial: Option<Vec<f64>>,
        #[py(*, "Literal['turning_points', 'bank'] | None" = None)] method: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Inverse> {
        inverse(slf.as_any(), &slf.get().compiled, limits, initial, method)
    }

    /// How uncertain the output is when the history between the limits (low, high) is unknown.
    ///
    /// Raises ValueError for a model with a negative weight.
    fn bracket(slf: &Bound<'_, Self>, #[py("Sequence[float]")] limits: (f64, f64)) -> PyResult<Bracket> {
        Bracket::of(slf.as_any(), &slf.get().compiled, limits)
    }

    /// Writes the model to a JSON file; the file appears only when it is complete.
    fn save(&self, py: Python<'_>, path: PathBuf) -> PyResult<()> {
        save(py, &self.model.clone().into(), path)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.model == other.model
    }
}
