//! The linear part of an actuator, sample by sample: second-order dynamics or a first-order lag, creep, delay.
//!
//! Parameters ([`SecondOrder`], [`FirstOrder`], [`Creep`], [`Delay`]) are validated once and immutable; together with a
//! sampling interval each makes a [`Block`], and [`Stream`] turns a block into a [`Process`](hysteresis_core::Process).
//! Blocks follow each other in a [`Cascade`]; a [`Chain`] is all of an actuator's linear part, discretised as one.
//!
//! # Sampling
//! The input is held from one sample to the next (zero-order hold) and discretised exactly. The output that belongs to
//! a sample is the one at the *end* of its interval: what a measurement sees just before the next sample is put out. So
//! infinitely fast dynamics return their input at once, as a static model does. A record whose output is measured at
//! the moment when its input is put out lags by one sample more: a [`Delay`] of 1.
//!
//! All blocks are linear and time-invariant, so their order in a cascade does not matter as long as all are at rest at
//! the start. For how to choose creep see [`Creep::logarithmic`].

mod cascade;
mod chain;
mod creep;
mod delay;
mod error;
mod first_order;
mod second_order;
mod stream;

pub use cascade::Cascade;
pub use chain::{Chain, ChainBlock, PulseTransfer};
pub use creep::{Creep, CreepBlock};
pub use delay::{Delay, DelayBlock};
pub use error::Error;
pub(crate) use error::check_positive;
pub use first_order::{FirstOrder, FirstOrderBlock};
pub use second_order::{SecondOrder, SecondOrderBlock};
pub use stream::Stream;

use nalgebra::Matrix2;

/// A discrete-time linear system with its state, for admissible samples.
///
/// No method allocates, locks or panics. [`Stream`] adds what a [`Process`](hysteresis_core::Process) needs: samples
/// that are not finite are held back and counted.
pub trait Block {
    /// Takes one sample and returns the output at the end of its interval.
    fn advance(&mut self, input: f64) -> f64;

    /// What [`advance`](Self::advance) would return, without taking the sample.
    fn look_ahead(&self, input: f64) -> f64;

    /// Puts the block to rest, as if its input had been `level` since forever, and returns its output there.
    fn settle(&mut self, level: f64) -> f64;
}

/// Second-order dynamics or a first-order lag: what follows the hysteresis in the cascade of Remark 1 of the paper.
///
/// ```
/// use hysteresis_control::linear::{Block, Dynamics, FirstOrder};
/// let mut lag = Dynamics::from(FirstOrder::new(100.0)?).block(1e-3)?;
/// assert!((lag.advance(1.0) - (1.0 - (-0.2 * core::f64::consts::PI).exp())).abs() < 1e-15);
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Dynamics {
    /// A lag.
    FirstOrder(FirstOrder),
    /// A resonance, or two lags.
    SecondOrder(SecondOrder),
}

impl Dynamics {
    /// exp(T M) for the distance from rest, (y - u, y' / w) while u is held; of a lag only the first entry.
    pub(crate) fn transition(&self, dt: f64) -> Result<Matrix2<f64>, Error> {
        Ok(match self {
            Self::FirstOrder(lag) => Matrix2::new(lag.decay(dt)?, 0.0, 0.0, 0.0),
            Self::SecondOrder(resonance) => resonance.transition(dt)?,
        })
    }

    /// The block for a sampling interval in seconds, at rest at zero.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0.
    pub fn block(&self, dt: f64) -> Result<DynamicsBlock, Error> {
        Ok(match self {
            Self::FirstOrder(lag) => DynamicsBlock::FirstOrder(lag.block(dt)?),
            Self::SecondOrder(resonance) => DynamicsBlock::SecondOrder(resonance.block(dt)?),
        })
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

/// The block of [`Dynamics`].
#[derive(Clone, Debug, PartialEq)]
pub enum DynamicsBlock {
    /// Of a lag.
    FirstOrder(FirstOrderBlock),
    /// Of second-order dynamics.
    SecondOrder(SecondOrderBlock),
}

impl DynamicsBlock {
    /// The output and, of second-order dynamics, its velocity over 2 pi f: all that the block remembers.
    #[must_use]
    pub fn state(&self) -> [f64; 2] {
        match self {
            Self::FirstOrder(block) => [block.output, 0.0],
            Self::SecondOrder(block) => [block.position, block.velocity],
        }
    }

    /// Goes on from a state.
    pub fn restore(&mut self, [position, velocity]: [f64; 2]) {
        match self {
            Self::FirstOrder(block) => block.output = position,
            Self::SecondOrder(block) => (block.position, block.velocity) = (position, velocity),
        }
    }
}

impl Block for DynamicsBlock {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        match self {
            Self::FirstOrder(block) => block.advance(input),
            Self::SecondOrder(block) => block.advance(input),
        }
    }

    fn look_ahead(&self, input: f64) -> f64 {
        match self {
            Self::FirstOrder(block) => block.look_ahead(input),
            Self::SecondOrder(block) => block.look_ahead(input),
        }
    }

    fn settle(&mut self, level: f64) -> f64 {
        match self {
            Self::FirstOrder(block) => block.settle(level),
            Self::SecondOrder(block) => block.settle(level),
        }
    }
}
