//! What the outputs of a bank weigh.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::vectors::Vectors;
use super::block::Block;
use super::side::Side;

/// What outputs weigh.
pub(super) trait Weights {
    /// At the output `z`.
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers;

    /// From `z` on, both as they are seen.
    fn along<S: Side, V: Vectors>(side: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers;
}

/// The same above and below zero.
pub(super) struct Whole;

impl Weights for Whole {
    #[inline(always)]
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, _: V::Numbers) -> V::Numbers {
        v.load(&block.weights[0])
    }

    #[inline(always)]
    fn along<S: Side, V: Vectors>(_: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        Self::of(block, v, z)
    }
}

/// By the sign of the output.
pub(super) struct Split;

impl Weights for Split {
    /// At zero either will do.
    #[inline(always)]
    fn of<V: Vectors>(block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        let [above, below] = &block.weights;
        v.select(v.is_below(v.splat(0.0), z), v.load(above), v.load(below))
    }

    /// At zero it is about to come above.
    #[inline(always)]
    fn along<S: Side, V: Vectors>(side: S, block: &Block<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        let (above, below) = side.weights(block);
        v.select(v.is_below(z, v.splat(0.0)), v.load(below), v.load(above))
    }
}
