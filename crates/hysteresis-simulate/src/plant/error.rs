//! A plant that cannot be.

use core::fmt;

use hysteresis_control::linear;

/// Why a plant could not be made: the message names the parameter, what was expected and what came.
///
/// ```
/// use hysteresis_core::{CompiledModel};
/// use hysteresis_simulate::paper;
/// use hysteresis_simulate::plant::{PlantOptions, Plant};
/// let compiled = CompiledModel::new(&paper::table_1_recovered());
/// let error = Plant::new(&compiled, &PlantOptions { noise: -1.0, ..PlantOptions::default() }).unwrap_err();
/// assert_eq!(error.to_string(), "noise: expected a finite number >= 0, got -1.0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// A number outside its domain.
    Parameter(hysteresis_core::Error),
    /// A linear block that cannot be.
    Linear(linear::Error),
    /// A D/A converter of so many bits without limits that it could span.
    NoLimits {
        /// The bits.
        dac_bits: u32,
    },
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Parameter(error) => error.fmt(f),
            Self::Linear(error) => error.fmt(f),
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

impl From<linear::Error> for Error {
    fn from(error: linear::Error) -> Self {
        Self::Linear(error)
    }
}
