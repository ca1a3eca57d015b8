//! One scalar hysteresis operator w = H\[q\], and its memory.

use hysteresis_core::{Duhem, DuhemForward, DuhemState, Error, MAX_KNOTS, Operator, Play, Process, check_all_finite};
use serde::{Deserialize, Serialize};

use crate::checks::check_numbers;
use crate::oscillator::tables;

/// The largest threshold and weight: sums of their products stay finite.
const LARGEST: f64 = 1e50;

/// One scalar, rate-independent operator w = H\[q\], at rest at q = 0.
///
/// ```
/// use hysteresis_control::multi_axis::ScalarOperator;
/// let plays = ScalarOperator::plays(&[0.0, 0.5], &[1.0, 2.0])?;
/// assert_eq!(plays.slopes(), (1.0, 3.0)); // a threshold of 0 always slides
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Table", into = "Table")]
pub enum ScalarOperator {
    /// w = sum of weights times plays.
    Plays {
        /// The plays; their thresholds, half the width of their loops, have the unit of q.
        plays: Vec<Play>,
        /// Their weights, in the unit of w over q; of any sign.
        weights: Vec<f64>,
    },
    /// w = z of a free Duhem operator of q.
    Duhem(Box<Duhem<MAX_KNOTS>>),
}

/// An operator in a file.
#[derive(Clone, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
enum Table {
    Plays { thresholds: Vec<f64>, weights: Vec<f64> },
    Duhem { knots: Vec<f64>, rising: Vec<f64>, falling: Vec<f64> },
}

impl From<ScalarOperator> for Table {
    fn from(operator: ScalarOperator) -> Self {
        match operator {
            ScalarOperator::Plays { plays, weights } => {
                Self::Plays { thresholds: plays.iter().map(Play::r).collect(), weights }
            }
            ScalarOperator::Duhem(duhem) => {
                let [knots, rising, falling] = tables(&duhem);
                Self::Duhem { knots, rising, falling }
            }
        }
    }
}

impl TryFrom<Table> for ScalarOperator {
    type Error = Error;

    fn try_from(table: Table) -> Result<Self, Error> {
        match table {
            Table::Plays { thresholds, weights } => Self::plays(&thresholds, &weights),
            Table::Duhem { knots, rising, falling } => Duhem::new(&knots, &rising, &falling).map(Self::duhem),
        }
    }
}

impl ScalarOperator {
    /// A sum of plays.
    ///
    /// # Errors
    /// [`Error::Whole`] without a play, [`Error::Length`] unless there are as many weights, [`Error::Domain`] for a
    /// threshold that is negative, or a number beyond 1e50.
    pub fn plays(thresholds: &[f64], weights: &[f64]) -> Result<Self, Error> {
        if thresholds.is_empty() {
            return Err(Error::whole("thresholds", None, "a play at least", 0));
        }
        hysteresis_core::check_length("weights", thresholds.len(), weights.len())?;
        check_all_finite("weights", weights)?;
        if let Some(i) = thresholds.iter().position(|r| !(0.0..=LARGEST).contains(r)) {
            return Err(Error::domain("thresholds", Some(i), "a number from 0 to 1e50", thresholds[i]));
        }
        if let Some(i) = weights.iter().position(|weight| weight.abs() > LARGEST) {
            return Err(Error::domain("weights", Some(i), "a number of at most 1e50 in magnitude", weights[i]));
        }
        let plays = thresholds.iter().map(|r| Play::new(*r)).collect::<Result<_, Error>>()?;
        Ok(Self::Plays { plays, weights: weights.to_vec() })
    }

    /// A Duhem operator.
    #[must_use]
    pub fn duhem(duhem: Duhem<MAX_KNOTS>) -> Self {
        Self::Duhem(Box::new(duhem))
    }

    /// The least and the largest dw/dq that lasts: of plays that all stand or all slide, and of f at the knots.
    #[must_use]
    pub fn slopes(&self) -> (f64, f64) {
        match self {
            Self::Plays { plays, weights } => {
                let always = |(play, w): (&Play, &f64)| if play.r() == 0.0 { *w } else { 0.0 };
                let (stuck, all) = (plays.iter().zip(weights).map(always).sum(), weights.iter().sum());
                (f64::min(stuck, all), f64::max(stuck, all))
            }
            Self::Duhem(duhem) => (duhem.min_slope(), duhem.max_slope()),
        }
    }
}

/// The slope of an operator that others are least far from: beside it w is smallest.
pub(super) fn middle(operator: &ScalarOperator) -> f64 {
    let (least, most) = operator.slopes();
    0.5 * (least + most)
}

/// Everything that an operator remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum OperatorState {
    /// The outputs of the plays.
    Plays(Vec<f64>),
    /// The memory of a Duhem operator.
    Duhem(DuhemState),
}

/// An operator with its memory.
#[derive(Clone, Debug)]
pub(super) enum OperatorStream {
    /// Play, weight and output of each.
    Plays(Box<[(Play, f64, f64)]>),
    Duhem(Box<DuhemForward<MAX_KNOTS>>),
}

impl OperatorStream {
    /// At rest.
    pub(super) fn new(operator: &ScalarOperator) -> Self {
        match operator {
            ScalarOperator::Plays { plays, weights } => {
                Self::Plays(plays.iter().zip(weights).map(|(play, weight)| (*play, *weight, 0.0)).collect())
            }
            ScalarOperator::Duhem(duhem) => Self::Duhem(Box::new(DuhemForward::new(**duhem))),
        }
    }

    /// w for the next q.
    #[inline]
    pub(super) fn step(&mut self, q: f64) -> f64 {
        match self {
            Self::Plays(plays) => plays.iter_mut().fold(0.0, |sum, (play, weight, output)| {
                *output = play.next(*output, q);
                sum + *weight * *output
            }),
            Self::Duhem(duhem) => duhem.step(q),
        }
    }

    /// The last w.
    pub(super) fn output(&self) -> f64 {
        match self {
            Self::Plays(plays) => plays.iter().fold(0.0, |sum, (_, weight, output)| sum + *weight * *output),
            Self::Duhem(duhem) => duhem.output(),
        }
    }

    /// What [`step`](Self::step) would give.
    #[inline]
    pub(super) fn peek(&self, q: f64) -> f64 {
        match self {
            Self::Plays(plays) => {
                plays.iter().fold(0.0, |sum, (play, weight, output)| sum + *weight * play.next(*output, q))
            }
            Self::Duhem(duhem) => duhem.peek(q),
        }
    }

    pub(super) fn reset(&mut self) {
        match self {
            Self::Plays(plays) => plays.iter_mut().for_each(|(_, _, output)| *output = 0.0),
            Self::Duhem(duhem) => duhem.reset(),
        }
    }

    pub(super) fn state(&self) -> OperatorState {
        match self {
            Self::Plays(plays) => OperatorState::Plays(plays.iter().map(|(_, _, output)| *output).collect()),
            Self::Duhem(duhem) => OperatorState::Duhem(duhem.state()),
        }
    }

    pub(super) fn set_state(&mut self, state: &OperatorState) -> Result<(), Error> {
        match (self, state) {
            (Self::Plays(plays), OperatorState::Plays(outputs)) => {
                check_numbers("state.operators", plays.len(), outputs)?;
                plays.iter_mut().zip(outputs).for_each(|((_, _, own), output)| *own = *output);
                Ok(())
            }
            (Self::Duhem(duhem), OperatorState::Duhem(state)) => duhem.set_state(state),
            _ => Err(Error::whole("state.operators", None, "operators of the kinds that are here", 1)),
        }
    }
}
