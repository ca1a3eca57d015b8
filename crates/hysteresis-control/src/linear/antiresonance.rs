//! A resonance below or above an antiresonance.

use nalgebra::{Complex, DMatrix, DVector};

use super::{SecondOrder, StateSpace};

/// An antiresonance and the resonance that belongs to it, of unit static gain:
///
/// G(s) = ((s/w_a)^2 + 2 zeta_a s/w_a + 1) / ((s/w)^2 + 2 zeta s/w + 1).
///
/// At the antiresonance w_a a part of the structure takes up the force that would move the position. Far above both the
/// gain is (w / w_a)^2.
///
/// ```
/// use hysteresis_control::linear::{Antiresonance, LinearDynamics, SecondOrder};
/// let pair = Antiresonance::new(SecondOrder::new(600.0, 0.01)?, SecondOrder::new(650.0, 0.01)?);
/// let dynamics = LinearDynamics::from(SecondOrder::new(800.0, 0.02)?).then(pair);
/// assert_eq!(dynamics.static_gain(), 1.0);
/// assert!(dynamics.frequency_response(600.0).norm() < 0.32);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Antiresonance {
    zero: SecondOrder,
    pole: SecondOrder,
}

impl Antiresonance {
    /// From the frequency and damping of the antiresonance (the zeros) and of the resonance (the poles).
    #[must_use]
    pub fn new(zero: SecondOrder, pole: SecondOrder) -> Self {
        Self { zero, pole }
    }

    /// The antiresonance: w_a and zeta_a.
    #[must_use]
    pub fn zero(&self) -> SecondOrder {
        self.zero
    }

    /// The resonance: w and zeta.
    #[must_use]
    pub fn pole(&self) -> SecondOrder {
        self.pole
    }

    /// G(s).
    pub(super) fn at(self, s: Complex<f64>) -> Complex<f64> {
        self.zero.denominator(s) / self.pole.denominator(s)
    }
}

impl From<Antiresonance> for StateSpace {
    /// The states are p and p'/w behind the poles alone, p'' + 2 zeta w p' + w^2 p = w^2 u.
    fn from(Antiresonance { zero, pole }: Antiresonance) -> Self {
        let (wa, w) = (zero.radians(), pole.radians());
        let direct = (w / wa).powi(2);
        let velocity = 2.0 * w * (zero.damping() * wa - pole.damping() * w) / (wa * wa);
        let StateSpace { a, b, poles, .. } = pole.into();
        Self { a, b, c: DVector::from_vec(vec![1.0 - direct, velocity]), d: direct, gain: 1.0, poles }
    }
}

impl From<SecondOrder> for StateSpace {
    /// The states are y and y'/w.
    fn from(resonance: SecondOrder) -> Self {
        let (w, zeta) = (resonance.radians(), resonance.damping());
        Self {
            a: DMatrix::from_row_slice(2, 2, &[0.0, w, -w, -2.0 * zeta * w]),
            b: DVector::from_vec(vec![0.0, w]),
            c: DVector::from_vec(vec![1.0, 0.0]),
            d: 0.0,
            gain: 1.0,
            poles: resonance.poles().to_vec(),
        }
    }
}
