//! The linear part of an actuator: modes, lags, antiresonances, creep, dead time, and what they do sample by sample.
//!
//! Parameters are validated once and immutable, in Hz and seconds. [`LinearDynamics`] are a dead time and sections in
//! series ([`FirstOrder`], [`SecondOrder`], [`Antiresonance`], [`Modes`], or a [`StateSpace`] in general). Together
//! with a sampling interval they make a [`Block`], as [`Creep`] and a [`Delay`] alone do, and [`Stream`] turns a block
//! into a [`Process`].
//!
//! # Time
//! An input u(k) is put out at t_k = k T and held until t_(k+1). A row (u(k), y(k)) of a record has the output read at
//! t_k: modes answer to u(k) from t_(k+1) on, only what passes at once is in y(k) already. [`Block::step`] returns it.
//! A controller acts on a reading that is taken just before it puts out the next input: [`Block::advance`] holds u(k)
//! for one interval and returns the reading at its end.
//!
//! The hold is discretised exactly (zero-order hold), the dead time included. All blocks are linear and time-invariant.
//! For how to choose creep see [`Creep::logarithmic`].
//!
//! Each file knows only those above it: `state_space`, the general form; `sections`; `sampled`, behind a hold;
//! `dynamics`, which joins them. `creep` stands alone.

mod creep;
mod dynamics;
mod sampled;
mod sections;
mod state_space;

pub(crate) use creep::check_time_constants;
pub use creep::{Creep, CreepBlock};
pub use dynamics::{Dynamics, LinearDynamics, Section};
pub use hysteresis_core::Error;
pub use sampled::{Delay, DelayBlock, LinearBlock, LinearState, PulseTransfer};
pub(crate) use sampled::{Discrete, dot};
pub use sections::{Antiresonance, FirstOrder, Modes, SecondOrder};
pub use state_space::StateSpace;

use hysteresis_core::{Process, is_admissible};

/// A discrete-time linear system with its state, for admissible samples.
///
/// No method allocates, locks or panics. [`Stream`] adds what a [`Process`] needs: samples
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

/// A block that starts at rest and holds back samples that are not finite. Its outputs are the rows of a record, see
/// [`Block::step`].
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_control::linear::{FirstOrder, Stream};
/// let mut lag = Stream::new(FirstOrder::from_time_constant(1.0)?.block(2.0_f64.ln())?, 0.0);
/// assert_eq!(lag.step(1.0), 0.0);
/// assert!((lag.step(1.0) - 0.5).abs() < 1e-15);
/// assert!((lag.step(f64::NAN) - 0.5).abs() < 1e-15 && lag.rejected() == 1);
/// assert!((lag.peek(1.0) - 0.75).abs() < 1e-15);
/// lag.reset();
/// assert_eq!(lag.peek(1.0), 0.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Stream<B> {
    block: B,
    rest: f64,
    output: f64,
    rejected: u64,
}

impl<B: Block> Stream<B> {
    /// The block at rest: its input has been `rest` since forever, and is again after every reset.
    pub fn new(mut block: B, rest: f64) -> Self {
        let output = block.settle(rest);
        Self { block, rest, output, rejected: 0 }
    }

    /// How many samples were not finite (or beyond 1e100) and left output and state as they were.
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// The last output; at rest, the output at rest.
    pub fn output(&self) -> f64 {
        self.output
    }
}

impl<B: Block> Process for Stream<B> {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if is_admissible(input) {
            self.output = self.block.step(input);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.output
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        if is_admissible(input) { self.block.output(input) } else { self.output }
    }

    fn reset(&mut self) {
        self.output = self.block.settle(self.rest);
        self.rejected = 0;
    }
}
