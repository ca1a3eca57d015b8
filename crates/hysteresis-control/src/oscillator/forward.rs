//! What an oscillator does for a drive: sample by sample, over a record, and once it repeats.

use hysteresis_core::{Error, Process, check_all_finite, check_model, is_admissible};
use serde::{Deserialize, Serialize};

use super::drive::{FineDrive, Hold};
use super::equation::{Equation, State};
use super::model::HystereticOscillator;
use crate::as_f64;
use crate::checks::check_numbers;

/// The position of an oscillator, sample by sample: `step(u)` returns y(k), then holds u(k) for one interval.
///
/// Begins at rest. An interval is integrated in sub-steps; turning points are found inside them. A drive that is not
/// finite, or beyond 1e100, counts as the last one. One that would bring position, velocity or z beyond 1e100 leaves
/// the state as it is, and does not become the last one. Both are counted.
///
/// ```
/// use hysteresis_control::oscillator::{HystereticOscillator, OscillatorForward};
/// use hysteresis_core::{Duhem, Process};
/// let oscillator = HystereticOscillator::new(0.5, 5.0, 2.5e4, Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1)?)?;
/// let mut forward = OscillatorForward::new(&oscillator, 1e-3, None)?;
/// assert_eq!(forward.step(100.0), 0.0);
/// assert!(forward.step(100.0) > 2e-5); // b u dt^2 / 2
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct OscillatorForward {
    equation: Equation<f64>,
    state: State<f64>,
    last_drive: f64,
    sub_step: f64,
    sub_steps: usize,
    rejected: u64,
    fingerprint: u64,
}

/// Everything that a forward stream remembers.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OscillatorState {
    /// The fingerprint of the oscillator.
    pub model: u64,
    /// y.
    pub position: f64,
    /// y'.
    pub velocity: f64,
    /// z.
    pub hysteresis: f64,
    /// The last drive that was taken.
    pub drive: f64,
}

impl OscillatorForward {
    /// At rest, for an interval `dt` in seconds and a number of sub-steps, or as many as
    /// [`HystereticOscillator::sub_steps`] says.
    ///
    /// # Errors
    /// As [`HystereticOscillator::sub_steps`].
    pub fn new(oscillator: &HystereticOscillator, dt: f64, sub_steps: Option<usize>) -> Result<Self, Error> {
        let sub_steps = oscillator.sub_steps(dt, sub_steps)?;
        let equation = oscillator.equation();
        Ok(Self {
            equation,
            state: State::rest(),
            last_drive: 0.0,
            sub_step: dt / as_f64(sub_steps),
            sub_steps,
            rejected: 0,
            fingerprint: oscillator.fingerprint(),
        })
    }

    /// The number of sub-steps of an interval.
    #[must_use]
    pub fn sub_steps(&self) -> usize {
        self.sub_steps
    }

    /// y.
    #[must_use]
    pub fn output(&self) -> f64 {
        self.state.position
    }

    /// How many drives were not admissible, or would have brought the state beyond 1e100.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Everything that it remembers.
    #[must_use]
    pub fn state(&self) -> OscillatorState {
        let State { position, velocity, hysteresis } = self.state;
        OscillatorState { model: self.fingerprint, position, velocity, hysteresis, drive: self.last_drive }
    }

    /// Goes on from a saved state, bit for bit.
    ///
    /// # Errors
    /// [`Error::OtherModel`] for a state of another oscillator, [`Error::Domain`] for a number that is not finite or
    /// beyond 1e100.
    pub fn set_state(&mut self, state: &OscillatorState) -> Result<(), Error> {
        let OscillatorState { model, position, velocity, hysteresis, drive } = *state;
        check_model(self.fingerprint, model)?;
        check_numbers("state", 4, &[position, velocity, hysteresis, drive])?;
        (self.state, self.last_drive) = (State { position, velocity, hysteresis }, drive);
        Ok(())
    }

    /// Holds the drive for one interval and returns the position at its end, y(k+1): a plant in a loop.
    pub fn advance(&mut self, drive: f64) -> f64 {
        let is_drive = is_admissible(drive);
        let held = if is_drive { drive } else { self.last_drive };
        let mut next = self.state;
        for _ in 0..self.sub_steps {
            next = self.equation.step(&next, self.sub_step, [held; 3]);
        }
        let is_state = is_within(&next);
        if is_state {
            (self.state, self.last_drive) = (next, held);
        }
        self.rejected += u64::from(!(is_drive && is_state));
        self.state.position
    }
}

impl Process for OscillatorForward {
    fn step(&mut self, drive: f64) -> f64 {
        let position = self.state.position;
        self.advance(drive);
        position
    }

    fn peek(&self, _: f64) -> f64 {
        self.state.position
    }

    fn reset(&mut self) {
        (self.state, self.last_drive, self.rejected) = (State::rest(), 0.0, 0);
    }
}

impl HystereticOscillator {
    /// The positions y(k) under a whole drive u(k), at rest before it.
    ///
    /// # Errors
    /// [`Error::Domain`] for a drive that is not finite, as [`sub_steps`](Self::sub_steps), or if position, velocity
    /// or z leaves 1e100.
    pub fn response(&self, u: &[f64], dt: f64, hold: Hold, sub_steps: Option<usize>) -> Result<Vec<f64>, Error> {
        self.simulate(u, dt, hold, sub_steps, None)
    }

    /// The positions over one period of a drive that repeats for ever, after `settle` periods from rest.
    ///
    /// # Errors
    /// As [`response`](Self::response).
    pub fn periodic_response(
        &self,
        u: &[f64],
        dt: f64,
        hold: Hold,
        sub_steps: Option<usize>,
        settle: usize,
    ) -> Result<Vec<f64>, Error> {
        self.simulate(u, dt, hold, sub_steps, Some(settle))
    }

    /// The positions; with `settle` the drive is a period.
    fn simulate(
        &self,
        u: &[f64],
        dt: f64,
        hold: Hold,
        sub_steps: Option<usize>,
        settle: Option<usize>,
    ) -> Result<Vec<f64>, Error> {
        check_all_finite("u", u)?;
        let sub_steps = self.sub_steps(dt, sub_steps)?;
        if u.is_empty() {
            return Ok(Vec::new());
        }
        let fine = FineDrive::new(u, hold, settle.is_some(), sub_steps);
        let (equation, h) = (self.equation(), dt / as_f64(sub_steps));
        let (mut state, mut y) = (State::rest(), Vec::with_capacity(u.len()));
        for period in 0..=settle.unwrap_or(0) {
            for (k, held) in u.iter().enumerate() {
                if period == settle.unwrap_or(0) {
                    y.push(state.position);
                }
                state = fine.sub_steps(k).fold(state, |state, drive| equation.step(&state, h, drive));
                if !is_within(&state) {
                    let expected = "a drive under which the motion stays within 1e100";
                    return Err(Error::domain("u", Some(k), expected, *held));
                }
            }
        }
        Ok(y)
    }
}

/// Whether all three numbers of a state are admissible.
fn is_within(state: &State<f64>) -> bool {
    [state.position, state.velocity, state.hysteresis].into_iter().all(is_admissible)
}
