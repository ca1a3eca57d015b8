//! Which slopes a model can have, and when its output tells its input.

use crate::error::Error;
use crate::real::Real;

/// The slope of the model is the identity weight plus weights of operators that slide, so it is positive
/// everywhere if the identity weight outweighs all negative weights together.
///
/// With every w_i >= 0 this is the familiar w_0 > 0. Conditions on partial sums alone are not enough:
/// w = \[1, 1, -1.5\] has slope -0.5 where all three slide.
///
/// A split operator slides with one of its two weights at a time, and operators on either side of zero slide at once:
/// so the smaller weight of each counts, and no condition on the families one by one is enough.
/// `operators` gives the two weights of each and whether it is an identity.
pub(crate) fn check<T: Real>(operators: impl Iterator<Item = (f64, f64, bool)>) -> Result<(), Error> {
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
