//! The hot path: on a smooth signal a sample is two comparisons and one multiply-add.

use crate::engine::{Direction, Line, Piece};
use crate::real::Real;

/// The straight line that a stream is on, and the samples for which it stays on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment<T> {
    /// Of the direction of travel: times this, inputs grow along the branch.
    sign: T,
    /// The last input, times the sign.
    last: T,
    /// Where the line ends, times the sign.
    end: T,
    line: Line<T>,
}

impl<T: Real> Segment<T> {
    /// The segment at the input `last`. It ends where admissible inputs end, so that no other is ever on it.
    #[inline]
    pub(super) fn new(piece: Piece<T>, last: T) -> Self {
        let sign: T = piece.direction.sign();
        let end = sign * piece.end;
        let end = if end < T::MAX_MAGNITUDE { end } else { T::MAX_MAGNITUDE };
        Self { sign, last: sign * last, end, line: piece.line }
    }

    /// The output if the input lies ahead on the line. False for NaN.
    #[inline]
    pub(super) fn peek(&self, input: T) -> Option<T> {
        let ahead = self.sign * input;
        (ahead >= self.last && ahead < self.end).then(|| self.line.at(input))
    }

    /// [`peek`](Self::peek), and moves there.
    #[inline]
    pub(super) fn step(&mut self, input: T) -> Option<T> {
        let output = self.peek(input);
        if output.is_some() {
            self.last = self.sign * input;
        }
        output
    }

    /// The last input.
    #[inline]
    pub(super) fn input(&self) -> T {
        self.sign * self.last
    }

    /// The output at the last input.
    #[inline]
    pub(super) fn output(&self) -> T {
        self.line.at(self.input())
    }

    /// The direction in which `input` lies.
    #[inline]
    pub(super) fn direction_to(&self, input: T) -> Direction {
        let ahead = self.sign * input >= self.last;
        if ahead == (self.sign > T::ZERO) { Direction::Rising } else { Direction::Falling }
    }
}
