//! What the models are exercised with: the linear dynamics behind the hysteresis of an actuator, test signals,
//! references with their derivatives, feed-forward through inverse dynamics, and gains for the feedback.

#![forbid(unsafe_code)]

pub mod excitation;
pub mod linear;
pub mod shaping;
pub mod signals;
pub mod trajectory;
pub mod tuning;
