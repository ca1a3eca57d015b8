use serde::{Deserialize, Serialize};

use super::options::ObserverOptions;
use crate::stage::StageState;

/// Everything that an [`Observer`](super::Observer) remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObserverState {
    /// How much is believed.
    pub options: ObserverOptions,
    /// The model of the stage.
    pub stage: StageState,
    /// What the model does not know: the distance of the modes from rest, and the disturbance at their input.
    pub unknown: Vec<f64>,
    /// The covariance of the unknown, row by row, in units of the variance of the noise; none where it has settled.
    pub covariance: Option<Vec<f64>>,
    /// Whether the drive that is held until the next measurement has been taken.
    #[serde(default)]
    pub predicted: bool,
    /// How many drives or measurements were not finite.
    pub rejected: u64,
}
