//! Which way the input goes, and so which bounds can push the operators. The outputs are the same bits whether it is told or not.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::direction::Direction;

/// Which way a move can push the operators, and whether they can stick at zero there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Push {
    Up,
    UpBelowZero,
    Down,
    DownAboveZero,
    /// Either way: right of every move, also from outputs that no input has led to.
    Either,
    /// No way: the outputs stay, wherever the input is.
    Nowhere,
}

impl Push {
    /// Of a move of the input to `to`, the last one being `from`; NaN if no input has led to the outputs.
    #[inline(always)]
    pub(super) fn between(from: f64, to: f64) -> Self {
        if to >= from {
            if to < 0.0 { Self::UpBelowZero } else { Self::Up }
        } else if to < from {
            if to > 0.0 { Self::DownAboveZero } else { Self::Down }
        } else {
            Self::Either
        }
    }
}

/// How often the input turned round of late: where it turns often, a processor cannot guess the next direction, and for few operators
/// both bounds cost less than a wrong guess.
#[derive(Clone, Copy, Debug)]
pub(super) struct Turns {
    rises: bool,
    /// A bit for each of the last eight moves: whether it turned round.
    moves: u8,
    few_operators: bool,
}

/// Both bounds of so many blocks cost about as much as a wrong guess.
const FEW_BLOCKS: usize = 8;

/// From so many turns in eight moves on the processor guesses wrong too often.
const MANY_TURNS: u32 = 3;

impl Turns {
    #[inline(always)]
    pub(super) fn of(blocks: usize) -> Self {
        Self { rises: true, moves: 0, few_operators: blocks <= FEW_BLOCKS }
    }

    /// Which way the input went last.
    #[inline]
    pub(super) fn direction(self) -> Direction {
        if self.rises { Direction::Rising } else { Direction::Falling }
    }

    /// [`Push::between`], or either where that costs less.
    #[inline(always)]
    pub(super) fn push(&mut self, from: f64, to: f64) -> Push {
        let rises = to >= from;
        self.moves = self.moves << 1 | u8::from(rises != self.rises);
        self.rises = rises;
        if self.few_operators & (self.moves.count_ones() >= MANY_TURNS) {
            Push::Either
        } else {
            Push::between(from, to)
        }
    }
}
