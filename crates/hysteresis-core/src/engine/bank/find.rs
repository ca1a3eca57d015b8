//! The inverse of a bank: the input at which the output is what was asked for.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::marker::PhantomData;

use super::super::direction::Direction;
use super::super::line::{Line, Piece};
use super::super::solve::{Path, Point, Reach, solve};
use super::super::vectors::{Lanes, Vectors};
use super::block::{Block, Both, Bounds};
use super::blocks::BankLoop;
use super::look::{Look, Seen, Start};
use super::side::{Falling, Rising};
use super::weights::Weights;

/// A search from `near` on, all of it in one loop for the instructions of the processor: where it comes to, and the last piece that it
/// looked at. `look` is the first look.
pub(super) struct Find<'a, O> {
    pub(super) look: Look<'a, O>,
    pub(super) near: Point,
    pub(super) to: f64,
    pub(super) limit: f64,
}

impl<O: Start> BankLoop for Find<'_, O> {
    type Output = (Reach, Piece);

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> (Reach, Piece) {
        let Self { look, near, to, limit } = self;
        let last = Piece::point(look.direction, near.input, near.output);
        let mut path = Ahead::<_, _, W> { v, blocks, look, last, weights: PhantomData };
        let reach = solve(&mut path, look.direction, near, None, look.x, to, limit);
        (reach, path.last)
    }
}

/// The inputs ahead of where a search began. A look does not move the bank.
struct Ahead<'a, V: Vectors, O, W> {
    v: V,
    blocks: &'a [Block<V::Lanes>],
    look: Look<'a, O>,
    last: Piece,
    weights: PhantomData<W>,
}

impl<V: Vectors, O: Start, W: Weights> Path<f64> for Ahead<'_, V, O, W> {
    type Checkpoint = ();

    #[inline(always)]
    fn checkpoint(&self) {}

    #[inline(always)]
    fn go_back(&mut self, (): ()) {}

    #[inline(always)]
    fn look(&mut self, _: Direction, x: f64) -> Piece {
        self.last = Look { x, ..self.look }.run::<V, W>(self.v, self.blocks);
        self.last
    }
}

/// The line of the output at the input `x` if a move there is the first one, from outputs that no input has led to.
pub(super) struct FirstLine<'a> {
    pub(super) outputs: &'a [f64],
    pub(super) x: f64,
}

impl BankLoop for FirstLine<'_> {
    type Output = Line;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Line {
        let (x, zero) = (v.splat(self.x), v.splat(0.0));
        let (mut output, mut slope) = (v.nothing(), v.nothing());
        for (block, last) in blocks.iter().zip(V::Lanes::vectors(self.outputs)) {
            let last = v.load(last);
            let z = Both.next(block, v, x, last);
            let w = W::of(block, v, z);
            output = v.sum_product(output, w, z);
            let rises = Seen::at(Rising, block, v, x, last).slides;
            let falls = Seen::at(Falling, block, v, v.negated(x), last).slides;
            slope = v.sum(slope, v.select(v.or(rises, falls), w, zero));
        }
        let slope = v.total(slope);
        Line { slope, offset: v.total(output) - slope * self.x }
    }
}
