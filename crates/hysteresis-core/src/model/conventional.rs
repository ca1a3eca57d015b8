use alloc::boxed::Box;
use alloc::vec::Vec;

use super::checks::check_weights;
use super::invertibility;
use super::offsets::Offsets;
use crate::error::{Error, check_length};
use crate::operator::Play;

/// The conventional Prandtl-Ishlinskii model (CPI), equation (4): y = `output_offset` + sum_i w_i z_i.
///
/// z_i is the [`Play`] of threshold r_i at the input x - `input_offset`. Weights in output unit per input unit,
/// thresholds in the unit of the input. Immutable; streams share it.
///
/// ```
/// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut forward = model.forward();
/// assert_eq!(forward.step(4.0), 4.0 + 0.5 * 2.0);
/// assert_eq!(forward.step(3.0), 3.0 + 0.5 * 2.0); // the play holds
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct PrandtlIshlinskii {
    weights: Box<[f64]>,
    operators: Box<[Play]>,
    offsets: Offsets,
}

impl PrandtlIshlinskii {
    /// A model of `weights.len()` plays.
    ///
    /// # Errors
    /// [`Error::Empty`] without operators, [`Error::Length`] for unequal lengths, [`Error::Domain`] for a weight
    /// or offset that is not finite or a threshold that is negative or not finite.
    pub fn new(weights: &[f64], thresholds: &[f64], offsets: Offsets) -> Result<Self, Error> {
        check_weights("weights", weights)?;
        check_length("thresholds", weights.len(), thresholds.len())?;
        let operators = thresholds
            .iter()
            .enumerate()
            .map(|(i, r)| {
                Play::new(*r).map_err(|error| match error {
                    Error::Domain { expected, got, .. } => {
                        Error::Domain { parameter: "thresholds", index: Some(i), expected, got }
                    }
                    other => other,
                })
            })
            .collect::<Result<Vec<_>, _>>()?;
        Ok(Self { weights: weights.into(), operators: operators.into(), offsets: offsets.check()? })
    }

    /// The weights w_i.
    #[must_use]
    pub fn weights(&self) -> &[f64] {
        &self.weights
    }

    /// The operators, each with its threshold r_i.
    #[must_use]
    pub fn operators(&self) -> &[Play] {
        &self.operators
    }

    /// The offsets of input and output.
    #[must_use]
    pub fn offsets(&self) -> Offsets {
        self.offsets
    }

    /// Whether the sufficient condition for an inverse holds, and if not, why not.
    ///
    /// # Errors
    /// [`Error::NotInvertible`] unless the weight at threshold zero exceeds the sum of the negative weights.
    pub fn check_invertible(&self) -> Result<(), Error> {
        invertibility::check::<f64>(self.members())
    }

    /// The least and the greatest slope dy/dx that the model can have: (w_0, sum of w_i) with no negative weight.
    ///
    /// ```
    /// use hysteresis_core::{Offsets, PrandtlIshlinskii};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5, 0.25], &[0.0, 2.0, 4.0], Offsets::default())?;
    /// assert_eq!(model.slope_range(), (1.0, 1.75));
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        invertibility::slope_range(self.members())
    }

    /// The weight, above and below zero, of every operator and whether it is an identity.
    fn members(&self) -> impl Iterator<Item = (f64, f64, bool)> {
        self.weights.iter().zip(&self.operators).map(|(w, z)| (*w, *w, z.r() == 0.0))
    }
}
