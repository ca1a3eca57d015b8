//! The inverse of a model: a search for the input at which the output is what was asked for.

use super::branch::Checkpoint;
use super::direction::Direction;
use super::engine_state::EngineState;
use super::families::{Families, Stacks};
use super::line::Piece;
use super::solve::{Path, Point, Reach, first_guess, solve};

/// An engine state on the move that may turn out to be too far. `start` is where it began if the turning points of the
/// last reversal are not on the stacks.
pub(super) struct InverseSearch<'a> {
    pub(super) state: &'a mut EngineState,
    pub(super) start: Option<&'a EngineState>,
    pub(super) families: &'a Families,
    pub(super) stacks: &'a Stacks,
}

impl InverseSearch<'_> {
    /// Moves the state on from `near` until the output is `to` or the input is at `limit`.
    #[inline(never)]
    pub(super) fn run(self, near: Point, to: f64, limit: f64) -> Reach {
        // One body, compiled for each direction.
        match self.state.direction {
            Direction::Rising => self.find(Direction::Rising, near, to, limit),
            Direction::Falling => self.find(Direction::Falling, near, to, limit),
        }
    }

    #[inline(always)]
    fn find(mut self, direction: Direction, near: Point, to: f64, limit: f64) -> Reach {
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
        mut near: Point,
        to: f64,
        limit: f64,
    ) -> (Point, Option<Point>) {
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

impl Path for InverseSearch<'_> {
    type Checkpoint = (Checkpoint, Checkpoint);

    #[inline(always)]
    fn checkpoint(&self) -> (Checkpoint, Checkpoint) {
        (self.state.positive.checkpoint(), self.state.negative.checkpoint())
    }

    #[inline(always)]
    fn go_back(&mut self, (positive, negative): (Checkpoint, Checkpoint)) {
        let (start, stacks) = (self.start, self.stacks);
        self.state.positive.go_back(positive, start.map(|start| &start.positive), &stacks.positive);
        self.state.negative.go_back(negative, start.map(|start| &start.negative), &stacks.negative);
    }

    #[inline(always)]
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        self.state.advance_in(direction, self.families, self.stacks, input);
        self.state.piece_in(direction, self.families)
    }
}
