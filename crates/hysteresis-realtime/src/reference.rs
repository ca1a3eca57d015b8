//! What the stage is to follow.

use hysteresis_core::{Error, check_all_finite};

/// Positions, one per sampling interval.
///
/// ```
/// use hysteresis_realtime::Reference;
/// let reference = Reference::periodic(vec![0.0, 1.0, 2.0])?;
/// assert_eq!([2, 3, 100].map(|sample| reference.at(sample)), [2.0, 0.0, 1.0]);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Reference {
    positions: Box<[f64]>,
    repeats: bool,
}

impl Reference {
    /// Positions that are followed again and again.
    ///
    /// # Errors
    /// [`Error`] for none, or one that is not finite.
    pub fn periodic(positions: Vec<f64>) -> Result<Self, Error> {
        Self::new(positions, true)
    }

    /// Positions that are followed once; then the loop goes to rest.
    ///
    /// # Errors
    /// [`Error`] for none, or one that is not finite.
    pub fn once(positions: Vec<f64>) -> Result<Self, Error> {
        Self::new(positions, false)
    }

    fn new(positions: Vec<f64>, repeats: bool) -> Result<Self, Error> {
        let parameter = "reference";
        if positions.is_empty() {
            return Err(Error::Empty { parameter });
        }
        check_all_finite(parameter, &positions)?;
        Ok(Self { positions: positions.into(), repeats })
    }

    /// The position wanted at a sample; past the end the last one.
    #[inline]
    #[must_use]
    pub fn at(&self, sample: u64) -> f64 {
        let length = self.positions.len() as u64;
        let sample = if self.repeats { sample % length } else { sample.min(length - 1) };
        usize::try_from(sample).ok().and_then(|sample| self.positions.get(sample)).copied().unwrap_or(f64::NAN)
    }

    /// How many samples there are, if they are followed once.
    #[must_use]
    pub fn length(&self) -> Option<u64> {
        (!self.repeats).then_some(self.positions.len() as u64)
    }
}
