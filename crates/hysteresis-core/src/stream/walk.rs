//! How a stream walks along its polyline, forward or inverse: one sample at a time, or in blocks.

use super::segment::{BLOCK, Segment};
use crate::error::{Error, check_length};
use crate::real::Real;

/// A stream: on a segment, and when it leaves that, on another.
pub(crate) trait Walk<T: Real> {
    fn segment(&mut self) -> &mut Segment<T>;

    /// A sample relative to the origin of the segments. Does not fall where the sample grows.
    fn relative(&self, sample: T) -> T;

    /// What is put out for a value of the segment.
    fn finished(&self, value: T) -> T;

    /// [`finished`](Self::finished) for every value of a block.
    #[inline(always)]
    fn finished_block(&self, values: [T; BLOCK]) -> [T; BLOCK] {
        values.map(|value| self.finished(value))
    }

    /// Takes a sample that does not lie on the segment, with what it is relative to the origin; the value of the next segment there.
    fn leave_segment(&mut self, sample: T, relative: T) -> T;

    #[inline]
    fn step(&mut self, sample: T) -> T {
        self.take(sample).0
    }

    /// [`step`](Self::step) if the sample lies on the segment.
    #[cfg(feature = "alloc")]
    #[inline(always)]
    fn step_on_line(&mut self, sample: T) -> Option<T> {
        let relative = self.relative(sample);
        let value = self.segment().step(relative)?;
        Some(self.finished(value))
    }

    /// [`step`](Self::step), and whether the sample lay on the segment.
    #[inline(always)]
    fn take(&mut self, sample: T) -> (T, bool) {
        let relative = self.relative(sample);
        let on_line = self.segment().step(relative);
        let value = on_line.unwrap_or_else(|| self.leave_segment(sample, relative));
        (self.finished(value), on_line.is_some())
    }

    /// [`step`](Self::step) for every sample.
    ///
    /// # Errors
    /// [`Error::Length`] unless there is room for as many outputs; nothing is taken then.
    fn run(&mut self, mut samples: &[T], mut outputs: &mut [T]) -> Result<(), Error> {
        check_length("output", samples.len(), outputs.len())?;
        while !samples.is_empty() {
            let taken = self.run_on_lines(samples, outputs, false);
            (samples, outputs) = behind(taken, samples, outputs);
        }
        Ok(())
    }

    /// Takes the samples on the segment, and some of those behind them: how many. After a long line, or if `only_to_the_next`, none
    /// behind the first that leaves it.
    #[inline(always)]
    fn run_on_lines(&mut self, samples: &[T], outputs: &mut [T], only_to_the_next: bool) -> usize {
        let on_line = self.run_on_line(samples, outputs);
        let (samples, outputs) = behind(on_line, samples, outputs);
        on_line + self.run_to_the_next_line(samples, outputs, only_to_the_next || on_line > 0)
    }

    /// Takes the blocks that lie on the segment, as vectors: how many samples that is.
    #[inline(always)]
    fn run_on_line(&mut self, samples: &[T], outputs: &mut [T]) -> usize {
        let mut segment = *self.segment();
        let blocks = samples.as_chunks::<BLOCK>().0;
        let mut on_line = 0;
        for block in blocks {
            if !segment.holds(block, |sample| self.relative(sample)) {
                break;
            }
            segment.move_to(self.relative(block[BLOCK - 1]));
            on_line += 1;
        }
        let blocks = blocks.get(..on_line).unwrap_or_default();
        for (output, block) in outputs.as_chunks_mut::<BLOCK>().0.iter_mut().zip(blocks) {
            *output = self.finished_block(block.map(|sample| segment.at(self.relative(sample))));
        }
        *self.segment() = segment;
        on_line * BLOCK
    }

    /// Takes samples one by one: how many. After a long line that ends as soon as the next one begins, which is long too; where
    /// lines are shorter than blocks, as in noise, to try again at once would not pay.
    #[inline(always)]
    fn run_to_the_next_line(&mut self, samples: &[T], outputs: &mut [T], after_long_line: bool) -> usize {
        let mut taken = 0;
        let most = if after_long_line { BLOCK } else { 4 * BLOCK };
        for (sample, output) in samples.iter().zip(outputs).take(most) {
            let (value, on_line) = self.take(*sample);
            *output = value;
            taken += 1;
            if after_long_line && !on_line {
                break;
            }
        }
        taken
    }
}

/// What is left behind the first so many: nothing past the end, where an index would panic.
#[inline(always)]
pub(super) fn behind<'a, 'b, T>(taken: usize, samples: &'a [T], outputs: &'b mut [T]) -> (&'a [T], &'b mut [T]) {
    (samples.get(taken..).unwrap_or_default(), outputs.get_mut(taken..).unwrap_or_default())
}
