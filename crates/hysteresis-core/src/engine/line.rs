//! Straight lines: what a model is between two breakpoints.

use super::direction::Direction;
use crate::real::Real;

/// A straight line: output = slope * input + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Line<T = f64> {
    pub(crate) slope: T,
    pub(crate) offset: T,
}

impl<T: Real> Line<T> {
    #[inline]
    pub(crate) fn at(self, input: T) -> T {
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
pub(crate) struct Piece<T = f64> {
    pub(crate) direction: Direction,
    pub(crate) line: Line<T>,
    pub(crate) begin: T,
    pub(crate) end: T,
}

impl<T: Real> Piece<T> {
    /// A piece of no length: every new sample is evaluated anew.
    pub(crate) fn point(direction: Direction, input: T, output: T) -> Self {
        Self { direction, line: Line { slope: T::ZERO, offset: output }, begin: input, end: input }
    }

    /// The same piece over the output, up to a limit of the input.
    #[inline]
    pub(crate) fn inverse(self, limits: (T, T)) -> Self {
        let Self { direction, line, begin, end } = self;
        let end = direction.nearer(end, direction.limit(limits));
        Self { direction, line: line.inverted(), begin: line.at(begin), end: line.at(end) }
    }
}
