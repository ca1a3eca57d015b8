//! What the loop remembers from sample to sample, as a plain value.

use super::command::Mode;
use super::options::check_drive;
use super::terms::{Counters, Terms};
#[cfg(feature = "alloc")]
use crate::error::check_finite;
use crate::error::{Error, check_positive};
use crate::filter::FilterState;
#[cfg(feature = "alloc")]
use crate::filter::Sections;

/// A term of a saved state may be this large: products and sums of admissible numbers, over any number of samples, are
/// smaller, and sums of such terms stay finite.
#[cfg(feature = "alloc")]
const LARGEST_TERM: f64 = 1e250;

#[cfg(feature = "alloc")]
pub(super) fn check_terms(terms: &[f64]) -> Result<(), Error> {
    let expected = "finite terms, at most 1e250 in magnitude";
    if terms.iter().all(|term| term.abs() <= LARGEST_TERM) { Ok(()) } else { Err(Error::State { expected }) }
}

/// Where a stop goes, and how fast.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, StopRamp};
/// let options = ControllerOptions::new(2.0, 0.0, 1e-3, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.stop(100.0, 2.0)?;
/// assert_eq!(controller.state().feedback_loop.stop, Some(StopRamp { rate: 100.0, rest_drive: 2.0 }));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct StopRamp {
    /// How fast the drive moves, in volts per second. A slower slew bounds it.
    pub rate: f64,
    /// The drive at which it ends, in volts.
    pub rest_drive: f64,
}

impl StopRamp {
    pub(super) fn check(&self, names: [&'static str; 2], limits: (f64, f64)) -> Result<(), Error> {
        check_positive(names[0], self.rate)?;
        check_drive(names[1], None, self.rest_drive, limits)?;
        Ok(())
    }
}

/// What the loop itself remembers from sample to sample.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 500.0, 1e-3, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// for _ in 0..7 {
///     controller.step(3.0.into(), 1.0); // the start, 5 samples of bumpless time, and one of which the error counts
/// }
/// assert_eq!(controller.state().feedback_loop.integral, 500.0 * 1e-3 * (3.0 - 1.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct LoopState {
    /// The terms of the last sample that was acted upon. Its drive is the present one.
    pub terms: Terms,
    /// The integral from which the next sample goes on, in volts: what anti-windup left of the one in `terms`.
    pub integral: f64,
    /// What the filters of the feedback remember.
    #[cfg_attr(feature = "serde", serde(default))]
    pub filter: FilterState,
    /// Whether a motion is under way. If not, the next sample starts one from the present drive.
    pub started: bool,
    /// For how many samples the bumpless term goes on.
    pub bumpless_samples: u32,
    /// For how many samples the integral still rests. A start shortens it to its bumpless time, and one after missing measurements
    /// counts as a sample of it.
    pub integral_rest_samples: u32,
    /// Whether the last sample had a proportional term.
    pub feedback_active: bool,
    /// Whether the volts of the feed-forward came with the last sample.
    pub feedforward_given: bool,
    /// What the controller does with its samples.
    pub mode: Mode,
    /// The mode to which a hold or a stop returns.
    pub resumes: Mode,
    /// Where a stop goes; none in the other modes.
    pub stop: Option<StopRamp>,
    /// The last plausible measurement since the start.
    pub last_measurement: Option<f64>,
    /// How many measurements in a row were missing or implausible.
    pub missing_in_a_row: u32,
    /// What was counted.
    pub counters: Counters,
}

impl LoopState {
    /// At rest at a drive.
    pub(super) fn at(drive: f64) -> Self {
        Self {
            terms: Terms::at(drive),
            integral: 0.0,
            filter: FilterState::default(),
            started: false,
            bumpless_samples: 0,
            integral_rest_samples: u32::MAX,
            feedback_active: false,
            feedforward_given: false,
            mode: Mode::Run,
            resumes: Mode::Run,
            stop: None,
            last_measurement: None,
            missing_in_a_row: 0,
            counters: Counters::default(),
        }
    }

    /// The last error, for a measurement that is missing while the drive comes back to that of the law after a hold in the midst of a
    /// motion or a switch, or that follows such a one. To hold the drive once more then, and again and again where every other
    /// measurement is missing, would let it stand still; and feedback that comes and goes would start its filters anew each time.
    pub(super) fn stand_in_error(&self) -> Option<f64> {
        let comes_back = self.terms.bumpless != 0.0 && self.integral_rest_samples == 0;
        let stood_in = self.missing_in_a_row > 0;
        let follows = self.started && self.feedback_active && self.last_measurement.is_some();
        (follows && (comes_back || stood_in)).then_some(self.terms.error)
    }

    /// Ends the motion: the next one starts from the present drive, with an integral that rests at first. The position
    /// may be anywhere then, so the next measurement is not compared with the last one.
    pub(super) fn end_motion(&mut self) {
        (self.started, self.integral_rest_samples, self.last_measurement) = (false, u32::MAX, None);
    }

    /// Lets the bumpless term take what a switch would make the drive jump by.
    pub(super) fn carry(&mut self, difference: f64, bumpless_samples: u32) {
        if difference != 0.0 {
            self.terms.bumpless += difference;
            self.bumpless_samples = bumpless_samples;
        }
    }

    /// Restates the last sample with a feed-forward that changes from `old` to `new`.
    pub(super) fn change_feedforward(&mut self, old: f64, new: f64, bumpless_samples: u32) {
        self.carry(old - new, bumpless_samples);
        self.terms.feedforward += new - old;
        self.feedforward_given = false;
    }

    /// Whether a controller with these limits can be in this state: only such a state is ever restored.
    #[cfg(feature = "alloc")]
    pub(super) fn check(&self, limits: (f64, f64), filters: &Sections) -> Result<(), Error> {
        let Terms { reference, target, error, filtered_error, feedforward, .. } = self.terms;
        let Terms { proportional, integral, bumpless, unlimited_drive, .. } = self.terms;
        filters.check(&self.filter)?;
        check_drive("state.feedback_loop.terms.drive", None, self.terms.drive, limits)?;
        check_finite("state.feedback_loop.terms.target", None, target)?;
        check_finite("state.feedback_loop.last_measurement", None, self.last_measurement.unwrap_or(0.0))?;
        // A smoothed reference may lie beyond those that it is made of, by rounding.
        check_terms(&[reference, error, filtered_error, feedforward])?;
        check_terms(&[proportional, integral, bumpless, unlimited_drive, self.integral])?;
        if !matches!(self.resumes, Mode::Run | Mode::Feedforward)
            || ![self.resumes, Mode::Hold, Mode::Stop].contains(&self.mode)
        {
            return Err(Error::State { expected: "a mode that is the one it resumes, a hold or a stop" });
        }
        match (self.mode, &self.stop) {
            (Mode::Stop, Some(ramp)) => {
                ramp.check(["state.feedback_loop.stop.rate", "state.feedback_loop.stop.rest_drive"], limits)
            }
            (Mode::Run | Mode::Feedforward | Mode::Hold, None) => Ok(()),
            _ => Err(Error::State { expected: "a rate and a rest drive if, and only if, the mode is a stop" }),
        }
    }
}
