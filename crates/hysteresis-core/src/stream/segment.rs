//! The hot path: on a smooth signal a sample is two comparisons and one multiply-add.

use crate::engine::{Direction, Line, Piece};
use crate::error::MAX_MAGNITUDE;

/// The straight line that a stream is on, and the samples for which it stays on it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Segment {
    /// Of the direction of travel: times this, inputs grow along the branch.
    sign: f64,
    /// The last input, times the sign.
    last: f64,
    /// Where the line ends, times the sign.
    end: f64,
    line: Line,
}

impl Segment {
    /// The segment at the input `last`. It ends where admissible inputs end, so that no other is ever on it.
    #[inline]
    pub(super) fn new(piece: Piece, last: f64) -> Self {
        let sign = piece.direction.sign();
        let end = sign * piece.end;
        let end = if end < MAX_MAGNITUDE { end } else { MAX_MAGNITUDE };
        Self { sign, last: sign * last, end, line: piece.line }
    }

    /// The output if the input lies ahead on the line. False for NaN.
    #[inline]
    pub(super) fn peek(&self, input: f64) -> Option<f64> {
        let ahead = self.sign * input;
        (ahead >= self.last && ahead < self.end).then(|| self.line.at(input))
    }

    /// [`peek`](Self::peek), and moves there.
    #[inline]
    pub(super) fn step(&mut self, input: f64) -> Option<f64> {
        let output = self.peek(input);
        if output.is_some() {
            self.last = self.sign * input;
        }
        output
    }

    /// The last input.
    #[inline]
    pub(super) fn input(&self) -> f64 {
        self.sign * self.last
    }

    /// The output at the last input.
    #[inline]
    pub(super) fn output(&self) -> f64 {
        self.line.at(self.input())
    }

    /// The direction in which `input` lies.
    #[inline]
    pub(super) fn direction_to(&self, input: f64) -> Direction {
        let ahead = self.sign * input >= self.last;
        if ahead == (self.sign > 0.0) { Direction::Rising } else { Direction::Falling }
    }
}
