//! All that a controller remembers, as plain values: out of it, and into it.

use alloc::vec::Vec;

use super::controller::HybridController;
use super::feedforward::{FeedForwardState, Preview, PreviewState};
use super::law::LoopState;
use super::options::{ControllerOptions, check_unchanged};
use super::source::DriveSource;
use crate::duhem::Duhem;
use crate::engine::CompiledModel;
use crate::error::Error;
use crate::filter::Biquad;
use crate::quasistatic::MAX_KNOTS;

/// The limits of the drive in a saved state.
///
/// ```
/// use hysteresis_core::{ControllerOptions, DriveLimits, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 0.0, 1e-4, (-10.0, 10.0));
/// let controller = HybridController::new(FeedForward::None, None, &options)?;
/// assert_eq!(controller.state().limits, DriveLimits { low: -10.0, high: 10.0 });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct DriveLimits {
    /// The lowest drive in volts.
    pub low: f64,
    /// The highest drive in volts.
    pub high: f64,
}

/// Everything that a [`HybridController`](super::HybridController) remembers: restored, it continues bit for bit.
///
/// It also names the gains, the filters, the sampling interval, the limits, the model and the preview of its
/// controller: a controller with others refuses it. The other options are not part of it.
///
/// ```
/// use hysteresis_core::{ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let limits = (-500.0, 500.0);
/// let options = ControllerOptions::new(60.0, 6e3, 1e-4, limits);
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let inverse = model.inverse(Some(limits))?;
/// let mut controller = HybridController::new(inverse.into(), None, &options)?;
/// controller.step(0.5.into(), 0.1);
/// let saved = controller.state();
/// let next = controller.step(0.6.into(), 0.2);
/// controller.set_state(&saved)?;
/// assert_eq!(controller.step(0.6.into(), 0.2), next);
/// controller.set_gains(5.0, 6e3)?;
/// let error = controller.set_state(&saved).unwrap_err();
/// assert_eq!(error.to_string(), "state.kp: expected 5.0, as in this controller, got 60.0");
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct ControllerState {
    /// The proportional gain.
    pub kp: f64,
    /// The integral gain, per second.
    pub ki: f64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The sections of the filters in the feedback.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Vec::is_empty"))]
    pub filters: Vec<Biquad>,
    /// The limits of the drive.
    pub limits: DriveLimits,
    /// What the loop itself remembers.
    pub feedback_loop: LoopState,
    /// What the source of the feed-forward remembers, if it has a memory.
    pub feedforward: Option<FeedForwardState>,
    /// What the preview remembers, if there is one.
    pub preview: Option<PreviewState>,
}

impl ControllerState {
    /// Whether it is the state of a controller with these options.
    pub(super) fn check(&self, options: &ControllerOptions) -> Result<(), Error> {
        check_unchanged([
            ("state.kp", options.kp, self.kp),
            ("state.ki", options.ki, self.ki),
            ("state.dt", options.dt, self.dt),
            ("state.limits.low", options.limits.0, self.limits.low),
            ("state.limits.high", options.limits.1, self.limits.high),
        ])?;
        if self.filters != options.filters.as_slice() {
            return Err(Error::State { expected: "the filters that the controller has" });
        }
        self.feedback_loop.check(options.limits, &options.filters)
    }
}

impl HybridController {
    /// Goes on with the weights and the offset of another model of the same operators, as
    /// [`Inverse::set_model`](crate::Inverse::set_model) or [`Forward::set_model`](crate::Forward::set_model) of the
    /// source, without a jump. Allocates nothing, and frees what the old model holds if no other clone of it is left.
    ///
    /// # Errors
    /// As there, and [`Error::NoModel`] without a source that has one; the controller is as before then.
    pub fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        let old = self.source.peek(self.now.terms.target);
        self.source.set_model(model)?;
        self.planned = None;
        if self.now.started && !self.now.feedforward_given {
            let new = self.source.peek(self.now.terms.target);
            self.now.change_feedforward(old, new, self.rules.bumpless_samples);
        }
        Ok(())
    }

    /// The Duhem operator of the model that feeds forward, if it has one: [`set_model`](Self::set_model) does not
    /// change it.
    #[must_use]
    pub fn duhem(&self) -> Option<&Duhem<MAX_KNOTS>> {
        self.source.duhem()
    }

    /// Everything that the controller remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> ControllerState {
        let (low, high) = self.options.limits;
        ControllerState {
            kp: self.options.kp,
            ki: self.options.ki,
            dt: self.options.dt,
            filters: self.options.filters.as_slice().to_vec(),
            limits: DriveLimits { low, high },
            feedback_loop: self.now,
            feedforward: self.source.state(),
            preview: self.preview.as_ref().map(Preview::state),
        }
    }

    /// Continues from `state`, bit for bit. The amplifier must be at the drive of the state.
    ///
    /// # Errors
    /// [`Error::Domain`] that names the field for a state of a controller with other gains, sampling interval or
    /// limits; [`Error::State`], [`Error::Domain`] or [`Error::Length`] for one that this controller cannot be in. The
    /// controller is as before then.
    pub fn set_state(&mut self, state: &ControllerState) -> Result<(), Error> {
        state.check(&self.options)?;
        match (&mut self.preview, &state.preview) {
            (None, None) => self.source.set_state(state.feedforward.as_ref())?,
            (Some(preview), Some(saved)) => {
                preview.check(saved)?;
                self.source.set_state(state.feedforward.as_ref())?;
                preview.set_state(saved);
            }
            _ => return Err(Error::State { expected: "a preview if, and only if, the controller has one" }),
        }
        self.planned = None;
        self.now = state.feedback_loop;
        Ok(())
    }
}
