//! A dead time alone.

use super::error::{check_dead_time, check_positive};
use super::history::{History, Split};
use super::{Block, Error};

/// A dead time d in seconds: y(t) = u(t - d).
///
/// Sampled every T seconds it is d = (n + f) T with 0 <= f < 1, and between samples the input is taken as straight:
/// y(k) = (1 - f) u(k - n) + f u(k - n - 1). A whole number of samples is exact; half a sample passes cos(pi F T) of a
/// sine of the frequency F, 0.98 at 600 Hz and 10 kHz. [`LinearDynamics`](super::LinearDynamics) behind a dead time
/// need no such line: how they answer to an input that is held is known exactly at any time.
///
/// ```
/// use hysteresis_control::linear::{Block, Delay};
/// let mut delay = Delay::new(1.25e-4)?.block(1e-4)?;
/// assert_eq!([4.0, 8.0, 8.0].map(|u| delay.step(u)), [0.0, 3.0, 7.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Delay {
    seconds: f64,
}

impl Delay {
    /// A dead time in seconds.
    ///
    /// # Errors
    /// [`Error`] unless it is finite and 0 or more.
    pub fn new(seconds: f64) -> Result<Self, Error> {
        Ok(Self { seconds: check_dead_time(seconds)? })
    }

    /// No dead time.
    #[must_use]
    pub const fn none() -> Self {
        Self { seconds: 0.0 }
    }

    /// d, in seconds.
    #[must_use]
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    /// The block for a sampling interval in seconds, at rest at zero; all its memory is taken here.
    ///
    /// # Errors
    /// [`Error`] unless `dt` is finite and above 0 and the dead time at most 2^20 of it.
    pub fn block(&self, dt: f64) -> Result<DelayBlock, Error> {
        let Split { whole, share } = Split::new(self.seconds, check_positive("dt", None, dt)?)?;
        Ok(DelayBlock { past: History::new(whole), share })
    }
}

/// The block of a [`Delay`].
#[derive(Clone, Debug, PartialEq)]
pub struct DelayBlock {
    past: History,
    share: f64,
}

impl Block for DelayBlock {
    #[inline]
    fn output(&self, input: f64) -> f64 {
        let (younger, older) = self.past.pair(input);
        if self.share == 0.0 { younger } else { younger + self.share * (older - younger) }
    }

    /// A straight line does not jump at a sample: just before the next one it is where [`output`](Self::output) is.
    #[inline]
    fn look_ahead(&self, input: f64) -> f64 {
        self.output(input)
    }

    #[inline]
    fn hold(&mut self, input: f64) {
        self.past.push(input);
    }

    fn settle(&mut self, level: f64) -> f64 {
        self.past.fill(level);
        level
    }
}
