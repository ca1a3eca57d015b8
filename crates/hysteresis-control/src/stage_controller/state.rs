//! All that the loop of a stage remembers, as plain values.

use hysteresis_core::ControllerState;
use serde::{Deserialize, Serialize};

use crate::learning::RepetitiveState;
use crate::observer::ObserverState;

/// Everything that a [`StageController`](super::StageController) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageControllerState {
    /// Feed-forward and feedback.
    pub controller: ControllerState,
    /// The observer, if there is one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub observer: Option<ObserverState>,
    /// Learning, if there is any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repetitive: Option<RepetitiveState>,
    /// For how many samples nothing is learned.
    #[serde(default)]
    pub rest_samples: u32,
}
