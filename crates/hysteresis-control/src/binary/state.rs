//! Saved states as bytes. Where the text of a state leaves fields out, its bytes have them all.

use hysteresis_core::{
    Biquad, ControllerState, DriveLimits, FeedForwardState, LoopState, PreviewState, QuasiStaticState,
};
use serde::{Deserialize, Serialize};

use super::{Binary, Kind, Sampled, pack, unpack, unpack_grown};
use crate::learning::{RepetitiveOptions, RepetitiveState, Supervision};
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
#[serde(remote = "RepetitiveState")]
struct UnsupervisedLearning {
    model: u64,
    dt: f64,
    period: usize,
    options: RepetitiveOptions,
    corrections: Vec<f64>,
    errors: Vec<f64>,
    sum: f64,
    waited: u64,
    rejected: u64,
    #[serde(skip)]
    supervision: Supervision,
}

#[derive(Serialize, Deserialize)]
struct OfLearning(#[serde(with = "UnsupervisedLearning")] RepetitiveState);

/// What bytes had before there was a supervisor. It comes behind them now.
#[derive(Serialize, Deserialize)]
struct UnsupervisedStageController {
    #[serde(with = "WholeController")]
    controller: ControllerState,
    observer: Option<ObserverState>,
    repetitive: Option<OfLearning>,
    rest_samples: u32,
}

#[derive(Serialize, Deserialize)]
struct OfController(#[serde(with = "WholeController")] ControllerState);

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
        let Self { controller, observer, repetitive, rest_samples } = self.clone();
        let supervision = repetitive.as_ref().map(|learning| learning.supervision.clone());
        let repetitive = repetitive.map(OfLearning);
        let unsupervised = UnsupervisedStageController { controller, observer, repetitive, rest_samples };
        match supervision {
            Some(supervision) => pack(Kind::StageController, &(unsupervised, supervision)),
            None => pack(Kind::StageController, &unsupervised),
        }
    }

    fn from_bytes(bytes: &[u8]) -> Result<Self, Error> {
        let (unsupervised, supervision) = unpack_grown(Kind::StageController, bytes)?;
        let UnsupervisedStageController { controller, observer, repetitive, rest_samples } = unsupervised;
        let repetitive = match (repetitive, supervision) {
            (None, Some::<Supervision>(_)) => {
                let (expected, got) = (Kind::StageController.name(), "a supervisor without learning".into());
                return Err(Error::Bytes { expected, got });
            }
            (None, None) => None,
            (Some(OfLearning(learning)), supervision) => {
                Some(RepetitiveState { supervision: supervision.unwrap_or_default(), ..learning })
            }
        };
        Ok(Self { controller, observer, repetitive, rest_samples })
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
