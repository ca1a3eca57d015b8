use super::tracked::Operator;
use crate::error::{Error, check_non_negative};

/// The play (backlash) operator, equations (1)-(3): z(k) = max(x - r, min(x + r, z(k-1))).
///
/// `r >= 0` is the threshold in the unit of the input; the loop is 2 r wide.
///
/// ```
/// use hysteresis_core::{Operator, Play};
/// let play = Play::new(10.0)?;
/// assert_eq!(play.next(0.0, 25.0), 15.0); // pushed from the left
/// assert_eq!(play.next(15.0, 20.0), 15.0); // inside the gap nothing moves
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Play {
    r: f64,
}

impl Play {
    /// A play of half-width `r`.
    ///
    /// # Errors
    /// [`Error::Domain`] unless `r` is finite and not negative.
    pub fn new(r: f64) -> Result<Self, Error> {
        Ok(Self { r: check_non_negative("r", None, r)? })
    }

    /// The threshold r.
    #[must_use]
    pub fn r(&self) -> f64 {
        self.r
    }
}

impl Operator for Play {
    #[inline]
    fn next(&self, last_output: f64, input: f64) -> f64 {
        (input - self.r).max((input + self.r).min(last_output))
    }
}
