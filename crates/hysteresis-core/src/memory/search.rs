//! Which breakpoints a move of the input has passed.

use core::ops::Range;

use super::turning_points::Direction;

/// How many marks are tried one by one before a guess is asked for.
const NEAR: usize = 2;

/// The first operator of `range` whose `mark` still lies ahead of the input `x`, or the end of the range. Marks lie
/// in the order in which the branch passes them.
///
/// A smooth signal passes few marks at a time: the nearest are tried one by one. A jump passes many: `guess` is where
/// their number is known but for rounding, and the marks decide.
#[inline]
pub(super) fn first_ahead(
    direction: Direction,
    x: f64,
    range: Range<usize>,
    mark: impl Fn(usize) -> f64,
    guess: impl FnOnce() -> usize,
) -> usize {
    let passed = |i: usize| direction.has_passed(mark(i), x);
    for i in range.start..range.end.min(range.start + NEAR) {
        if !passed(i) {
            return i;
        }
    }
    if range.end <= range.start + NEAR {
        return range.end;
    }
    let found = guess().max(range.start + NEAR).min(range.end);
    if (found < range.end && passed(found)) || !passed(found - 1) {
        return bisect(range.start + NEAR, range.end, passed);
    }
    found
}

/// The first number from `low` to `high` that is not passed, `high` if all are.
#[cold]
fn bisect(mut low: usize, mut high: usize, passed: impl Fn(usize) -> bool) -> usize {
    while low < high {
        let middle = low.midpoint(high);
        if passed(middle) {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    low
}
