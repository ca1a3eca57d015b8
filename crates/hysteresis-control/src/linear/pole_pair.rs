//! Dynamics of one pole or two.

use super::{Error, FirstOrder, LinearBlock, LinearDynamics, SecondOrder, Section, StateSpace};

/// Second-order dynamics or a first-order lag: what follows the hysteresis in the cascade of Remark 1 of the paper.
///
/// ```
/// use hysteresis_control::linear::{Block, Dynamics, FirstOrder};
/// let mut lag = Dynamics::from(FirstOrder::new(100.0)?).block(1e-3)?;
/// assert!((lag.advance(1.0) - (1.0 - (-0.2 * core::f64::consts::PI).exp())).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dynamics {
    /// A lag.
    FirstOrder(FirstOrder),
    /// A resonance, or two lags.
    SecondOrder(SecondOrder),
}

impl Dynamics {
    /// The block for a sampling interval in seconds, at rest at zero.
    ///
    /// # Errors
    /// As for [`LinearDynamics::block`].
    pub fn block(&self, dt: f64) -> Result<LinearBlock, Error> {
        LinearDynamics::from(*self).block(dt)
    }
}

impl From<FirstOrder> for Dynamics {
    fn from(lag: FirstOrder) -> Self {
        Self::FirstOrder(lag)
    }
}

impl From<SecondOrder> for Dynamics {
    fn from(resonance: SecondOrder) -> Self {
        Self::SecondOrder(resonance)
    }
}

impl From<Dynamics> for Section {
    fn from(dynamics: Dynamics) -> Self {
        match dynamics {
            Dynamics::FirstOrder(lag) => lag.into(),
            Dynamics::SecondOrder(resonance) => resonance.into(),
        }
    }
}

impl From<Dynamics> for StateSpace {
    fn from(dynamics: Dynamics) -> Self {
        Section::from(dynamics).state_space()
    }
}
