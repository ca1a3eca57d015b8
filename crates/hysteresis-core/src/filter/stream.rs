//! A filter with its memory.

use super::biquad::Biquad;
use super::sections::{FilterState, Sections};
use crate::error::{Error, check_finite, is_admissible};
use crate::process::Process;

/// A filter that runs, sample by sample.
///
/// ```
/// use hysteresis_core::{Biquad, Filter, Process};
/// let slow = Biquad::new([0.1, 0.0, 0.0], [-0.9, 0.0])?;
/// let mut filter = Filter::new(&[slow])?;
/// assert_eq!((filter.step(10.0), filter.step(10.0)), (1.0, 1.9));
/// filter.settle(10.0)?;
/// assert!((filter.step(10.0) - 10.0).abs() < 1e-14);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Filter {
    sections: Sections,
    state: FilterState,
    rejected: u64,
}

impl Filter {
    /// A filter at rest at zero.
    ///
    /// # Errors
    /// As [`Sections::new`].
    pub fn new(sections: &[Biquad]) -> Result<Self, Error> {
        Ok(Self { sections: Sections::new(sections)?, state: FilterState::default(), rejected: 0 })
    }

    /// Its sections.
    #[must_use]
    pub fn sections(&self) -> &Sections {
        &self.sections
    }

    /// Replaces the sections, without a jump: with the same input the output stays as it was, and goes on from there.
    ///
    /// # Errors
    /// As [`Sections::new`]; the filter is as before then.
    pub fn set_sections(&mut self, sections: &[Biquad]) -> Result<(), Error> {
        let sections = Sections::new(sections)?;
        self.state = sections.taking_over(&self.state, &self.sections);
        self.sections = sections;
        Ok(())
    }

    /// Comes to rest at an input, as if it had always been the same.
    ///
    /// # Errors
    /// [`Error::Domain`] for an input that is not finite.
    pub fn settle(&mut self, input: f64) -> Result<(), Error> {
        self.state = self.sections.at_rest(check_finite("input", None, input)?);
        Ok(())
    }

    /// What it remembers.
    #[must_use]
    pub fn state(&self) -> FilterState {
        self.state
    }

    /// Continues from a state, bit for bit.
    ///
    /// # Errors
    /// As [`Sections::check`]; the filter is as before then.
    pub fn set_state(&mut self, state: &FilterState) -> Result<(), Error> {
        self.sections.check(state)?;
        self.state = *state;
        Ok(())
    }

    /// How many inputs were not finite (or beyond 1e100) and left output and state as they were.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }
}

impl Process for Filter {
    #[inline]
    fn step(&mut self, input: f64) -> f64 {
        if is_admissible(input) {
            self.state = self.sections.next(&self.state, input);
        } else {
            self.rejected = self.rejected.saturating_add(1);
        }
        self.state.output
    }

    #[inline]
    fn peek(&self, input: f64) -> f64 {
        if is_admissible(input) { self.sections.next(&self.state, input).output } else { self.state.output }
    }

    fn reset(&mut self) {
        (self.state, self.rejected) = (FilterState::default(), 0);
    }
}
