//! The way of the inverse: a place that moves until the output is what was asked for.

use super::branch::Foothold;
use super::place::{Families, Place, Stacks};
use super::solve::{Known, Traveller, first_guess, solve};
use super::turning_points::Direction;
use super::{Piece, Reach};

/// A place on the move that may turn out to be too far. `start` is where it began if the turning points of the last
/// reversal are not on the stacks.
pub(super) struct Scout<'a> {
    pub(super) place: &'a mut Place,
    pub(super) start: Option<&'a Place>,
    pub(super) families: &'a Families,
    pub(super) stacks: &'a Stacks,
}

impl Scout<'_> {
    /// Moves on from `near` until the output is `to` or the input is at `limit`.
    #[inline(always)]
    pub(super) fn find(mut self, direction: Direction, near: Known, to: f64, limit: f64) -> Reach {
        let (near, far) = self.close_loops(direction, near, to, limit);
        let slope = self.place.line(self.families).slope;
        solve(&mut self, direction, near, far, first_guess(near, slope, far, to), to, limit)
    }

    /// Closes every loop whose turning point has an output that `to` lies beyond; where that comes to, and the turning
    /// point at which the loop that holds `to` closes.
    #[inline(always)]
    fn close_loops(&mut self, direction: Direction, mut near: Known, to: f64, limit: f64) -> (Known, Option<Known>) {
        let (Place { positive, negative, .. }, families, stacks) = (&mut *self.place, self.families, self.stacks);
        loop {
            let one = positive.closes_at(&stacks.positive, direction);
            let other = negative.closes_at(&stacks.negative, direction.reversed()).map(Known::mirrored);
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

impl Traveller for Scout<'_> {
    type Foothold = (Foothold, Foothold);

    #[inline(always)]
    fn foothold(&self) -> (Foothold, Foothold) {
        (self.place.positive.foothold(), self.place.negative.foothold())
    }

    #[inline(always)]
    fn go_back(&mut self, (positive, negative): (Foothold, Foothold)) {
        let (start, stacks) = (self.start, self.stacks);
        self.place.positive.go_back(positive, start.map(|start| &start.positive), &stacks.positive);
        self.place.negative.go_back(negative, start.map(|start| &start.negative), &stacks.negative);
    }

    #[inline(always)]
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        self.place.advance_in(direction, self.families, self.stacks, input);
        self.place.piece_in(direction, self.families)
    }
}
