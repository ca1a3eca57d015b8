//! The straight line that the output of a bank is on over the input, and how far it holds.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::direction::Direction;
use super::super::four_lanes::{FourLanes, Lanes};
use super::super::line::{Line, Piece};
use super::block::{Block, Both, Bounds, Thresholds};
use super::members::BankLoop;
use super::side::{Falling, Rising, Side};
use super::weights::Weights;

/// Four operators at an input, as they are seen.
pub(super) struct Seen<F: FourLanes> {
    last: F::Numbers,
    z: F::Numbers,
    is_below_inner: F::Mask,
    pub(super) slides: F::Mask,
}

impl<F: FourLanes> Seen<F> {
    /// Moved to `x` from the output `last`. What slides has come to lo(x) and does not stick at zero.
    #[inline(always)]
    pub(super) fn at(side: impl Side, block: &Block, four: F, x: F::Numbers, last: F::Numbers) -> Self {
        let thresholds = side.thresholds(block);
        let (last, least) = (side.seen(four, last), thresholds.least(four, x));
        let is_below_inner = four.is_below(x, four.load(&thresholds.inner));
        let sticks_not = four.or(is_below_inner, four.is_at_most(four.load(&thresholds.outer), x));
        let slides = four.and(four.is_at_most(last, least), sticks_not);
        Self { last, z: four.max(least, last), is_below_inner, slides }
    }

    /// Where lo begins to push the output `z`.
    #[inline(always)]
    fn pushed_from(Thresholds { outer, inner }: &Thresholds, four: F, z: F::Numbers) -> F::Numbers {
        four.add(z, four.select(four.is_below(z, four.splat(0.0)), four.load(inner), four.load(outer)))
    }

    /// Its output at the input zero, if it stays on its line.
    #[inline(always)]
    fn offset(&self, Thresholds { outer, inner }: &Thresholds, four: F) -> F::Numbers {
        let slid = four.negated(four.select(self.is_below_inner, four.load(inner), four.load(outer)));
        four.select(self.slides, slid, self.z)
    }

    /// Where its line begins, having come from `last`.
    #[inline(always)]
    fn begin(&self, Thresholds { outer, inner }: &Thresholds, four: F) -> F::Numbers {
        let (outer, inner, zero) = (four.load(outer), four.load(inner), four.splat(0.0));
        let below = four.select(self.is_below_inner, four.add(self.last, inner), outer);
        let begins = four.select(four.is_below(self.last, zero), below, four.add(self.last, outer));
        let stuck = four.select(four.is_below(self.last, self.z), inner, four.splat(f64::NEG_INFINITY));
        four.select(self.slides, begins, stuck)
    }

    /// Where its line ends ahead: where it is pushed, or sticks at zero.
    #[inline(always)]
    fn end(&self, thresholds: &Thresholds, four: F) -> F::Numbers {
        let sticks = four.select(self.is_below_inner, four.load(&thresholds.inner), four.splat(f64::INFINITY));
        four.select(self.slides, sticks, Self::pushed_from(thresholds, four, self.z))
    }

    /// Where its line ends behind: where the opposite bound pushes it, or infinitely far ahead if it slides; of an identity only where
    /// it weighs otherwise.
    #[inline(always)]
    fn back(&self, side: impl Side, block: &Block, four: F) -> F::Numbers {
        let opposite = side.opposite_thresholds(block);
        let (inner, outer, zero) = (four.load(&opposite.inner), four.load(&opposite.outer), four.splat(0.0));
        let is_above = four.is_below(zero, self.z);
        let turned =
            four.select(self.slides, four.splat(f64::INFINITY), four.sub(self.z, four.select(is_above, inner, outer)));
        let weighs_otherwise = four.select(four.is_below(self.z, zero), four.splat(f64::NEG_INFINITY), zero);
        let is_identity = four.is_at_most(four.add(outer, four.load(&side.thresholds(block).outer)), zero);
        four.select(is_identity, weighs_otherwise, turned)
    }
}

/// Where operators come from.
pub(super) trait Start: Copy {
    /// Four outputs there, the bank having put out `last`.
    fn of<F: FourLanes>(self, block: &Block, four: F, last: F::Numbers) -> F::Numbers;
}

/// From the outputs that the bank has.
#[derive(Clone, Copy)]
pub(super) struct Here;

impl Start for Here {
    #[inline(always)]
    fn of<F: FourLanes>(self, _: &Block, _: F, last: F::Numbers) -> F::Numbers {
        last
    }
}

/// From an input to which the bank has not been moved yet.
#[derive(Clone, Copy)]
pub(super) struct At(pub(super) f64);

impl Start for At {
    #[inline(always)]
    fn of<F: FourLanes>(self, block: &Block, four: F, last: F::Numbers) -> F::Numbers {
        Both.next(block, four, four.splat(self.0), last)
    }
}

/// The stretch at the input `x`, every operator coming from `start`. It has the same bits wherever on it `x` is.
#[derive(Clone, Copy)]
pub(super) struct Look<'a, O> {
    pub(super) outputs: &'a [Lanes],
    pub(super) start: O,
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl<O: Start> BankLoop for Look<'_, O> {
    type Output = Piece;

    #[inline(always)]
    fn run<F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> Piece {
        match self.direction {
            Direction::Rising => self.seen_from::<F, W>(Rising, four, blocks),
            Direction::Falling => self.seen_from::<F, W>(Falling, four, blocks),
        }
    }
}

impl<O: Start> Look<'_, O> {
    #[inline(always)]
    fn seen_from<F: FourLanes, W: Weights>(self, side: impl Side, four: F, blocks: &[Block]) -> Piece {
        let (x, nothing) = (four.splat(side.turned(self.x)), four.splat(0.0));
        let (mut slope, mut offset) = (nothing, nothing);
        let (mut begin, mut end) = (four.splat(f64::NEG_INFINITY), four.splat(f64::INFINITY));
        for (block, last) in blocks.iter().zip(self.outputs) {
            let thresholds = side.thresholds(block);
            let seen = Seen::at(side, block, four, x, self.start.of(block, four, four.load(last)));
            let w = W::along(side, block, four, seen.z);
            slope = four.add(slope, four.select(seen.slides, w, nothing));
            offset = four.add_product(offset, w, seen.offset(thresholds, four));
            begin = four.max(begin, seen.begin(thresholds, four));
            end = four.min(end, seen.end(thresholds, four));
        }
        Piece {
            direction: self.direction,
            line: Line { slope: four.total(slope), offset: side.turned(four.total(offset)) },
            begin: side.turned(four.largest(begin)),
            end: side.turned(four.smallest(end)),
        }
    }
}

/// Where the line at the input `x`, to which the operators have come, ends behind that: infinitely far ahead, if any but an identity
/// slides.
pub(super) struct LookBack<'a> {
    pub(super) outputs: &'a [Lanes],
    pub(super) direction: Direction,
    pub(super) x: f64,
}

impl BankLoop for LookBack<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> f64 {
        match self.direction {
            Direction::Rising => self.seen_from(Rising, four, blocks),
            Direction::Falling => self.seen_from(Falling, four, blocks),
        }
    }
}

impl LookBack<'_> {
    #[inline(always)]
    fn seen_from<F: FourLanes>(self, side: impl Side, four: F, blocks: &[Block]) -> f64 {
        let x = four.splat(side.turned(self.x));
        let mut back = four.splat(f64::NEG_INFINITY);
        for (block, z) in blocks.iter().zip(self.outputs) {
            back = four.max(back, Seen::at(side, block, four, x, four.load(z)).back(side, block, four));
        }
        side.turned(four.largest(back))
    }
}
