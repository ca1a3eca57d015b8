//! What models and controllers are exercised with: plants with converters and noise, closed loops and their errors, test
//! signals, and the tables and benchmark plants of the paper.

#![forbid(unsafe_code)]

pub mod closed_loop;
pub mod driven;
pub mod excitation;
pub mod metrics;
pub mod multi_axis;
pub mod paper;
pub mod plant;
pub mod signals;
pub mod tracking;

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
