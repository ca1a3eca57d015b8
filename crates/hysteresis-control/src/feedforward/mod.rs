//! Feed-forward through the inverse of linear dynamics: what the hysteresis has to put out, so that the position behind
//! the dynamics follows the reference.
//!
//! y(k) is the position read at t_k, w(k) the input of the dynamics put out at t_k and held until t_(k+1), see
//! [`linear`](crate::linear). Two ways lead from a reference r to the w with y(k) = r(k):
//!
//! - [`DynamicsInverse`], for a reference whose samples are all known: stable inversion over the whole record, from rest.
//! - [`PreviewCoefficients`], sample by sample: a weighted sum of references of which some lie ahead.
//!
//! w then goes through the exact inverse of the hysteresis. Both take any stable [`LinearDynamics`] with any dead time:
//! resonances, antiresonances, zeros in the right half plane, modes above half the sampling rate.
//!
//! Between samples the held input leaves a ripple: behind a resonance f of a sine of the frequency F about
//! (pi F T)^2 / 6 of what the resonance adds, and next to corners what [`DynamicsInverse`] says.

mod inverse;
mod preview;

pub use inverse::DynamicsInverse;
pub use preview::{PreviewCoefficients, PreviewOptions, smoothing_kernel};

use crate::linear::{Block, Error, LinearDynamics};

/// Where the position is furthest from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// The sample of the reference.
    pub sample: usize,
    /// How far, in its unit.
    pub error: f64,
}

/// How far from the reference the position comes that `inputs` of the dynamics lead to, from rest at the position
/// `start`; nothing if all samples pass before the start has faded.
///
/// The first samples are left out, the dead time and 7 [settling times](LinearDynamics::settling_time): what rests
/// cannot follow a reference that starts with a velocity, and exp(-7) of that is left.
///
/// ```
/// use hysteresis_control::feedforward::{DynamicsInverse, worst_miss};
/// use hysteresis_control::linear::SecondOrder;
/// let stage = SecondOrder::new(800.0, 0.02)?.into();
/// let turn = std::f64::consts::TAU / 1000.0;
/// let reference: Vec<f64> = (0..=5000).map(|k| (turn * f64::from(k)).cos()).collect(); // ends at rest
/// let inputs = DynamicsInverse::new(&stage, 1e-4)?.invert(&reference, None)?;
/// let plain = worst_miss(&stage, 1e-4, &reference, &reference, 1.0)?.unwrap();
/// let miss = worst_miss(&stage, 1e-4, &reference, &inputs, 1.0)?.unwrap();
/// assert!(plain.error > 3e-3 && miss.error < 1e-6);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
///
/// # Errors
/// As for [`LinearDynamics::block`].
pub fn worst_miss(
    dynamics: &LinearDynamics,
    dt: f64,
    reference: &[f64],
    inputs: &[f64],
    start: f64,
) -> Result<Option<Miss>, Error> {
    let mut block = dynamics.block(dt)?;
    block.settle(start / dynamics.static_gain());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let settled = ((dynamics.dead_time() + 7.0 * dynamics.settling_time()) / dt).ceil() as usize;
    let rows = inputs.iter().zip(reference).enumerate();
    let errors = rows.map(|(sample, (input, r))| Miss { sample, error: (block.step(*input) - r).abs() });
    Ok(errors.filter(|miss| miss.sample > settled).max_by(|a, b| a.error.total_cmp(&b.error)))
}
