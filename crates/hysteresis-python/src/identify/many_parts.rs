//! The operators of a model of any kind, as arrays.

use hysteresis_core::{CoupledPlay, Model, Offsets, Play};

/// The operators of a model, as arrays.
pub(super) struct Parts {
    pub(super) weights: Vec<f64>,
    pub(super) weights_negative: Vec<f64>,
    pub(super) thresholds: Vec<f64>,
    pub(super) offsets: Offsets,
}

impl Parts {
    pub(super) fn of(model: &Model) -> Self {
        match model {
            Model::Conventional(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights().to_vec(),
                thresholds: model.operators().iter().map(Play::r).collect(),
                offsets: model.offsets(),
            },
            Model::Modified(model) => Self {
                weights: model.weights().to_vec(),
                weights_negative: model.weights_negative().to_vec(),
                thresholds: model.operators().iter().map(CoupledPlay::r).collect(),
                offsets: model.offsets(),
            },
        }
    }
}
