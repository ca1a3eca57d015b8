//! The way through a record: which samples become rows, and which the operators must see between them.

use crate::records::record::Record;
use crate::records::signal::as_f64;

/// The fractional part of the golden ratio: its multiples spread evenly and follow no period of any drive.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Reversals below this share of the range of the input are left out of a thinned course: they move no operator by
/// more, and where a search should start does not hang on that.
const DEAD_BAND: f64 = 1e-3;

/// The way through one record.
#[derive(Clone, Debug)]
pub(crate) enum Course {
    /// Every fitted sample is a row.
    All {
        /// The samples to leave out first.
        skip: usize,
        /// How many samples there are.
        samples: usize,
    },
    /// A selection. Operators are rate-independent: between rows far apart they need to see the reversals only.
    Some {
        /// The samples that are rows.
        rows: Vec<usize>,
        /// The samples at which the input turns round; none where all samples are to be seen.
        turns: Option<Vec<usize>>,
    },
}

impl Course {
    /// The course that takes one in `stride` of the fitted samples, but for the last `unread`.
    pub(crate) fn new(record: &Record<'_>, stride: usize, unread: usize) -> Self {
        let skip = record.skip();
        let samples = record.input().len().saturating_sub(unread).max(skip + 1);
        if stride == 1 && record.left_out().is_empty() {
            return Self::All { skip, samples };
        }
        let (low, high) = record.input_bounds();
        let rows = record.fitted().take_while(|k| *k < samples).filter(|k| is_used(k - skip, stride)).collect();
        let turns = (stride > 1).then(|| turns(record.input(), DEAD_BAND * (high - low)));
        Self::Some { rows, turns }
    }

    /// The same with every reversal, also those in the dead band: then thinned rows are those of all samples, bit for
    /// bit.
    #[cfg(test)]
    pub(crate) fn with_all_turns(mut self, input: &[f64]) -> Self {
        if let Self::Some { turns: Some(all), .. } = &mut self {
            *all = turns(input, 0.0);
        }
        self
    }

    /// How many rows there are.
    pub(crate) fn len(&self) -> usize {
        match self {
            Self::All { skip, samples } => samples - skip,
            Self::Some { rows, .. } => rows.len(),
        }
    }

    /// The sample of row number `row`.
    pub(crate) fn sample(&self, row: usize) -> usize {
        match self {
            Self::All { skip, .. } => skip + row,
            Self::Some { rows, .. } => rows[row],
        }
    }

    /// What of a signal of the record is at the rows.
    pub(crate) fn of<'a>(&'a self, signal: &'a [f64]) -> impl Iterator<Item = f64> + Clone {
        (0..self.len()).map(|row| signal[self.sample(row)])
    }

    /// The sum of squares of a signal about its mean over the rows.
    pub(crate) fn squares_of(&self, signal: &[f64]) -> f64 {
        let mean = self.of(signal).sum::<f64>() / as_f64(self.len());
        self.of(signal).map(|value| (value - mean).powi(2)).sum()
    }

    /// The samples to see between rows; all of them if there are none.
    pub(crate) fn turns(&self) -> Option<&[usize]> {
        match self {
            Self::All { .. } => None,
            Self::Some { turns, .. } => turns.as_deref(),
        }
    }
}

/// Where the input turns round by more than `dead_band`, in order.
pub(crate) fn turns(input: &[f64], dead_band: f64) -> Vec<usize> {
    let mut turns = Vec::new();
    let (mut low, mut high) = (0, 0);
    let mut rising = None;
    for (k, x) in input.iter().enumerate() {
        if *x < input[low] {
            low = k;
        }
        if *x > input[high] {
            high = k;
        }
        if rising != Some(false) && input[high] - x > dead_band {
            turns.push(high);
            (rising, low) = (Some(false), k);
        } else if rising != Some(true) && x - input[low] > dead_band {
            turns.push(low);
            (rising, high) = (Some(true), k);
        }
        // On a branch only the extreme ahead counts.
        match rising {
            Some(true) => low = k,
            Some(false) => high = k,
            None => {}
        }
    }
    turns
}

/// Whether the k-th fitted sample is a row: one in every `stride`, at places that follow no period.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the stride")]
fn is_used(k: usize, stride: usize) -> bool {
    let place = as_f64(stride) * (as_f64(k / stride) * GOLDEN).fract();
    k % stride == place as usize
}

/// In order: the first one, and of a course that is thinned the turns and, for each row, the sample that acts on it
/// behind a dead time of `whole` samples and the one before. Without such a course all samples.
pub(crate) struct SeenSamples<'a> {
    samples: usize,
    thinned: Option<(&'a Course, &'a [usize])>,
    whole: usize,
    row: usize,
    seen: Option<usize>,
    turned: usize,
}

impl<'a> SeenSamples<'a> {
    /// Of a record of so many samples.
    pub(crate) fn new(samples: usize, course: Option<&'a Course>, whole: usize) -> Self {
        let thinned = course.and_then(|course| Some((course, course.turns()?)));
        Self { samples, thinned, whole, row: 0, seen: None, turned: 0 }
    }

    /// The next sample of a thinned course; none behind its last row.
    fn next_thinned(&mut self, course: &Course, turns: &[usize], seen: usize) -> Option<usize> {
        let newest = loop {
            let newest = (self.row < course.len()).then(|| course.sample(self.row).saturating_sub(self.whole))?;
            if newest > seen {
                break newest;
            }
            self.row += 1;
        };
        while turns.get(self.turned).is_some_and(|turn| *turn <= seen) {
            self.turned += 1;
        }
        let before = (newest - 1).max(seen + 1);
        Some(turns.get(self.turned).map_or(before, |turn| before.min(*turn)))
    }
}

impl Iterator for SeenSamples<'_> {
    type Item = usize;

    fn next(&mut self) -> Option<usize> {
        let next = match (self.seen, self.thinned) {
            (None, _) => 0,
            (Some(seen), None) => Some(seen + 1).filter(|next| *next < self.samples)?,
            (Some(seen), Some((course, turns))) => self.next_thinned(course, turns, seen)?,
        };
        self.seen = Some(next);
        self.seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_takes_one_row_per_stride_at_no_fixed_phase() {
        for stride in [1, 2, 7, 200] {
            let used: Vec<_> = (0..50 * stride).filter(|k| is_used(*k, stride)).collect();
            assert_eq!(used.len(), 50);
            assert!(used.iter().enumerate().all(|(block, k)| k / stride == block));
            let phases: std::collections::BTreeSet<_> = used.iter().map(|k| k % stride).collect();
            assert!(phases.len() >= stride.min(40), "stride {stride}: {} phases", phases.len());
        }
    }

    #[test]
    fn turns_are_the_extremes_of_swings_beyond_the_dead_band() {
        let input = [0.0, 1.0, 3.0, 2.95, 3.05, 1.0, -2.0, -1.95, -2.0, 5.0, 4.0, 4.5];
        assert_eq!(turns(&input, 0.1), [0, 4, 6, 9, 10]);
        assert_eq!(turns(&input, 0.0), [0, 2, 3, 4, 6, 7, 8, 9, 10]);
        assert_eq!(turns(&input, 2.0), [0, 4, 6]);
        assert!(turns(&[1.0; 5], 0.0).is_empty() && turns(&[], 0.0).is_empty());
    }
}
