//! What learning remembers, as plain values.

use serde::{Deserialize, Serialize};

use super::options::{LearningOptions, RepetitiveOptions, Trial};

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
    /// The present target.
    pub target: Vec<f64>,
    /// The target of the period with the least error, and the root mean square of that error.
    pub best: Vec<f64>,
    /// The root mean square of the least error; none before the first period.
    pub best_rmse: Option<f64>,
    /// From how many periods it has learned.
    pub learned: u32,
    /// The factor of the gain: halved with every period that was not accepted.
    pub trust: f64,
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
}
