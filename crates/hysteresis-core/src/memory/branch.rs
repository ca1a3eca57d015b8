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
    /// The output of the family over the input, from the breakpoint `begin` up to but not including `end`.
    line: Line,
    begin: f64,
    end: f64,
    /// Sum of w p over the operators that do not slide.
    frozen: f64,
    direction: Direction,
    moved: usize,
    at_zero: usize,
    /// Where `top` belongs on the stack.
    height: usize,
    /// The newest turning point that still matters.
    top: Remembered,
}

impl Branch {
    /// The branch of a family at rest, about to move in `direction`.
    pub(crate) fn virgin(family: &Family, direction: Direction) -> Self {
        let top = Remembered::virgin(family.len());
        let line = Line { slope: 0.0, offset: 0.0 };
        let begin = -f64::INFINITY * direction.sign();
        let mut branch = Self { line, begin, end: begin, frozen: 0.0, direction, moved: 0, at_zero: 0, height: 0, top };
        branch.draw(family);
        branch
    }

    /// The branch and the stack that a checked state describes.
    pub(crate) fn restored(family: &Family, state: &FamilyState, direction: Direction) -> (Self, Stack) {
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
        stack.points(self.height)
    }

    /// Puts the newest turning point on the stack: owed after a reversal, before the next one.
    #[inline]
    pub(crate) fn keep_top(&self, stack: &mut Stack) {
        stack.put(self.height, self.top);
    }

    /// The output of the family over the input, between the last breakpoint and the next.
    #[inline]
    pub(crate) fn line(&self) -> Line {
        self.line
    }

    /// The last input at which the line changed.
    #[inline]
    pub(crate) fn begin(&self) -> f64 {
        self.begin
    }

    /// The next input at which the line changes, or the infinity that the branch points to.
    #[inline]
    pub(crate) fn end(&self) -> f64 {
        self.end
    }

    /// Turns round at `input`, where the model's output is `output`: what slid on this branch is frozen by a new
    /// turning point. The line of the new branch is owed until it advances.
    #[inline]
    pub(crate) fn reverse(&mut self, family: &Family, input: f64, output: f64, reversal: u64) {
        if self.moved > 0 {
            let (ended, moved, at_zero) = (self.direction, self.moved, self.at_zero);
            let point = TurningPoint { input, output, ended, moved, at_zero, reversal };
            self.top = Remembered { point, beyond: self.frozen, released: self.released(family, ended, input) };
            self.height += 1;
        }
        self.direction = self.direction.reversed();
        (self.moved, self.at_zero) = (0, 0);
        (self.begin, self.end) = (input, input);
    }

    /// Moves on to the input `x`, ahead on this branch. Takes turning points off but reads the stack only.
    #[inline]
    pub(crate) fn advance(&mut self, family: &Family, stack: &Stack, x: f64) {
        if self.direction.has_passed(self.end, x) {
            self.wipe_out(stack, x);
            match self.direction {
                Direction::Rising => self.slide_up(family, x),
                Direction::Falling => self.slide_down(family, x),
            }
            self.draw(family);
        }
    }

    /// Takes off the turning points that a move to `x` wipes out. The line is owed until the branch advances.
    #[inline]
    pub(crate) fn wipe_out(&mut self, stack: &Stack, x: f64) {
        let mut top = &self.top;
        let mut mark = top.wiped_at(self.direction);
        if !self.direction.has_passed(mark, x) {
            return;
        }
        while self.direction.has_passed(mark, x) {
            self.begin = mark;
            self.moved = top.point.moved;
            self.height -= 1;
            top = stack.get(self.height);
            mark = top.wiped_at(self.direction);
        }
        self.end = self.begin;
        self.top = *top;
    }

    /// The turning point at which the present loop closes, if it is remembered: the newest that ended a branch of the
    /// same direction.
    #[inline]
    pub(crate) fn closes_at(&self, stack: &Stack) -> Option<TurningPoint> {
        if self.top.point.ended == self.direction {
            return Some(self.top.point);
        }
        let older = stack.get(self.height.checked_sub(1)?).point;
        (older.ended == self.direction).then_some(older)
    }

    /// Counts the operators that slide upwards at `x`: among the frozen ones, if they start before their loop closes.
    #[inline]
    fn slide_up(&mut self, family: &Family, x: f64) {
        let TurningPoint { input: turned, ended, moved: captured, .. } = self.top.point;
        if ended == Direction::Falling {
            let mark = |i| family.starts_rising(i, turned);
            let guess = || family.started_rising(turned, x);
            let moved = first_ahead(Direction::Rising, x, self.moved..captured, mark, guess);
            self.pass(moved > self.moved, mark(moved.wrapping_sub(1)));
            self.moved = moved;
        }
    }

    /// Counts the operators that slide downwards at `x`, as [`slide_up`](Self::slide_up), and those that have come to
    /// rest at zero.
    #[inline]
    fn slide_down(&mut self, family: &Family, x: f64) {
        let TurningPoint { input: turned, ended, moved: captured, .. } = self.top.point;
        if ended == Direction::Rising {
            let mark = |i| family.starts_falling(i, turned);
            let guess = || family.started_falling(turned, x);
            let moved = first_ahead(Direction::Falling, x, self.moved..captured, mark, guess);
            self.pass(moved > self.moved, mark(moved.wrapping_sub(1)));
            self.moved = moved;
        }
        let mark = |i| family.rests(i);
        let at_zero = first_ahead(Direction::Falling, x, self.at_zero..self.moved, mark, || family.resting(x));
        self.pass(at_zero > self.at_zero, mark(at_zero.wrapping_sub(1)));
        self.at_zero = at_zero;
    }

    /// Notes that the breakpoint at `mark` lies behind.
    #[inline]
    fn pass(&mut self, passed: bool, mark: f64) {
        if passed && self.direction.has_passed(self.begin, mark) {
            self.begin = mark;
        }
    }

    /// Draws the line of this place, and its end, from prefix sums and turning points.
    #[inline]
    fn draw(&mut self, family: &Family) {
        let TurningPoint { input: turned, ended, .. } = self.top.point;
        self.end = match (self.direction, ended) {
            // Back at the reversal that ended a branch of the same direction the inner loop closes.
            (Direction::Rising, Direction::Rising) | (Direction::Falling, Direction::Falling) => turned,
            (Direction::Rising, Direction::Falling) => family.starts_rising(self.moved, turned),
            (Direction::Falling, Direction::Rising) => family.starts_falling(self.moved, turned),
        };
        if self.at_zero < self.moved && self.direction == Direction::Falling {
            self.end = self.end.max(family.rests(self.at_zero));
        }
        self.frozen = self.frozen(family);
        let sliding = family.sliding(self.direction, self.at_zero, self.moved);
        self.line = Line { slope: sliding.slope, offset: sliding.offset + self.frozen };
    }

    /// Sum of w p over the operators that do not slide.
    #[inline]
    fn frozen(&self, family: &Family) -> f64 {
        let TurningPoint { input, ended, moved, at_zero, .. } = self.top.point;
        family.sliding(ended, self.moved.max(at_zero), moved).at(input) + self.top.beyond
    }

    /// Where the operators that slid on a branch that `ended` at `turned` all slide again, the other way.
    #[inline]
    fn released(&self, family: &Family, ended: Direction, turned: f64) -> f64 {
        match ended {
            Direction::Rising => family.starts_falling(self.moved.wrapping_sub(1), turned),
            Direction::Falling => family.starts_rising(self.moved.wrapping_sub(1), turned),
        }
    }
}
