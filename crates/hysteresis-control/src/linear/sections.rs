//! What linear dynamics are made of: a lag, a resonance, an antiresonance beside one, and modes in parallel.
//!
//! Each has its transfer function and its state space.

use core::f64::consts::TAU;

use hysteresis_core::check_all_finite;
use nalgebra::{Complex, DMatrix, DVector};

use super::state_space::NO_GAIN;
use super::{Error, StateSpace};
use crate::checks::{check_number, check_positive, check_whole};

/// A first-order lag of unit static gain: tau y' + y = u, tau = 1 / (2 pi f).
///
/// An amplifier of the bandwidth f is one: it passes 1/sqrt(2) of a sine of that frequency.
///
/// ```
/// use hysteresis_control::linear::{Block, FirstOrder};
/// let amplifier = FirstOrder::new(279.0)?;
/// assert!((amplifier.time_constant() - 0.57e-3).abs() < 1e-6);
/// let mut block = amplifier.block(1e-4)?;
/// assert_eq!(block.step(1.0), 0.0); // what is put out now has not moved anything yet
/// assert!((block.step(1.0) - 0.1608).abs() < 1e-4);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FirstOrder {
    frequency: f64,
}

impl FirstOrder {
    /// A lag with the cut-off frequency f in Hz.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and above 0.
    pub fn new(frequency: f64) -> Result<Self, Error> {
        Ok(Self { frequency: check_positive("frequency", None, frequency)? })
    }

    /// A lag with the time constant tau in seconds.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and above 0.
    pub fn from_time_constant(time_constant: f64) -> Result<Self, Error> {
        let frequency = 1.0 / (TAU * check_positive("time_constant", None, time_constant)?);
        Self::new(frequency).map_err(|error| error.renamed("time_constant", time_constant))
    }

    /// The cut-off frequency in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// tau, in seconds.
    #[must_use]
    pub fn time_constant(&self) -> f64 {
        1.0 / (TAU * self.frequency)
    }
}

impl From<FirstOrder> for StateSpace {
    fn from(lag: FirstOrder) -> Self {
        let rate = TAU * lag.frequency();
        Self {
            a: DMatrix::from_element(1, 1, -rate),
            b: DVector::from_element(1, rate),
            c: DVector::from_element(1, 1.0),
            d: 0.0,
            gain: 1.0,
            poles: vec![Complex::from(-rate)],
        }
    }
}

/// Second-order dynamics of unit static gain: y'' + 2 zeta w y' + w^2 y = w^2 u, w = 2 pi f.
///
/// f is the undamped natural frequency in Hz and zeta the damping ratio. With zeta < 1 the step response rings at
/// f sqrt(1 - zeta^2); for zeta < 1/sqrt(2) the gain peaks, at f sqrt(1 - 2 zeta^2); with zeta >= 1 it creeps in like
/// two lags. The mass-spring-damper after the hysteresis in Remark 1 of the paper.
///
/// ```
/// use hysteresis_control::linear::{Block, SecondOrder};
/// let mut stage = SecondOrder::new(2000.0, 0.03)?.block(1e-5)?;
/// let peak = (0..100).map(|_| stage.step(1.0)).fold(0.0, f64::max);
/// let overshoot = (-core::f64::consts::PI * 0.03 / (1.0 - 0.03_f64.powi(2)).sqrt()).exp();
/// assert!((peak - (1.0 + overshoot)).abs() < 1e-3);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SecondOrder {
    frequency: f64,
    damping: f64,
}

impl SecondOrder {
    /// From the undamped natural frequency in Hz and the damping ratio.
    ///
    /// # Errors
    /// [`Error`] unless both are finite and above 0.
    pub fn new(frequency: f64, damping: f64) -> Result<Self, Error> {
        Ok(Self {
            frequency: check_positive("frequency", None, frequency)?,
            damping: check_positive("damping", None, damping)?,
        })
    }

    /// The undamped natural frequency in Hz.
    #[must_use]
    pub fn frequency(&self) -> f64 {
        self.frequency
    }

    /// The damping ratio.
    #[must_use]
    pub fn damping(&self) -> f64 {
        self.damping
    }

    /// w = 2 pi f, in radians per second.
    fn radians(self) -> f64 {
        TAU * self.frequency
    }

    /// The two poles; far from each other without cancellation.
    pub(super) fn poles(self) -> [Complex<f64>; 2] {
        let (w, zeta) = (self.radians(), self.damping);
        // (1 - zeta)(1 + zeta) keeps its digits next to critical damping, where 1 - zeta^2 loses them.
        let distance = ((1.0 - zeta).abs() * (1.0 + zeta)).sqrt();
        if zeta < 1.0 {
            [Complex::new(-zeta * w, distance * w), Complex::new(-zeta * w, -distance * w)]
        } else {
            [Complex::from(-w / (zeta + distance)), Complex::from(-w * (zeta + distance))]
        }
    }

    /// (s/w)^2 + 2 zeta s/w + 1.
    pub(super) fn denominator(self, s: Complex<f64>) -> Complex<f64> {
        let x = s / self.radians();
        x * x + x * (2.0 * self.damping) + 1.0
    }
}

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
        let expected = "one for each mode, 1 to 32";
        check_whole("gains", gains.len() == modes.len() && (1..=32).contains(&gains.len()), expected, gains.len())?;
        check_all_finite("gains", gains)?;
        let (sum, size) = (gains.iter().sum::<f64>(), gains.iter().map(|gain| gain.abs()).sum::<f64>());
        check_number("gains", sum.abs() > NO_GAIN * size, "a sum that is not 0", sum)?;
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
