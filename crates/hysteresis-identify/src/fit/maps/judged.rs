//! Where a candidate with maps leads, and how it predicts beside one with fewer.

use crate::fit::folds::CrossValidation;
use crate::fit::maps::Place;

/// Where a candidate leads, and how it predicts.
pub(super) struct Judged {
    pub(super) place: Place,
    pub(super) alone: CrossValidation,
    /// With the best loop shift beside it, where loops only decay: they do not tell one from a map.
    pub(super) shifted: Option<CrossValidation>,
}

impl Judged {
    /// Whether one with a map more predicts better by this factor of the mean square error, whether this one has a loop shift or not.
    pub(super) fn is_beaten_by(&self, other: &Self, must_gain: f64) -> bool {
        self.is_beaten_alone_by(other, must_gain)
            && self.shifted.as_ref().is_none_or(|shifted| is_better(&other.alone, shifted, must_gain))
    }

    /// The same while this one has no loop shift.
    pub(super) fn is_beaten_alone_by(&self, other: &Self, must_gain: f64) -> bool {
        is_better(&other.alone, &self.alone, must_gain)
    }
}

/// The place of the one that predicts best, of those that may be taken.
pub(super) fn best_of(judged: &[Judged], may_be_taken: impl Fn(&Judged) -> bool) -> Option<usize> {
    let typical = |place: &usize| judged[*place].alone.typical_error();
    let taken = (0..judged.len()).filter(|place| may_be_taken(&judged[*place]));
    taken.min_by(|a, b| typical(a).total_cmp(&typical(b)))
}

/// Whether one predicts better than another by this factor of the mean square error, and by more than chance.
fn is_better(one: &CrossValidation, other: &CrossValidation, must_gain: f64) -> bool {
    let pair = [other.clone(), one.clone()];
    one.rmse < other.rmse && CrossValidation::good(&pair, must_gain).all(|place| place != 0)
}
