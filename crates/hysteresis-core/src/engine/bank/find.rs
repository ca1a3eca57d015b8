//! The inverse of a bank: the input at which the output is what was asked for.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::marker::PhantomData;

use super::super::direction::Direction;
use super::super::four_lanes::{FourLaneLoop, FourLanes, Lanes};
use super::super::line::{Line, Piece};
use super::super::solve::{Path, Point, Reach, solve};
use super::block::{Block, Both, Bounds, Weights};
use super::look::{Look, Side, SlidingWeights, Start, Stretch};

/// A search from `near` on, all of it in one loop for the instructions of the processor.
pub(super) struct Find<'a, S, W, O> {
    pub(super) blocks: &'a [Block],
    pub(super) outputs: &'a [Lanes],
    pub(super) start: O,
    pub(super) near: Point,
    pub(super) guess: f64,
    pub(super) to: f64,
    pub(super) limit: f64,
    pub(super) by: PhantomData<(S, W)>,
}

impl<S: Side, W: SlidingWeights, O: Start> FourLaneLoop for Find<'_, S, W, O> {
    type Output = (Reach, Piece);

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> (Reach, Piece) {
        let Self { near, guess, to, limit, .. } = self;
        let last = Piece::point(S::DIRECTION, near.input, near.output);
        let mut path = Ahead { four, find: self, last };
        let reach = solve(&mut path, S::DIRECTION, near, None, guess, to, limit);
        (reach, path.last)
    }
}

/// The inputs ahead of where a search began. A look does not move the bank.
struct Ahead<'a, F, S, W, O> {
    four: F,
    find: Find<'a, S, W, O>,
    last: Piece,
}

impl<F: FourLanes, S: Side, W: SlidingWeights, O: Start> Path<f64> for Ahead<'_, F, S, W, O> {
    type Checkpoint = ();

    #[inline(always)]
    fn checkpoint(&self) {}

    #[inline(always)]
    fn go_back(&mut self, (): ()) {}

    #[inline(always)]
    fn look(&mut self, direction: Direction, x: f64) -> Piece {
        let Find { blocks, outputs, start, .. } = self.find;
        let look: Look<'_, S, W, O> = Look { blocks, outputs, start, x, by: PhantomData };
        let Stretch { line, begin, end } = look.run(self.four);
        self.last = Piece { direction, line, begin, end };
        self.last
    }
}

/// The line of the output at the input `x` if a move there is the first one, from outputs that no input has led to.
pub(super) struct FirstLine<'a, W> {
    pub(super) blocks: &'a [Block],
    pub(super) outputs: &'a [Lanes],
    pub(super) x: f64,
    pub(super) by: PhantomData<W>,
}

impl<W: Weights> FourLaneLoop for FirstLine<'_, W> {
    type Output = Line;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> Line {
        let x = four.splat(self.x);
        let (mut output, mut slope) = (four.splat(0.0), four.splat(0.0));
        for (block, last) in self.blocks.iter().zip(self.outputs) {
            let last = four.load(last);
            let z = Both::next(block, four, x, last);
            let w = W::of(block, four, z);
            output = four.mul_add(w, z, output);
            slope = four.add(slope, four.select(Both::slide(block, four, x, last), w, four.splat(0.0)));
        }
        let slope = four.total(slope);
        Line { slope, offset: four.total(output) - slope * self.x }
    }
}
