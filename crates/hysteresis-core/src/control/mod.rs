//! The hybrid controller: feed-forward and proportional-integral feedback, equation (8), within limits at every sample.

mod controller;
mod feedforward;
mod law;
mod limiter;
mod options;
mod preview;
mod state;
mod terms;

pub use controller::HybridController;
pub use feedforward::FeedForward;
pub use options::{AntiWindup, ControllerOptions, Law};
pub use preview::{Preview, PreviewState};
pub use state::{ControllerState, LoopState};
pub use terms::{Counters, Terms};

/// What the controller is to do.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Mode, Preview};
/// let options = ControllerOptions::new(2.0, 0.1, (-500.0, 500.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.set_mode(Mode::Hold);
/// assert_eq!(controller.step(3.0.into(), 0.0), 0.0);
/// controller.release();
/// assert_eq!(controller.mode(), Mode::Run);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(rename_all = "snake_case"))]
pub enum Mode {
    /// Feed-forward and feedback.
    Run,
    /// Feed-forward alone: the proportional term is off, the integral is frozen and stays part of the drive.
    Feedforward,
    /// The drive stays and nothing advances, whatever comes.
    Hold,
}

/// What is asked of one sample.
///
/// A number is a command too: `1.5.into()` asks for the position 1.5.
///
/// ```
/// use hysteresis_core::Command;
/// assert_eq!(Command::from(1.5), Command { reference: 1.5, target: None, feedforward: None });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The position that is wanted, in the unit of the measurement; with a [`Preview`] that of `ahead` samples later.
    pub reference: f64,
    /// What the feed-forward is to reach, if not the reference (or what the preview makes of it): dynamic feed-forward.
    pub target: Option<f64>,
    /// Volts that replace the output of the feed-forward for this sample. Its source follows the target all the same.
    pub feedforward: Option<f64>,
}

impl From<f64> for Command {
    #[inline]
    fn from(reference: f64) -> Self {
        Self { reference, target: None, feedforward: None }
    }
}
