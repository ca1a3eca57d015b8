//! Where a family is on its current branch, and how far a move of the input takes it.

use super::family::{Family, Line};
use super::state::FamilyState;
use super::turning_points::{Direction, Remembered, Stack, TurningPoint};

/// A place on a rising or falling branch of one family.
///
/// The operators `[0, moved)` slide (those before `at_zero` rest at zero), `[moved, top.moved)` are frozen as the
/// turning point `top` left them, and the rest as the turning points below it did. Moving forward only ever raises
/// `moved` and, when it reaches `top.moved`, wipes `top` out. A branch is a value: looking ahead changes no state.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch {
    direction: Direction,
    moved: usize,
    at_zero: usize,
    /// The newest turning point that still matters.
    top: TurningPoint,
    /// Sum of w p over the operators that older turning points froze.
    beyond: f64,
    /// How many turning points lie below `top` on the stack.
    below: usize,
}

/// The first index in `from..to` for which `passed` fails; `passed` holds for a prefix. Searches in growing steps
/// from `from`, since a smooth signal passes few breakpoints at a time.
#[inline]
fn gallop(from: usize, to: usize, passed: impl Fn(usize) -> bool) -> usize {
    let (mut low, mut step) = (from, 1);
    while low < to {
        let probe = low + (step - 1).min(to - low - 1);
        if !passed(probe) {
            return bisect(low, probe, passed);
        }
        low = probe + 1;
        step *= 2;
    }
    low
}

/// The first index in `low..high` for which `passed` fails, or `high`.
#[inline]
fn bisect(mut low: usize, mut high: usize, passed: impl Fn(usize) -> bool) -> usize {
    while low < high {
        let middle = low + (high - low) / 2;
        if passed(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}

impl Branch {
    /// The branch of a family at rest, about to move in `direction`.
    pub(crate) fn virgin(operators: usize, direction: Direction) -> Self {
        Self { direction, moved: 0, at_zero: 0, top: TurningPoint::virgin(operators), beyond: 0.0, below: 0 }
    }

    /// The branch and the stack that a checked state describes.
    pub(crate) fn restored(family: &Family, state: &FamilyState, direction: Direction) -> (Self, Stack) {
        let mut stack = Stack::new(family.len());
        let mut branch = Self::virgin(family.len(), direction);
        for point in &state.turning_points {
            branch = Self { moved: point.moved, ..branch };
            branch = Self { top: *point, beyond: branch.frozen(family), below: branch.below + 1, ..branch };
            branch.settle(&mut stack);
        }
        (Self { moved: state.moved, at_zero: state.at_zero, ..branch }, stack)
    }

    /// What restores the branch.
    pub(crate) fn state(&self, stack: &Stack) -> FamilyState {
        FamilyState { moved: self.moved, at_zero: self.at_zero, turning_points: stack.points().collect() }
    }

    /// Makes the stack that of this branch.
    #[inline]
    pub(crate) fn settle(&self, stack: &mut Stack) {
        stack.settle(self.below, Remembered { point: self.top, beyond: self.beyond });
    }

    /// The branch that starts where this one ends at `input`.
    #[inline]
    pub(crate) fn reversed(&self, family: &Family, stack: &Stack, input: f64, reversal: u64) -> Self {
        let mut branch = Self {
            direction: self.direction.reversed(),
            moved: 0,
            at_zero: 0,
            top: TurningPoint { input, ended: self.direction, moved: self.moved, at_zero: self.at_zero, reversal },
            beyond: self.frozen(family),
            below: self.below + 1,
        };
        if self.moved == 0 {
            branch.wipe_out(stack);
        }
        branch
    }

    /// The branch after the input has moved on to `x`.
    #[inline]
    pub(crate) fn advanced(mut self, family: &Family, stack: &Stack, x: f64) -> Self {
        loop {
            let end = self.top.moved;
            if self.moved < end {
                if !self.slides(family, end - 1, x) {
                    self.moved = gallop(self.moved, end - 1, |i| self.slides(family, i, x));
                    break;
                }
                self.moved = end;
            }
            if self.below == 0 {
                break;
            }
            self.wipe_out(stack);
        }
        if self.direction == Direction::Falling {
            self.at_zero = gallop(self.at_zero, self.moved, |i| -family.fall(i) >= x);
        }
        self
    }

    /// Whether operator i, frozen at `top`, slides once the input has come to `x`.
    #[inline]
    fn slides(&self, family: &Family, i: usize, x: f64) -> bool {
        match self.direction {
            Direction::Rising => self.starts_at(family, i) <= x,
            Direction::Falling => self.starts_at(family, i) >= x,
        }
    }

    /// The input at which operator i, frozen at `top`, starts to slide.
    #[inline]
    fn starts_at(&self, family: &Family, i: usize) -> f64 {
        let point = self.top.input;
        match (self.direction, self.top.ended) {
            // Back at the reversal that ended a branch of the same direction: the inner loop closes.
            (Direction::Rising, Direction::Rising) | (Direction::Falling, Direction::Falling) => point,
            (Direction::Rising, Direction::Falling) => family.rise(i).max(point + family.gap(i)),
            (Direction::Falling, Direction::Rising) => point - family.gap(i),
        }
    }

    /// Forgets the newest turning point: every operator that it froze slides again.
    #[inline]
    fn wipe_out(&mut self, stack: &Stack) {
        self.below -= 1;
        let remembered = stack.get(self.below);
        (self.top, self.beyond) = (remembered.point, remembered.beyond);
    }

    /// The next input at which the line changes, or the infinity that the branch points to.
    #[inline]
    pub(crate) fn next_breakpoint(&self, family: &Family) -> f64 {
        let next_start = self.next_start(family);
        if self.direction == Direction::Falling && self.at_zero < self.moved {
            next_start.max(-family.fall(self.at_zero))
        } else {
            next_start
        }
    }

    #[inline]
    fn next_start(&self, family: &Family) -> f64 {
        if self.moved < self.top.moved { self.starts_at(family, self.moved) } else { self.horizon() }
    }

    /// The input at which the newest turning point is wiped out, or infinity.
    #[inline]
    pub(crate) fn next_wipe_out(&self, family: &Family) -> f64 {
        if self.moved < self.top.moved { self.starts_at(family, self.top.moved - 1) } else { self.horizon() }
    }

    #[inline]
    fn horizon(&self) -> f64 {
        f64::INFINITY * self.direction.sign()
    }

    /// The output of the family as a line in the input, up to the next breakpoint.
    #[inline]
    pub(crate) fn line(&self, family: &Family) -> Line {
        let sliding = match self.direction {
            Direction::Rising => family.risen(0, self.moved),
            Direction::Falling => family.fallen(self.at_zero, self.moved),
        };
        Line { slope: sliding.slope, offset: sliding.offset + self.frozen(family) }
    }

    /// Sum of w p over the operators that do not slide.
    #[inline]
    fn frozen(&self, family: &Family) -> f64 {
        let TurningPoint { input, ended, moved, at_zero, .. } = self.top;
        let group = match ended {
            Direction::Rising => family.risen(self.moved, moved),
            Direction::Falling => family.fallen(self.moved.max(at_zero), moved),
        };
        group.at(input) + self.beyond
    }
}
