//! Where a family is on its current branch, and how far a move of the input takes it.

use super::family::{Family, Line};
use super::restore_tolerance;
use super::search::first_ahead;
use super::state::FamilyState;
use super::turning_points::{Direction, Remembered, Stack, TurningPoint};

/// A place on a rising or falling branch of one family.
///
/// The operators `[0, moved)` slide (those before `at_zero` rest at zero), `[moved, top.moved)` are frozen as the
/// turning point `top` left them, and the rest as the turning points below it did. Moving forward only ever raises
/// `moved` and, when it reaches `top.moved`, wipes `top` out. A branch is a value: a copy can look ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch {
    /// The output of the family over the input, up to but not including the breakpoint `end`.
    line: Line,
    end: f64,
    direction: Direction,
    moved: usize,
    at_zero: usize,
    /// How many turning points lie below `top` on the stack.
    below: usize,
    /// The newest turning point that still matters.
    top: Remembered,
}

impl Branch {
    /// The branch of a family at rest, about to move in `direction`.
    pub(crate) fn virgin(family: &Family, direction: Direction) -> Self {
        let top = Remembered { point: TurningPoint::virgin(family.len()), beyond: 0.0 };
        let line = Line { slope: 0.0, offset: 0.0 };
        let mut branch = Self { line, end: 0.0, direction, moved: 0, at_zero: 0, below: 0, top };
        branch.draw(family);
        branch
    }

    /// The branch and the stack that a checked state describes.
    pub(crate) fn restored(family: &Family, state: &FamilyState, direction: Direction) -> (Self, Stack) {
        let mut stack = Stack::new(family.len());
        let mut branch = Self::virgin(family, direction);
        for point in &state.turning_points {
            branch.moved = point.moved;
            branch.top = Remembered { point: *point, beyond: branch.frozen(family) };
            branch.below += 1;
            branch.keep_top(&mut stack);
        }
        (branch.moved, branch.at_zero) = (state.moved, state.at_zero);
        branch.draw(family);
        (branch, stack)
    }

    /// Whether `x` lies on the branch but for rounding: past the reversal it began with, or before the one where its
    /// loop closes.
    pub(crate) fn holds(&self, x: f64) -> bool {
        let TurningPoint { input, ended, .. } = self.top.point;
        let (past, slack) = (self.direction.sign() * (x - input), restore_tolerance(x.abs() + input.abs()));
        if ended == self.direction { past <= slack } else { past >= -slack }
    }

    /// What restores the branch.
    pub(crate) fn state(&self, stack: &Stack) -> FamilyState {
        FamilyState { moved: self.moved, at_zero: self.at_zero, turning_points: self.remembered(stack).collect() }
    }

    /// The turning points that still matter, oldest first.
    pub(crate) fn remembered(&self, stack: &Stack) -> impl Iterator<Item = TurningPoint> {
        stack.points(self.below)
    }

    /// Puts the newest turning point on the stack: owed after a reversal, before the next one.
    #[inline]
    pub(crate) fn keep_top(&self, stack: &mut Stack) {
        stack.put(self.below, self.top);
    }

    /// The output of the family over the input, up to the next breakpoint.
    #[inline]
    pub(crate) fn line(&self) -> Line {
        self.line
    }

    /// The next input at which the line changes, or the infinity that the branch points to.
    #[inline]
    pub(crate) fn end(&self) -> f64 {
        self.end
    }

    /// Turns round at `input`, where the model's output is `output`: what slid on this branch is frozen by a new turning point.
    #[inline]
    pub(crate) fn reverse(&mut self, family: &Family, input: f64, output: f64, reversal: u64) {
        if self.moved > 0 {
            let (moved, at_zero) = (self.moved, self.at_zero);
            let point = TurningPoint { input, output, ended: self.direction, moved, at_zero, reversal };
            self.top = Remembered { point, beyond: self.frozen(family) };
            self.below += 1;
        }
        self.direction = self.direction.reversed();
        (self.moved, self.at_zero) = (0, 0);
        self.draw(family);
    }

    /// Moves on to the input `x`, ahead on this branch. Takes turning points off but reads the stack only.
    #[inline]
    pub(crate) fn advance(&mut self, family: &Family, stack: &Stack, x: f64) {
        if !self.direction.has_passed(self.end, x) {
            return;
        }
        loop {
            let captured = self.top.point.moved;
            self.moved = first_ahead(self.direction, x, self.moved..captured, |i| self.starts_at(family, i));
            if self.moved < captured || self.below == 0 {
                break;
            }
            self.below -= 1;
            self.top = stack.get(self.below);
        }
        if self.direction == Direction::Falling {
            self.at_zero = first_ahead(self.direction, x, self.at_zero..self.moved, |i| -family.fall(i));
        }
        self.draw(family);
    }

    /// The turning point at which the present loop closes, if it is remembered: the newest that ended a branch of the
    /// same direction.
    #[inline]
    pub(crate) fn closes_at(&self, stack: &Stack) -> Option<TurningPoint> {
        if self.top.point.ended == self.direction {
            return Some(self.top.point);
        }
        let older = stack.get(self.below.checked_sub(1)?).point;
        (older.ended == self.direction).then_some(older)
    }

    /// The input at which operator i, frozen at `top`, starts to slide.
    #[inline]
    fn starts_at(&self, family: &Family, i: usize) -> f64 {
        let TurningPoint { input, ended, .. } = self.top.point;
        match (self.direction, ended) {
            // Back at the reversal that ended a branch of the same direction: the inner loop closes.
            (Direction::Rising, Direction::Rising) | (Direction::Falling, Direction::Falling) => input,
            (Direction::Rising, Direction::Falling) => family.rise(i).max(input + family.gap(i)),
            (Direction::Falling, Direction::Rising) => input - family.gap(i),
        }
    }

    /// Draws the line of this place from prefix sums and turning points, and its end.
    #[inline]
    fn draw(&mut self, family: &Family) {
        let start = if self.moved < self.top.point.moved { self.starts_at(family, self.moved) } else { self.horizon() };
        let (sliding, end) = match self.direction {
            Direction::Rising => (family.risen(0, self.moved), start),
            Direction::Falling if self.at_zero < self.moved => {
                (family.fallen(self.at_zero, self.moved), start.max(-family.fall(self.at_zero)))
            }
            Direction::Falling => (Line { slope: 0.0, offset: 0.0 }, start),
        };
        self.line = Line { slope: sliding.slope, offset: sliding.offset + self.frozen(family) };
        self.end = end;
    }

    #[inline]
    fn horizon(&self) -> f64 {
        f64::INFINITY * self.direction.sign()
    }

    /// Sum of w p over the operators that do not slide.
    #[inline]
    fn frozen(&self, family: &Family) -> f64 {
        let TurningPoint { input, ended, moved, at_zero, .. } = self.top.point;
        let group = match ended {
            Direction::Rising => family.risen(self.moved, moved),
            Direction::Falling => family.fallen(self.moved.max(at_zero), moved),
        };
        group.at(input) + self.top.beyond
    }
}
