//! Several axes that move each other: a hybrid controller for each actuator, and a matrix between axes and actuators.
//!
//! `matrix` knows nothing of controllers; `controller` has the steps, `changes` what changes a running one.

mod changes;
mod controller;
mod matrix;

pub use changes::MultiAxisState;
pub use controller::{AxesCommand, MultiAxisController};
pub use matrix::AxisMatrix;
