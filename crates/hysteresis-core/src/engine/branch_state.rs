//! What a branch remembers, out of a saved state, into one, and with other weights.

use super::branch::Branch;
use super::checks::restore_tolerance;
use super::direction::Direction;
use super::family::Family;
use super::memory_state::FamilyState;
use super::turning_points::{Remembered, Stack, TurningPoint};
use crate::store::Store;

impl Branch<f64> {
    /// The branch and the stack that a checked state describes.
    pub(crate) fn restored<S: Store>(
        family: &Family<f64, S>,
        state: &FamilyState,
        direction: Direction,
    ) -> (Self, Stack<f64, S>) {
        let mut stack = Stack::new(family.len());
        let mut branch = Self::virgin(family, direction);
        for point in &state.turning_points {
            branch.moved = point.moved;
            let (beyond, released) = (branch.frozen(family), branch.released(family, point.ended, point.input));
            branch.top = Remembered { point: *point, beyond, released };
            branch.height += 1;
            branch.keep_top(&mut stack);
        }
        (branch.moved, branch.at_zero) = (state.moved, state.at_zero);
        branch.draw(family, direction);
        (branch, stack)
    }

    /// The same position with other weights: what is remembered of the operators at older turning points is summed anew.
    pub(crate) fn reweigh(
        &mut self,
        family: &Family<f64, impl Store>,
        stack: &mut Stack<f64, impl Store>,
        direction: Direction,
    ) {
        let (moved, height) = (self.moved, self.height);
        self.top = Remembered::virgin(family.len());
        for level in 1..=height {
            let older = *stack.get(level);
            self.moved = older.point.moved;
            self.top = Remembered { beyond: self.frozen(family), ..older };
            stack.put(level, self.top);
        }
        self.moved = moved;
        self.draw(family, direction);
    }

    /// Takes the newest turning point from the stack, where it was changed.
    pub(crate) fn renew_top(&mut self, stack: &Stack<f64, impl Store>) {
        self.top = *stack.get(self.height);
    }

    /// How many turning points the stack holds.
    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// Whether `x` lies on the branch but for rounding: past the reversal it began with, or before the one where its
    /// loop closes.
    pub(crate) fn holds(&self, direction: Direction, x: f64) -> bool {
        let TurningPoint { input, ended, .. } = self.top.point;
        let (past, slack) = (direction.sign::<f64>() * (x - input), restore_tolerance(x.abs() + input.abs()));
        if ended == direction { past <= slack } else { past >= -slack }
    }

    /// What restores the branch.
    pub(crate) fn state(&self, stack: &Stack<f64, impl Store>) -> FamilyState {
        FamilyState { moved: self.moved, at_zero: self.at_zero, turning_points: self.remembered(stack).collect() }
    }

    /// The turning points that still matter, oldest first.
    pub(crate) fn remembered(&self, stack: &Stack<f64, impl Store>) -> impl Iterator<Item = TurningPoint> {
        stack.points(self.height)
    }
}
