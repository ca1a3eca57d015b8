//! Identification of the linear part behind a known hysteresis model: the cascade of Remark 1 of the paper.

mod identification;
mod options;

pub use identification::{DynamicsIdentification, identify_dynamics};
pub use options::DynamicsOptions;
