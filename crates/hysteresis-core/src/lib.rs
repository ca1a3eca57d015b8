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
//! The crate needs no standard library and has no dependency unless a feature asks for one. Without the feature
//! `alloc`, which is on by default, it needs no allocator either: what is left is [`embedded`], models of a fixed size
//! and their streams, `f64` and `f32`, and [`HybridController`] over them, for firmware.

// Where to read. `operator` has one operator, `model` the parameters of many, `embedded` both model and streams of a
// fixed size. A sample of a stream begins in `stream`, and leaves it for `engine` where its straight line ends; each
// says the way in its first lines. `quasistatic` puts maps, creep and loop shift around the hysteresis, `control`
// closes the loop, with the sections of `filter` in it. Every file imports from those that come before it here, and
// none of these from it: `error`, `real`, `fingerprint`, `store`, `process`, `operator`, `duhem`, `filter`, `model`,
// `engine`, `stream`, `embedded`, `quasistatic`, `control`, `dsp_process`.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(feature = "alloc")]
extern crate alloc;
#[cfg(test)]
extern crate std;

mod control;
#[cfg(feature = "dsp_process")]
mod dsp_process;
mod duhem;
pub mod embedded;
mod engine;
mod error;
mod filter;
mod fingerprint;
mod model;
mod operator;
mod process;
#[cfg(feature = "alloc")]
mod quasistatic;
mod real;
mod store;
mod stream;

pub use control::{
    AntiWindup, Command, ControllerOptions, Counters, DriveSource, FeedForward, HybridController, Law, LoopState, Mode,
    Preview, StopRamp, Terms,
};
#[cfg(feature = "alloc")]
pub use control::{
    ArrayController, ArrayControllerState, ArrayCounters, ArrayInverse, ArrayOptions, ArraySample, ArrayStop,
    AxesCommand, AxisMatrix, ControllerState, DriveLimits, FeedForwardState, MultiAxisController,
    MultiAxisControllerState, PreviewState,
};
pub use duhem::{Duhem, DuhemForward, DuhemInverse, DuhemInverseState, DuhemState};
#[cfg(feature = "alloc")]
pub use engine::{BankState, CompiledModel, FamilyState, MemoryState, Method, TurningPointState};
pub use engine::{Direction, TurningPoint};
pub use error::{Bound, Error, MAX_MAGNITUDE, check_all_finite, check_length, check_model, is_admissible};
pub use filter::{Biquad, Filter, FilterState, MAX_SECTIONS, Sections};
pub use fingerprint::Fingerprint;
#[cfg(feature = "json")]
pub use model::{JsonError, SCHEMA, SCHEMA_SPLIT};
#[cfg(feature = "alloc")]
pub use model::{Model, ModifiedPrandtlIshlinskii, PrandtlIshlinskii};
pub use model::{Offsets, Ratios};
pub use operator::{CoupledPlay, Operator, Play, Tracked};
pub use process::Process;
#[cfg(feature = "alloc")]
pub use quasistatic::{
    Bracket, BracketArray, BracketState, CreepTerms, LoopShiftTerms, MAX_KNOTS, PiecewiseLinearMap, QuasiStatic,
    QuasiStaticForward, QuasiStaticInverse, QuasiStaticState, RelaxingPlayTerms, SlowGainTerms,
};
pub use real::{Real, unless_faded};
#[cfg(feature = "alloc")]
pub use stream::{ActuatorError, Forward, Inverse, StreamArray, StreamState};

/// The example of the README, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../README.md")]
struct Readme;

/// The example of docs/firmware.md, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../../../docs/firmware.md")]
struct Firmware;

/// The example of the README of this crate, run as a test.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct CrateReadme;
