//! What is sampled: the error of parameters that no signal or trajectory can have, and how long either may be.

use core::fmt;
use std::borrow::Cow;

/// A parameter that no signal, excitation or trajectory can have.
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    /// The name of the argument.
    pub parameter: &'static str,
    /// The domain in words.
    pub expected: Cow<'static, str>,
    /// The number that came.
    pub got: f64,
}

impl Error {
    /// Names the parameter, its domain in words and what came.
    pub fn new(parameter: &'static str, expected: impl Into<Cow<'static, str>>, got: f64) -> Self {
        Self { parameter, expected: expected.into(), got }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: expected {}, got {:?}", self.parameter, self.expected, self.got)
    }
}

impl std::error::Error for Error {}

/// The longest signal, in samples: 8 GiB of numbers.
pub const MAX_SAMPLES: f64 = 1_073_741_824.0;

/// Checks a number that must be finite, or names it.
///
/// # Errors
/// [`Error`] unless it is.
pub fn finite(parameter: &'static str, got: f64) -> Result<(), Error> {
    if got.is_finite() { Ok(()) } else { Err(Error::new(parameter, "a finite number", got)) }
}

/// Checks a number that must be finite and above 0, or names it.
///
/// # Errors
/// [`Error`] unless it is.
pub fn positive(parameter: &'static str, got: f64) -> Result<(), Error> {
    if got > 0.0 && got.is_finite() { Ok(()) } else { Err(Error::new(parameter, "a finite number above 0", got)) }
}
