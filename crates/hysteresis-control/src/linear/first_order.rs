//! A lag.

use core::f64::consts::TAU;

use super::error::check_positive;
use super::{Block, Error};

/// A first-order lag of unit static gain: tau y' + y = u, tau = 1 / (2 pi f).
///
/// Exactly discretised for an input u(k) that is held from sample to sample:
/// y(k+1) = u(k) + a (y(k) - u(k)), a = exp(-T / tau).
/// The amplifier pole of the benchmark plants is one: it passes 1/sqrt(2) of a sine at its cut-off frequency f.
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_control::linear::{FirstOrder, Stream};
/// let amplifier = FirstOrder::new(279.0)?;
/// assert!((amplifier.time_constant() - 0.57e-3).abs() < 1e-6);
/// let mut stream = Stream::new(amplifier.block(1e-4)?, 0.0);
/// assert!((stream.step(1.0) - 0.1608).abs() < 1e-4);
/// # Ok::<(), hysteresis_control::linear::Error>(())
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
        Self::new(frequency).map_err(|error| Error { parameter: "time_constant", got: time_constant, ..error })
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

    /// The block for a sampling interval in seconds, at rest at zero.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn block(&self, dt: f64) -> Result<FirstOrderBlock, Error> {
        Ok(FirstOrderBlock { decay: self.decay(dt)?, output: 0.0 })
    }

    /// exp(-T / tau).
    pub(super) fn decay(self, dt: f64) -> Result<f64, Error> {
        Ok((-TAU * self.frequency * check_positive("dt", None, dt)?).exp())
    }
}

/// The block of a [`FirstOrder`].
#[derive(Clone, Debug, PartialEq)]
pub struct FirstOrderBlock {
    decay: f64,
    pub(super) output: f64,
}

impl Block for FirstOrderBlock {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        self.output = self.look_ahead(input);
        self.output
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        // The distance from rest decays: at rest nothing moves, not even a rounding.
        input + self.decay * (self.output - input)
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.output = level;
        level
    }
}
