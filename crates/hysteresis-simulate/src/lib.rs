//! What the models are exercised with: the linear dynamics behind the hysteresis of an actuator, whole plants with
//! converters and noise, closed loops and their errors; references with their derivatives, feed-forward through inverse
//! dynamics, gains for the feedback, learning and observation; and test signals.

#![forbid(unsafe_code)]

pub mod closed_loop;
pub mod excitation;
pub mod learning;
pub mod linear;
pub mod metrics;
mod observer;
pub mod paper;
pub mod plant;
pub mod shaping;
pub mod signals;
pub mod tracking;
pub mod trajectory;
pub mod tuning;

pub use observer::{Observer, ObserverOptions};
