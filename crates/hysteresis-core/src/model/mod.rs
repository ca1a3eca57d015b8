//! Validated, immutable parameters of the two models: equations (4) and (6).

mod conventional;
mod invertibility;
#[cfg(feature = "json")]
mod json;
mod modified;

pub use conventional::PrandtlIshlinskii;
#[cfg(feature = "json")]
pub use json::{JsonError, SCHEMA, SCHEMA_SPLIT};
pub use modified::{ModifiedPrandtlIshlinskii, Ratios};

use crate::error::{Error, check_finite};

/// Where the model's own zero lies: y = output + sum of w_i H_i\[x - input\].
///
/// `input` in the unit of the input moves the sticky zero of the coupled play (unipolar drives), `output` in the
/// unit of the output is the reading of the sensor at the model's zero.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let offsets = Offsets { input: 2.0, output: -100.0 };
/// let model = PrandtlIshlinskii::new(&[10.0], &[0.0], offsets)?;
/// assert_eq!(model.forward().step(3.0), -90.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Offsets {
    /// Subtracted from the input, in the unit of the input.
    pub input: f64,
    /// Added to the output, in the unit of the output.
    pub output: f64,
}

impl Offsets {
    fn check(self) -> Result<Self, Error> {
        check_finite("input_offset", None, self.input)?;
        check_finite("output_offset", None, self.output)?;
        Ok(self)
    }
}

/// A model of either kind, as a file holds it.
#[derive(Clone, Debug, PartialEq)]
pub enum Model {
    /// Play operators.
    Conventional(PrandtlIshlinskii),
    /// Coupled-play operators.
    Modified(ModifiedPrandtlIshlinskii),
}

impl From<PrandtlIshlinskii> for Model {
    fn from(model: PrandtlIshlinskii) -> Self {
        Self::Conventional(model)
    }
}

impl From<ModifiedPrandtlIshlinskii> for Model {
    fn from(model: ModifiedPrandtlIshlinskii) -> Self {
        Self::Modified(model)
    }
}

fn check_weights(weights: &[f64]) -> Result<(), Error> {
    if weights.is_empty() {
        return Err(Error::Empty { parameter: "weights" });
    }
    for (i, w) in weights.iter().enumerate() {
        check_finite("weights", Some(i), *w)?;
    }
    Ok(())
}

fn check_length(parameter: &'static str, expected: usize, values: &[f64]) -> Result<(), Error> {
    let got = values.len();
    if got == expected { Ok(()) } else { Err(Error::Length { parameter, expected, got }) }
}
