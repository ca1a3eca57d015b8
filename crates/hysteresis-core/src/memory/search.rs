//! Which breakpoints a move of the input has passed.

use core::ops::Range;

use super::turning_points::Direction;

/// How many marks are tried one by one before a search.
const NEAR: usize = 4;

/// The first operator of `range` whose `mark` still lies ahead of the input `x`, or the end of the range. Marks lie
/// in the order in which the branch passes them.
///
/// A smooth signal passes few marks at a time, and the close of a loop all of them: the nearest are tried one by one,
/// then the last. In between, marks are often evenly spaced: interpolation finds the place in a step or two, and
/// every other step halves what is left, whatever the spacing.
#[inline]
pub(super) fn first_ahead(direction: Direction, x: f64, range: Range<usize>, mark: impl Fn(usize) -> f64) -> usize {
    let near_end = range.end.min(range.start + NEAR);
    for i in range.start..near_end {
        if !direction.has_passed(mark(i), x) {
            return i;
        }
    }
    if near_end >= range.end {
        return near_end;
    }
    let last = mark(range.end - 1);
    if direction.has_passed(last, x) {
        return range.end;
    }
    between(direction, x, near_end - 1, range.end - 1, last, mark)
}

/// As [`first_ahead`], knowing that `passed` has been passed and `ahead`, whose mark is `ahead_mark`, has not.
fn between(
    direction: Direction,
    x: f64,
    mut passed: usize,
    mut ahead: usize,
    mut ahead_mark: f64,
    mark: impl Fn(usize) -> f64,
) -> usize {
    let mut passed_mark = mark(passed);
    let mut interpolate = true;
    while ahead - passed > 1 {
        let left = ahead - passed;
        let guess = if interpolate { share(left, (x - passed_mark) / (ahead_mark - passed_mark)) } else { left / 2 };
        let probe = passed + guess.clamp(1, left - 1);
        let probe_mark = mark(probe);
        if direction.has_passed(probe_mark, x) {
            (passed, passed_mark) = (probe, probe_mark);
        } else {
            (ahead, ahead_mark) = (probe, probe_mark);
        }
        interpolate = !interpolate;
    }
    ahead
}

/// That share of a number of operators; the number itself is small enough for exact arithmetic, and a guess at that.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a guess")]
fn share(of: usize, part: f64) -> usize {
    (of as f64 * part) as usize
}
