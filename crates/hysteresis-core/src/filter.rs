//! Filters of second-order sections, sample by sample and of fixed memory: what shapes a feedback.
//!
//! A [`Biquad`] is one section, [`Sections`] are a few in a row, a [`Filter`] runs them. How the coefficients follow
//! from a frequency and a damping ratio is for the crate that designs.

use crate::error::{Error, check_all_finite, check_finite, is_admissible};
use crate::process::Process;
use crate::real::unless_faded;

/// The largest coefficient: so the terms of a feedback stay finite for all admissible numbers, whatever the filter.
const MAX_COEFFICIENT: f64 = 1e12;

/// A second-order section, b before inputs and a before outputs:
///
/// ```text
/// y(k) = b0 u(k) + b1 u(k-1) + b2 u(k-2) - a1 y(k-1) - a2 y(k-2)
/// ```
///
/// A section of first order has b2 = a2 = 0. It is evaluated in the transposed direct form II, which has the fewest
/// states and the least rounding of the direct forms (Oppenheim and Schafer, Discrete-Time Signal Processing, chapter
/// 6).
///
/// ```
/// use hysteresis_core::Biquad;
/// let mean = Biquad::new([0.5, 0.5, 0.0], [0.0, 0.0])?;
/// assert_eq!(mean.static_gain(), 1.0);
/// let error = Biquad::new([1.0, 0.0, 0.0], [0.0, 1.0]).unwrap_err();
/// assert_eq!(error.to_string(), "a[1]: expected a stable section, |a2| < 1 and |a1| < 1 + a2, got 1.0");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Biquad {
    b: [f64; 3],
    a: [f64; 2],
}

impl Biquad {
    /// What goes through unchanged.
    pub const IDENTITY: Self = Self { b: [1.0, 0.0, 0.0], a: [0.0, 0.0] };

    /// A section of these coefficients, that before y(k) being 1.
    ///
    /// # Errors
    /// [`Error::Domain`] for a coefficient that is not finite or beyond 1e12, or unless both poles lie inside the unit
    /// circle.
    pub fn new(b: [f64; 3], a: [f64; 2]) -> Result<Self, Error> {
        for (parameter, values) in [("b", &b[..]), ("a", &a[..])] {
            check_all_finite(parameter, values)?;
            if let Some((index, got)) = values.iter().enumerate().find(|(_, value)| value.abs() > MAX_COEFFICIENT) {
                return Err(Error::domain(parameter, Some(index), "at most 1e12 in magnitude", *got));
            }
        }
        let expected = "a stable section, |a2| < 1 and |a1| < 1 + a2";
        if a[1].abs() >= 1.0 {
            return Err(Error::domain("a", Some(1), expected, a[1]));
        }
        if a[0].abs() >= 1.0 + a[1] {
            return Err(Error::domain("a", Some(0), expected, a[0]));
        }
        Ok(Self { b, a })
    }

    /// b0, b1 and b2.
    #[must_use]
    pub fn numerator(&self) -> [f64; 3] {
        self.b
    }

    /// a1 and a2.
    #[must_use]
    pub fn denominator(&self) -> [f64; 2] {
        self.a
    }

    /// What a constant input is multiplied by in the end.
    #[must_use]
    pub fn static_gain(&self) -> f64 {
        (self.b[0] + self.b[1] + self.b[2]) / (1.0 + self.a[0] + self.a[1])
    }

    /// By how much the largest input may be amplified at most, or more: the sum of |b| over what the poles lack to the
    /// unit circle.
    fn largest_gain(&self) -> f64 {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        // (1 - |p|) (1 - |q|) of the poles p and q, or less.
        let margin = if a1 * a1 < 4.0 * a2 {
            0.25 * (1.0 - a2) * (1.0 - a2)
        } else if a2 >= 0.0 {
            1.0 + a2 - a1.abs()
        } else {
            0.25 * (1.0 + a2 + a1) * (1.0 + a2 - a1)
        };
        (b0.abs() + b1.abs() + b2.abs()) / margin
    }

    /// The output for an input, and the states after it.
    #[inline]
    pub(super) fn next(&self, [s, t]: [f64; 2], input: f64) -> (f64, [f64; 2]) {
        let ([b0, b1, b2], [a1, a2]) = (self.b, self.a);
        let output = b0 * input + s;
        (output, [b1 * input - a1 * output + t, b2 * input - a2 * output])
    }

    /// The states in which the same input gives the same output again: exactly at rest if the output is the input times
    /// the static gain.
    fn going_on(&self, input: f64, output: f64) -> [f64; 2] {
        [output - self.b[0] * input, self.b[2] * input - self.a[1] * output]
    }
}

/// How many sections a filter has at most: a notch for each of three modes, two low-passes and a lead.
pub const MAX_SECTIONS: usize = 6;

/// Sections that amplify by more, for the worst of all inputs: terms of a feedback would not stay finite for all
/// admissible numbers.
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

/// What a filter remembers, as a plain value: two numbers for each section, and the newest signal in front of each and
/// behind the last. Places without a section hold zeros.
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

impl FilterState {
    /// Behind an input that has faded.
    #[cold]
    fn fade(&mut self) {
        self.states.as_flattened_mut().iter_mut().for_each(|state| *state = unless_faded(*state));
    }
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
        if unless_faded(input) == 0.0 {
            after.fade();
        }
        after
    }

    /// At rest at an input that was always the same.
    #[must_use]
    pub fn at_rest(&self, input: f64) -> FilterState {
        self.going_on(input, None)
    }

    /// A state from which a filter that replaces `before` goes on without a jump: with the same input the output stays
    /// as it was.
    ///
    /// Every section takes over the signal in front of it. What sections have more, or other static gains, the last one
    /// takes up; without a section the output follows the input at once.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poles_of_either_sign_have_a_gain_as_large_as_is_stated() {
        // A quarter of what both poles together lack to the unit circle, each to its nearer end.
        let section = Biquad::new([1.0, -2.0, 0.5], [0.1, -0.25]).unwrap();
        let expected = 3.5 / (0.25 * (1.0 - 0.25 + 0.1) * (1.0 - 0.25 - 0.1));
        assert!((section.largest_gain() / expected - 1.0).abs() < 1e-14);
    }

    /// The sum of the magnitudes of the impulse response is by how much the worst input is amplified.
    fn worst_input(section: &Biquad) -> f64 {
        let mut state = [0.0; 2];
        let mut sum = 0.0;
        for k in 0..40_000 {
            let (output, next) = section.next(state, if k == 0 { 1.0 } else { 0.0 });
            (sum, state) = (sum + output.abs(), next);
        }
        sum
    }

    /// From far inside the unit circle to near it, where a bound that is a little wrong is wrong by much.
    #[test]
    fn no_input_is_amplified_by_more_than_the_largest_gain() {
        let sizes = [0.0, 0.3, 0.9, 0.99, 0.999];
        for one in sizes {
            for other in sizes {
                let real = [(one, other), (-one, other), (-one, -other)].map(|(p, q)| [-(p + q), p * q]);
                let pair = [0.01, 1.0, 3.1].map(|angle: f64| [-2.0 * one * angle.cos(), one * one]);
                for a in real.into_iter().chain(pair) {
                    let section = Biquad::new([1.0, 0.0, 0.0], a).unwrap();
                    let (worst, bound) = (worst_input(&section), section.largest_gain());
                    assert!(worst <= bound * (1.0 + 1e-9), "{a:?}: {worst} > {bound}");
                    assert!(
                        bound <= 4.0 * worst.max(1.0) / (1.0 - one.max(other)),
                        "{a:?}: {bound} says nothing, {worst}"
                    );
                }
            }
        }
    }
}
