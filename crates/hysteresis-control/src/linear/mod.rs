//! The linear part of an actuator: modes, lags, antiresonances, creep, dead time, and what they do sample by sample.
//!
//! Parameters are validated once and immutable, in Hz and seconds. [`LinearDynamics`] are a dead time and sections in
//! series ([`FirstOrder`], [`SecondOrder`], [`Antiresonance`], [`Modes`], or a [`StateSpace`] in general). Together with
//! a sampling interval they make a [`Block`], as [`Creep`] and a [`Delay`] alone do, and [`Stream`] turns a block into a
//! [`Process`](hysteresis_core::Process).
//!
//! # Time
//! An input u(k) is put out at t_k = k T and held until t_(k+1). A row (u(k), y(k)) of a record has the output read at
//! t_k: modes answer to u(k) from t_(k+1) on, only what passes at once is in y(k) already. [`Block::step`] returns it.
//! A controller acts on a reading that is taken just before it puts out the next input: [`Block::advance`] holds u(k)
//! for one interval and returns the reading at its end.
//!
//! The hold is discretised exactly (zero-order hold), the dead time included. All blocks are linear and time-invariant.
//! For how to choose creep see [`Creep::logarithmic`].

mod antiresonance;
mod block;
mod creep;
mod delay;
mod discrete;
mod dynamics;
mod error;
mod first_order;
mod history;
mod modes;
mod pole_pair;
mod pulse_transfer;
mod second_order;
mod state_space;
mod stream;
mod transfer_function;

pub use antiresonance::Antiresonance;
pub use block::{LinearBlock, LinearState};
pub use creep::{Creep, CreepBlock};
pub use delay::{Delay, DelayBlock};
pub(crate) use discrete::Discrete;
pub use dynamics::{LinearDynamics, Section};
pub(crate) use error::check_positive;
pub use first_order::FirstOrder;
pub use hysteresis_core::Error;
pub use modes::Modes;
pub use pole_pair::Dynamics;
pub use pulse_transfer::PulseTransfer;
pub use second_order::SecondOrder;
pub use state_space::StateSpace;
pub use stream::Stream;

/// A discrete-time linear system with its state, for admissible samples.
///
/// No method allocates, locks or panics. [`Stream`] adds what a [`Process`](hysteresis_core::Process) needs: samples
/// that are not finite are held back and counted.
///
/// ```
/// use hysteresis_control::linear::{Block, FirstOrder};
/// let lag = FirstOrder::new(100.0)?.block(1e-3)?;
/// let (mut record, mut plant) = (lag.clone(), lag);
/// assert_eq!(record.step(1.0), 0.0); // read as the input is put out
/// assert_eq!(plant.advance(1.0), record.step(1.0)); // read an interval later
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
pub trait Block {
    /// The output at t_k, the input put out at t_k. Nothing changes.
    fn output(&self, input: f64) -> f64;

    /// The output just before t_(k+1), the input held from t_k on. Nothing changes.
    fn look_ahead(&self, input: f64) -> f64;

    /// Holds the input until t_(k+1).
    fn hold(&mut self, input: f64);

    /// Puts the block to rest, as if its input had been `level` since forever, and returns its output there.
    fn settle(&mut self, level: f64) -> f64;

    /// A row of a record: the [`output`](Self::output) at t_k; then holds the input until t_(k+1).
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        let output = self.output(input);
        self.hold(input);
        output
    }

    /// Holds the input until t_(k+1) and returns the output just before: what [`look_ahead`](Self::look_ahead) returns.
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        let output = self.look_ahead(input);
        self.hold(input);
        output
    }
}
