//! All that the controller remembers, as plain values.

use super::options::check_drive;
use super::preview::PreviewState;
use super::terms::{Counters, Terms};
use super::{ControllerOptions, Mode};
use crate::error::{Error, check_finite};
use crate::stream::StreamState;

/// A term of a saved state may be this large: products and sums of admissible numbers, over any number of samples, are
/// smaller, and sums of such terms stay finite.
const LARGEST_TERM: f64 = 1e250;

/// What the loop itself remembers from sample to sample.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 0.5, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// for _ in 0..52 {
///     controller.step(3.0.into(), 1.0); // the start, 50 samples until it is over, and one of which the error counts
/// }
/// assert_eq!(controller.state().feedback_loop.integral, 0.5 * (3.0 - 1.0));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct LoopState {
    /// The terms of the last sample that was acted upon. Its drive is the present one.
    pub terms: Terms,
    /// The integral from which the next sample goes on, in volts: what anti-windup left of that in `terms`.
    pub integral: f64,
    /// Whether the next sample goes on from `terms`. Else it starts a motion from the present drive.
    pub started: bool,
    /// In how many samples the transition will be gone.
    pub fading: u32,
    /// For how many samples the integral still rests; before a start, at most: no longer than its transition takes.
    pub resting: u32,
    /// Whether the last sample had a proportional term.
    pub feedback: bool,
    /// Whether the volts of the feed-forward came with the last sample.
    pub given: bool,
    /// What the controller is to do.
    pub mode: Mode,
    /// The mode to which a hold returns.
    pub resumes: Mode,
    /// How many measurements in a row were missing.
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
            started: false,
            fading: 0,
            resting: u32::MAX,
            feedback: false,
            given: false,
            mode: Mode::Run,
            resumes: Mode::Run,
            missing_in_a_row: 0,
            counters: Counters::default(),
        }
    }

    /// Whether a controller of these options can be in this state: only such a state is ever restored.
    fn check(&self, options: &ControllerOptions) -> Result<(), Error> {
        let Terms { reference, target, error, feedforward, proportional, integral, transition, demanded, .. } =
            self.terms;
        check_drive("state.feedback_loop.terms.drive", self.terms.drive, options.limits)?;
        check_finite("state.feedback_loop.terms.reference", None, reference)?;
        check_finite("state.feedback_loop.terms.target", None, target)?;
        let terms = [error, feedforward, proportional, integral, transition, demanded, self.integral];
        if !terms.into_iter().all(|term| term.abs() <= LARGEST_TERM) {
            return Err(Error::State { expected: "finite terms, at most 1e250 in magnitude" });
        }
        if self.resumes == Mode::Hold || ![self.resumes, Mode::Hold].contains(&self.mode) {
            return Err(Error::State { expected: "a mode that is the one it resumes, or a hold" });
        }
        Ok(())
    }
}

/// Everything that a [`HybridController`](super::HybridController) remembers: restored, it continues bit for bit.
///
/// Options, gains and models are not part of it.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let inverse = model.inverse(Some((-500.0, 500.0)))?;
/// let options = ControllerOptions::new(60.0, 0.6, (-500.0, 500.0));
/// let mut controller = HybridController::new(inverse.into(), None, &options)?;
/// controller.step(0.5.into(), 0.1);
/// let saved = controller.state();
/// let next = controller.step(0.6.into(), 0.2);
/// controller.set_state(&saved)?;
/// assert_eq!(controller.step(0.6.into(), 0.2), next);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ControllerState {
    /// What the loop itself remembers.
    pub feedback_loop: LoopState,
    /// What the source of the feed-forward remembers, if it has a memory.
    pub feedforward: Option<StreamState>,
    /// What the preview remembers, if there is one.
    pub preview: Option<PreviewState>,
}

impl ControllerState {
    pub(super) fn check(&self, options: &ControllerOptions) -> Result<(), Error> {
        self.feedback_loop.check(options)
    }
}
