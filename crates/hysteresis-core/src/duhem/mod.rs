//! Duhem hysteresis: z' = f+(z) x' where x rises, z' = f-(z) x' where it falls, with exact branches and an exact
//! inverse.
//!
//! `exponential` has the two functions that a branch needs, `chain` the branch of one direction, `parameters` both of
//! them, `motion` the memory, and `stream` what steps.

mod chain;
mod exponential;
mod motion;
mod parameters;
mod stream;

pub use motion::DuhemState;
pub use parameters::Duhem;
pub use stream::{DuhemForward, DuhemInverse, DuhemInverseState};
