//! What evaluates a model, forward and inverse, between and across breakpoints, and what it remembers.
//!
//! Nested thresholds run on the turning-point [`engine`](turning_point_engine::Engine); anything else on the
//! [`bank`](bank::Bank) of operators. Inputs here are relative to the input offset, outputs to the output offset.

mod bank;
mod branch;
mod checks;
mod compiled_model;
mod direction;
mod engine_state;
mod families;
mod family;
mod inverse_search;
mod line;
mod lookup;
mod memory;
mod memory_state;
mod search;
mod solve;
mod turning_point_engine;
mod turning_points;

pub(crate) use checks::{check_same, count_as_f64};
pub use compiled_model::{CompiledModel, Method};
pub use direction::Direction;
pub(crate) use line::{Line, Piece};
pub(crate) use memory::Memory;
pub use memory_state::{FamilyState, MemoryState, TurningPointState};
pub(crate) use solve::{Point, Reach};
pub use turning_points::TurningPoint;
