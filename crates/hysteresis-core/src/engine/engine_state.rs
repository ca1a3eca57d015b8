//! Where a model is between two breakpoints: both families on their branches.

use super::branch::Branch;
use super::direction::Direction;
use super::families::{Families, Stacks};
use super::line::{Line, Piece};
use crate::real::Real;
use crate::store::Store;

/// Both families on their branches, and the direction of the input. A copy can look ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EngineState<T> {
    pub(crate) direction: Direction,
    pub(crate) positive: Branch<T>,
    pub(crate) negative: Branch<T>,
}

impl<T: Real> EngineState<T> {
    /// At rest: all operators at zero, the input at zero.
    pub(crate) fn virgin(families: &Families<T, impl Store>) -> Self {
        Self {
            direction: Direction::Rising,
            positive: Branch::virgin(&families.positive, Direction::Rising),
            negative: Branch::virgin(&families.negative, Direction::Falling),
        }
    }

    /// Turns round at the input `x`, which becomes turning point number `reversal`.
    #[inline]
    pub(crate) fn reverse(&mut self, families: &Families<T, impl Store>, x: T, reversal: u64) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.reverse_from(Direction::Rising, families, x, reversal),
            Direction::Falling => self.reverse_from(Direction::Falling, families, x, reversal),
        }
    }

    #[inline(always)]
    fn reverse_from(&mut self, ended: Direction, families: &Families<T, impl Store>, x: T, reversal: u64) {
        let (output, mirrored) = (self.line(families).at(x), ended.reversed());
        self.direction = mirrored;
        self.positive.reverse(&families.positive, ended, x, output, reversal);
        self.negative.reverse(&families.negative, mirrored, -x, output, reversal);
    }

    /// Moves on to the input `x`, ahead on this branch.
    #[inline(never)]
    pub(crate) fn advance(&mut self, families: &Families<T, impl Store>, stacks: &Stacks<T, impl Store>, x: T) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.advance_in(Direction::Rising, families, stacks, x),
            Direction::Falling => self.advance_in(Direction::Falling, families, stacks, x),
        }
    }

    #[inline(always)]
    pub(super) fn advance_in(
        &mut self,
        direction: Direction,
        families: &Families<T, impl Store>,
        stacks: &Stacks<T, impl Store>,
        x: T,
    ) {
        self.positive.advance(&families.positive, &stacks.positive, direction, x);
        self.negative.advance(&families.negative, &stacks.negative, direction.reversed(), -x);
    }

    /// Puts what the last reversal froze on the stacks.
    #[inline]
    pub(crate) fn keep_top(&self, stacks: &mut Stacks<T, impl Store>) {
        self.positive.keep_top(&mut stacks.positive);
        self.negative.keep_top(&mut stacks.negative);
    }

    /// Reads a number of each line of memory.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch(&self) -> u64 {
        self.positive.fetch() ^ self.negative.fetch()
    }

    /// Reads the thresholds at which the next operators begin to slide.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch_next(&self, families: &Families<T, impl Store>) -> u64 {
        families.positive.fetch(self.positive.moved) ^ families.negative.fetch(self.negative.moved)
    }

    /// The output of the model over the input, up to the next breakpoint.
    #[inline]
    pub(crate) fn line(&self, families: &Families<T, impl Store>) -> Line<T> {
        let (positive, negative) = (self.positive.line(), self.negative.line());
        Line {
            slope: T::narrow(families.identity_weight + positive.slope + negative.slope),
            offset: T::narrow(positive.offset - negative.offset),
        }
    }

    /// Where the line ends behind the input, if that may go back on it: if no operator slides.
    #[inline]
    pub(crate) fn back(&self, families: &Families<T, impl Store>) -> Option<T> {
        if self.positive.slides() || self.negative.slides() {
            return None;
        }
        let back = self.direction.reversed();
        let positive = self.positive.next_start(&families.positive, back);
        Some(back.nearer(positive, -self.negative.next_start(&families.negative, self.direction)))
    }

    /// The line and its breakpoints, over the input.
    #[inline]
    pub(crate) fn piece(&self, families: &Families<T, impl Store>) -> Piece<T> {
        self.piece_in(self.direction, families)
    }

    #[inline(always)]
    pub(super) fn piece_in(&self, direction: Direction, families: &Families<T, impl Store>) -> Piece<T> {
        let begin = direction.further(self.positive.begin(), -self.negative.begin());
        let end = direction.nearer(self.positive.end(), -self.negative.end());
        Piece { direction, line: self.line(families), begin, end }
    }
}
