//! Filters and gains of the proportional-integral feedback from the dynamics behind a hysteresis.
//!
//! Each file knows only those above it: `search` in one dimension; `loop_response`, a loop of given gains over
//! frequency; `family`, the dynamics that may be; `result`, what is asked for and what was found; `tune`, the search
//! for it.

mod family;
mod loop_response;
mod result;
mod search;
mod tune;

pub use family::ModeUncertainty;
pub(crate) use family::{DAMPED, family, light_modes, modes};
pub use loop_response::Margins;
pub use result::{LoopFamily, Structure, Tuning, TuningOptions};
pub use tune::{loop_margins, tune};
