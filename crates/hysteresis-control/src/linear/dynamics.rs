//! Linear dynamics: sections in series behind a dead time.

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::sampled::Discrete;
use super::state_space::MAX_STATES;
use super::{Antiresonance, Delay, Error, FirstOrder, LinearBlock, Modes, PulseTransfer, SecondOrder, StateSpace};
use crate::checks::{check_dead_time, check_number, check_positive, check_whole};

/// One of the parts that [`LinearDynamics`] are made of.
#[derive(Clone, Debug, PartialEq)]
pub enum Section {
    /// A lag: an amplifier, a sensor.
    FirstOrder(FirstOrder),
    /// A resonance, or two lags.
    SecondOrder(SecondOrder),
    /// An antiresonance and its resonance.
    Antiresonance(Antiresonance),
    /// Modes in parallel.
    Modes(Modes),
    /// Anything else, in matrices.
    StateSpace(StateSpace),
}

impl Section {
    /// The section in matrices.
    #[must_use]
    pub fn state_space(&self) -> StateSpace {
        match self {
            Self::FirstOrder(lag) => (*lag).into(),
            Self::SecondOrder(resonance) => (*resonance).into(),
            Self::Antiresonance(pair) => (*pair).into(),
            Self::Modes(modes) => modes.into(),
            Self::StateSpace(matrices) => matrices.clone(),
        }
    }

    fn poles(&self) -> Vec<Complex<f64>> {
        match self {
            Self::FirstOrder(lag) => vec![Complex::from(-TAU * lag.frequency())],
            Self::SecondOrder(resonance) => resonance.poles().to_vec(),
            Self::Antiresonance(pair) => pair.pole().poles().to_vec(),
            Self::Modes(modes) => modes.modes().iter().flat_map(|mode| mode.poles()).collect(),
            Self::StateSpace(matrices) => matrices.poles().to_vec(),
        }
    }

    fn zeros(&self) -> Vec<Complex<f64>> {
        match self {
            Self::FirstOrder(_) | Self::SecondOrder(_) => Vec::new(),
            Self::Antiresonance(pair) => pair.zero().poles().to_vec(),
            Self::Modes(modes) => StateSpace::from(modes).zeros(),
            Self::StateSpace(matrices) => matrices.zeros(),
        }
    }

    fn static_gain(&self) -> f64 {
        match self {
            Self::FirstOrder(_) | Self::SecondOrder(_) | Self::Antiresonance(_) => 1.0,
            Self::Modes(modes) => modes.gains().iter().sum(),
            Self::StateSpace(matrices) => matrices.static_gain(),
        }
    }

    fn at(&self, s: Complex<f64>) -> Complex<f64> {
        match self {
            Self::FirstOrder(lag) => (s * lag.time_constant() + 1.0).inv(),
            Self::SecondOrder(resonance) => resonance.denominator(s).inv(),
            Self::Antiresonance(pair) => pair.at(s),
            Self::Modes(modes) => modes.at(s),
            Self::StateSpace(matrices) => matrices.at(s),
        }
    }
}

/// Linear dynamics in continuous time: a dead time and sections in series, G(s) = exp(-s d) G_1(s) G_2(s) ..
///
/// Made from its parts with [`then`](Self::then): a [`FirstOrder`] lag, a [`SecondOrder`] resonance, an
/// [`Antiresonance`], [`Modes`] in parallel, a [`StateSpace`], a [`Delay`]. Parameters are in Hz and seconds.
///
/// [`block`](Self::block) samples them for an input that is held from sample to sample, exactly: all sections as one,
/// so that what the amplifier does between samples reaches the modes as it is, and with any dead time.
///
/// ```
/// use hysteresis_control::linear::{Block, Delay, FirstOrder, LinearDynamics, SecondOrder};
/// let dynamics = LinearDynamics::from(FirstOrder::new(279.0)?)
///     .then(SecondOrder::new(2000.0, 0.03)?)
///     .then(Delay::new(1e-4)?);
/// assert_eq!((dynamics.order(), dynamics.dead_time(), dynamics.static_gain()), (3, 1e-4, 1.0));
/// assert!(dynamics.frequency_response(1984.0).norm() > 2.0); // the resonance behind the lag
/// let mut stage = dynamics.block(1e-4)?;
/// let position = [1.0; 4].map(|u| stage.step(u));
/// assert_eq!(position[..2], [0.0, 0.0]); // dead time of one sample, then one that the modes take to move
/// assert!((position[2] - 0.041).abs() < 1e-3 && position[2] < position[3]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearDynamics {
    sections: Vec<Section>,
    dead_time: f64,
}

impl LinearDynamics {
    /// What passes everything at once.
    #[must_use]
    pub fn none() -> Self {
        Self::default()
    }

    /// These dynamics and `next` behind them. Sections add up and so do dead times.
    #[must_use]
    pub fn then(mut self, next: impl Into<Self>) -> Self {
        let next = next.into();
        self.sections.extend(next.sections);
        self.dead_time += next.dead_time;
        self
    }

    /// These dynamics beside `other`: both have the same input, and their outputs add up.
    ///
    /// ```
    /// use hysteresis_control::linear::{Delay, FirstOrder, LinearDynamics, SecondOrder, StateSpace};
    /// let fast = LinearDynamics::from(StateSpace::from_gain(0.9)?);
    /// let slow = LinearDynamics::from(StateSpace::from_gain(0.1)?).then(FirstOrder::new(2.0)?);
    /// let both = fast.parallel(&slow)?.then(SecondOrder::new(800.0, 0.02)?);
    /// assert_eq!((both.order(), both.static_gain()), (3, 1.0));
    /// assert!(fast.parallel(&slow.then(Delay::new(1e-4)?)).is_err());
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`] unless both have the same dead time and their static gains do not cancel.
    pub fn parallel(&self, other: &Self) -> Result<Self, Error> {
        let expected = "the same dead time on both sides";
        check_number("dead_time", self.dead_time == other.dead_time, expected, other.dead_time)?;
        let sum = self.state_space().parallel(&other.state_space())?;
        Ok(Self { sections: vec![Section::StateSpace(sum)], dead_time: self.dead_time })
    }

    /// The same sections behind a dead time of so many seconds, whatever it was before.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and 0 or more.
    pub fn with_dead_time(self, seconds: f64) -> Result<Self, Error> {
        Ok(Self { dead_time: check_dead_time(seconds)?, ..self })
    }

    /// The sections, the first of them first.
    #[must_use]
    pub fn sections(&self) -> &[Section] {
        &self.sections
    }

    /// The dead time d in seconds.
    #[must_use]
    pub fn dead_time(&self) -> f64 {
        self.dead_time
    }

    /// The number of states: of poles.
    #[must_use]
    pub fn order(&self) -> usize {
        self.sections.iter().map(|section| section.poles().len()).sum()
    }

    /// The poles in radians per second.
    #[must_use]
    pub fn poles(&self) -> Vec<Complex<f64>> {
        self.sections.iter().flat_map(Section::poles).collect()
    }

    /// The finite zeros in radians per second; a dead time has none.
    #[must_use]
    pub fn zeros(&self) -> Vec<Complex<f64>> {
        self.sections.iter().flat_map(Section::zeros).collect()
    }

    /// G(0): the position that an input of 1 leads to.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        self.sections.iter().map(Section::static_gain).product()
    }

    /// G(2 pi i f) for a frequency in Hz, the dead time included.
    #[must_use]
    pub fn frequency_response(&self, frequency: f64) -> Complex<f64> {
        let s = Complex::new(0.0, TAU * frequency);
        let sections = self.sections.iter().map(|section| section.at(s)).product::<Complex<f64>>();
        sections * (s * -self.dead_time).exp()
    }

    /// After how many seconds nothing is left of a state but exp(-1), the dead time not counted: 1 / the slowest decay.
    #[must_use]
    pub fn settling_time(&self) -> f64 {
        self.poles().iter().map(|pole| -1.0 / pole.re).fold(0.0, f64::max)
    }

    /// All sections as one in matrices, without the dead time.
    #[must_use]
    pub fn state_space(&self) -> StateSpace {
        let sections = self.sections.iter().map(Section::state_space);
        sections.reduce(|all, next| all.then(&next)).unwrap_or_else(|| StateSpace::constant(1.0))
    }

    /// The block for a sampling interval T in seconds, at rest at zero; all its memory is taken here.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0, the dead time at most 2^20 of it, the order at most 64, and no part
    /// faster than a millionth of `dt`.
    pub fn block(&self, dt: f64) -> Result<LinearBlock, Error> {
        Ok(LinearBlock::new(self.sampled(dt)?))
    }

    /// The pulse transfer function P(z): from an input that is put out at t_k and held to what is read at t_k, before
    /// the input of t_k has any effect. That is what a feedback sees.
    ///
    /// Without any dynamics P = 1/z: an input put out at t_k is read at t_(k+1).
    ///
    /// ```
    /// use hysteresis_control::linear::{FirstOrder, LinearDynamics};
    /// use nalgebra::Complex;
    /// let lag = FirstOrder::new(100.0)?;
    /// let (z, a) = (Complex::new(0.6, 0.8), (-1e-4 / lag.time_constant()).exp());
    /// let textbook = Complex::from(1.0 - a) / (z - a);
    /// assert!((LinearDynamics::from(lag).pulse_transfer(1e-4)?.at(z) - textbook).norm() < 1e-15);
    /// assert_eq!(LinearDynamics::none().pulse_transfer(1e-4)?.at(z), z.inv());
    /// # Ok::<(), hysteresis_core::Error>(())
    /// ```
    ///
    /// # Errors
    /// As for [`block`](Self::block).
    pub fn pulse_transfer(&self, dt: f64) -> Result<PulseTransfer, Error> {
        Ok(PulseTransfer::before(&self.sampled(dt)?))
    }

    /// The transfer function of the rows of a record, as [`Block::step`](super::Block::step) returns them: what is read
    /// at t_k with the input of t_k put out. It differs from [`pulse_transfer`](Self::pulse_transfer) only where a part
    /// of the input passes at once.
    ///
    /// # Errors
    /// As for [`block`](Self::block).
    pub fn record_transfer(&self, dt: f64) -> Result<PulseTransfer, Error> {
        Ok(PulseTransfer::of_record(&self.sampled(dt)?))
    }

    pub(crate) fn sampled(&self, dt: f64) -> Result<Discrete, Error> {
        check_positive("dt", None, dt)?;
        check_whole("dynamics", self.order() <= MAX_STATES, "at most 64 poles", self.order())?;
        Discrete::new(&self.state_space().balanced(), self.dead_time, dt)
    }
}

impl From<Delay> for LinearDynamics {
    fn from(delay: Delay) -> Self {
        Self { sections: Vec::new(), dead_time: delay.seconds() }
    }
}

impl<S: Into<Section>> From<S> for LinearDynamics {
    fn from(section: S) -> Self {
        Self { sections: vec![section.into()], dead_time: 0.0 }
    }
}

impl From<FirstOrder> for Section {
    fn from(lag: FirstOrder) -> Self {
        Self::FirstOrder(lag)
    }
}

impl From<SecondOrder> for Section {
    fn from(resonance: SecondOrder) -> Self {
        Self::SecondOrder(resonance)
    }
}

impl From<Antiresonance> for Section {
    fn from(pair: Antiresonance) -> Self {
        Self::Antiresonance(pair)
    }
}

impl From<Modes> for Section {
    fn from(modes: Modes) -> Self {
        Self::Modes(modes)
    }
}

impl From<StateSpace> for Section {
    fn from(matrices: StateSpace) -> Self {
        Self::StateSpace(matrices)
    }
}

impl FirstOrder {
    /// The block for a sampling interval in seconds, at rest at zero.
    ///
    /// # Errors
    /// As for [`LinearDynamics::block`].
    pub fn block(&self, dt: f64) -> Result<LinearBlock, Error> {
        LinearDynamics::from(*self).block(dt)
    }
}

impl SecondOrder {
    /// The block for a sampling interval in seconds, at rest at zero.
    ///
    /// # Errors
    /// As for [`LinearDynamics::block`].
    pub fn block(&self, dt: f64) -> Result<LinearBlock, Error> {
        LinearDynamics::from(*self).block(dt)
    }
}

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
