//! Inverses in closed form: exact for the conventional model, an approximation of the same form for the modified one.
//!
//! The exact inverse of either model is the stream [`Inverse`](crate::Inverse).

use alloc::vec::Vec;

use super::{ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};
use crate::error::Error;
use crate::operator::{CoupledPlay, Play};

impl PrandtlIshlinskii {
    /// The inverse as another conventional model, in closed form: w'_0 = 1 / w_0,
    /// w'_i = -w_i / (S_i S_(i-1)) with S_i = sum_(j<=i) w_j, and r'_i = sum_(j<=i) w_j (r_i - r_j).
    ///
    /// Input in the unit of the output and the other way round; the offsets swap sides.
    ///
    /// # Errors
    /// [`Error::NoClosedForm`] unless r_0 = 0, the thresholds never decrease and every S_i is positive.
    ///
    /// ```
    /// use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let inverse = model.closed_form_inverse()?;
    /// assert_eq!(inverse.weights(), [1.0, -0.5 / 1.5]);
    /// assert_eq!(inverse.operators()[1].r(), 2.0);
    /// assert!((model.forward().step(inverse.forward().step(5.0)) - 5.0).abs() < 1e-14);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn closed_form_inverse(&self) -> Result<Self, Error> {
        let thresholds: Vec<f64> = self.operators().iter().map(Play::r).collect();
        let (weights, thresholds) = closed_form(self.weights(), &thresholds)?;
        Self::new(&weights, &thresholds, swapped(self.offsets()))
    }
}

impl ModifiedPrandtlIshlinskii {
    /// The parametric inverse of the paper, equation (7) and Table II: weights and r' as in the closed form of the
    /// conventional model, the other thresholds as fractions `ratios` of r'.
    ///
    /// Only approximately an inverse (erratum 8): on the paper's actuator it leaves 0.73 % of the peak-to-peak
    /// displacement. The paper uses [`Ratios::PAPER_INVERSE`].
    ///
    /// # Errors
    /// [`Error::NoClosedForm`] unless r_0 = 0, r never decreases and every partial sum of the weights is positive, and
    /// for a split model, whose families would need thresholds r' of their own; [`Error::Domain`] for ratios that break
    /// ra >= rb >= 0 or 1 >= rc >= 0.
    ///
    /// ```
    /// use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
    /// let model = ModifiedPrandtlIshlinskii::from_ratios(&[1.0, 0.5], &[0.0, 2.0], Ratios::PAPER, Offsets::default())?;
    /// let inverse = model.parametric_inverse(Ratios::PAPER_INVERSE)?;
    /// assert_eq!(inverse.weights(), [1.0, -0.5 / 1.5]);
    /// assert_eq!(inverse.operators()[1].r(), 2.0);
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    pub fn parametric_inverse(&self, ratios: Ratios) -> Result<Self, Error> {
        let unequal = self.weights().iter().zip(self.weights_negative()).position(|(w, v)| w != v);
        if let Some(index) = unequal {
            let (expected, got) = ("the same weight in both families", self.weights_negative()[index]);
            return Err(Error::NoClosedForm { index, expected, got });
        }
        let r: Vec<f64> = self.operators().iter().map(CoupledPlay::r).collect();
        let (weights, r) = closed_form(self.weights(), &r)?;
        Self::from_ratios(&weights, &r, ratios, swapped(self.offsets()))
    }
}

fn swapped(offsets: Offsets) -> Offsets {
    Offsets { input: offsets.output, output: offsets.input }
}

/// Weights and thresholds of the inverse. r'_i grows by S_(i-1) (r_i - r_(i-1)) from one operator to the next.
fn closed_form(weights: &[f64], r: &[f64]) -> Result<(Vec<f64>, Vec<f64>), Error> {
    let mut inverse_weights = Vec::with_capacity(weights.len());
    let mut inverse_r = Vec::with_capacity(weights.len());
    let (mut last_sum, mut last_r, mut last_inverse_r) = (0.0, 0.0, 0.0);
    for (index, (&weight, &r)) in weights.iter().zip(r).enumerate() {
        if index == 0 && r != 0.0 {
            return Err(Error::NoClosedForm { index, expected: "the threshold 0", got: r });
        }
        if r < last_r {
            return Err(Error::NoClosedForm { index, expected: "a threshold not below the one before it", got: r });
        }
        let sum = last_sum + weight;
        if sum <= 0.0 {
            return Err(Error::NoClosedForm { index, expected: "a positive sum of the weights up to it", got: sum });
        }
        last_inverse_r += last_sum * (r - last_r);
        inverse_weights.push(if index == 0 { sum.recip() } else { -weight / (sum * last_sum) });
        inverse_r.push(last_inverse_r);
        (last_sum, last_r) = (sum, r);
    }
    Ok((inverse_weights, inverse_r))
}
