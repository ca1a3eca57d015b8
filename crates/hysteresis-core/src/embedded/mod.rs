//! Models and streams of a fixed size, without an allocator: for firmware.
//!
//! [`Model<T, N>`](Model) has room for N operators and works with numbers T, `f64` or `f32`. [`Forward`] and [`Inverse`] are its
//! streams; each owns its model, or borrows one that several share. They run on the same engine as the streams on the heap: with
//! `f64` their outputs are those of [`crate::Forward`](../struct.Forward.html) and [`crate::Inverse`](../struct.Inverse.html) bit for
//! bit.
//!
//! ```
//! use hysteresis_core::embedded::{Inverse, Model};
//! use hysteresis_core::{Offsets, Process, Ratios};
//! let (weights, r) = ([4.3e-3, 1.7e-3, 1.7e-3], [0.0, 150.0, 300.0]); // um/V, V
//! let model = Model::<f32, 3>::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default())?;
//! let mut inverse = Inverse::new(model, Some((-500.0, 500.0)))?; // V
//! let drive: f32 = inverse.step(1.5); // V for 1.5 um: in the interrupt of a timer
//! assert!((drive - 292.5).abs() < 1e-3 && !inverse.saturated());
//! # Ok::<(), hysteresis_core::Error>(())
//! ```
//!
//! **Single precision.** Sums over operators are kept in `f64`, whatever T is, and only the line on which a stream is has numbers T.
//! So the error of `f32` does not grow with operators, turning points or time. With u = 6e-8, half of the distance from 1 to the next
//! `f32`, an output is off by at most u times
//!
//! ```text
//! 4 |slope x| + 2 |offset of the line| + sum_i w_i a_i + |output offset| + |y|
//! ```
//!
//! for rounding of the input x behind its offset, of the line, of the thresholds a_i and of the sum. Over the range of the drive that
//! is about 8 u, 5e-7 of the range of the output. The tests ask for 1e-6 of that range, with up to 100 operators and signals of every
//! kind, for the model and for the model behind its inverse.

mod forward;
mod inverse;
mod model;

pub use forward::Forward;
pub use inverse::Inverse;
pub use model::{Holds, Model};
