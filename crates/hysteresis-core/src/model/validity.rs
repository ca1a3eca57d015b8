//! What models of any size and of a fixed size have in common: offsets, proportions of thresholds, and when weights and
//! slopes are those of a model that can be inverted.

use crate::error::{Error, check_all_finite, check_between, check_finite, check_non_negative, check_within};
use crate::operator::CoupledPlay;
use crate::real::Real;

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
    pub(crate) fn check(self) -> Result<Self, Error> {
        check_finite("input_offset", None, self.input)?;
        check_finite("output_offset", None, self.output)?;
        Ok(self)
    }
}

/// The three thresholds of every operator as fractions of its r: ra = `ra` r, rb = `rb` r, rc = `rc` r.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Ratios {
    /// ra / r, at least `rb`.
    pub ra: f64,
    /// rb / r, between 0 and `ra`.
    pub rb: f64,
    /// rc / r, between 0 and 1.
    pub rc: f64,
}

impl Ratios {
    /// The ratios of the paper's actuator (Table I): 0.95, 0.30, 0.35.
    pub const PAPER: Self = Self { ra: 0.95, rb: 0.30, rc: 0.35 };

    /// The ratios of the paper's inverse (Table II): 0.90, 0.35, 0.35.
    pub const PAPER_INVERSE: Self = Self { ra: 0.90, rb: 0.35, rc: 0.35 };

    /// Equal thresholds: every coupled play is a play.
    pub const PLAY: Self = Self { ra: 1.0, rb: 1.0, rc: 1.0 };

    /// The coupled play of threshold `r` in these proportions; `index` names the operator in errors.
    pub(crate) fn operator(self, index: usize, r: f64) -> Result<CoupledPlay, Error> {
        CoupledPlay::indexed(Some(index), r, self.ra * r, self.rb * r, self.rc * r)
    }

    pub(crate) fn check(self) -> Result<Self, Error> {
        check_non_negative("ra", None, self.ra)?;
        check_within("rb", None, self.rb, "ra", self.ra)?;
        check_between("rc", None, self.rc, (0.0, 1.0))?;
        Ok(self)
    }
}

pub(crate) fn check_weights(parameter: &'static str, weights: &[f64]) -> Result<(), Error> {
    if weights.is_empty() {
        return Err(Error::Empty { parameter });
    }
    check_all_finite(parameter, weights)
}

/// The slope of the model is the identity weight plus weights of operators that slide, so it is positive
/// everywhere if the identity weight outweighs all negative weights together.
///
/// With every w_i >= 0 this is the familiar w_0 > 0. Conditions on partial sums alone are not enough:
/// w = \[1, 1, -1.5\] has slope -0.5 where all three slide.
///
/// A split operator slides with one of its two weights at a time, and operators on either side of zero slide at once:
/// so the smaller weight of each counts, and no condition on the families one by one is enough.
/// `operators` gives the two weights of each and whether it is an identity.
pub(crate) fn check_invertible<T: Real>(operators: impl Iterator<Item = (f64, f64, bool)>) -> Result<(), Error> {
    let (mut identity_weight, mut negative_sum, mut magnitude) = (0.0, 0.0, 0.0);
    for (above, below, is_identity) in operators {
        let weight = above.min(below);
        magnitude += above.abs().max(below.abs());
        if is_identity {
            identity_weight += weight;
        } else {
            negative_sum += weight.min(0.0);
        }
    }
    // Inputs found through the reciprocal of a slope must stay finite.
    let min_slope = 1.0 / T::MAX_MAGNITUDE.wide();
    if identity_weight + negative_sum > (T::MIN_RELATIVE_SLOPE * magnitude).max(min_slope) {
        Ok(())
    } else {
        Err(Error::NotInvertible { identity_weight, negative_sum })
    }
}

/// The least and the greatest slope that the model can have, for the same `operators`.
///
/// Identities always slide, with one of their two weights; every other operator slides, with either weight, or rests.
/// Branches on which operators of both signs slide alone may not exist, so these are bounds; with no negative weight
/// the lower one is met right after every reversal, the upper one where all operators slide.
#[cfg(feature = "alloc")]
pub(super) fn slope_range(operators: impl Iterator<Item = (f64, f64, bool)>) -> (f64, f64) {
    operators.fold((0.0, 0.0), |(least, most), (above, below, is_identity)| {
        let rest = if is_identity { above } else { 0.0 };
        (least + above.min(below).min(rest), most + above.max(below).max(rest))
    })
}
