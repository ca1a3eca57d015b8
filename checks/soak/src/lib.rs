//! No drift: after any number of samples, the engine and its inverse equal a bank that has seen only what still
//! matters.
//!
//! [`Mixed`] targets go through the inverse within limits, its drive through the forward stream, so both see the same
//! history. [`Reduced`] keeps what is left of that history after the textbook's deletions, without a look at the
//! engine. At a checkpoint a fresh bank of operators is fed the reduced history, and both streams must equal it to
//! [`TOLERANCE`], now and for every move that may come next.

//!
//! [`loops`] are what runs around the inverse: controllers with filters, smoothed previews, observers and learning, of
//! one axis, of several and of arrays, with plants that show and do anything. No drive ever leaves limits or slew rate.

#![forbid(unsafe_code)]

pub mod loops;
mod signal;
mod soak;

pub use signal::{Mixed, Random};
pub use soak::{Failure, Reduced, Soak, TOLERANCE, actuator, bank};
