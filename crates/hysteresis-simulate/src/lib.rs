//! What the models are exercised with: the linear dynamics behind the hysteresis of an actuator, whole plants with
//! converters and noise, closed loops and their errors, and test signals.

#![forbid(unsafe_code)]

pub mod closed_loop;
pub mod excitation;
pub mod linear;
pub mod metrics;
pub mod plant;
pub mod signals;
