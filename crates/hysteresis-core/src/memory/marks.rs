//! Where a number lies among sorted ones.

use alloc::boxed::Box;
use alloc::vec::Vec;

/// Numbers that never decrease, and a table that tells where to look among them.
///
/// Even buckets cover the numbers, as many as there are numbers. Evenly spaced, each bucket holds exactly one, so that a
/// search is a multiplication, a look into the table and one comparison, without a branch to mispredict; whatever
/// the spacing, a bucket is searched by halves: O(log n) at worst.
#[derive(Clone, Debug)]
pub(super) struct Marks {
    values: Box<[f64]>,
    /// Where the first bucket is centred, and how many buckets lie in one unit.
    origin: f64,
    per_unit: f64,
    /// How many values lie in the buckets before each one; the last entry is past all buckets.
    before: Box<[usize]>,
}

impl Marks {
    /// Of values in order.
    pub(super) fn new(values: Vec<f64>) -> Self {
        debug_assert!(values.is_sorted());
        let (origin, last) = (values.first().copied().unwrap_or(0.0), values.last().copied().unwrap_or(0.0));
        let per_unit = count_as_f64(values.len().saturating_sub(1)) / (last - origin);
        let mut marks = Self { values: values.into(), origin, per_unit, before: Box::default() };
        let mut before = alloc::vec![0; marks.values.len() + 1];
        for value in &marks.values {
            before[marks.bucket(*value) + 1] += 1;
        }
        for bucket in 1..before.len() {
            before[bucket] += before[bucket - 1];
        }
        marks.before = before.into();
        marks
    }

    /// Value i, or infinity past the last.
    #[inline]
    pub(super) fn get(&self, i: usize) -> f64 {
        self.values.get(i).copied().unwrap_or(f64::INFINITY)
    }

    /// How many values are at most `x`.
    #[inline]
    pub(super) fn at_most(&self, x: f64) -> usize {
        // The bucket never decreases in x: all values of earlier buckets are below x, all of later ones above.
        let bucket = self.bucket(x);
        let before = |bucket: usize| self.before.get(bucket).copied().unwrap_or(self.values.len());
        let (start, end) = (before(bucket), before(bucket + 1));
        start + self.values.get(start..end).unwrap_or(&[]).partition_point(|value| *value <= x)
    }

    /// The bucket in which `x` lies, the outermost ones being open.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates, NaN gives 0")]
    fn bucket(&self, x: f64) -> usize {
        (((x - self.origin) * self.per_unit + 0.5) as usize).min(self.values.len().saturating_sub(1))
    }
}

/// Exact for any number of operators that fits in memory.
#[expect(clippy::cast_precision_loss, reason = "a number of operators")]
fn count_as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_like_a_scan_whatever_the_spacing() {
        let even: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let geometric: Vec<f64> = (0..50).map(|i| 1e-9 * 1.7_f64.powi(i)).collect();
        let clustered = alloc::vec![0.0, 0.0, 1e-300, 1e-300, 1.0, 1.0, 1.0, 1e100];
        let equal = alloc::vec![3.0; 7];
        for values in [even, geometric, clustered, equal, alloc::vec![5e-324, 1e-323], alloc::vec![2.0], Vec::new()] {
            let marks = Marks::new(values.clone());
            let around = values.iter().flat_map(|v| [v.next_down(), *v, v.next_up(), 0.5 * v, 1.3 * v]);
            for x in around.chain([f64::NEG_INFINITY, -1.0, 0.0, 1e300, f64::INFINITY]) {
                let scanned = values.iter().filter(|value| **value <= x).count();
                assert_eq!(marks.at_most(x), scanned, "{x} among {values:?}");
            }
        }
    }
}
