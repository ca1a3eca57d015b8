//! What the models are exercised with: test signals for actuators.

#![forbid(unsafe_code)]

pub mod excitation;
pub mod signals;
