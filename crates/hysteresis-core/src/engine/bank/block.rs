//! Four operators side by side, and which of their bounds push them.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

use super::super::four_lanes::{FourLanes, LANES, Lanes};
use super::members::SplitWeight;
use crate::operator::CoupledPlay;

/// Thresholds and weights of four operators. Lanes that are left over never move and weigh nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    pub(super) r: Lanes,
    pub(super) rc: Lanes,
    pub(super) ra: Lanes,
    pub(super) rb: Lanes,
    pub(super) above: Lanes,
    pub(super) below: Lanes,
}

impl Block {
    pub(super) fn of(operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        let (never, nothing) = ([f64::INFINITY; LANES], [0.0; LANES]);
        let mut block = Self { r: never, rc: never, ra: never, rb: never, above: nothing, below: nothing };
        for (lane, (weight, operator)) in operators.iter().enumerate() {
            (block.r[lane], block.rc[lane]) = (operator.r(), operator.rc());
            (block.ra[lane], block.rb[lane]) = (operator.ra(), operator.rb());
            (block.above[lane], block.below[lane]) = (weight.above, weight.below);
        }
        block
    }

    /// The operators with their weights, and after them what the lanes that are left over hold.
    pub(super) fn operators(&self) -> [(SplitWeight, CoupledPlay); LANES] {
        array::from_fn(|lane| {
            let weight = SplitWeight { above: self.above[lane], below: self.below[lane] };
            (weight, CoupledPlay::of_checked(self.r[lane], self.ra[lane], self.rb[lane], self.rc[lane]))
        })
    }

    /// Reads a number of each line of memory.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        self.r[0].to_bits() ^ self.ra[0].to_bits() ^ self.above[0].to_bits()
    }

    /// lo(x) of equation (5): what the outputs cannot be below.
    #[inline(always)]
    fn least<F: FourLanes>(&self, four: F, x: F::Numbers) -> F::Numbers {
        let (above, below) = (four.sub(x, four.load(&self.r)), four.sub(x, four.load(&self.rc)));
        four.max(above, four.min(below, four.splat(0.0)))
    }

    /// hi(x): what they cannot be above.
    #[inline(always)]
    fn greatest<F: FourLanes>(&self, four: F, x: F::Numbers) -> F::Numbers {
        let (below, above) = (four.add(x, four.load(&self.ra)), four.add(x, four.load(&self.rb)));
        four.min(below, four.max(above, four.splat(0.0)))
    }
}

/// The bounds that push the operators: in a known direction only those behind them.
pub(super) trait Bounds {
    /// What the outputs `z` are at the input `x`.
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers;
}

/// The lower ones: the input rises, or stays.
pub(super) struct Lower;

impl Bounds for Lower {
    #[inline(always)]
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        four.max(block.least(four, x), z)
    }
}

/// The lower ones at an input below zero: x - rc alone, with the same bits, as x - r is not above it and zero is.
pub(super) struct LowerBelowZero;

impl Bounds for LowerBelowZero {
    #[inline(always)]
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        four.max(four.sub(x, four.load(&block.rc)), z)
    }
}

/// The upper ones: the input falls.
pub(super) struct Upper;

impl Bounds for Upper {
    #[inline(always)]
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        four.min(block.greatest(four, x), z)
    }
}

/// The upper ones at an input above zero: x + rb alone, with the same bits, as x + ra is not below it and zero is.
pub(super) struct UpperAboveZero;

impl Bounds for UpperAboveZero {
    #[inline(always)]
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        four.min(four.add(x, four.load(&block.rb)), z)
    }
}

/// Both: the outputs may be such as no input has led to.
pub(super) struct Both;

impl Bounds for Both {
    #[inline(always)]
    fn next<F: FourLanes>(block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        four.max(block.least(four, x), four.min(block.greatest(four, x), z))
    }
}

/// None: the outputs stay.
pub(super) struct Unmoved;

impl Bounds for Unmoved {
    #[inline(always)]
    fn next<F: FourLanes>(_: &Block, _: F, _: F::Numbers, z: F::Numbers) -> F::Numbers {
        z
    }
}
