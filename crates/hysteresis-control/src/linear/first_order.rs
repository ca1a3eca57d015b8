//! A lag.

use core::f64::consts::TAU;

use super::Error;
use super::error::check_positive;

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
