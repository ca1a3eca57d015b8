//! What models and controllers are exercised with: plants with converters and noise, closed loops and their errors,
//! test signals, and the tables and benchmark plants of the paper.
//!
//! Rooms know only those above them:
//!
//! - [`signals`], and [`excitation`]: drives that make an actuator known.
//! - [`plant`]: a stage between its converters, of one axis or of several. [`driven`]: what a loop drives, a plant or
//!   anything else.
//! - [`metrics`]: the record of a loop and its errors.
//! - [`closed_loop`]: any controller, or that of a stage, with a plant and a reference; [`multi_axis`]: of several
//!   axes.
//! - [`paper`]: what belongs to the paper alone.

#![forbid(unsafe_code)]

pub mod closed_loop;
pub mod driven;
pub mod excitation;
pub mod metrics;
pub mod multi_axis;
pub mod paper;
pub mod plant;
pub mod signals;

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
