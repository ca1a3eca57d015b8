//! Inputs on their way through a dead time.

use super::Error;

/// The longest dead time, in samples: 8 MiB of numbers.
pub(crate) const MAX_SAMPLES: f64 = 1_048_576.0;

/// How far from a whole number of samples a dead time counts as whole: seconds over seconds round.
const WHOLE: f64 = 1e-9;

/// A dead time in samples: d = (n + f) T, 0 <= f < 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Split {
    pub(crate) whole: usize,
    pub(crate) share: f64,
}

impl Split {
    /// Of a dead time that is not negative; both in seconds.
    pub(crate) fn new(dead_time: f64, dt: f64) -> Result<Self, Error> {
        let samples = dead_time / dt;
        if !(0.0..=MAX_SAMPLES).contains(&samples) {
            let expected = "at most 2^20 sampling intervals";
            return Err(Error::domain("dead_time", None, expected, dead_time));
        }
        let nearest = samples.round();
        let samples = if (samples - nearest).abs() <= WHOLE * nearest.max(1.0) { nearest } else { samples };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked above")]
        Ok(Self { whole: samples.floor() as usize, share: samples.fract() })
    }
}

/// The last n + 1 inputs, a ring: what was put out but has not come to act.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct History {
    past: Box<[f64]>,
    oldest: usize,
}

impl History {
    /// All inputs were zero.
    pub(crate) fn new(whole: usize) -> Self {
        Self { past: vec![0.0; whole + 1].into(), oldest: 0 }
    }

    /// u(k - n) and u(k - n - 1), with `input` as u(k).
    #[inline]
    pub(crate) fn pair(&self, input: f64) -> (f64, f64) {
        let older = self.past.get(self.oldest).copied().unwrap_or(input);
        // With one place in the ring, the input itself is the younger neighbour.
        let after = self.past.get(self.after_oldest()).filter(|_| self.past.len() > 1);
        (after.copied().unwrap_or(input), older)
    }

    /// Takes u(k).
    #[inline]
    pub(crate) fn push(&mut self, input: f64) {
        if let Some(oldest) = self.past.get_mut(self.oldest) {
            *oldest = input;
        }
        self.oldest = self.after_oldest();
    }

    #[inline]
    fn after_oldest(&self) -> usize {
        if self.oldest + 1 < self.past.len() { self.oldest + 1 } else { 0 }
    }

    /// All inputs were `level`.
    pub(crate) fn fill(&mut self, level: f64) {
        self.past.fill(level);
        self.oldest = 0;
    }

    /// How many inputs are remembered.
    pub(crate) fn len(&self) -> usize {
        self.past.len()
    }

    /// The inputs, the oldest first.
    pub(crate) fn inputs(&self) -> impl Iterator<Item = f64> + '_ {
        self.past[self.oldest..].iter().chain(&self.past[..self.oldest]).copied()
    }

    /// Goes on from as many inputs, the oldest first.
    pub(crate) fn restore(&mut self, inputs: &[f64]) {
        self.past.copy_from_slice(inputs);
        self.oldest = 0;
    }
}
