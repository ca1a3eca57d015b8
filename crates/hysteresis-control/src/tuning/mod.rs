//! Filters and gains of the proportional-integral feedback from the dynamics behind a hysteresis.
//!
//! Each file knows only those above it: `search`, `open_loop`, `response`, `feedback`; `margins`, `bandwidth`, `gains`; `family`,
//! `structure`, `options`; `problem`, `tune`; `loop_family`, `explanation`.

mod bandwidth;
mod explanation;
mod family;
mod feedback;
mod gains;
mod loop_family;
mod margins;
mod open_loop;
mod options;
mod problem;
mod response;
mod search;
mod structure;
mod tune;

pub use family::ModeUncertainty;
pub(crate) use family::{DAMPED, family, light_modes, modes};
pub use loop_family::LoopFamily;
pub use margins::Margins;
pub use options::{Tuning, TuningOptions};
pub use structure::Structure;
pub use tune::{loop_margins, tune};
