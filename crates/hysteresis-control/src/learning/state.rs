//! What learning remembers, as plain values.

use hysteresis_core::is_admissible;
use serde::{Deserialize, Serialize};

use super::belief::Belief;
use super::options::{LearningOptions, RepetitiveOptions, Trial};
use super::supervisor::SupervisorState;
use crate::linear::Error;

/// Everything that an [`IterativeLearning`](super::IterativeLearning) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct IterativeState {
    /// The fingerprint of the loop and of the target with which it began.
    pub model: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// How it learns.
    pub options: LearningOptions,
    /// The target of the next period, which may begin where the last one ended.
    pub target: Vec<f64>,
    /// The target without that beginning.
    pub goal: Vec<f64>,
    /// So many periods pass before the next one that is learned from.
    pub settling: u32,
    /// The target of the period with the least error, and the root mean square of that error.
    pub best: Vec<f64>,
    /// The root mean square of the least error; none before the first period.
    pub best_rmse: Option<f64>,
    /// What the periods so far tell of every harmonic; none before the first one.
    pub beliefs: Vec<Belief>,
    /// The variance of the noise in a harmonic.
    pub noise: f64,
    /// The share of a step that is taken: halved with every period that was not accepted, doubled where the error comes
    /// down.
    pub trust: f64,
    /// The first period that counts: those before are forgotten.
    pub since: usize,
    /// Whether learning has stopped because it no longer helps.
    pub finished: bool,
    /// What every period was like.
    pub trials: Vec<Trial>,
}

/// Everything that a [`RepetitiveControl`](super::RepetitiveControl) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveState {
    /// The fingerprint of the loop.
    pub model: u64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The number of samples of a period.
    pub period: usize,
    /// How it learns.
    pub options: RepetitiveOptions,
    /// The last corrections, the oldest first.
    pub corrections: Vec<f64>,
    /// The last errors, the oldest first.
    pub errors: Vec<f64>,
    /// The sum of the corrections of the last period.
    pub sum: f64,
    /// How many samples came.
    pub waited: u64,
    /// How many errors were not finite.
    pub rejected: u64,
    /// Whether learning goes on, and what there is to tell. States of before there was a supervisor have none.
    #[serde(default)]
    pub supervision: Supervision,
}

/// Whether learning goes on, and what there is to tell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Supervision {
    /// The references of the last period, the oldest first.
    pub references: Vec<f64>,
    /// What tells divergence.
    pub supervisor: SupervisorState,
    /// For how many samples the correction fades out, and then stays at zero until nothing is remembered.
    pub fading: usize,
    /// Whether that is, or was, the end of learning.
    pub stopped: bool,
    /// How often learning has diverged.
    pub divergences: u64,
}

/// Checks what was believed of as many harmonics as there are, or of none.
pub(super) fn check_beliefs(beliefs: &[Belief], harmonics: usize) -> Result<(), Error> {
    if !(beliefs.is_empty() || beliefs.len() == harmonics) {
        let expected = "one for every harmonic, or none";
        return Err(Error::whole("state.beliefs", None, expected, beliefs.len()));
    }
    for (index, belief) in beliefs.iter().enumerate() {
        let [.., error_variance, response_variance] = belief.numbers();
        let wrong = belief.numbers().into_iter().find(|number| !is_admissible(*number));
        if let Some(got) = wrong.or([error_variance, response_variance].into_iter().find(|variance| *variance < 0.0)) {
            let expected = "finite numbers, variances not negative";
            return Err(Error::domain("state.beliefs", Some(index), expected, got));
        }
    }
    Ok(())
}
