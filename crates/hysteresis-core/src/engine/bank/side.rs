//! A falling input is a rising one in the mirror: x, z and their thresholds change sides.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::four_lanes::{FourLanes, Lanes};
use super::block::Block;

/// The side from which a bank is seen.
pub(super) trait Side {
    /// Inputs and outputs as they are seen.
    fn seen<F: FourLanes>(four: F, numbers: F::Numbers) -> F::Numbers;

    /// A number, seen or seen back.
    fn turned(number: f64) -> f64;

    /// The thresholds above zero (r, if the input rises) and below (rc).
    fn thresholds(block: &Block) -> (&Lanes, &Lanes);

    /// The thresholds of the opposite bound, above zero (rb) and below (ra).
    fn opposite_thresholds(block: &Block) -> (&Lanes, &Lanes);

    /// The weights above zero and below.
    fn weights(block: &Block) -> (&Lanes, &Lanes);
}

/// The input rises.
pub(super) struct Rising;

impl Side for Rising {
    #[inline(always)]
    fn seen<F: FourLanes>(_: F, numbers: F::Numbers) -> F::Numbers {
        numbers
    }

    #[inline(always)]
    fn turned(number: f64) -> f64 {
        number
    }

    #[inline(always)]
    fn thresholds(block: &Block) -> (&Lanes, &Lanes) {
        (&block.r, &block.rc)
    }

    #[inline(always)]
    fn opposite_thresholds(block: &Block) -> (&Lanes, &Lanes) {
        (&block.rb, &block.ra)
    }

    #[inline(always)]
    fn weights(block: &Block) -> (&Lanes, &Lanes) {
        (&block.above, &block.below)
    }
}

/// The input falls.
pub(super) struct Falling;

impl Side for Falling {
    #[inline(always)]
    fn seen<F: FourLanes>(four: F, numbers: F::Numbers) -> F::Numbers {
        four.negated(numbers)
    }

    #[inline(always)]
    fn turned(number: f64) -> f64 {
        -number
    }

    #[inline(always)]
    fn thresholds(block: &Block) -> (&Lanes, &Lanes) {
        (&block.ra, &block.rb)
    }

    #[inline(always)]
    fn opposite_thresholds(block: &Block) -> (&Lanes, &Lanes) {
        (&block.rc, &block.r)
    }

    #[inline(always)]
    fn weights(block: &Block) -> (&Lanes, &Lanes) {
        (&block.below, &block.above)
    }
}
