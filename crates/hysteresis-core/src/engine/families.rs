//! The two families of one-sided plays that a model is made of.

use alloc::vec::Vec;

use super::checks::{check_same, check_same_count};
use super::family::{Family, Member};
use super::turning_points::Stack;
use crate::error::Error;
use crate::model::ModifiedPrandtlIshlinskii;

/// A model as w_0 x plus two families of one-sided plays, the second one mirrored.
///
/// A coupled play is p(x; a = r, b = rb) - p(-x; a = ra, b = rc), which needs r >= rc and ra >= rb.
#[derive(Debug)]
pub(crate) struct Families {
    pub(super) identity_weight: f64,
    pub(crate) positive: Family,
    pub(crate) negative: Family,
}

impl Families {
    /// The families of a model, or nothing if the thresholds of one of them are not nested in any order.
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Option<Self> {
        let mut identity_weight = 0.0;
        let (mut positive, mut negative) = (Vec::new(), Vec::new());
        for (above, below, z) in model.members() {
            // What both sides of an identity have is a straight line that always slides, so the slope stays above it;
            // the rest, if it is split, is a one-sided play of no width.
            let straight = if z.is_identity() { above.min(below) } else { 0.0 };
            identity_weight += straight;
            if !z.is_identity() || above > straight {
                positive.push(Member { weight: above - straight, rise: z.r(), fall: z.rb() });
            }
            if !z.is_identity() || below > straight {
                negative.push(Member { weight: below - straight, rise: z.ra(), fall: z.rc() });
            }
        }
        Some(Self { identity_weight, positive: Family::nested(positive)?, negative: Family::nested(negative)? })
    }

    /// Whether the weights differ too.
    ///
    /// # Errors
    /// [`Error::OtherOperators`] if the thresholds differ.
    pub(crate) fn check_same_operators(&self, other: &Self) -> Result<bool, Error> {
        let positive = compare(["r", "rb"], &self.positive, &other.positive)?;
        let negative = compare(["ra", "rc"], &self.negative, &other.negative)?;
        Ok(self.identity_weight != other.identity_weight || positive || negative)
    }

    /// An upper bound of what is summed for an output at inputs of that magnitude: what rounding is relative to.
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        self.identity_weight.abs() * input + self.positive.output_scale(input) + self.negative.output_scale(input)
    }
}

/// Whether the weights of two families differ; their thresholds may not.
fn compare([rise, fall]: [&'static str; 2], running: &Family, new: &Family) -> Result<bool, Error> {
    check_same_count(running.len(), new.len())?;
    let mut differ = false;
    for ((a, b, w), (other_a, other_b, other_w)) in running.entries().zip(new.entries()) {
        check_same(rise, a, other_a)?;
        check_same(fall, b, other_b)?;
        differ |= w != other_w;
    }
    Ok(differ)
}

/// Room for the turning points of both families.
#[derive(Clone, Debug)]
pub(crate) struct Stacks {
    pub(crate) positive: Stack,
    pub(crate) negative: Stack,
}
