//! Where to look for a number among sorted ones.

use alloc::boxed::Box;

use super::checks::count_as_f64;

/// A table over numbers that never decrease: between which of them a number lies.
///
/// Even buckets cover the numbers, as many as there are numbers. Evenly spaced, each bucket holds exactly one, so that
/// a search is a multiplication and a look into the table, without a branch to mispredict; whatever the spacing, what
/// is left is at most one bucket, to be searched by halves.
#[derive(Clone, Debug)]
pub(super) struct Lookup {
    /// Where the first bucket is centred, and how many buckets lie in one unit.
    origin: f64,
    per_unit: f64,
    /// How many numbers lie in the buckets before each one; the last entry is past all buckets.
    before: Box<[u32]>,
}

/// The most numbers that a table can count.
pub(super) const MAX_NUMBERS: u32 = u32::MAX - 1;

impl Lookup {
    /// Of at most [`MAX_NUMBERS`] numbers in order.
    pub(super) fn new(numbers: impl ExactSizeIterator<Item = f64> + Clone) -> Self {
        let (count, origin) = (numbers.len(), numbers.clone().next().unwrap_or(0.0));
        let width = numbers.clone().last().unwrap_or(0.0) - origin;
        let per_unit = count_as_f64(count.saturating_sub(1)) / width;
        let mut before = alloc::vec![0; count + 2];
        let lookup = Self { origin, per_unit, before: Box::default() };
        for number in numbers {
            before[lookup.bucket(number, count) + 1] += 1;
        }
        for bucket in 1..before.len() {
            before[bucket] += before[bucket - 1];
        }
        Self { before: before.into(), ..lookup }
    }

    /// Bounds of how many numbers are at most `x`: all those of the earlier buckets are, none of the later ones is.
    #[inline]
    pub(super) fn at_most(&self, x: f64) -> (usize, usize) {
        let bucket = self.bucket(x, self.before.len().saturating_sub(2));
        let before = |bucket: usize| self.before.get(bucket).map_or(0, |count| *count as usize);
        (before(bucket), before(bucket + 1))
    }

    /// The bucket of `count` in which `x` lies, the outermost ones being open. It never decreases in x.
    #[inline]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the cast saturates, NaN gives 0")]
    fn bucket(&self, x: f64, count: usize) -> usize {
        (((x - self.origin) * self.per_unit + 0.5) as u32 as usize).min(count.saturating_sub(1))
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;

    use super::*;

    #[test]
    fn brackets_what_a_scan_counts_whatever_the_spacing() {
        let even: Vec<f64> = (0..50).map(|i| 0.1 * f64::from(i)).collect();
        let geometric: Vec<f64> = (0..50).map(|i| 1e-9 * 1.7_f64.powi(i)).collect();
        let clustered = alloc::vec![0.0, 0.0, 1e-300, 1e-300, 1.0, 1.0, 1.0, 1e100];
        let equal = alloc::vec![3.0; 7];
        for numbers in [even, geometric, clustered, equal, alloc::vec![5e-324, 1e-323], alloc::vec![2.0], Vec::new()] {
            let lookup = Lookup::new(numbers.iter().copied());
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
            let lookup = Lookup::new(numbers.collect::<Vec<f64>>().into_iter());
            for k in 0..5000_u32 {
                let (least, most) = lookup.at_most(0.001 * f64::from(k * count));
                assert!(most - least == 1, "{count} numbers: {least}..{most}");
            }
        }
    }
}
