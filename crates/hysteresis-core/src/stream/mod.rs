//! Streams: a model paired with its memory, one sample at a time or in blocks, alone or many side by side.
//!
//! The way of a sample: `Forward::step` and `Inverse::step` in `heap` (in [`embedded`](crate::embedded) likewise) call
//! `step` of the trait `Walk` in `walk`. Where the sample lies on the straight line of the last one, that is all. Where
//! it leaves it, `walk` asks the memory of the stream to move, in [`engine`](crate::engine), and draws the next line.

#[cfg(feature = "alloc")]
mod array;
#[cfg(feature = "alloc")]
mod heap;
mod walk;

#[cfg(feature = "alloc")]
pub use array::{ActuatorError, StreamArray};
#[cfg(feature = "alloc")]
pub use heap::{Forward, Inverse, StreamState};
#[cfg(feature = "alloc")]
pub(crate) use walk::Look;
pub(crate) use walk::{ForwardCore, InverseCore, Walk};
