//! The hot path: on a smooth signal, or where nothing slides, a sample is two comparisons and one multiply-add.

use crate::engine::{Direction, Line, Piece};
use crate::real::Real;

/// How many samples are compared and evaluated as vectors.
pub(super) const BLOCK: usize = 8;

/// The straight line that a stream is on, and the samples for which it stays on it.
///
/// Where operators slide, those are the samples ahead: a step back is a reversal. Where none does, as right after a
/// reversal, the line holds on both sides, and noise changes nothing that is remembered.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment<T> {
    /// Of the direction of travel: times this, inputs grow along the branch.
    sign: T,
    /// The last input, times the sign.
    last: T,
    /// Where the line ends ahead, times the sign.
    end: T,
    /// Where it ends behind, times the sign; infinity as long as a step back leaves it at once.
    back: T,
    line: Line<T>,
}

impl<T: Real> Segment<T> {
    /// The segment at the input `last`, inputs being relative to `origin`. It ends where admissible inputs may end, so that
    /// none beyond is on it: the last one was admissible.
    #[inline]
    pub(super) fn new(piece: Piece<T>, last: T, origin: T) -> Self {
        let sign: T = piece.direction.sign();
        let (last, end, most) = (sign * last, sign * piece.end, surely_admissible(origin));
        let end = if end < most { end } else { most };
        Self { sign, last, end, back: T::INFINITY, line: piece.line }
    }

    /// A place that no sample is on: it begins at infinity, which a processor can predict of any signal, and ends at the last input.
    #[inline]
    pub(super) fn point(input: T, output: T) -> Self {
        let line = Line { slope: T::ZERO, offset: output };
        Self { sign: T::ONE, last: T::INFINITY, end: input, back: T::INFINITY, line }
    }

    /// Lets the line hold behind `last` too, down to but not including `back`; not where it is at its end. `origin` as in
    /// [`new`](Self::new).
    #[inline]
    pub(super) fn open(&mut self, back: T, origin: T) {
        if self.last < self.end {
            self.back = (self.sign * back).max(-surely_admissible(origin));
        }
    }

    /// Whether an input that is not on the line lies behind it.
    #[inline(always)]
    pub(super) fn lies_behind(&self, input: T) -> bool {
        self.sign * input < self.last
    }

    /// The output if the input lies on the line. False for NaN.
    #[inline]
    pub(super) fn peek(&self, input: T) -> Option<T> {
        let ahead = self.sign * input;
        ((ahead >= self.last || ahead > self.back) && ahead < self.end).then(|| self.at(input))
    }

    /// [`peek`](Self::peek), and moves there.
    #[inline]
    pub(super) fn step(&mut self, input: T) -> Option<T> {
        let output = self.peek(input);
        if output.is_some() {
            self.move_to(input);
        }
        output
    }

    /// Moves to an input on the line.
    #[inline(always)]
    pub(super) fn move_to(&mut self, input: T) {
        self.last = self.sign * input;
    }

    /// The output at an input on the line.
    #[inline(always)]
    pub(super) fn at(&self, input: T) -> T {
        self.line.at(input)
    }

    /// Whether all samples of a block surely lie on the line, compared as vectors. `relative` brings a sample to the origin of the
    /// line, and does not fall where that grows.
    #[inline(always)]
    pub(super) fn holds(&self, block: &[T; BLOCK], relative: impl Fn(T) -> T) -> bool {
        let ahead = |sample| self.sign * relative(sample);
        let mut holds = true;
        if self.back < T::INFINITY {
            for sample in block {
                holds &= (ahead(*sample) > self.back) & (ahead(*sample) < self.end);
            }
            return holds;
        }
        if self.sign > T::ZERO {
            for (last, next) in block.iter().zip(&block[1..]) {
                holds &= last <= next;
            }
        } else {
            for (last, next) in block.iter().zip(&block[1..]) {
                holds &= last >= next;
            }
        }
        holds & (ahead(block[0]) >= self.last) & (ahead(block[BLOCK - 1]) < self.end)
    }

    /// The last input.
    #[inline]
    pub(super) fn input(&self) -> T {
        self.sign * if self.last < T::INFINITY { self.last } else { self.end }
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

/// The largest magnitude relative to `origin` up to which every sample is admissible.
#[inline]
fn surely_admissible<T: Real>(origin: T) -> T {
    T::MAX_MAGNITUDE - origin.abs()
}
