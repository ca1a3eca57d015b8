use alloc::boxed::Box;

use super::{Bracket, BracketState};
use crate::engine::CompiledModel;
use crate::error::{Error, check_length, check_within_limits};
use crate::stream::ActuatorError;

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
        let bracket = |(actuator, model)| {
            Bracket::new(model, limits(actuator)).map_err(|error| ActuatorError { actuator, error })
        };
        Ok(Self { brackets: models.iter().enumerate().map(bracket).collect::<Result<_, _>>()? })
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
    /// [`Error::Rows`] unless `input` consists of whole rows of M elements, [`Error::Length`] unless `low` and `high` are as long;
    /// nothing is taken then.
    pub fn run(&mut self, input: &[f64], low: &mut [f64], high: &mut [f64]) -> Result<(), Error> {
        self.check_rows("input", input)?;
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
    /// [`Error::Rows`] unless they are whole rows, [`Error::Domain`] for a drive that is not finite or outside its limits;
    /// nothing is taken then.
    pub fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        self.check_rows("drives", drives)?;
        for row in drives.chunks_exact(self.brackets.len().max(1)) {
            let each = self.brackets.iter().zip(row).enumerate();
            for (index, (bracket, drive)) in each {
                check_within_limits("drives", &[*drive], bracket.limits()).map_err(|error| at(error, index))?;
            }
        }
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
    /// As [`Bracket::set_state`], with the index of the first actuator whose state is wrong; the brackets are as before then.
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

    fn check_rows(&self, parameter: &'static str, rows: &[f64]) -> Result<(), Error> {
        let (width, got) = (self.brackets.len(), rows.len());
        if got.is_multiple_of(width) { Ok(()) } else { Err(Error::Rows { parameter, width, got }) }
    }
}

/// The same error about the number of an actuator.
fn at(error: Error, index: usize) -> Error {
    match error {
        Error::Domain { parameter, expected, got, .. } => {
            Error::Domain { parameter, index: Some(index), expected, got }
        }
        other => other,
    }
}
