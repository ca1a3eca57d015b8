//! What the models are exercised with: the linear dynamics behind the hysteresis of an actuator, and test signals.

#![forbid(unsafe_code)]

pub mod excitation;
pub mod learning;
pub mod linear;
mod observer;
pub mod signals;

pub use observer::{Observer, ObserverOptions};
