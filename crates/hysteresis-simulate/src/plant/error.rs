//! A plant that cannot be.

use core::fmt;

use hysteresis_control::stage;

/// Why a plant could not be made: the message names the parameter, what was expected and what came.
///
/// ```
/// use hysteresis_simulate::paper::Benchmark;
/// use hysteresis_simulate::plant::{Plant, PlantOptions};
/// let error = Plant::new(&Benchmark::A1.stage(), &PlantOptions::new(0.0)).unwrap_err();
/// assert_eq!(error.to_string(), "dt: expected a finite number > 0, got 0.0");
/// ```
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Parameter(hysteresis_core::Error),
    /// A stage that cannot run.
    Stage(stage::Error),
    /// A D/A converter of so many bits without limits that it could span.
    NoLimits {
        /// The bits.
        dac_bits: u32,
    },
}

impl Error {
    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::Parameter(error) => error.parameter(),
            Self::Stage(error) => error.parameter(),
            Self::NoLimits { .. } => Some("limits"),
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Stage(error) => error.fmt(f),
            Self::NoLimits { dac_bits } => {
                write!(f, "limits: expected (low, high) for the {dac_bits} bits of the D/A converter to span, got none")
            }
        }
    }
}

impl core::error::Error for Error {}

impl From<hysteresis_core::Error> for Error {
    fn from(error: hysteresis_core::Error) -> Self {
        Self::Parameter(error)
    }
}

impl From<stage::Error> for Error {
    fn from(error: stage::Error) -> Self {
        Self::Stage(error)
    }
}
