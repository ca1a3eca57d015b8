//! Which breakpoints a move of the input has passed.

use core::hint::select_unpredictable;
use core::ops::Range;

use super::turning_points::Direction;

/// How many marks are tried one by one before the table is asked.
const NEAR: usize = 2;

/// The first operator of `range` whose `mark` still lies ahead of the input `x`, or the end of the range. Marks lie
/// in the order in which the branch passes them.
///
/// A smooth signal passes few marks at a time: the nearest are tried one by one. A jump passes many: `bounds` tells
/// between which it comes to rest. They hold but for rounding; the marks decide.
#[inline(always)]
pub(super) fn first_ahead(
    direction: Direction,
    x: f64,
    range: Range<usize>,
    mark: impl Fn(usize) -> f64 + Copy,
    bounds: impl FnOnce() -> (usize, usize),
) -> usize {
    let passed = move |i: usize| direction.has_passed(mark(i), x);
    let Range { start, end } = range;
    if start >= end || !passed(start) {
        return start;
    }
    if start + 1 == end || !passed(start + 1) {
        return start + 1;
    }
    let start = start + NEAR;
    let (least, most) = bounds();
    let (least, most) = (least.max(start).min(end), most.max(start).min(end));
    // Evenly spaced thresholds leave one mark to try, and its neighbour to make sure: no branch to mispredict.
    let one_more = (most > least) & passed(least);
    let (found, neighbour) = select_unpredictable(one_more, (least + 1, least + 1), (least, least - 1));
    let certain = passed(neighbour) != one_more || neighbour == end;
    if certain { found } else { bisect(start, end, passed) }
}

/// The first number from `low` to `high` that is not passed, `high` if all are.
#[cold]
#[inline(never)]
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
