//! What controls an actuator beside the sample-by-sample controller of the core: the linear dynamics behind its
//! hysteresis, feed-forward through their inverse, references with their derivatives, gains for the feedback, learning
//! from periods that repeat, and observation of the position behind a noisy measurement.

#![forbid(unsafe_code)]

pub mod binary;
pub mod feedforward;
pub mod filters;
mod guarded;
pub mod learning;
pub mod linear;
mod observer;
pub mod sampling;
mod saved;
pub mod stage;
mod stage_controller;
pub mod trajectory;
pub mod tuning;

pub use guarded::guarded;
pub use observer::{Observer, ObserverOptions, ObserverState};
pub use stage_controller::{StageController, StageControllerState};

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
