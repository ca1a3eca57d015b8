//! Where a family is on its current branch, how far a move of the input takes it, and what of the past still matters: a
//! stack of turning points, each with fewer operators than the one below.

use core::hint::select_unpredictable;

use super::family::Family;
use super::lookup::{far_ahead, near_ahead};
use super::polyline::{Direction, Line, Point};
use crate::real::Real;
use crate::store::Store;

/// A reversal of the input that still determines the output of some operators.
///
/// The operators `[0, moved)` slid on the branch that ended here. Operator i among them was left at x - `a_i` if
/// the branch rose, and at max(0, x + `b_i`) if it fell; those before `at_zero` were left at zero.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TurningPoint<T = f64> {
    /// The input at the reversal, in the family's own coordinate (mirrored for the negative family).
    pub input: T,
    /// The output of the whole model at the reversal: back at this input, the model is back at this output.
    pub output: T,
    /// The direction of the branch that ended here, in the same coordinate.
    pub ended: Direction,
    /// How many operators slid on that branch.
    pub moved: usize,
    /// How many of them rested at zero.
    pub at_zero: usize,
    /// The number of the reversal, counted from the virgin state: orders the memory in time.
    pub reversal: u64,
}

/// A turning point with what follows from it and from those below it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Remembered<T> {
    pub(crate) point: TurningPoint<T>,
    /// Sum of w p over the operators from `moved` on: those that older ones froze.
    pub(crate) beyond: f64,
    /// Where a branch of the other direction has set all its operators sliding again.
    pub(crate) released: T,
}

impl<T: Real> Remembered<T> {
    /// The bottom of every stack: all operators at zero, as if the input had come down to minus infinity. No move takes
    /// it off.
    pub(crate) fn virgin(operators: usize) -> Self {
        let point = TurningPoint {
            input: T::MIN,
            output: T::MIN,
            ended: Direction::Falling,
            moved: operators,
            at_zero: operators,
            reversal: 0,
        };
        Self { point, beyond: 0.0, released: T::INFINITY }
    }

    /// The input at which a branch in `direction` no longer needs it: back at the reversal, or all its operators slide.
    #[inline(always)]
    fn wiped_at(&self, direction: Direction) -> T {
        select_unpredictable(self.point.ended == direction, self.point.input, self.released)
    }
}

/// The turning points of a family above the virgin state, oldest first, in room allocated once. How many there are
/// is the branch's matter.
#[derive(Clone, Debug)]
pub(crate) struct Stack<T: Real, S: Store> {
    room: S::Of<Remembered<T>>,
    virgin: Remembered<T>,
}

impl<T: Real, S: Store> Stack<T, S> {
    /// The stack of a family at rest. Upwards `moved` falls strictly, from n at most, and is never zero: n places
    /// suffice.
    pub(crate) fn new(operators: usize) -> Self {
        let virgin = Remembered::virgin(operators);
        Self { room: S::filled(virgin, operators), virgin }
    }

    /// The oldest `count` turning points above the virgin state.
    #[cfg(feature = "alloc")]
    pub(crate) fn points(&self, count: usize) -> impl Iterator<Item = TurningPoint<T>> {
        self.room.as_ref().iter().take(count).map(|remembered| remembered.point)
    }

    /// The turning point number `height`, the virgin state being number 0.
    #[inline(always)]
    pub(crate) fn get(&self, height: usize) -> &Remembered<T> {
        self.room.as_ref().get(height.wrapping_sub(1)).unwrap_or(&self.virgin)
    }

    /// Changes the output that is remembered at a turning point.
    #[cfg(feature = "alloc")]
    pub(crate) fn set_output(&mut self, height: usize, output: T) {
        if let Some(entry) = self.room.as_mut().get_mut(height.wrapping_sub(1)) {
            entry.point.output = output;
        }
    }

    #[inline(always)]
    pub(crate) fn put(&mut self, height: usize, top: Remembered<T>) {
        debug_assert!(height <= self.room.as_ref().len());
        if let Some(entry) = self.room.as_mut().get_mut(height.wrapping_sub(1)) {
            *entry = top;
        }
    }
}

/// Room for the turning points of both families.
#[derive(Clone, Debug)]
pub(crate) struct Stacks<T: Real, S: Store> {
    pub(crate) positive: Stack<T, S>,
    pub(crate) negative: Stack<T, S>,
}

/// The position on a rising or falling branch of one family.
///
/// The operators `[0, moved)` slide (those before `at_zero` rest at zero), `[moved, top.moved)` are frozen as the
/// turning point `top` left them, and the rest as the turning points below it did. Moving forward only ever raises
/// `moved` and, when it reaches `top.moved`, wipes `top` out. A branch is a value: a copy can look ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Branch<T> {
    /// The output of the family over the input, from the breakpoint `begin` up to but not including `end`.
    line: Line,
    begin: T,
    end: T,
    /// Sum of w p over the operators that do not slide.
    frozen: f64,
    pub(super) moved: usize,
    pub(super) at_zero: usize,
    /// Where `top` belongs on the stack.
    pub(super) height: usize,
    /// The newest turning point that still matters.
    pub(super) top: Remembered<T>,
}

/// As much of a position on a branch as is needed to come back to it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Checkpoint<T> {
    begin: T,
    moved: usize,
    at_zero: usize,
    height: usize,
}

impl<T: Real> Branch<T> {
    /// The branch of a family at rest, about to move in `direction`.
    pub(crate) fn virgin(family: &Family<T, impl Store>, direction: Direction) -> Self {
        let top = Remembered::virgin(family.len());
        let line = Line { slope: 0.0, offset: 0.0 };
        let begin = -T::INFINITY * direction.sign();
        let mut branch = Self { line, begin, end: begin, frozen: 0.0, moved: 0, at_zero: 0, height: 0, top };
        branch.draw(family, direction);
        branch
    }

    /// Reads a number of each line of memory.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch(&self) -> u64 {
        (self.moved ^ self.height ^ self.top.point.moved) as u64 ^ self.line.slope.to_bits()
    }

    /// Puts the newest turning point on the stack: due after a reversal, before the next one.
    #[inline]
    pub(crate) fn keep_top(&self, stack: &mut Stack<T, impl Store>) {
        stack.put(self.height, self.top);
    }

    /// The output of the family over the input, between the last breakpoint and the next. Where it is stale, its slope
    /// is right already.
    #[inline]
    pub(crate) fn line(&self) -> Line {
        self.line
    }

    /// The last input at which the line changed.
    #[inline]
    pub(crate) fn begin(&self) -> T {
        self.begin
    }

    /// The next input at which the line changes, or the infinity that the branch points to.
    #[inline]
    pub(crate) fn end(&self) -> T {
        self.end
    }

    /// Whether an operator slides or rests at zero, so that a step back is a reversal.
    #[inline(always)]
    pub(crate) fn slides(&self) -> bool {
        self.moved > 0
    }

    /// Turns round at `input`, where a branch in `ended` ends and the model's output is `output`: what slid on it is
    /// frozen by a new turning point. The line of the new branch is stale until it advances.
    #[inline(always)]
    pub(crate) fn reverse(
        &mut self,
        family: &Family<T, impl Store>,
        ended: Direction,
        input: T,
        output: T,
        reversal: u64,
    ) {
        if self.slides() {
            let (moved, at_zero) = (self.moved, self.at_zero);
            let point = TurningPoint { input, output, ended, moved, at_zero, reversal };
            self.top = Remembered { point, beyond: self.frozen, released: self.released(family, ended, input) };
            self.height += 1;
            self.begin = input;
        } else {
            // Nothing slid: the line is the one that led here.
            self.begin = -T::INFINITY * ended.reversed().sign();
        }
        (self.moved, self.at_zero) = (0, 0);
        self.end = input;
        self.line.slope = 0.0;
    }

    /// Moves on in `direction` to the input `x`. Takes turning points off but reads the stack only.
    #[inline(always)]
    pub(crate) fn advance(
        &mut self,
        family: &Family<T, impl Store>,
        stack: &Stack<T, impl Store>,
        direction: Direction,
        x: T,
    ) {
        if !direction.has_passed(self.end, x) {
            return;
        }
        self.wipe_out(stack, direction, x);
        if self.top.point.ended != direction {
            self.release(family, direction, x);
        }
        if direction == Direction::Falling {
            self.rest(family, x);
        }
        self.draw(family, direction);
    }

    /// Closes the loops that a move to `x` closes. The line is stale until the branch advances.
    #[inline(always)]
    pub(crate) fn close_loops(
        &mut self,
        family: &Family<T, impl Store>,
        stack: &Stack<T, impl Store>,
        direction: Direction,
        x: T,
    ) {
        if self.wipe_out(stack, direction, x) {
            self.line.slope = family.sliding(direction, self.at_zero, self.moved).slope;
            self.end = self.begin;
        }
    }

    /// Takes off the turning points that a move to `x` wipes out, if there are any.
    #[inline(always)]
    fn wipe_out(&mut self, stack: &Stack<T, impl Store>, direction: Direction, x: T) -> bool {
        let mut top = &self.top;
        let mut mark = top.wiped_at(direction);
        if !direction.has_passed(mark, x) {
            return false;
        }
        while direction.has_passed(mark, x) {
            self.begin = mark;
            self.moved = top.point.moved;
            if top.point.ended == direction {
                self.at_zero = top.point.at_zero;
            }
            self.height = self.height.wrapping_sub(1);
            top = stack.get(self.height);
            mark = top.wiped_at(direction);
        }
        self.top = *top;
        true
    }

    /// Where to go back to.
    #[inline(always)]
    pub(crate) fn checkpoint(&self) -> Checkpoint<T> {
        Checkpoint { begin: self.begin, moved: self.moved, at_zero: self.at_zero, height: self.height }
    }

    /// Goes back on the same branch. `start` is the branch where it began if its newest turning point is not on the
    /// stack. The line is stale until the branch advances.
    #[inline]
    pub(crate) fn go_back(&mut self, to: Checkpoint<T>, start: Option<&Self>, stack: &Stack<T, impl Store>) {
        if to.height != self.height {
            self.top = match start {
                Some(start) if start.height == to.height => start.top,
                _ => *stack.get(to.height),
            };
        }
        (self.moved, self.at_zero, self.height) = (to.moved, to.at_zero, to.height);
        (self.begin, self.end) = (to.begin, to.begin);
    }

    /// Where the present loop closes, if that is remembered: at the newest turning point that ended a branch of the
    /// same direction. With the output of the whole model there.
    #[inline(always)]
    pub(crate) fn closes_at(&self, stack: &Stack<T, impl Store>, direction: Direction) -> Option<Point<T>> {
        let mut point = &self.top.point;
        if point.ended != direction {
            point = &stack.get(self.height.checked_sub(1)?).point;
        }
        (point.ended == direction).then_some(Point { input: point.input, output: point.output })
    }

    /// Lets slide those of the operators frozen by `top` that start before `x`.
    #[inline(always)]
    fn release(&mut self, family: &Family<T, impl Store>, direction: Direction, x: T) {
        let TurningPoint { input: turned, moved: captured, .. } = self.top.point;
        let mark = move |i| starts(family, direction, i, turned);
        let moved = match near_ahead(direction, x, self.moved..captured, mark) {
            Ok(moved) => moved,
            Err(left) => far_ahead(direction, x, left, mark, started(family, direction, turned, x)),
        };
        if moved > self.moved {
            self.moved = moved;
            self.begin = mark(moved - 1);
        }
    }

    /// Brings to rest those of the operators that slide downwards and come to zero before `x`.
    #[inline(always)]
    fn rest(&mut self, family: &Family<T, impl Store>, x: T) {
        let mark = move |i| family.rests(i);
        let at_zero = match near_ahead(Direction::Falling, x, self.at_zero..self.moved, mark) {
            Ok(at_zero) => at_zero,
            Err(left) => far_ahead(Direction::Falling, x, left, mark, family.resting(x)),
        };
        if at_zero > self.at_zero {
            self.at_zero = at_zero;
            self.begin = Direction::Falling.further(self.begin, mark(at_zero - 1));
        }
    }

    /// Draws the line at this position, and its end, from prefix sums and turning points.
    #[inline(always)]
    pub(super) fn draw(&mut self, family: &Family<T, impl Store>, direction: Direction) {
        self.end = self.next_start(family, direction);
        if direction == Direction::Falling && self.at_zero < self.moved {
            self.end = Direction::Falling.nearer(self.end, family.rests(self.at_zero));
        }
        self.frozen = self.frozen(family);
        let sliding = family.sliding(direction, self.at_zero, self.moved);
        self.line = Line { slope: sliding.slope, offset: sliding.offset + self.frozen };
    }

    /// The input at which a move in `direction` lets the next operator slide.
    #[inline(always)]
    pub(crate) fn next_start(&self, family: &Family<T, impl Store>, direction: Direction) -> T {
        let TurningPoint { input: turned, ended, .. } = self.top.point;
        // Back at the reversal that ended a branch of the same direction the inner loop closes.
        select_unpredictable(ended == direction, turned, starts(family, direction, self.moved, turned))
    }

    /// Sum of w p over the operators that do not slide.
    #[inline(always)]
    pub(super) fn frozen(&self, family: &Family<T, impl Store>) -> f64 {
        let TurningPoint { input, ended, moved, at_zero, .. } = self.top.point;
        family.sliding(ended, self.moved.max(at_zero), moved).at(input.wide()) + self.top.beyond
    }

    /// Where the operators that slid on a branch that `ended` at `turned` all slide again, the other way.
    #[inline(always)]
    pub(super) fn released(&self, family: &Family<T, impl Store>, ended: Direction, turned: T) -> T {
        starts(family, ended.reversed(), self.moved.wrapping_sub(1), turned)
    }
}

/// The input at which operator i, left by a branch that ended at `turned`, starts to slide the other way.
#[inline(always)]
fn starts<T: Real>(family: &Family<T, impl Store>, direction: Direction, i: usize, turned: T) -> T {
    match direction {
        Direction::Rising => family.starts_rising(i, turned),
        Direction::Falling => family.starts_falling(i, turned),
    }
}

/// Bounds, to rounding, of how many operators have started, the input having moved from `turned` to `x`.
#[inline(always)]
fn started<T: Real>(family: &Family<T, impl Store>, direction: Direction, turned: T, x: T) -> (usize, usize) {
    match direction {
        Direction::Rising => family.started_rising(turned, x),
        Direction::Falling => family.started_falling(turned, x),
    }
}
