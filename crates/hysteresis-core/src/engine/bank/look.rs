//! The straight line that the output of a bank is on over the input, and how far it holds.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::direction::Direction;
use super::super::line::{Line, Piece};
use super::super::vectors::{Lanes, Vectors};
use super::block::{Block, Both, Bounds, Thresholds};
use super::blocks::BankLoop;
use super::side::{Falling, Rising, Side};
use super::weights::Weights;

/// The operators of a block at an input, as they are seen.
pub(super) struct Seen<V: Vectors> {
    last: V::Numbers,
    z: V::Numbers,
    is_below_inner: V::Mask,
    pub(super) slides: V::Mask,
}

impl<V: Vectors> Seen<V> {
    /// Moved to `x` from the output `last`. What slides has come to lo(x) and does not stick at zero.
    #[inline(always)]
    pub(super) fn at(side: impl Side, block: &Block<V::Lanes>, v: V, x: V::Numbers, last: V::Numbers) -> Self {
        let thresholds = side.thresholds(block);
        let (last, least) = (side.seen(v, last), thresholds.least(v, x));
        let is_below_inner = v.is_below(x, v.load(&thresholds.inner));
        let sticks_not = v.or(is_below_inner, v.is_at_most(v.load(&thresholds.outer), x));
        let slides = v.and(v.is_at_most(last, least), sticks_not);
        Self { last, z: v.max(least, last), is_below_inner, slides }
    }

    /// Where lo begins to push the output `z`.
    #[inline(always)]
    fn pushed_from(Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V, z: V::Numbers) -> V::Numbers {
        v.add(z, v.select(v.is_below(z, v.splat(0.0)), v.load(inner), v.load(outer)))
    }

    /// Its output at the input zero, if it stays on its line.
    #[inline(always)]
    fn offset(&self, Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let slid = v.negated(v.select(self.is_below_inner, v.load(inner), v.load(outer)));
        v.select(self.slides, slid, self.z)
    }

    /// Where its line begins, having come from `last`.
    #[inline(always)]
    fn begin(&self, Thresholds { outer, inner }: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let (outer, inner, zero) = (v.load(outer), v.load(inner), v.splat(0.0));
        let below = v.select(self.is_below_inner, v.add(self.last, inner), outer);
        let begins = v.select(v.is_below(self.last, zero), below, v.add(self.last, outer));
        let stuck = v.select(v.is_below(self.last, self.z), inner, v.splat(f64::NEG_INFINITY));
        v.select(self.slides, begins, stuck)
    }

    /// Where its line ends ahead: where it is pushed, or sticks at zero.
    #[inline(always)]
    fn end(&self, thresholds: &Thresholds<V::Lanes>, v: V) -> V::Numbers {
        let sticks = v.select(self.is_below_inner, v.load(&thresholds.inner), v.splat(f64::INFINITY));
        v.select(self.slides, sticks, Self::pushed_from(thresholds, v, self.z))
    }

    /// Where its line ends behind: where the opposite bound pushes it, or infinitely far ahead if it slides; of an identity only where
    /// it weighs otherwise.
    #[inline(always)]
    fn back(&self, side: impl Side, block: &Block<V::Lanes>, v: V) -> V::Numbers {
        let opposite = side.opposite_thresholds(block);
        let (inner, outer, zero) = (v.load(&opposite.inner), v.load(&opposite.outer), v.splat(0.0));
        let is_above = v.is_below(zero, self.z);
        let turned = v.select(self.slides, v.splat(f64::INFINITY), v.sub(self.z, v.select(is_above, inner, outer)));
        let weighs_otherwise = v.select(v.is_below(self.z, zero), v.splat(f64::NEG_INFINITY), zero);
        let is_identity = v.is_at_most(v.add(outer, v.load(&side.thresholds(block).outer)), zero);
        v.select(is_identity, weighs_otherwise, turned)
    }
}

/// Where operators come from.
pub(super) trait Start: Copy {
    /// The outputs of the block there, the bank having put out `last`.
    fn of<V: Vectors>(self, block: &Block<V::Lanes>, v: V, last: V::Numbers) -> V::Numbers;
}

/// From the outputs that the bank has.
#[derive(Clone, Copy)]
pub(super) struct Here;

impl Start for Here {
    #[inline(always)]
    fn of<V: Vectors>(self, _: &Block<V::Lanes>, _: V, last: V::Numbers) -> V::Numbers {
        last
    }
}

/// From an input to which the bank has not been moved yet.
#[derive(Clone, Copy)]
pub(super) struct At(pub(super) f64);

impl Start for At {
    #[inline(always)]
    fn of<V: Vectors>(self, block: &Block<V::Lanes>, v: V, last: V::Numbers) -> V::Numbers {
        Both.next(block, v, v.splat(self.0), last)
    }
}

/// The stretch at the input `x`, every operator coming from `start`. It has the same bits wherever on it `x` is.
#[derive(Clone, Copy)]
pub(super) struct Look<'a, O> {
    pub(super) outputs: &'a [f64],
    pub(super) start: O,
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl<O: Start> BankLoop for Look<'_, O> {
    type Output = Piece;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Piece {
        match self.direction {
            Direction::Rising => self.seen_from::<V, W>(Rising, v, blocks),
            Direction::Falling => self.seen_from::<V, W>(Falling, v, blocks),
        }
    }
}

impl<O: Start> Look<'_, O> {
    #[inline(always)]
    fn seen_from<V: Vectors, W: Weights>(self, side: impl Side, v: V, blocks: &[Block<V::Lanes>]) -> Piece {
        let (x, zero) = (v.splat(side.turned(self.x)), v.splat(0.0));
        let (mut slope, mut offset) = (v.nothing(), v.nothing());
        let (mut begin, mut end) = (v.splat(f64::NEG_INFINITY), v.splat(f64::INFINITY));
        for (block, last) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            let thresholds = side.thresholds(block);
            let seen = Seen::at(side, block, v, x, self.start.of(block, v, v.load(last)));
            let w = W::along(side, block, v, seen.z);
            slope = v.sum(slope, v.select(seen.slides, w, zero));
            offset = v.sum_product(offset, w, seen.offset(thresholds, v));
            begin = v.max(begin, seen.begin(thresholds, v));
            end = v.min(end, seen.end(thresholds, v));
        }
        Piece {
            direction: self.direction,
            line: Line { slope: v.total(slope), offset: side.turned(v.total(offset)) },
            begin: side.turned(v.largest(begin)),
            end: side.turned(v.smallest(end)),
        }
    }
}

/// Where the line at the input `x`, to which the operators have come, ends behind that: infinitely far ahead, if any but an identity
/// slides.
pub(super) struct LookBack<'a> {
    pub(super) outputs: &'a [f64],
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl BankLoop for LookBack<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        match self.direction {
            Direction::Rising => self.seen_from(Rising, v, blocks),
            Direction::Falling => self.seen_from(Falling, v, blocks),
        }
    }
}

impl LookBack<'_> {
    #[inline(always)]
    fn seen_from<V: Vectors>(self, side: impl Side, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        let x = v.splat(side.turned(self.x));
        let mut back = v.splat(f64::NEG_INFINITY);
        for (block, z) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            back = v.max(back, Seen::at(side, block, v, x, v.load(z)).back(side, block, v));
        }
        side.turned(v.largest(back))
    }
}
