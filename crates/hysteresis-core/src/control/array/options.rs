//! How a controller of an array is set up.

use alloc::vec::Vec;

use super::super::options::per_sample;
use crate::error::{Bound, Error, MAX_MAGNITUDE, check_all_finite, check_length, check_positive, check_rows};
use crate::fingerprint::Fingerprint;

/// How an [`ArrayController`](super::ArrayController) is set up. The limits of the drives are those of the inverses
/// that it is given.
///
/// ```
/// use hysteresis_core::{ArrayController, ArrayOptions, CompiledModel, Offsets, PrandtlIshlinskii, StreamArray};
/// let model = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?;
/// let models = vec![CompiledModel::new(&(&model).into()); 2];
/// let inverse = StreamArray::inverse(&models, Some((-10.0, 10.0))).map_err(|wrong| wrong.error)?;
/// let set = ArrayOptions { ki: 100.0, slew: vec![2e3], ..ArrayOptions::new(1e-3) };
/// let paired = ArrayOptions { neighbours: vec![(0, 1)], max_difference: vec![1.5], ..set };
/// assert!(ArrayController::new(inverse.clone(), &paired).is_ok());
/// let error = ArrayController::new(inverse, &ArrayOptions { dt: 0.0, ..paired }).unwrap_err();
/// assert_eq!(error.to_string(), "dt: expected a finite number > 0, got 0.0");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct ArrayOptions {
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The integral gain per second: behind the exact inverses the loop is linear, and the plant is 1.
    pub ki: f64,
    /// How fast the integral goes to zero by itself, per second: at most 1 / dt.
    pub leak: f64,
    /// What makes errors of actuators of those of the S sensors, M rows of S numbers one behind the other. Without one
    /// sensor i measures actuator i.
    pub reconstruction: Option<Vec<f64>>,
    /// How fast the drives may move, in volts per second: none without a limit, one for all, or one for each actuator.
    pub slew: Vec<f64>,
    /// Pairs of actuators whose positions may not differ by more than `max_difference`.
    pub neighbours: Vec<(usize, usize)>,
    /// How far the positions of each pair may be apart, in the unit of the models' output: one for all pairs, or one
    /// for each.
    pub max_difference: Vec<f64>,
    /// How long, in seconds, the difference at a start or a change takes to go to zero, in a straight line.
    pub bumpless_time: f64,
    /// The drives that the amplifiers have at the start; without them zero, or the limits nearest to it.
    pub start_drive: Option<Vec<f64>>,
}

impl ArrayOptions {
    /// Feed-forward alone: no feedback, no slew, no pairs, a bumpless time of 5 ms.
    #[must_use]
    pub fn new(dt: f64) -> Self {
        Self {
            dt,
            ki: 0.0,
            leak: 0.0,
            reconstruction: None,
            slew: Vec::new(),
            neighbours: Vec::new(),
            max_difference: Vec::new(),
            bumpless_time: 5e-3,
            start_drive: None,
        }
    }

    /// Of what the state of a controller belongs to besides gains, limits and models.
    pub(super) fn fingerprint(&self) -> u64 {
        let mut fingerprint = Fingerprint::new();
        fingerprint.numbers(self.reconstruction.as_deref().unwrap_or_default());
        fingerprint.numbers(&self.slew);
        fingerprint.count(self.neighbours.len());
        for (one, other) in &self.neighbours {
            fingerprint.count(*one);
            fingerprint.count(*other);
        }
        fingerprint.numbers(&self.max_difference);
        fingerprint.numbers(&[self.bumpless_time]);
        fingerprint.finish()
    }

    /// The slew of every actuator, if there is one.
    pub(super) fn checked_slew(&self, actuators: usize) -> Result<impl Fn(usize) -> Option<f64> + '_, Error> {
        check_one_or_each("slew", &self.slew, actuators, true)?;
        Ok(|actuator| one_or_each(&self.slew, actuator))
    }

    /// The number of sensors S.
    pub(super) fn sensors(&self, actuators: usize) -> Result<usize, Error> {
        let Some(matrix) = &self.reconstruction else { return Ok(actuators) };
        let got = matrix.len();
        if got == 0 {
            return Err(Error::Empty { parameter: "reconstruction" });
        }
        check_rows("reconstruction", actuators, got)?;
        check_all_finite("reconstruction", matrix)?;
        Ok(got / actuators)
    }
}

/// The gains for one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    /// ki dt.
    pub(super) ki: f64,
    /// leak dt.
    pub(super) leak: f64,
}

impl Gains {
    pub(super) fn new(ki: f64, leak: f64, dt: f64) -> Result<Self, Error> {
        Ok(Self { ki: per_sample("ki", ki, dt, MAX_MAGNITUDE)?, leak: per_sample("leak", leak, dt, 1.0)? })
    }
}

/// Checks numbers above zero of which there are one, or one for each, or none where there need not be any.
pub(super) fn check_one_or_each(
    parameter: &'static str,
    numbers: &[f64],
    each: usize,
    or_none: bool,
) -> Result<(), Error> {
    if numbers.len() != 1 && !(or_none && numbers.is_empty()) {
        check_length(parameter, each, numbers.len())?;
    }
    for (index, number) in numbers.iter().enumerate() {
        let index = (numbers.len() > 1).then_some(index);
        if check_positive(parameter, *number).is_err() {
            return Err(Error::Domain { parameter, index, expected: Bound::Positive, got: *number });
        }
    }
    Ok(())
}

/// The number for one of them.
pub(super) fn one_or_each(numbers: &[f64], index: usize) -> Option<f64> {
    if numbers.len() == 1 { numbers.first().copied() } else { numbers.get(index).copied() }
}
