use super::{Forward, StreamState, check_limits};
use crate::engine::CompiledModel;
use crate::error::{Bound, Error, check_within_limits};
use crate::process::Process;

/// Where the output must lie when the history of the input is unknown: two streams that bracket the truth.
///
/// With no negative weight every operator, and so the output, grows with its state. The stream that has come down from
/// the upper limit is nowhere below the truth, the one that has come up from the lower limit nowhere above it, whatever
/// the input did between the limits before. The width shrinks as the motion wipes history out. It is zero after a full
/// stroke, unless thresholds are so large that no stroke between the limits wipes them out.
///
/// ```
/// use hysteresis_core::{Bracket, CompiledModel, Offsets, PrandtlIshlinskii};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let mut bracket = Bracket::new(&CompiledModel::new(&(&model).into()), (-10.0, 10.0))?;
/// assert_eq!(bracket.step(3.0), (3.5, 5.5)); // the play is between 1 and 5
/// assert_eq!(bracket.width(), 2.0);
/// bracket.step(10.0); // a full stroke
/// assert_eq!((bracket.step(3.0), bracket.width()), ((5.5, 5.5), 0.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Bracket {
    low: Forward,
    high: Forward,
    limits: (f64, f64),
}

/// Everything that a [`Bracket`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct BracketState {
    /// The stream that came up from the lower limit.
    pub low: StreamState,
    /// The stream that came down from the upper limit.
    pub high: StreamState,
}

impl Bracket {
    /// A bracket over all histories between `limits` (low, high), in the unit of the input.
    ///
    /// # Errors
    /// [`Error::Domain`] for a negative weight, or unless the limits are finite and low < high.
    pub fn new(model: &CompiledModel, limits: (f64, f64)) -> Result<Self, Error> {
        if let Some(got) = model.negative_weight() {
            return Err(Error::Domain { parameter: "weights", index: None, expected: Bound::NonNegative, got });
        }
        let limits = check_limits(Some(limits))?;
        let mut bracket = Self { low: Forward::new(model), high: Forward::new(model), limits };
        bracket.reset();
        Ok(bracket)
    }

    /// Takes an input and returns the lowest and the highest output that there can be. An input that is not finite leaves
    /// both as they are; one beyond the limits is clamped, so that the bracket holds.
    #[inline]
    pub fn step(&mut self, input: f64) -> (f64, f64) {
        let within = input.max(self.limits.0).min(self.limits.1);
        let input = if input.is_nan() { input } else { within };
        (self.low.step(input), self.high.step(input))
    }

    /// Takes over what was driven before, oldest input first.
    ///
    /// # Errors
    /// [`Error::Domain`] for an input that is not finite; nothing is taken then.
    pub fn follow(&mut self, inputs: &[f64]) -> Result<(), Error> {
        check_within_limits("inputs", inputs, self.limits)?;
        self.low.follow(inputs)?;
        self.high.follow(inputs)
    }

    /// The lowest and the highest output that there can be now.
    #[must_use]
    pub fn outputs(&self) -> (f64, f64) {
        (self.low.output(), self.high.output())
    }

    /// How uncertain the output is: the highest minus the lowest.
    #[must_use]
    pub fn width(&self) -> f64 {
        self.high.output() - self.low.output()
    }

    /// The limits (low, high) between which the unknown history lies.
    #[must_use]
    pub fn limits(&self) -> (f64, f64) {
        self.limits
    }

    /// Nothing is known of the history.
    pub fn reset(&mut self) {
        self.low.reset();
        self.high.reset();
        self.low.step(self.limits.0);
        self.high.step(self.limits.1);
    }

    /// Everything that the bracket remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> BracketState {
        BracketState { low: self.low.state(), high: self.high.state() }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// As [`Forward::set_state`]; the bracket is as before then.
    pub fn set_state(&mut self, state: &BracketState) -> Result<(), Error> {
        let mut low = self.low.clone();
        low.set_state(&state.low)?;
        self.high.set_state(&state.high)?;
        self.low = low;
        Ok(())
    }
}
