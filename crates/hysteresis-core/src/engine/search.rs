//! Which breakpoints a move of the input has passed.

use core::hint::select_unpredictable;
use core::ops::Range;

use super::direction::Direction;
use crate::real::Real;

/// The first operator of `range` whose `mark` still lies ahead of the input `x`, or the end of the range. Marks lie
/// in the order in which the branch passes them. As an error, the part of the range left when both of its first two
/// marks are passed: a smooth signal passes few at a time, and for a jump [`far_ahead`] knows better where to look.
#[inline(always)]
pub(super) fn near_ahead<T: Real>(
    direction: Direction,
    x: T,
    range: Range<usize>,
    mark: impl Fn(usize) -> T,
) -> Result<usize, Range<usize>> {
    let Range { start, end } = range;
    if start >= end || !direction.has_passed(mark(start), x) {
        return Ok(start);
    }
    if start + 1 == end || !direction.has_passed(mark(start + 1), x) {
        return Ok(start + 1);
    }
    Err(start + 2..end)
}

/// As [`near_ahead`], for a range that does not begin at zero, when it is known but for rounding that the first `least`
/// marks are passed and those from `most` on are not. The marks decide.
#[inline(always)]
pub(super) fn far_ahead<T: Real>(
    direction: Direction,
    x: T,
    range: Range<usize>,
    mark: impl Fn(usize) -> T + Copy,
    (least, most): (usize, usize),
) -> usize {
    let passed = move |i: usize| direction.has_passed(mark(i), x);
    let Range { start, end } = range;
    let (least, most) = (least.max(start).min(end), most.max(start).min(end));
    // Evenly spaced thresholds leave one mark to try, and its neighbour to make sure: no branch to mispredict.
    let passed_least = passed(least);
    let one_more = (most > least) & passed_least;
    let (found, neighbour) = select_unpredictable(one_more, (least + 1, least + 1), (least, least - 1));
    let bounded = most > least || least == end || !passed_least;
    let certain = bounded && (passed(neighbour) != one_more || neighbour == end);
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

#[cfg(test)]
mod tests {
    use super::{Direction, far_ahead};

    #[test]
    fn the_marks_decide_whatever_the_bounds_say() {
        let marks = [0.0_f64, 1.0, 1.0, 2.0, 5.0, 5.0, 5.0, 6.0, 9.0, 9.5, 11.0, 12.0];
        // Past the end stands what no move passes.
        let mark = |i: usize| *marks.get(i).unwrap_or(&f64::INFINITY);
        for half in -1..=26_i32 {
            let x = 0.5 * f64::from(half);
            let passed = marks.iter().filter(|mark| **mark <= x).count();
            for start in 1..=marks.len() {
                for (least, most) in (0..=13).flat_map(|least| (0..=13).map(move |most| (least, most))) {
                    let found = far_ahead(Direction::Rising, x, start..marks.len(), mark, (least, most));
                    assert_eq!(found, passed.max(start), "{x} from {start}, {least} to {most}");
                }
            }
        }
    }
}
