//! Feed-forward through the inverse of linear dynamics: what the hysteresis has to put out, so that the position behind
//! the dynamics follows the reference.
//!
//! y(k) is the position read at t_k, w(k) the input of the dynamics put out at t_k and held until t_(k+1), see
//! [`linear`](crate::linear). Two ways lead from a reference r to the w with y(k) = r(k):
//!
//! - [`DynamicsInverse`], for a reference whose samples are all known: stable inversion over the whole record, from
//!   rest.
//! - [`PreviewCoefficients`], sample by sample: a weighted sum of references of which some lie ahead.
//!
//! w then goes through the exact inverse of the hysteresis. Both take any stable
//! [`LinearDynamics`](crate::linear::LinearDynamics) with any dead time: resonances, antiresonances, zeros in the right
//! half plane, modes above half the sampling rate.
//!
//! Between samples the held input leaves a ripple: behind a resonance f of a sine of the frequency F about
//! (pi F T)^2 / 6 of what the resonance adds, and next to corners what [`DynamicsInverse`] says.

mod inverse;
mod preview;

pub use inverse::DynamicsInverse;
pub use preview::{PreviewCoefficients, PreviewOptions, smoothing_kernel};
