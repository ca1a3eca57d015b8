//! Small arguments: numbers, counts, pairs of numbers, and words to choose from.

use std::path::PathBuf;

use pyo3::prelude::*;
use pyo3::types::PyString;

use super::errors::{self, not_converted, unexpected};

/// A whole number of at least one.
pub(crate) fn count(name: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    match value.extract::<usize>() {
        Ok(count) if count > 0 => Ok(count),
        _ => {
            let got = value.repr()?;
            Err(errors::value(name, format_args!("expected a whole number of at least one, got {got}")))
        }
    }
}

/// A whole number that is not negative.
pub(crate) fn whole<'py, T: for<'a> FromPyObject<'a, 'py>>(name: &str, value: &Bound<'py, PyAny>) -> PyResult<T> {
    whole_number(name, "a whole number of at least zero", value)
}

/// A whole number that T can be.
pub(crate) fn whole_number<'py, T: for<'a> FromPyObject<'a, 'py>>(
    name: &str,
    expected: &str,
    value: &Bound<'py, PyAny>,
) -> PyResult<T> {
    if let Ok(number) = value.extract::<T>() {
        return Ok(number);
    }
    let got = value.repr()?;
    Err(errors::value(name, format_args!("expected {expected}, got {got}")))
}

/// The path of a file.
pub(crate) fn path(name: &str, value: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    let expected = "the path of a file";
    let path: PathBuf = value.extract().map_err(|error| not_converted(name, expected, value, error))?;
    if path.as_os_str().is_empty() || path.as_os_str().as_encoded_bytes().contains(&0) {
        return Err(errors::value(name, format_args!("expected {expected}, got {}", value.repr()?)));
    }
    Ok(path)
}

/// A word.
pub(crate) fn word(name: &str, expected: &str, value: &Bound<'_, PyAny>) -> PyResult<String> {
    value.extract().map_err(|error| not_converted(name, expected, value, error))
}

/// Limits from any two numbers.
pub(crate) fn pair(name: &str, limits: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    two(name, "(low, high)", limits)
}

/// One number for each axis of the plane.
pub(crate) fn pair_of_axes(name: &str, value: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    two(name, "(x, y)", value)
}

/// Any two numbers, which a message calls by these names.
pub(crate) fn two(name: &str, called: &str, value: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    // The length first: a range may be longer than memory.
    if value.len().is_ok_and(|numbers| numbers == 2)
        && let Ok(numbers) = value.extract::<Vec<f64>>()
        && let [first, second] = numbers[..]
    {
        return Ok((first, second));
    }
    Err(unexpected(name, format_args!("two numbers {called}"), value))
}

/// A number of samples.
pub(crate) fn samples(name: &str, value: &Bound<'_, PyAny>) -> PyResult<usize> {
    if let Ok(samples) = value.extract::<usize>() {
        return Ok(samples);
    }
    let got = value.repr()?;
    Err(errors::value(name, format_args!("expected a number of samples, got {got}")))
}

/// Whether an argument is this word.
pub(crate) fn is_word(value: &Bound<'_, PyAny>, word: &str) -> bool {
    value.cast::<PyString>().is_ok_and(|text| *text == word)
}

/// A word that is none of those expected.
pub(crate) fn unknown<T>(name: &str, expected: &str, got: &str) -> PyResult<T> {
    Err(errors::value(name, format_args!("expected {expected}, got \"{got}\"")))
}
