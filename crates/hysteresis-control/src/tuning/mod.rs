//! Gains of the proportional-integral feedback from the dynamics behind a hysteresis.

mod feedback;
mod margins;
mod options;
mod response;
mod search;
mod tune;

pub use margins::Margins;
pub use options::{Tuning, TuningOptions};
pub use tune::{loop_margins, tune};
