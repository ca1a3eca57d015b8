//! What the search for the structure tried, and why it was taken or left.

/// How results call the term that more than one file speaks of.
pub(crate) const COUPLED_PLAYS: &str = "coupled plays";
pub(crate) const DUHEM: &str = "Duhem operator";
pub(crate) const DEAD_TIME: &str = "dead time";

/// A term that the search tried, or did not try, and why.
///
/// A result lists its trials in the order of the search. A term may be in the list more than once: it is tried again
/// when the model has changed.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TermTrial {
    /// What was added to the model, or took the place of something: "output map", "relaxing plays", "no dynamics".
    pub term: String,
    /// What the model had then of maps, slow gain, relaxing plays, creep of every decade and a lag in front. What
    /// cross-validation chooses last, creep, loop shift, weights and operators, names what of these is beside it alone.
    pub beside: Vec<String>,
    /// What came of it.
    pub outcome: TrialOutcome,
    /// By what it was judged.
    pub judged_by: TrialJudge,
    /// What it gained, by its judge; none where nothing was fitted that could be judged.
    pub gain: Option<f64>,
    /// What it had to gain at least; none where it was not tried.
    pub needed: Option<f64>,
}

/// What came of the trial of a term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum TrialOutcome {
    /// The model is better with it, and the search went on with it.
    Better,
    /// The model is better with it, but better still with other terms.
    Beaten,
    /// It was taken at first. Then the search began again, or what was found later made it needless.
    Overruled,
    /// It gains too little, or no more than chance would, or the fit is worse.
    NotBetter,
    /// It is told, but explains too small a share of what the model leaves.
    TooSmall,
    /// The derivatives of the fit without it promise so little that it was not fitted.
    NotPromising,
    /// At the bounds of its search, without an inverse, before the drive, or running away on other drives: a model with
    /// it stands for something else.
    StandsForOther,
    /// Something that these records do not tell from it explains as much: a loop shift, a drift, a transient, or any
    /// term that follows loops of one size.
    NotTold,
    /// These records cannot tell it: it was not tried.
    CannotBeTold,
    /// It needs a sampling interval, more samples, or the modified model: it was not tried.
    NotOpen,
    /// The fit leaves too little for what the term must gain, of loops that are all alike or beside the noise of the
    /// sensor: it was not tried.
    LittleLeft,
    /// The fit leaves rounding or white noise: it was not tried.
    NothingLeft,
    /// It could not be fitted to these records.
    NotFitted,
    /// It is left out again: without it the model predicts no worse than by what it must gain.
    Needless,
}

/// By what a term is judged.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum TrialJudge {
    /// Cross-validation: the gain is the factor by which the typical error on held-out stretches falls.
    HeldOutError,
    /// Evidence: the gain is by how many variances of the noise the sum of squares falls.
    Evidence,
}

impl TermTrial {
    /// A term that is judged by stretches that are held out; its mean square error must fall by a factor.
    pub(crate) fn by_stretches(term: &str, must_gain: f64, outcome: TrialOutcome) -> Self {
        Self { needed: Some(must_gain.sqrt()), ..Self::not_tried(term, outcome) }
    }

    /// A term that was not tried.
    pub(crate) fn not_tried(term: &str, outcome: TrialOutcome) -> Self {
        let (term, judged_by) = (term.to_owned(), TrialJudge::HeldOutError);
        Self { term, beside: Vec::new(), outcome, judged_by, gain: None, needed: None }
    }

    /// A term that is judged by evidence; none where there was nothing to fit.
    pub(crate) fn by_evidence(term: &str, (gain, needed): (Option<f64>, f64), outcome: TrialOutcome) -> Self {
        Self { judged_by: TrialJudge::Evidence, gain, needed: Some(needed), ..Self::not_tried(term, outcome) }
    }

    pub(crate) fn with_gain(self, gain: f64) -> Self {
        Self { gain: Some(gain), ..self }
    }
}

/// Puts another outcome in the place of `Better`, for terms that a model that was found later does not have.
pub(crate) fn overrule(trials: &mut [TermTrial], outcome: TrialOutcome, is_left: impl Fn(&str) -> bool) {
    for trial in trials.iter_mut().filter(|trial| trial.outcome == TrialOutcome::Better && is_left(&trial.term)) {
        trial.outcome = outcome;
    }
}
