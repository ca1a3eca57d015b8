//! A block as a process: the rows of a record.

use hysteresis_core::{Process, is_admissible};

use super::Block;

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
