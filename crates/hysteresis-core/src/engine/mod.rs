//! What evaluates a model, forward and inverse, between and across breakpoints, and what it remembers.
//!
//! Nested thresholds run on the turning-point [`engine`](turning_point_engine::Engine); anything else on the
//! [`bank`](bank::Bank) of operators. Inputs here are relative to the input offset, outputs to the output offset.

#[cfg(feature = "alloc")]
mod bank;
mod branch;
#[cfg(feature = "alloc")]
mod branch_state;
mod checks;
#[cfg(feature = "alloc")]
mod compiled_model;
mod direction;
#[cfg(feature = "alloc")]
mod engine_changes;
mod engine_state;
mod families;
mod family;
#[cfg(feature = "alloc")]
mod heap_memory;
mod inverse_search;
mod line;
mod lookup;
mod memory;
#[cfg(feature = "alloc")]
mod memory_state;
#[cfg(feature = "alloc")]
mod other_method;
mod search;
mod solve;
mod turning_point_engine;
mod turning_points;
#[cfg(feature = "alloc")]
mod vectors;

#[cfg(feature = "alloc")]
pub(crate) use checks::{check_same, count_as_f64};
#[cfg(feature = "alloc")]
pub use compiled_model::{CompiledModel, Method};
pub use direction::Direction;
pub(crate) use families::{Evaluates, Families};
#[cfg(feature = "alloc")]
pub(crate) use heap_memory::HeapMemory;
pub(crate) use line::{Line, Piece};
pub(crate) use memory::Memory;
#[cfg(feature = "alloc")]
pub use memory_state::{BankState, FamilyState, MemoryState, TurningPointState};
pub(crate) use solve::{Point, Reach};
pub(crate) use turning_point_engine::Engine;
pub use turning_points::TurningPoint;
