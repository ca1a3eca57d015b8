//! What the models are exercised with: the linear dynamics behind the hysteresis of an actuator, and test signals.

#![forbid(unsafe_code)]

pub mod excitation;
pub mod linear;
pub mod signals;
