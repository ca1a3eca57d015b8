//! Feed-forward through the inverse of linear dynamics: what the hysteresis has to put out, so that the position behind
//! the dynamics follows the reference.
//!
//! A [chain](LinearDynamics) of delay d T, amplifier pole and dynamics has the inverse (1 + a_1 s + a_2 s^2 + a_3 s^3) exp(s d T), and
//! an output that is held from sample to sample lags by half a sample more. So the target at the sample k is
//!
//! target(k) = r + a_1 r' + a_2 r'' + a_3 r''' at the time t_k + T / 2 + d T.
//!
//! [`Shaper`] holds these numbers. The derivatives come from a [`Trajectory`] in closed form, from samples that are
//! known in advance ([`Shaper::shape`]), or, sample by sample, from a window of references of which some lie ahead
//! ([`Shaper::preview`]). The target then goes through the exact inverse of the hysteresis.
//!
//! What is left of a sine of the frequency F is the unevenness of the hold, (pi F T)^2 / 6 of it for two poles or more:
//! 1.6e-4 at 100 Hz and 10 kHz, a hundredth of that at 10 Hz. Behind a lag of cut-off f alone pi^2 f F T^2 / 3 is added.

mod preview;
mod samples;
mod stencil;

pub use preview::{PreviewCoefficients, PreviewOptions};
pub use samples::{Miss, worst_miss};

use core::f64::consts::TAU;

use crate::linear::{Error, LinearDynamics, Section};
use crate::trajectory::Trajectory;

/// The inverse of [`LinearDynamics`] as a polynomial of derivatives at a later time.
///
/// ```
/// use hysteresis_control::linear::SecondOrder;
/// use hysteresis_control::feedforward::Shaper;
/// use hysteresis_control::trajectory::Sine;
/// let stage = SecondOrder::new(400.0, 0.95)?.into();
/// let shaper = Shaper::new(&stage, 1e-4)?;
/// assert!((shaper.terms()[1] - 2.0 * 0.95 / (core::f64::consts::TAU * 400.0)).abs() < 1e-18);
/// assert_eq!(shaper.lead(), 0.5e-4);
/// let target = shaper.target(&Sine::new(3.3, 20.0, 0.0)?, 0.0);
/// assert!(target > 0.3); // um ahead of the reference, which is at zero
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Shaper {
    terms: [f64; 4],
    order: usize,
    /// Samples.
    lead: f64,
    dt: f64,
}

impl Shaper {
    /// From the linear part and the sampling interval in seconds.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0 and the inverse has finite terms.
    pub fn new(dynamics: &LinearDynamics, dt: f64) -> Result<Self, Error> {
        crate::linear::check_positive("dt", None, dt)?;
        let (mut terms, mut order) = ([1.0, 0.0, 0.0, 0.0], 0);
        for section in dynamics.sections() {
            let [first, second] = match section {
                Section::FirstOrder(lag) => [lag.time_constant(), 0.0],
                Section::SecondOrder(resonance) => {
                    let w = TAU * resonance.frequency();
                    [2.0 * resonance.damping() / w, (1.0 / w).powi(2)]
                }
                _ => {
                    let expected = "first-order and second-order sections";
                    return Err(Error { parameter: "dynamics", index: None, expected, got: f64::NAN });
                }
            };
            order += if second == 0.0 { 1 } else { 2 };
            let product = |m: usize| {
                let term = |back: usize| m.checked_sub(back).map_or(0.0, |i: usize| terms[i]);
                term(0) + first * term(1) + second * term(2)
            };
            terms = [product(0), product(1), product(2), product(3)];
        }
        if order > 3 {
            let expected = "an order of at most 3";
            return Err(Error { parameter: "dynamics", index: None, expected, got: f64::NAN });
        }
        if terms.iter().any(|term| !term.is_finite()) {
            let expected = "dynamics and amplifier whose inverse has finite terms";
            return Err(Error { parameter: "dynamics", index: None, expected, got: terms[order] });
        }
        Ok(Self { terms, order, lead: 0.5 + dynamics.dead_time() / dt, dt })
    }

    /// 1, a_1, a_2, a_3: of the reference and its derivatives, in s^m.
    #[must_use]
    pub fn terms(&self) -> [f64; 4] {
        self.terms
    }

    /// The number of derivatives that count, 0 to 3.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// By how many seconds the target looks ahead: T / 2 + d T.
    #[must_use]
    pub fn lead(&self) -> f64 {
        self.lead * self.dt
    }

    /// The target of the sample that is put out at the time t in seconds.
    pub fn target(&self, trajectory: &(impl Trajectory + ?Sized), t: f64) -> f64 {
        let motion = trajectory.at(t + self.lead());
        let [_, a1, a2, a3] = self.terms;
        motion.position + a1 * motion.velocity + a2 * motion.acceleration + a3 * motion.jerk
    }
}
