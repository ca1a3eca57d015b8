//! A parameter that no linear block can have.

use core::fmt;

use hysteresis_core::{MAX_MAGNITUDE, is_admissible};

/// A parameter outside its domain: its name, what was expected, what came.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// let error = SecondOrder::new(400.0, -1.0).unwrap_err();
/// assert_eq!(error.to_string(), "damping: expected a finite number above 0 (1e-100 to 1e100), got -1.0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// The name of the argument.
    pub parameter: &'static str,
    /// Where in the array, for arrays.
    pub index: Option<usize>,
    /// The domain in words.
    pub expected: &'static str,
    /// The number that came.
    pub got: f64,
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { parameter, index, expected, got } = self;
        match index {
            Some(index) => write!(f, "{parameter}[{index}]: expected {expected}, got {got:?}"),
            None => write!(f, "{parameter}: expected {expected}, got {got:?}"),
        }
    }
}

impl core::error::Error for Error {}

/// The number, if it is finite and above zero by more than the reciprocal of the largest admissible magnitude.
pub(crate) fn check_positive(parameter: &'static str, index: Option<usize>, got: f64) -> Result<f64, Error> {
    if got.abs() <= MAX_MAGNITUDE && got >= 1.0 / MAX_MAGNITUDE {
        Ok(got)
    } else {
        Err(Error { parameter, index, expected: "a finite number above 0 (1e-100 to 1e100)", got })
    }
}

/// The number of seconds, if it can be a dead time.
pub(crate) fn check_dead_time(got: f64) -> Result<f64, Error> {
    if (0.0..=MAX_MAGNITUDE).contains(&got) {
        Ok(got)
    } else {
        Err(Error { parameter: "dead_time", index: None, expected: "a finite number of seconds, 0 or more", got })
    }
}

/// The numbers, if all are finite and at most 1e100 in magnitude.
pub(crate) fn check_finite(parameter: &'static str, numbers: &[f64]) -> Result<(), Error> {
    match numbers.iter().position(|number| !is_admissible(*number)) {
        None => Ok(()),
        Some(index) => {
            let expected = "a finite number (at most 1e100 in magnitude)";
            Err(Error { parameter, index: Some(index), expected, got: numbers[index] })
        }
    }
}
