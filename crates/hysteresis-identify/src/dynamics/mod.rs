//! Identification of the linear part behind a known hysteresis model: the cascade of Remark 1 of the paper.

mod findings;
mod identification;
mod options;
mod response;
mod search;
mod uncertainty;

pub use identification::{DynamicsIdentification, identify_dynamics};
pub use options::DynamicsOptions;
pub use uncertainty::Uncertainty;
