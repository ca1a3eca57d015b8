//! Several drives and positions that share their dynamics, with scalar hysteresis in front of or inside them.
//!
//! x+ = A x + B u + Bw w, q = Cq x + Dq u, w = H\[q\], y = C x + D u + offset. `operator` is one H; `model` the
//! parameters, their checks and their file; `forward` runs it, `inverse` finds the drives for a whole reference.
//! `tracking` leads it along references sample by sample, with the gains of `tracking_gains`; `controller` is its loop.
//! `of_oscillator` samples hysteresis inside one mode; `sub_steps` sees several steps as one.

mod controller;
mod forward;
mod inverse;
mod model;
mod of_oscillator;
mod operator;
mod sub_steps;
mod tracking;
mod tracking_gains;

pub use crate::json_file::FileError;
pub use controller::{MultiAxisStageController, MultiAxisStageState};
pub use forward::{MultiAxisForward, MultiAxisForwardState};
pub use inverse::{Precompensation, PrecompensationOptions};
pub use model::{Matrices, MultiAxisStage, SCHEMA};
pub use operator::{OperatorState, ScalarOperator};
pub use tracking::{Tracking, TrackingState};
pub use tracking_gains::TrackingOptions;
