//! Some operators side by side, as many as a vector has numbers, and which of their bounds push them.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::vectors::Vectors;
use super::members::SplitWeight;
use super::side::{Side, Unguessed};
use crate::operator::CoupledPlay;

/// The thresholds of the bound behind an input that rises, or of one that falls in the mirror.
#[derive(Clone, Copy, Debug)]
pub(super) struct Thresholds<L> {
    /// Above zero: r, or in the mirror ra.
    pub(super) outer: L,
    /// Below zero: rc, or in the mirror rb.
    pub(super) inner: L,
}

impl<L> Thresholds<L> {
    /// lo(x) of equation (5), or in the mirror -hi(-x): what the outputs cannot be below.
    #[inline(always)]
    pub(super) fn least<V: Vectors<Lanes = L>>(&self, v: V, x: V::Numbers) -> V::Numbers {
        lower(v, v.sub(x, v.load(&self.outer)), v.sub(x, v.load(&self.inner)))
    }

    /// [`least`](Self::least) at x or, for the sign -1, at -x: the same bits. Products are taken where a loop has nothing else to do
    /// than differences: a processor has other units for them.
    #[inline(always)]
    pub(super) fn least_signed<V: Vectors<Lanes = L>>(&self, v: V, x: V::Numbers, sign: V::Numbers) -> V::Numbers {
        let above = v.signed_sub(x, sign, v.load(&self.outer));
        lower(v, above, v.signed_sub(x, sign, v.load(&self.inner)))
    }
}

/// The lower bound, from what it is above zero and below.
#[inline(always)]
fn lower<V: Vectors>(v: V, above: V::Numbers, below: V::Numbers) -> V::Numbers {
    v.max(above, v.min(below, v.splat(0.0)))
}

/// Thresholds and weights of the operators of a vector. Lanes that are left over never move and weigh nothing. Aligned, so that no
/// vector lies in two lines of memory.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Block<L> {
    /// Of an input that rises, and of one that falls.
    pub(super) thresholds: [Thresholds<L>; 2],
    /// Above zero, and below.
    pub(super) weights: [L; 2],
}

impl<const N: usize> Block<[f64; N]> {
    pub(super) fn of(operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        let never = Thresholds { outer: [f64::INFINITY; N], inner: [f64::INFINITY; N] };
        let (mut rising, mut falling, [mut above, mut below]) = (never, never, [[0.0; N]; 2]);
        for (lane, (weight, operator)) in operators.iter().enumerate() {
            (rising.outer[lane], rising.inner[lane]) = (operator.r(), operator.rc());
            (falling.outer[lane], falling.inner[lane]) = (operator.ra(), operator.rb());
            (above[lane], below[lane]) = (weight.above, weight.below);
        }
        Self { thresholds: [rising, falling], weights: [above, below] }
    }

    /// Reads a number of each line of memory, or of each other one.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        let Self { thresholds: [rising, falling], weights: [above, _] } = self;
        rising.outer[0].to_bits() ^ falling.outer[0].to_bits() ^ above[0].to_bits()
    }
}

/// The bounds that push the operators.
pub(super) trait Bounds: Copy {
    /// What the outputs `z` are at the input `x`.
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers;
}

/// Those behind the input: seen from its side it rises.
#[derive(Clone, Copy)]
pub(super) struct Behind(pub(super) Unguessed);

impl Bounds for Behind {
    #[inline(always)]
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers {
        let Self(side) = self;
        let least = side.thresholds(block).least(v, side.seen(v, x));
        side.seen(v, v.max(least, side.seen(v, z)))
    }
}

/// Both: right of every move, also from outputs that no input has led to.
#[derive(Clone, Copy)]
pub(super) struct Both;

impl Bounds for Both {
    #[inline(always)]
    fn next<V: Vectors>(self, block: &Block<V::Lanes>, v: V, x: V::Numbers, z: V::Numbers) -> V::Numbers {
        let [rising, falling] = &block.thresholds;
        let greatest = v.negated(falling.least(v, v.negated(x)));
        v.max(rising.least(v, x), v.min(greatest, z))
    }
}

/// None: the outputs stay.
#[derive(Clone, Copy)]
pub(super) struct Unmoved;

impl Bounds for Unmoved {
    #[inline(always)]
    fn next<V: Vectors>(self, _: &Block<V::Lanes>, _: V, _: V::Numbers, z: V::Numbers) -> V::Numbers {
        z
    }
}
