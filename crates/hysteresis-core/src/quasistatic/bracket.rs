//! Where an output must lie when the history of its input is unknown: of one actuator, and of many.

use alloc::boxed::Box;

use super::parts::QuasiStatic;
use super::stage::{QuasiStaticForward, QuasiStaticState};
use crate::engine::CompiledModel;
use crate::error::{Bound, Error, check_length, check_rows, check_rows_between};
use crate::process::Process;
use crate::real::{check_limits, check_within_limits};
use crate::stream::ActuatorError;

/// Where the output must lie when the history of the input is unknown: two streams that bracket the truth.
///
/// With no negative weight every operator, and so the output, grows with its state. The stream that has come down from
/// the upper limit is nowhere below the truth, the one that has come up from the lower limit nowhere above it, whatever
/// the input did between the limits before. The width shrinks as the motion wipes history out. It is zero after a full
/// stroke, unless thresholds are so large that no stroke between the limits wipes them out. Strictly monotone maps in
/// front of and behind the hysteresis keep all that; loop shift, relaxing plays, slow gain and creep are left out.
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
    /// Came from the lower limit.
    from_low: QuasiStaticForward,
    /// Came from the upper limit.
    from_high: QuasiStaticForward,
    limits: (f64, f64),
}

/// Everything that a [`Bracket`] remembers: restored, it continues bit for bit.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct BracketState {
    /// The stream that came up from the lower limit.
    pub from_low: QuasiStaticState,
    /// The stream that came down from the upper limit.
    pub from_high: QuasiStaticState,
}

impl Bracket {
    /// A bracket over all histories between `limits` (low, high), in the unit of the input.
    ///
    /// # Errors
    /// [`Error::Domain`] for a negative weight, or unless the limits are finite and low < high.
    pub fn new(model: &CompiledModel, limits: (f64, f64)) -> Result<Self, Error> {
        Self::of_stage(&QuasiStatic::new(model), limits)
    }

    /// The same of a hysteresis between maps, what past drives add being left out: loop shift, relaxing plays, slow
    /// gain and creep.
    ///
    /// # Errors
    /// As for [`new`](Self::new), and [`Error::Whole`] for a stage with a Duhem operator: its z may drift from loop to
    /// loop, so two streams do not bracket it.
    pub fn of_stage(stage: &QuasiStatic, limits: (f64, f64)) -> Result<Self, Error> {
        if let Some(got) = stage.hysteresis().negative_weight() {
            return Err(Error::Domain { parameter: "weights", index: None, expected: Bound::NonNegative, got });
        }
        if let Some(duhem) = stage.duhem() {
            let expected = "no knots: two streams do not bracket what drifts from loop to loop";
            return Err(Error::whole("duhem", None, expected, duhem.knots().count()));
        }
        let limits = check_limits(Some(limits))?;
        let stream = stage.at_once().forward();
        let mut bracket = Self { from_low: stream.clone(), from_high: stream, limits };
        bracket.reset();
        Ok(bracket)
    }

    /// Takes an input and returns the lowest and the highest output that there can be. An input that is not finite
    /// leaves both as they are; one beyond the limits is clamped, so that the bracket holds.
    #[inline]
    pub fn step(&mut self, input: f64) -> (f64, f64) {
        let within = input.max(self.limits.0).min(self.limits.1);
        let input = if input.is_nan() { input } else { within };
        sorted(self.from_low.step(input), self.from_high.step(input))
    }

    /// Takes over what was driven before, oldest drive first.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite or outside the limits; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_within_limits("drives", drives, self.limits)?;
        self.from_low.follow(drives)?;
        self.from_high.follow(drives)
    }

    /// The lowest and the highest output that there can be now.
    #[must_use]
    pub fn outputs(&self) -> (f64, f64) {
        sorted(self.from_low.output(), self.from_high.output())
    }

    /// How uncertain the output is: the highest minus the lowest.
    #[must_use]
    pub fn width(&self) -> f64 {
        let (low, high) = self.outputs();
        high - low
    }

    /// The limits (low, high) between which the unknown history lies.
    #[must_use]
    pub fn limits(&self) -> (f64, f64) {
        self.limits
    }

    /// Nothing is known of the history.
    pub fn reset(&mut self) {
        self.from_low.reset();
        self.from_high.reset();
        self.from_low.step(self.limits.0);
        self.from_high.step(self.limits.1);
    }

    /// Everything that the bracket remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> BracketState {
        BracketState { from_low: self.from_low.state(), from_high: self.from_high.state() }
    }

    /// Continues from `state`, bit for bit.
    ///
    /// # Errors
    /// As [`QuasiStaticForward::set_state`]; the bracket is as before then.
    pub fn set_state(&mut self, state: &BracketState) -> Result<(), Error> {
        let mut from_low = self.from_low.clone();
        from_low.set_state(&state.from_low)?;
        self.from_high.set_state(&state.from_high)?;
        self.from_low = from_low;
        Ok(())
    }
}

/// Maps that fall turn the two round.
#[inline]
fn sorted(one: f64, other: f64) -> (f64, f64) {
    if one <= other { (one, other) } else { (other, one) }
}

/// A [`Bracket`] for each of M actuators: where their outputs must lie when the histories of their inputs are unknown.
///
/// Bit for bit what M single brackets give.
///
/// ```
/// use hysteresis_core::{BracketArray, CompiledModel, Offsets, PrandtlIshlinskii};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = vec![CompiledModel::new(&(&model).into()); 2];
/// let mut brackets = BracketArray::new(&models, |_| (-10.0, 10.0))?;
/// let (mut low, mut high) = ([0.0; 2], [0.0; 2]);
/// brackets.step(&[3.0, 10.0], &mut low, &mut high)?;
/// assert_eq!((low, high), ([3.5, 14.0], [5.5, 14.0])); // the second one has made a full stroke
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
#[derive(Clone, Debug)]
pub struct BracketArray {
    brackets: Box<[Bracket]>,
}

impl BracketArray {
    /// Brackets over all histories between the limits (low, high) of each actuator.
    ///
    /// # Errors
    /// As [`Bracket::new`], with the index of the first actuator that cannot be made.
    pub fn new(models: &[CompiledModel], limits: impl Fn(usize) -> (f64, f64)) -> Result<Self, ActuatorError> {
        Self::collected(models, |m, model| Bracket::new(model, limits(m)))
    }

    /// The same of hysteresis between maps.
    ///
    /// ```
    /// use hysteresis_core::{BracketArray, CompiledModel, Offsets, PiecewiseLinearMap, PrandtlIshlinskii, QuasiStatic};
    /// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
    /// let twice = PiecewiseLinearMap::new(&[0.0, 1.0], &[0.0, 2.0])?;
    /// let stage = QuasiStatic::new(&CompiledModel::new(&(&model).into())).with_output_map(twice);
    /// let mut brackets = BracketArray::of_stages(&[stage], |_| (-10.0, 10.0))?;
    /// let (mut low, mut high) = ([0.0], [0.0]);
    /// brackets.step(&[3.0], &mut low, &mut high)?;
    /// assert_eq!((low, high), ([7.0], [11.0]));
    /// # Ok::<(), Box<dyn core::error::Error>>(())
    /// ```
    ///
    /// # Errors
    /// As [`Bracket::of_stage`], with the index of the first actuator that cannot be made.
    pub fn of_stages(stages: &[QuasiStatic], limits: impl Fn(usize) -> (f64, f64)) -> Result<Self, ActuatorError> {
        Self::collected(stages, |m, stage| Bracket::of_stage(stage, limits(m)))
    }

    fn collected<A>(each: &[A], of: impl Fn(usize, &A) -> Result<Bracket, Error>) -> Result<Self, ActuatorError> {
        let bracket = |(actuator, each)| of(actuator, each).map_err(|error| ActuatorError { actuator, error });
        Ok(Self { brackets: each.iter().enumerate().map(bracket).collect::<Result<_, _>>()? })
    }

    /// The bracket of every actuator.
    #[must_use]
    pub fn brackets(&self) -> &[Bracket] {
        &self.brackets
    }

    /// Takes one input for each actuator and writes the lowest and the highest outputs that there can be.
    ///
    /// # Errors
    /// [`Error::Length`] unless all three have M elements; nothing is taken then.
    pub fn step(&mut self, input: &[f64], low: &mut [f64], high: &mut [f64]) -> Result<(), Error> {
        check_length("input", self.brackets.len(), input.len())?;
        self.run(input, low, high)
    }

    /// Takes a block of inputs, row by row: bit for bit the outputs of repeated [`step`](Self::step).
    ///
    /// # Errors
    /// [`Error::Rows`] unless `input` consists of whole rows of M elements, [`Error::Length`] unless `low` and `high`
    /// are as long; nothing is taken then.
    pub fn run(&mut self, input: &[f64], low: &mut [f64], high: &mut [f64]) -> Result<(), Error> {
        check_rows("input", self.brackets.len(), input.len())?;
        check_length("low", input.len(), low.len())?;
        check_length("high", input.len(), high.len())?;
        let width = self.brackets.len().max(1);
        for ((x, low), high) in
            input.chunks_exact(width).zip(low.chunks_exact_mut(width)).zip(high.chunks_exact_mut(width))
        {
            for (((bracket, x), low), high) in self.brackets.iter_mut().zip(x).zip(low).zip(high) {
                (*low, *high) = bracket.step(*x);
            }
        }
        Ok(())
    }

    /// Takes over what was driven before, rows of M drives, oldest first.
    ///
    /// # Errors
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its
    /// limits; nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        check_rows_between("drives", drives, &self.brackets.iter().map(Bracket::limits))?;
        for row in drives.chunks_exact(self.brackets.len().max(1)) {
            self.brackets.iter_mut().zip(row).try_for_each(|(bracket, drive)| bracket.follow(&[*drive]))?;
        }
        Ok(())
    }

    /// Nothing is known of any history.
    pub fn reset(&mut self) {
        self.brackets.iter_mut().for_each(Bracket::reset);
    }

    /// Continues from the state of every bracket, bit for bit.
    ///
    /// # Errors
    /// As [`Bracket::set_state`], with the index of the first actuator whose state is wrong; the brackets are as before
    /// then.
    pub fn set_states(&mut self, states: &[BracketState]) -> Result<(), ActuatorError> {
        let wrong = |actuator| move |error| ActuatorError { actuator, error };
        check_length("state", self.brackets.len(), states.len()).map_err(wrong(0))?;
        let mut restored = self.brackets.clone();
        for (actuator, (bracket, state)) in restored.iter_mut().zip(states).enumerate() {
            bracket.set_state(state).map_err(wrong(actuator))?;
        }
        self.brackets = restored;
        Ok(())
    }
}
