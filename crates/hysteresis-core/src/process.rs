//! What every stream can do.

use crate::error::{Error, check_length};
use crate::real::Real;

/// A causal sample-by-sample process with memory: single operators, forward models and inverses alike.
///
/// No method allocates, locks, panics, logs or reads a clock. An input that is not finite, or beyond
/// [`MAX_MAGNITUDE`](crate::MAX_MAGNITUDE), leaves state and output as they are and is counted.
///
/// ```
/// use hysteresis_core::{Play, Process, Tracked};
/// let mut play = Tracked::new(Play::new(1.0)?);
/// assert_eq!((play.peek(3.0), play.step(3.0), play.step(f64::NAN)), (2.0, 2.0, 2.0));
/// assert_eq!(play.rejected(), 1);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
pub trait Process<T: Real = f64> {
    /// Takes one sample and returns the output.
    fn step(&mut self, input: T) -> T;

    /// The output that [`step`](Self::step) would return, without taking the sample.
    fn peek(&self, input: T) -> T;

    /// Back to the virgin state: at rest since forever, with every event counter at zero.
    fn reset(&mut self);

    /// Takes a block of samples: bit for bit the outputs of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Length`] unless both slices have the same length; nothing is taken then.
    fn run(&mut self, input: &[T], output: &mut [T]) -> Result<(), Error> {
        check_length("output", input.len(), output.len())?;
        for (x, y) in input.iter().zip(output) {
            *y = self.step(*x);
        }
        Ok(())
    }

    /// [`step`](Self::step) if it needs no memory but what the process holds itself. None if it needs more, and nothing
    /// is taken then.
    #[doc(hidden)]
    #[inline]
    fn step_at_hand(&mut self, input: T) -> Option<T> {
        Some(self.step(input))
    }

    /// Reads what a step needs of the memory `depth` pointers deep, so that it is near. What is returned says nothing.
    #[doc(hidden)]
    #[inline]
    fn fetch(&self, _depth: usize) -> u64 {
        0
    }
}
