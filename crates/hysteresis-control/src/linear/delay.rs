//! A constant delay.

use super::{Block, Error};

/// The longest delay, in samples: 8 MiB of numbers.
const MAX_SAMPLES: f64 = 1_048_576.0;

/// A delay of d samples, fractions included: y(k) = (1 - f) u(k - n) + f u(k - n - 1), d = n + f.
///
/// Between samples the input is taken as straight. That smooths what is faster than a sample: at the frequency F and
/// the sampling interval T, half a sample passes cos(pi F T) of a sine, 0.98 at 600 Hz and 10 kHz. Whole delays are
/// exact.
///
/// ```
/// use hysteresis_control::linear::{Block, Delay};
/// let mut delay = Delay::new(1.25)?.block();
/// assert_eq!([4.0, 8.0, 8.0].map(|u| delay.advance(u)), [0.0, 3.0, 7.0]);
/// # Ok::<(), hysteresis_control::linear::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    samples: f64,
}

impl Delay {
    /// A delay in samples.
    ///
    /// # Errors
    /// [`Error`] unless it is from 0 to 2^20 samples.
    pub fn new(samples: f64) -> Result<Self, Error> {
        if (0.0..=MAX_SAMPLES).contains(&samples) {
            Ok(Self { samples })
        } else {
            Err(Error { parameter: "delay", index: None, expected: "0 to 2^20 samples", got: samples })
        }
    }

    /// No delay.
    #[must_use]
    pub const fn none() -> Self {
        Self { samples: 0.0 }
    }

    /// In samples.
    #[must_use]
    pub fn samples(&self) -> f64 {
        self.samples
    }

    /// The block, at rest at zero; all its memory is taken here.
    #[must_use]
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "the range is checked above")]
    pub fn block(&self) -> DelayBlock {
        let whole = self.samples.floor();
        DelayBlock { past: vec![0.0; whole as usize + 1].into(), oldest: 0, share: self.samples - whole }
    }
}

/// The block of a [`Delay`].
#[derive(Clone, Debug, PartialEq)]
pub struct DelayBlock {
    /// The last n + 1 inputs, a ring.
    past: Box<[f64]>,
    oldest: usize,
    share: f64,
}

impl DelayBlock {
    /// How many samples it remembers: the delay rounded down, and one more.
    pub(crate) fn samples(&self) -> usize {
        self.past.len()
    }

    /// The output, with the place that follows the oldest input in the ring.
    #[inline]
    fn output(&self, input: f64) -> (f64, usize) {
        let next = if self.oldest + 1 < self.past.len() { self.oldest + 1 } else { 0 };
        // With one place in the ring, the input itself is the younger neighbour.
        let younger = if self.past.len() == 1 { input } else { self.past[next] };
        let older = self.past[self.oldest];
        (if self.share == 0.0 { younger } else { younger + self.share * (older - younger) }, next)
    }
}

impl Block for DelayBlock {
    #[inline]
    fn advance(&mut self, input: f64) -> f64 {
        let (output, next) = self.output(input);
        self.past[self.oldest] = input;
        self.oldest = next;
        output
    }

    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.output(input).0
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.past.fill(level);
        level
    }
}
