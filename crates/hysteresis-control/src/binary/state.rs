//! Saved states as bytes. Where the text of a state leaves fields out, its bytes have them all.

use hysteresis_core::{
    Biquad, ControllerState, DriveLimits, FeedForwardState, LoopState, PreviewState, QuasiStaticState,
};
use serde::{Deserialize, Serialize};

use super::{Binary, Kind, Sampled, pack, unpack};
use crate::learning::RepetitiveState;
use crate::observer::ObserverState;
use crate::stage::{Error, StageState};
use crate::stage_controller::StageControllerState;

#[derive(Serialize, Deserialize)]
#[serde(remote = "ControllerState")]
struct WholeController {
    kp: f64,
    ki: f64,
    dt: f64,
    filters: Vec<Biquad>,
    limits: DriveLimits,
    feedback_loop: LoopState,
    feedforward: Option<FeedForwardState>,
    preview: Option<PreviewState>,
}

#[derive(Serialize, Deserialize)]
#[serde(remote = "StageControllerState")]
struct WholeStageController {
    #[serde(with = "WholeController")]
    controller: ControllerState,
    observer: Option<ObserverState>,
    repetitive: Option<RepetitiveState>,
    rest_samples: u32,
}

#[derive(Serialize, Deserialize)]
struct OfController(#[serde(with = "WholeController")] ControllerState);

#[derive(Serialize, Deserialize)]
struct OfStageController(#[serde(with = "WholeStageController")] StageControllerState);

impl Binary for ControllerState {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::Controller, &OfController(self.clone()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        unpack(Kind::Controller, bytes).map(|OfController(state)| state)
    }
}

impl Binary for StageControllerState {
    fn to_bytes(&self) -> Vec<u8> {
        pack(Kind::StageController, &OfStageController(self.clone()))
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        unpack(Kind::StageController, bytes).map(|OfStageController(state)| state)
    }
}

/// States whose bytes have the fields of their text.
macro_rules! plain {
    ($($state:ty: $kind:ident),*) => {$(
        impl Binary for $state {
            fn to_bytes(&self) -> Vec<u8> {
                pack(Kind::$kind, self)
            }

            fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
                unpack(Kind::$kind, bytes)
            }
        }
    )*};
}

plain!(Sampled<StageState>: Forward, Sampled<QuasiStaticState>: Inverse, ObserverState: Observer);
