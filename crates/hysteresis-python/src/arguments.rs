//! Small arguments: counts and pairs of numbers.

use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;

/// A whole number of at least one.
pub(crate) fn count(name: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    match value.extract::<usize>() {
        Ok(count) if count > 0 => Ok(count),
        _ => {
            let got = value.repr()?;
            Err(PyValueError::new_err(format!("{name}: expected a whole number of at least one, got {got}")))
        }
    }
}

/// A whole number that is not negative.
pub(crate) fn whole<'py, T: for<'a> FromPyObject<'a, 'py>>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<T> {
    if let Ok(number) = value.extract::<T>() {
        return Ok(number);
    }
    let got = value.repr()?;
    Err(PyValueError::new_err(format!("{name}: expected a whole number of at least zero, got {got}")))
}

/// Limits from any two numbers.
pub(crate) fn pair(name: &str, limits: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    match limits.extract::<Vec<f64>>() {
        Ok(numbers) if numbers.len() == 2 => Ok((numbers[0], numbers[1])),
        _ => {
            let got = limits.repr()?;
            Err(PyTypeError::new_err(format!("{name}: expected two numbers (low, high), got {got}")))
        }
    }
}

/// A number of samples.
pub(crate) fn samples(name: &str, value: i64) -> PyResult<usize> {
    usize::try_from(value)
        .map_err(|_| PyValueError::new_err(format!("{name}: expected a number of samples, got {value}")))
}
