//! The inverse of a model: a search for the input at which the output is what was asked for.

use super::branch::Checkpoint;
use super::direction::Direction;
use super::engine_state::EngineState;
use super::families::{Families, Stacks};
use super::line::Piece;
use super::solve::{Path, Point, Reach, first_guess, solve};
use crate::real::Real;
use crate::store::Store;

/// An engine state on the move that may turn out to be too far. `start` is where it began if the turning points of the
/// last reversal are not on the stacks.
pub(super) struct InverseSearch<'a, T: Real, S: Store> {
    pub(super) state: &'a mut EngineState<T>,
    pub(super) start: Option<&'a EngineState<T>>,
    pub(super) families: &'a Families<T, S>,
    pub(super) stacks: &'a Stacks<T, S>,
}

impl<T: Real, S: Store> InverseSearch<'_, T, S> {
    /// Moves the state on from `near` until the output is `to` or the input is at `limit`.
    #[inline(never)]
    pub(super) fn run(self, near: Point<T>, to: T, limit: T) -> Reach<T> {
        // One body, compiled for each direction.
        match self.state.direction {
            Direction::Rising => self.find(Direction::Rising, near, to, limit),
            Direction::Falling => self.find(Direction::Falling, near, to, limit),
        }
    }

    #[inline(always)]
    fn find(mut self, direction: Direction, near: Point<T>, to: T, limit: T) -> Reach<T> {
        let (near, far) = self.close_loops(direction, near, to, limit);
        let slope = self.state.line(self.families).slope;
        solve(&mut self, direction, near, far, first_guess(near, slope, far, to), to, limit)
    }

    /// Closes every loop whose turning point has an output that `to` lies beyond; where that comes to, and the turning
    /// point at which the loop that holds `to` closes.
    #[inline(always)]
    pub(super) fn close_loops(
        &mut self,
        direction: Direction,
        mut near: Point<T>,
        to: T,
        limit: T,
    ) -> (Point<T>, Option<Point<T>>) {
        let (EngineState { positive, negative, .. }, families, stacks) = (&mut *self.state, self.families, self.stacks);
        loop {
            let one = positive.closes_at(&stacks.positive, direction);
            let other = negative.closes_at(&stacks.negative, direction.reversed()).map(Point::mirrored);
            let nearest = match (one, other) {
                (Some(one), Some(other)) if direction.leads_away(one.input, other.input) => Some(other),
                (one, other) => one.or(other),
            };
            let Some(close) = nearest else { return (near, None) };
            let ahead = !direction.has_passed(close.input, near.input) & !direction.has_passed(limit, close.input);
            if !ahead {
                return (near, None);
            }
            if !direction.has_passed(close.output, to) {
                return (near, Some(close));
            }
            positive.close_loops(&families.positive, &stacks.positive, direction, close.input);
            negative.close_loops(&families.negative, &stacks.negative, direction.reversed(), -close.input);
            near = close;
        }
    }
}

impl<T: Real, S: Store> Path<T> for InverseSearch<'_, T, S> {
    type Checkpoint = (Checkpoint<T>, Checkpoint<T>);

    #[inline(always)]
    fn checkpoint(&self) -> (Checkpoint<T>, Checkpoint<T>) {
        (self.state.positive.checkpoint(), self.state.negative.checkpoint())
    }

    #[inline(always)]
    fn go_back(&mut self, (positive, negative): (Checkpoint<T>, Checkpoint<T>)) {
        let (start, stacks) = (self.start, self.stacks);
        self.state.positive.go_back(positive, start.map(|start| &start.positive), &stacks.positive);
        self.state.negative.go_back(negative, start.map(|start| &start.negative), &stacks.negative);
    }

    #[inline(always)]
    fn look(&mut self, direction: Direction, input: T) -> Piece<T> {
        self.state.advance_in(direction, self.families, self.stacks, input);
        self.state.piece_in(direction, self.families)
    }
}
