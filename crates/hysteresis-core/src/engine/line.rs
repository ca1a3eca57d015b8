//! Straight lines: what a model is between two breakpoints.

use super::direction::Direction;

/// A straight line: output = slope * input + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line {
    pub(crate) slope: f64,
    pub(crate) offset: f64,
}

impl Line {
    #[inline]
    pub(crate) fn at(self, input: f64) -> f64 {
        self.slope * input + self.offset
    }

    /// The input as a line in the output.
    #[inline]
    pub(crate) fn inverted(self) -> Self {
        Self { slope: self.slope.recip(), offset: -self.offset / self.slope }
    }
}

/// A straight line and how far, in the direction of travel, it holds: from `begin` up to but not including `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) direction: Direction,
    pub(crate) line: Line,
    pub(crate) begin: f64,
    pub(crate) end: f64,
}

impl Piece {
    /// A piece of no length: every new sample is evaluated anew.
    pub(crate) fn point(direction: Direction, input: f64, output: f64) -> Self {
        Self { direction, line: Line { slope: 0.0, offset: output }, begin: input, end: input }
    }
}
