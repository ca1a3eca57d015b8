//! Hysteresis of piezo actuators: the coupled-play (CP) operator, the modified Prandtl-Ishlinskii (MPI) model and
//! its exact inverse, sample by sample, at a cost that does not grow with the number of operators.
//!
//! After G. Wang, G. Chen, H. Zhou, F. Bai, "Modeling and Tracking Control for Piezoelectric Actuator Based on a New
//! Asymmetric Hysteresis Model", IEEE/CAA J. Autom. Sinica 4(4), 782-791, 2017. Equation and table numbers are those
//! of the paper; its misprints are corrected as listed in docs/paper.md.
//!
//! Parameters are immutable and shared, state is a separate plain value, and a stream pairs the two. Everything that
//! can fail fails at construction: [`Process::step`] and [`Process::peek`] never allocate, lock, panic, log or read a
//! clock.
//!
//! The crate needs no standard library (only `alloc`) and has no dependency unless the feature `json` is on.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod control;
pub mod embedded;
mod engine;
mod error;
mod filter;
mod fingerprint;
mod inverse;
mod model;
mod operator;
mod process;
mod quasistatic;
mod real;
mod store;
mod stream;

pub use control::{
    AntiWindup, ArrayController, ArrayControllerState, ArrayCounters, ArrayOptions, ArraySample, ArrayStop,
    AxesCommand, AxisMatrix, Command, ControllerOptions, ControllerState, Counters, DriveLimits, FeedForward,
    FeedForwardState, HybridController, Law, LoopState, Mode, MultiAxisController, MultiAxisState, Preview,
    PreviewState, StopRamp, Terms,
};
pub use engine::{CompiledModel, Direction, FamilyState, MemoryState, Method, TurningPoint, TurningPointState};
pub use error::{Bound, Error, MAX_MAGNITUDE, check_all_finite, check_length, is_admissible};
pub use filter::{Biquad, Filter, FilterState, MAX_SECTIONS, Sections};
pub use fingerprint::Fingerprint;
#[cfg(feature = "json")]
pub use model::{JsonError, SCHEMA, SCHEMA_SPLIT};
pub use model::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};
pub use operator::{CoupledPlay, Operator, Play, Tracked};
pub use process::Process;
pub use quasistatic::{
    Bracket, BracketArray, BracketState, CreepTerms, LoopShiftTerms, PiecewiseLinearMap, QuasiStatic,
    QuasiStaticForward, QuasiStaticInverse, QuasiStaticState,
};
pub use real::Real;
pub use stream::{ActuatorError, Forward, Inverse, StreamArray, StreamState};

/// The example of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;
