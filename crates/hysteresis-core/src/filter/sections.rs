//! Sections one behind the other, and what they remember.

use super::biquad::Biquad;
use crate::error::Error;

/// How many sections a filter has at most: a notch for each of three modes, two low-passes and a lead.
pub const MAX_SECTIONS: usize = 6;

/// Sections that amplify by more, for the worst of all inputs: terms of a feedback would not stay finite for all admissible numbers.
const LARGEST_GAIN: f64 = 1e40;

/// A number of a saved state may be this large; see [`LoopState`](crate::LoopState).
const LARGEST: f64 = 1e250;

/// The sections of a filter, one behind the other.
///
/// ```
/// use hysteresis_core::{Biquad, Sections};
/// let half = Biquad::new([0.5, 0.0, 0.0], [0.0, 0.0])?;
/// let quarter = Sections::new(&[half, half])?;
/// assert_eq!((quarter.static_gain(), quarter.as_slice().len()), (0.25, 2));
/// assert_eq!(Sections::default().static_gain(), 1.0);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sections {
    sections: [Biquad; MAX_SECTIONS],
    count: usize,
}

/// What a filter remembers, as a plain value: two numbers for each section, and the newest signal in front of each and behind the
/// last. Places without a section hold zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct FilterState {
    /// The states of every section.
    pub states: [[f64; 2]; MAX_SECTIONS],
    /// The newest input of every section.
    pub inputs: [f64; MAX_SECTIONS],
    /// The newest output of the last section.
    pub output: f64,
}

impl Default for Sections {
    /// No section: what comes goes out.
    fn default() -> Self {
        Self { sections: [Biquad::IDENTITY; MAX_SECTIONS], count: 0 }
    }
}

impl Sections {
    /// These sections, the first of them in front.
    ///
    /// # Errors
    /// [`Error::Whole`] for more than [`MAX_SECTIONS`], [`Error::Domain`] for some that may amplify by more than 1e40.
    pub fn new(sections: &[Biquad]) -> Result<Self, Error> {
        let mut found = Self { count: sections.len(), ..Self::default() };
        if sections.len() > MAX_SECTIONS {
            return Err(Error::whole("sections", None, "at most 6 sections", sections.len()));
        }
        for (place, section) in found.sections.iter_mut().zip(sections) {
            *place = *section;
        }
        let mut gain = 1.0;
        for (index, section) in found.as_slice().iter().enumerate() {
            gain *= section.largest_gain();
            // Of poles that round to the unit circle the gain may be no number.
            if gain.is_nan() || gain > LARGEST_GAIN {
                let expected = "sections that together amplify every input by at most 1e40";
                return Err(Error::domain("sections", Some(index), expected, gain));
            }
        }
        Ok(found)
    }

    /// The sections.
    #[must_use]
    pub fn as_slice(&self) -> &[Biquad] {
        self.sections.get(..self.count).unwrap_or(&self.sections)
    }

    /// What a constant input is multiplied by in the end.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        self.as_slice().iter().map(Biquad::static_gain).product()
    }

    /// The state after an input.
    #[inline]
    #[must_use]
    pub fn next(&self, before: &FilterState, input: f64) -> FilterState {
        let mut after = *before;
        let mut signal = input;
        let memory = after.states.iter_mut().zip(&mut after.inputs);
        for (section, (state, newest)) in self.as_slice().iter().zip(memory) {
            *newest = signal;
            (signal, *state) = section.next(*state, signal);
        }
        after.output = signal;
        after
    }

    /// At rest at an input that was always the same.
    #[must_use]
    pub fn at_rest(&self, input: f64) -> FilterState {
        self.going_on(input, None)
    }

    /// A state from which a filter that replaces `before` goes on without a jump: with the same input the output stays as it was.
    ///
    /// Every section takes over the signal in front of it. What sections have more, or other static gains, the last one takes up; without
    /// a section the output follows the input at once.
    #[must_use]
    pub fn taking_over(&self, before: &FilterState, sections_before: &Self) -> FilterState {
        let input = if sections_before.count == 0 { before.output } else { before.inputs[0] };
        self.going_on(input, Some(before.output))
    }

    /// At rest at an input, but for the last section if its output is to be another one.
    fn going_on(&self, input: f64, output: Option<f64>) -> FilterState {
        let mut state = FilterState::default();
        let mut signal = input;
        let last = self.count.saturating_sub(1);
        let memory = state.states.iter_mut().zip(&mut state.inputs).enumerate();
        for (section, (place, (states, newest))) in self.as_slice().iter().zip(memory) {
            *newest = signal;
            let behind = output.filter(|_| place == last).unwrap_or(section.static_gain() * signal);
            (*states, signal) = (section.going_on(signal, behind), behind);
        }
        state.output = signal;
        state
    }

    /// Whether a filter of these sections can be in this state: only such a state is ever restored.
    ///
    /// # Errors
    /// [`Error::State`].
    pub fn check(&self, state: &FilterState) -> Result<(), Error> {
        let too_large = Error::State { expected: "a filter of finite states, at most 1e250 in magnitude" };
        if state.output.is_nan() || state.output.abs() > LARGEST {
            return Err(too_large);
        }
        for (place, (states, input)) in state.states.iter().zip(&state.inputs).enumerate() {
            let values = [states[0], states[1], *input];
            if !values.iter().all(|value| value.abs() <= LARGEST) {
                return Err(too_large);
            }
            if place >= self.count && values != [0.0; 3] {
                return Err(Error::State { expected: "a filter of as many sections" });
            }
        }
        Ok(())
    }
}
