//! What the outputs of a bank weigh.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::four_lanes::FourLanes;
use super::block::Block;
use super::side::Side;

/// What outputs weigh.
pub(super) trait Weights {
    /// At the output `z`.
    fn of<F: FourLanes>(block: &Block, four: F, z: F::Numbers) -> F::Numbers;

    /// From `z` on, both as they are seen.
    fn along<S: Side, F: FourLanes>(side: S, block: &Block, four: F, z: F::Numbers) -> F::Numbers;
}

/// The same above and below zero.
pub(super) struct Whole;

impl Weights for Whole {
    #[inline(always)]
    fn of<F: FourLanes>(block: &Block, four: F, _: F::Numbers) -> F::Numbers {
        four.load(&block.weights[0])
    }

    #[inline(always)]
    fn along<S: Side, F: FourLanes>(_: S, block: &Block, four: F, z: F::Numbers) -> F::Numbers {
        Self::of(block, four, z)
    }
}

/// By the sign of the output.
pub(super) struct Split;

impl Weights for Split {
    /// At zero either will do.
    #[inline(always)]
    fn of<F: FourLanes>(block: &Block, four: F, z: F::Numbers) -> F::Numbers {
        let [above, below] = &block.weights;
        four.select(four.is_below(four.splat(0.0), z), four.load(above), four.load(below))
    }

    /// At zero it is about to come above.
    #[inline(always)]
    fn along<S: Side, F: FourLanes>(side: S, block: &Block, four: F, z: F::Numbers) -> F::Numbers {
        let (above, below) = side.weights(block);
        four.select(four.is_below(z, four.splat(0.0)), four.load(below), four.load(above))
    }
}
