//! What cannot be exported, or run.

use core::fmt;

use hysteresis_control::stage;
use hysteresis_core as core_;

/// What is wrong: the argument, what was expected, what came.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// The stage, or what is made from it.
    Stage(stage::Error),
    /// An argument that is no number.
    Argument {
        /// Its name.
        parameter: &'static str,
        /// What was expected.
        expected: String,
        /// What came.
        got: String,
    },
}

impl Error {
    pub(crate) fn argument(parameter: &'static str, expected: impl Into<String>, got: impl fmt::Debug) -> Self {
        Self::Argument { parameter, expected: expected.into(), got: format!("{got:?}") }
    }

    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Stage(error) => error.parameter(),
            Self::Argument { parameter, .. } => Some(parameter),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stage(error) => error.fmt(f),
            Self::Argument { parameter, expected, got } => write!(f, "{parameter}: expected {expected}, got {got}"),
        }
    }
}

impl core::error::Error for Error {}

impl From<stage::Error> for Error {
    fn from(error: stage::Error) -> Self {
        Self::Stage(error)
    }
}

impl From<core_::Error> for Error {
    fn from(error: core_::Error) -> Self {
        Self::Stage(error.into())
    }
}
