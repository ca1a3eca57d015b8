//! Identification while the actuator runs: recursive least squares with forgetting, sample by sample.

mod bounds;
mod covariance;
mod identifier;
mod options;
mod regressors;
mod restore;
mod state;

pub use identifier::RecursiveIdentifier;
pub use options::RecursiveOptions;
pub use regressors::MIN_IDENTITY_SHARE;
pub use state::{Frozen, RecursiveState};
