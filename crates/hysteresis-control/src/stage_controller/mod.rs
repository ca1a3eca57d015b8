//! One object for the loop of a stage: controller, observer and learning.

mod controller;
mod state;

pub use controller::StageController;
pub use state::StageControllerState;
