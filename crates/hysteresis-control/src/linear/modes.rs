//! Modes in parallel.

use hysteresis_core::check_all_finite;
use nalgebra::Complex;

use super::{Error, SecondOrder, StateSpace};

/// Second-order modes in parallel: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1).
///
/// The modal form of a mechanical structure. g_i is the share of mode i in the static gain; where neighbours have the
/// same sign there is an antiresonance between them. Modes that follow each other are in series instead:
/// [`LinearDynamics::then`](super::LinearDynamics::then).
///
/// ```
/// use hysteresis_control::linear::{LinearDynamics, Modes, SecondOrder};
/// let modes = Modes::new(&[0.8, 0.2], &[SecondOrder::new(800.0, 0.02)?, SecondOrder::new(1500.0, 0.01)?])?;
/// let dynamics = LinearDynamics::from(modes);
/// assert_eq!((dynamics.order(), dynamics.static_gain()), (4, 1.0));
/// assert_eq!(dynamics.zeros().len(), 2); // the antiresonance between both
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Modes {
    gains: Box<[f64]>,
    modes: Box<[SecondOrder]>,
}

impl Modes {
    /// From the share g_i and the resonance of each mode.
    ///
    /// # Errors
    /// [`Error`] unless there are as many gains as modes, at least one and at most 32, and the gains are finite and
    /// their sum is not 0.
    pub fn new(gains: &[f64], modes: &[SecondOrder]) -> Result<Self, Error> {
        if gains.len() != modes.len() || !(1..=32).contains(&gains.len()) {
            let expected = "one for each mode, 1 to 32";
            return Err(Error::whole("gains", None, expected, gains.len()));
        }
        check_all_finite("gains", gains)?;
        let (sum, size) = (gains.iter().sum::<f64>(), gains.iter().map(|gain| gain.abs()).sum::<f64>());
        if sum.abs() <= super::state_space::NO_GAIN * size {
            return Err(Error::domain("gains", None, "a sum that is not 0", sum));
        }
        Ok(Self { gains: gains.into(), modes: modes.into() })
    }

    /// g_i.
    #[must_use]
    pub fn gains(&self) -> &[f64] {
        &self.gains
    }

    /// The resonances.
    #[must_use]
    pub fn modes(&self) -> &[SecondOrder] {
        &self.modes
    }

    /// G(s).
    pub(super) fn at(&self, s: Complex<f64>) -> Complex<f64> {
        self.gains.iter().zip(&self.modes).map(|(gain, mode)| mode.denominator(s).inv() * *gain).sum()
    }
}

impl From<&Modes> for StateSpace {
    /// The states are those of the modes, one after the other.
    fn from(modes: &Modes) -> Self {
        let each = modes.gains.iter().zip(&modes.modes).map(|(gain, mode)| Self::from(*mode).scaled(*gain));
        let sum = each.reduce(|sum, mode| sum.beside(&mode)).unwrap_or_else(|| Self::constant(0.0));
        Self { gain: modes.gains.iter().sum(), ..sum }
    }
}
