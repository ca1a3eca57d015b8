//! Streams: a model paired with its memory, one sample at a time or in blocks, alone or many side by side.
//!
//! `forward_core` and `inverse_core` are what every stream is, on the heap and in `embedded`.

#[cfg(feature = "alloc")]
mod array;
#[cfg(feature = "alloc")]
mod forward;
mod forward_core;
#[cfg(feature = "alloc")]
mod inverse;
mod inverse_core;
#[cfg(all(feature = "alloc", feature = "serde"))]
mod memory_form;
mod segment;
#[cfg(feature = "alloc")]
mod state;
mod walk;

#[cfg(feature = "alloc")]
pub use array::{ActuatorError, StreamArray};
#[cfg(feature = "alloc")]
pub use forward::Forward;
pub(crate) use forward_core::ForwardCore;
#[cfg(feature = "alloc")]
pub use inverse::Inverse;
pub(crate) use inverse_core::{InverseCore, unlimited};
#[cfg(feature = "alloc")]
pub use state::StreamState;
#[cfg(feature = "alloc")]
pub(crate) use state::check_model;
pub(crate) use walk::Walk;

use crate::error::{Bound, Error, check_admissible};
use crate::real::Real;

/// Limits (low, high) of a drive, checked; without any, all that is admissible.
pub(crate) fn check_limits<T: Real>(limits: Option<(T, T)>) -> Result<(T, T), Error> {
    let Some((low, high)) = limits else { return Ok(unlimited()) };
    check_admissible("limits", Some(0), low)?;
    check_admissible("limits", Some(1), high)?;
    if low < high {
        Ok((low, high))
    } else {
        let expected = Bound::Above { what: "the low limit", limit: low.wide() };
        Err(Error::Domain { parameter: "limits", index: Some(1), expected, got: high.wide() })
    }
}
