//! What evaluates a model, forward and inverse, between and across breakpoints, and what it remembers.
//!
//! Nested thresholds run on the turning-point [`Engine`]; anything else on the [`bank`] of operators. Inputs here are
//! relative to the input offset, outputs to the output offset.
//!
//! The way of a sample that leaves its line: a stream calls its [`Memory`], which for models of any size is the one in
//! `compiled_model`. `turning_point_engine` turns round if the input does, and moves both families ahead: `branch`
//! takes off the turning points that are passed and finds the operators that begin to slide, by the tables of `family`
//! and `lookup`. The sums of `family` give the next line. A bank takes one pass over all its operators instead, in
//! `bank::loops`.

#[cfg(feature = "alloc")]
mod bank;
mod branch;
#[cfg(feature = "alloc")]
mod compiled_model;
mod family;
mod lookup;
mod memory;
mod polyline;
#[cfg(feature = "alloc")]
mod state_of_other_method;
mod turning_point_engine;
#[cfg(feature = "alloc")]
mod turning_point_state;
#[cfg(feature = "alloc")]
mod vectors;

#[cfg(feature = "alloc")]
pub use bank::BankState;
pub use branch::TurningPoint;
#[cfg(feature = "alloc")]
pub(crate) use compiled_model::HeapMemory;
#[cfg(feature = "alloc")]
pub use compiled_model::{CompiledModel, MemoryState, Method};
pub(crate) use family::{Evaluates, Families};
pub(crate) use memory::Memory;
pub use polyline::Direction;
pub(crate) use polyline::{Line, Piece, Point, Reach};
pub(crate) use turning_point_engine::Engine;
#[cfg(feature = "alloc")]
pub use turning_point_state::{FamilyState, TurningPointState};
