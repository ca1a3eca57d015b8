//! One hysteresis operator as a state machine: equations (1)-(3) and (5).
//!
//! An operator is a pure map from its last output and the new input to its new output. [`Tracked`] joins such a
//! map with its state, so that it can be stepped, peeked, reset and saved like every other stream.

mod coupled_play;
mod play;
mod tracked;

pub use coupled_play::CoupledPlay;
pub use play::Play;
pub use tracked::{Operator, Tracked};
