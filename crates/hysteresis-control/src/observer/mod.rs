//! The position behind a noisy measurement: the model of a stage, and a Kalman filter for what it does not know.

mod estimate;
mod filter;
mod options;
mod riccati;
mod state;

pub use estimate::Observer;
pub use options::ObserverOptions;
pub use state::ObserverState;
