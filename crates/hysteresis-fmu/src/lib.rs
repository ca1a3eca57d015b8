//! A functional mock-up unit of FMI 2.0 for co-simulation, around [`hysteresis_export::Simulation`].
//!
//! The names and types are those of `fmi2Functions.h`. 2.0 is the version that most tools take. One library serves all
//! units: it reads what it is to run from `resources/settings.json` and `resources/stage.json`.
//!
//! `component` is an instance, from its resources to what becomes of a call; `functions` are the calls.
//!
//! # Pointers
//! As the standard asks of the tool that calls: a component came from [`fmi2Instantiate`] and was not freed; arrays
//! have as many elements as is said beside them; texts end with a zero byte. A component that may be NULL is an
//! `Option` of a reference.
//!
//! # Panics
//! Every function that may fail runs behind [`guarded`](hysteresis_control::guarded), so that none unwinds into the
//! tool.

mod component;
mod functions;

pub use component::*;
pub use functions::*;
