//! Which samples operators see on the way through a record.

use super::course::Course;

/// In order: the first one, and of a course that is thinned the turns and, for each row, the sample that acts on it behind a dead time of
/// `whole` samples and the one before. Without such a course all samples.
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
