//! One block after the other.

use super::Block;

/// The output of the first block is the input of the second.
///
/// ```
/// use hysteresis_control::linear::{Block, Cascade, Delay, FirstOrder};
/// let lag = FirstOrder::new(279.0)?;
/// let mut both = Cascade(Delay::new(1.0)?.block(), lag.block(1e-4)?);
/// let mut alone = lag.block(1e-4)?;
/// assert_eq!((both.advance(1.0), both.advance(1.0)), (0.0, alone.advance(1.0)));
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Cascade<A, B>(pub A, pub B);

impl<A: Block, B: Block> Block for Cascade<A, B> {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        self.1.advance(self.0.advance(input))
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.1.look_ahead(self.0.look_ahead(input))
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.1.settle(self.0.settle(level))
    }
}
