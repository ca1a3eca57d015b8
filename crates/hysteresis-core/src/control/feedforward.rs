//! Where the feed-forward comes from.

use alloc::boxed::Box;

use super::source::{DriveSource, check_same_limits};
use crate::engine::CompiledModel;
use crate::error::Error;
use crate::process::Process;
use crate::quasistatic::{QuasiStaticInverse, QuasiStaticState};
use crate::stream::{Forward, Inverse, StreamState};

/// Where the feed-forward term H^-1\[target\] of equation (8) comes from: a target in, volts out.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios};
/// let limits = (-500.0, 500.0);
/// let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, limits) };
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 150.0, 300.0], Ratios::PAPER, Offsets::default())?;
/// let exact: FeedForward = model.inverse(Some(limits))?.into();
/// let parametric = model.parametric_inverse(Ratios::PAPER_INVERSE)?; // itself a model: um in, V out
/// let parametric: FeedForward = parametric.forward().into();
/// for source in [exact, parametric] {
///     let mut controller = HybridController::new(source, None, &options)?;
///     controller.step(1.0.into(), 0.0); // starts from 0 V
///     let drive = controller.step(1.0.into(), 0.0);
///     assert!((drive - 209.0).abs() < 5.0, "{drive}"); // V
/// }
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub enum FeedForward {
    /// Feedback alone: 0 V.
    None,
    /// The exact inverse of the actuator's model. It must have the limits of the controller: else targets out of reach
    /// would take its memory where the drive never goes.
    Inverse(Inverse),
    /// The exact inverse of hysteresis with maps, loop shift and creep, with the limits of the controller. Loop shift and
    /// creep go on at every sample, also while the drive is held.
    QuasiStatic(Box<QuasiStaticInverse>),
    /// A model that is itself an inverse, displacement in and volts out: Table II, or a closed form.
    Forward(Forward),
    /// Volts that come with every [`Command`](super::Command); a sample without them is rejected.
    Given,
}

/// What the source of the feed-forward remembers.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForwardState, HybridController, Offsets, PrandtlIshlinskii};
/// let limits = (-10.0, 10.0);
/// let inverse = PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], Offsets::default())?.inverse(Some(limits))?;
/// let options = ControllerOptions::new(0.0, 0.0, 1e-4, limits);
/// let controller = HybridController::new(inverse.clone().into(), None, &options)?;
/// assert_eq!(controller.state().feedforward, Some(FeedForwardState::Stream(inverse.state())));
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum FeedForwardState {
    /// An inverse, or a model that is itself one.
    Stream(StreamState),
    /// The inverse of hysteresis with maps, loop shift and creep.
    QuasiStatic(QuasiStaticState),
}

impl From<Inverse> for FeedForward {
    fn from(stream: Inverse) -> Self {
        Self::Inverse(stream)
    }
}

impl From<QuasiStaticInverse> for FeedForward {
    fn from(stream: QuasiStaticInverse) -> Self {
        Self::QuasiStatic(Box::new(stream))
    }
}

impl From<Forward> for FeedForward {
    fn from(stream: Forward) -> Self {
        Self::Forward(stream)
    }
}

impl DriveSource for FeedForward {
    #[inline]
    fn step(&mut self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.step(target),
            Self::QuasiStatic(stream) => stream.step(target),
            Self::Forward(stream) => stream.step(target),
            Self::None | Self::Given => 0.0,
        }
    }

    #[inline]
    fn peek(&self, target: f64) -> f64 {
        match self {
            Self::Inverse(stream) => stream.peek(target),
            Self::QuasiStatic(stream) => stream.peek(target),
            Self::Forward(stream) => stream.peek(target),
            Self::None | Self::Given => 0.0,
        }
    }

    #[inline]
    fn wait(&mut self) {
        if let Self::QuasiStatic(stream) = self {
            stream.follow_drive(stream.output());
        }
    }

    #[inline]
    fn follow_drive(&mut self, drive: f64) {
        match self {
            Self::Inverse(stream) => _ = stream.follow_drive(drive),
            Self::QuasiStatic(stream) => _ = stream.follow_drive(drive),
            Self::Forward(_) | Self::None | Self::Given => {}
        }
    }

    fn follow(&mut self, drives: &[f64]) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => stream.follow(drives),
            Self::QuasiStatic(stream) => stream.follow(drives),
            Self::Forward(_) => Err(Error::CannotFollow),
            Self::None | Self::Given => Ok(()),
        }
    }

    fn check_limits(&self, expected: (f64, f64)) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => check_same_limits(stream.limits(), expected),
            Self::QuasiStatic(stream) => check_same_limits(stream.limits(), expected),
            Self::Forward(_) | Self::None | Self::Given => Ok(()),
        }
    }

    fn is_given(&self) -> bool {
        matches!(self, Self::Given)
    }

    fn reset(&mut self) {
        match self {
            Self::Inverse(stream) => stream.reset(),
            Self::QuasiStatic(stream) => stream.reset(),
            Self::Forward(stream) => stream.reset(),
            Self::None | Self::Given => {}
        }
    }
}

impl FeedForward {
    pub(super) fn set_model(&mut self, model: &CompiledModel) -> Result<(), Error> {
        match self {
            Self::Inverse(stream) => stream.set_model(model),
            Self::QuasiStatic(stream) => stream.set_model(model),
            Self::Forward(stream) => stream.set_model(model),
            Self::None | Self::Given => Err(Error::NoModel),
        }
    }

    /// What the source remembers. Allocates.
    pub(super) fn state(&self) -> Option<FeedForwardState> {
        match self {
            Self::Inverse(stream) => Some(FeedForwardState::Stream(stream.state())),
            Self::QuasiStatic(stream) => Some(FeedForwardState::QuasiStatic(stream.state())),
            Self::Forward(stream) => Some(FeedForwardState::Stream(stream.state())),
            Self::None | Self::Given => None,
        }
    }

    pub(super) fn set_state(&mut self, state: Option<&FeedForwardState>) -> Result<(), Error> {
        match (self, state) {
            (Self::Inverse(stream), Some(FeedForwardState::Stream(state))) => stream.set_state(state),
            (Self::QuasiStatic(stream), Some(FeedForwardState::QuasiStatic(state))) => stream.set_state(state),
            (Self::Forward(stream), Some(FeedForwardState::Stream(state))) => stream.set_state(state),
            (Self::None | Self::Given, None) => Ok(()),
            _ => Err(Error::State { expected: "a feed-forward of the kind that the controller has" }),
        }
    }
}
