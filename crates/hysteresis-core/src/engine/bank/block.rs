//! Four operators side by side, and which of their bounds push them.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

use super::super::four_lanes::{FourLanes, LANES, Lanes};
use super::members::SplitWeight;
use super::side::{Side, Unguessed};
use crate::operator::CoupledPlay;

/// The thresholds of the bound behind an input that rises, or of one that falls in the mirror.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thresholds {
    /// Above zero: r, or in the mirror ra.
    pub(super) outer: Lanes,
    /// Below zero: rc, or in the mirror rb.
    pub(super) inner: Lanes,
}

impl Thresholds {
    /// lo(x) of equation (5), or in the mirror -hi(-x): what the outputs cannot be below.
    #[inline(always)]
    pub(super) fn least<F: FourLanes>(&self, four: F, x: F::Numbers) -> F::Numbers {
        lower(four, four.sub(x, four.load(&self.outer)), four.sub(x, four.load(&self.inner)))
    }

    /// [`least`](Self::least) at x or, for the sign -1, at -x: the same bits. Products are taken where a loop has nothing else to do
    /// than differences: a processor has other units for them.
    #[inline(always)]
    pub(super) fn least_signed<F: FourLanes>(&self, four: F, x: F::Numbers, sign: F::Numbers) -> F::Numbers {
        let above = four.signed_sub(x, sign, four.load(&self.outer));
        lower(four, above, four.signed_sub(x, sign, four.load(&self.inner)))
    }
}

/// The lower bound, from what it is above zero and below.
#[inline(always)]
fn lower<F: FourLanes>(four: F, above: F::Numbers, below: F::Numbers) -> F::Numbers {
    four.max(above, four.min(below, four.splat(0.0)))
}

/// Thresholds and weights of four operators. Lanes that are left over never move and weigh nothing.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block {
    /// Of an input that rises, and of one that falls.
    pub(super) thresholds: [Thresholds; 2],
    /// Above zero, and below.
    pub(super) weights: [Lanes; 2],
}

impl Block {
    pub(super) fn of(operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        let never = Thresholds { outer: [f64::INFINITY; LANES], inner: [f64::INFINITY; LANES] };
        let (mut rising, mut falling, [mut above, mut below]) = (never, never, [[0.0; LANES]; 2]);
        for (lane, (weight, operator)) in operators.iter().enumerate() {
            (rising.outer[lane], rising.inner[lane]) = (operator.r(), operator.rc());
            (falling.outer[lane], falling.inner[lane]) = (operator.ra(), operator.rb());
            (above[lane], below[lane]) = (weight.above, weight.below);
        }
        Self { thresholds: [rising, falling], weights: [above, below] }
    }

    /// The operators with their weights, and after them what the lanes that are left over hold.
    pub(super) fn operators(&self) -> [(SplitWeight, CoupledPlay); LANES] {
        let Self { thresholds: [rising, falling], weights: [above, below] } = self;
        array::from_fn(|lane| {
            let weight = SplitWeight { above: above[lane], below: below[lane] };
            let (r, ra, rb, rc) = (rising.outer[lane], falling.outer[lane], falling.inner[lane], rising.inner[lane]);
            (weight, CoupledPlay::of_checked(r, ra, rb, rc))
        })
    }

    /// Reads a number of each line of memory.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        let Self { thresholds: [rising, falling], weights: [above, _] } = self;
        rising.outer[0].to_bits() ^ falling.outer[0].to_bits() ^ above[0].to_bits()
    }
}

/// The bounds that push the operators.
pub(super) trait Bounds: Copy {
    /// What the outputs `z` are at the input `x`.
    fn next<F: FourLanes>(self, block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers;
}

/// Those behind the input: seen from its side it rises.
#[derive(Clone, Copy)]
pub(super) struct Behind(pub(super) Unguessed);

impl Bounds for Behind {
    #[inline(always)]
    fn next<F: FourLanes>(self, block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        let Self(side) = self;
        let least = side.thresholds(block).least(four, side.seen(four, x));
        side.seen(four, four.max(least, side.seen(four, z)))
    }
}

/// Both: right of every move, also from outputs that no input has led to.
#[derive(Clone, Copy)]
pub(super) struct Both;

impl Bounds for Both {
    #[inline(always)]
    fn next<F: FourLanes>(self, block: &Block, four: F, x: F::Numbers, z: F::Numbers) -> F::Numbers {
        let [rising, falling] = &block.thresholds;
        let greatest = four.negated(falling.least(four, four.negated(x)));
        four.max(rising.least(four, x), four.min(greatest, z))
    }
}

/// None: the outputs stay.
#[derive(Clone, Copy)]
pub(super) struct Unmoved;

impl Bounds for Unmoved {
    #[inline(always)]
    fn next<F: FourLanes>(self, _: &Block, _: F, _: F::Numbers, z: F::Numbers) -> F::Numbers {
        z
    }
}
