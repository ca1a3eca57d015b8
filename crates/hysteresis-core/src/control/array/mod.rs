//! A controller for an array of actuators: exact inverses, an integral through a reconstruction matrix, limits of every drive
//! and of the differences between neighbours.

mod controller;
mod law;
mod options;
mod pairs;

pub use controller::{ArrayController, ArrayControllerState, ArrayStop};
pub use law::{ArrayCounters, ArraySample};
pub use options::ArrayOptions;
