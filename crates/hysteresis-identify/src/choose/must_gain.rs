//! By how much a model must predict held-out stretches better than a simpler one.

use crate::choose::cross_validation::CrossValidation;

/// By which factor a term must lower the mean square error of prediction.
pub(crate) const MUST_GAIN: f64 = 1.2;

/// The same where loops are all alike: a term must halve the error.
pub(crate) const MUST_GAIN_OF_LIKE_LOOPS: f64 = 4.0;

/// Whether one predicts better than another by this factor of the mean square error, and by more than chance.
pub(crate) fn is_better(one: &CrossValidation, other: &CrossValidation, must_gain: f64) -> bool {
    let pair = [other.clone(), one.clone()];
    CrossValidation::good(&pair, must_gain).all(|place| place != 0)
}

/// What a term must gain where loops are all alike. One predicts the other with any term that fits, so it must halve
/// the error of a fit that leaves what is usual, and gain more where less is left.
pub(crate) struct OfLikeLoops {
    /// The share of the range that such a fit leaves.
    pub(crate) usual_left: f64,
    /// By which factor it must lower the mean square error of a fit that is poor: that describes nothing without it.
    pub(crate) gain_of_poor: f64,
}

impl OfLikeLoops {
    /// Below this part of what is usually left no term is tried.
    const LITTLE: f64 = 0.25;

    /// A fit that leaves this share of the range, noise included, is poor.
    const POOR: f64 = 0.02;

    pub(crate) fn leaves_little(&self, left: f64) -> bool {
        left < Self::LITTLE * self.usual_left
    }

    /// By which factor terms must lower the mean square error of a fit that leaves so much; beside another one they
    /// have no discount, as two together follow any loop.
    pub(crate) fn must_gain(&self, left: f64, terms: i32, is_beside: bool) -> f64 {
        let is_poor = left >= Self::POOR && !is_beside;
        let of_one = if is_poor { self.gain_of_poor } else { MUST_GAIN_OF_LIKE_LOOPS };
        of_one.powi(terms) * (self.usual_left / left).max(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Half the error at what is usually left; less of a poor fit, unless another term is there; more where little is
    /// left.
    #[test]
    fn what_like_loops_ask_for_depends_on_what_is_left() {
        let rule = OfLikeLoops { usual_left: 0.005, gain_of_poor: 1.5 };
        assert_eq!(rule.must_gain(0.01, 1, false), MUST_GAIN_OF_LIKE_LOOPS);
        assert_eq!(rule.must_gain(0.03, 1, false), 1.5);
        assert_eq!(rule.must_gain(0.03, 2, true), MUST_GAIN_OF_LIKE_LOOPS.powi(2));
        assert_eq!(rule.must_gain(0.0025, 1, false), 2.0 * MUST_GAIN_OF_LIKE_LOOPS);
        assert!(rule.leaves_little(0.001) && !rule.leaves_little(0.002));
    }
}
