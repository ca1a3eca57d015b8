//! A controller for an array of actuators: exact inverses, an integral through a reconstruction matrix, limits of every drive
//! and of the differences between neighbours.
//!
//! Each file knows only those above it: `options`, `counters`, `feedback`, `pairs`; `loop_state`; `controller`, `law`, and
//! `changes`, which changes a running one.

mod changes;
mod controller;
mod counters;
mod feedback;
mod law;
mod loop_state;
mod options;
mod pairs;

pub use controller::{ArrayController, ArraySample};
pub use counters::ArrayCounters;
pub use loop_state::{ArrayControllerState, ArrayStop};
pub use options::ArrayOptions;
