//! A stage for other tools.
//!
//! - [`c_header`]: its constants for C and C++, and the stage itself as bytes.
//! - [`MockUp`]: what a functional mock-up unit (FMI 2.0, co-simulation) says of itself. [`Simulation`] is what runs in
//!   it; `hysteresis-fmu` is the shared library around that. Both use one table of variables.
//!
//! Nothing is computed here: constants are those of the stage, and what runs is made by it.

mod c_header;
mod error;
mod mock_up;
mod simulation;

pub use c_header::{HeaderOptions, c_header, c_name};
pub use error::Error;
pub use mock_up::MockUp;
pub use simulation::{Kind, Settings, Simulation, Source};

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
