//! Which of many sorted numbers lie at or below another one: without a search where they are evenly spaced, or where
//! few are passed.

use core::hint::select_unpredictable;
use core::ops::Range;

use super::polyline::Direction;
use crate::real::{Real, count_as_f64};
use crate::store::Store;

/// A table over numbers that never decrease: between which of them a number lies.
///
/// Even buckets cover the numbers, as many as there are numbers. Evenly spaced, each bucket holds exactly one, so that
/// a search is a multiplication and a look into the table, without a branch to mispredict; whatever the spacing, what
/// is left is at most one bucket, to be searched by halves.
#[derive(Clone, Debug)]
pub(super) struct Lookup<T, S: Store> {
    /// Where the first bucket is centred, and how many buckets lie in one unit.
    origin: T,
    per_unit: T,
    /// The number of the last bucket.
    last: usize,
    /// How many numbers lie in the buckets before each one, and how many with it.
    counts: S::Of<[u32; 2]>,
}

/// The most numbers that a table can count.
pub(super) const MAX_NUMBERS: u32 = u32::MAX - 1;

impl<T: Real, S: Store> Lookup<T, S> {
    /// Of at most [`MAX_NUMBERS`] numbers in order.
    pub(super) fn new(numbers: impl ExactSizeIterator<Item = T> + Clone) -> Self {
        let (count, origin) = (numbers.len(), numbers.clone().next().unwrap_or(T::ZERO));
        let width = numbers.clone().last().unwrap_or(T::ZERO) - origin;
        let last = count.saturating_sub(1);
        let per_unit = T::narrow(count_as_f64(last)) / width;
        let mut lookup = Self { origin, per_unit, last, counts: S::filled([0; 2], count) };
        for number in numbers {
            let bucket = lookup.bucket(number);
            lookup.counts.as_mut()[bucket][1] += 1;
        }
        let mut sum = 0;
        for [before, with] in lookup.counts.as_mut() {
            *before = sum;
            sum += *with;
            *with = sum;
        }
        lookup
    }

    /// Bounds of how many numbers are at most `x`: all those of the earlier buckets are, none of the later ones is.
    #[inline]
    pub(super) fn at_most(&self, x: T) -> (usize, usize) {
        let [before, with] = self.counts.as_ref().get(self.bucket(x)).copied().unwrap_or_default();
        (before as usize, with as usize)
    }

    /// The bucket in which `x` lies, the outermost ones being open. It never decreases in x.
    #[inline]
    fn bucket(&self, x: T) -> usize {
        ((x - self.origin) * self.per_unit + T::HALF).whole().min(self.last)
    }
}

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

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec::Vec;

    use super::*;
    use crate::store::Heap;

    #[test]
    fn brackets_what_a_scan_counts_whatever_the_spacing() {
        let even: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let geometric: Vec<f64> = (0..50).map(|i| 1e-9 * 1.7_f64.powi(i)).collect();
        let clustered = alloc::vec![0.0, 0.0, 1e-300, 1e-300, 1.0, 1.0, 1.0, 1e100];
        let equal = alloc::vec![3.0; 7];
        for numbers in [even, geometric, clustered, equal, alloc::vec![5e-324, 1e-323], alloc::vec![2.0], Vec::new()] {
            let lookup = Lookup::<f64, Heap>::new(numbers.iter().copied());
            let around = numbers.iter().flat_map(|v| [v.next_down(), *v, v.next_up(), 0.5 * v, 1.3 * v]);
            for x in around.chain([f64::NEG_INFINITY, -1.0, 0.0, 1e300, f64::INFINITY]) {
                let scanned = numbers.iter().filter(|number| **number <= x).count();
                let (least, most) = lookup.at_most(x);
                assert!(least <= scanned && scanned <= most, "{x} among {numbers:?}: {least}..{most}, not {scanned}");
            }
        }
    }

    #[test]
    fn even_spacing_leaves_one_number_to_compare() {
        for count in [1, 2, 20, 1000, 12_345_u32] {
            let numbers = (0..count).map(|i| 0.3 + 0.07 * f64::from(i));
            let lookup = Lookup::<f64, Heap>::new(numbers.collect::<Vec<f64>>().into_iter());
            for k in 0..5000_u32 {
                let (least, most) = lookup.at_most(0.001 * f64::from(k * count));
                assert!(most - least == 1, "{count} numbers: {least}..{most}");
            }
        }
    }

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
