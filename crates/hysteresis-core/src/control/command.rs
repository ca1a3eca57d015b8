//! What a controller is asked to do.

/// What the controller does with its samples.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController, Mode};
/// let options = ControllerOptions::new(2.0, 1e3, 1e-4, (-500.0, 500.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.set_mode(Mode::Hold)?;
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
    /// The drive stays, for any reference and measurement, and nothing advances but the creep of a feed-forward that has any.
    Hold,
    /// The drive goes to a rest drive at a given rate and stays there, for any reference and measurement. Entered by
    /// [`stop`](super::HybridController::stop).
    Stop,
}

/// What is asked of one sample.
///
/// A number is a command too: `1.5.into()` asks for the position 1.5.
///
/// ```
/// use hysteresis_core::Command;
/// assert_eq!(Command::from(1.5), Command { reference: 1.5, target: None, correction: 0.0, estimate: None, feedforward: None });
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Command {
    /// The position that is wanted, in the unit of the measurement. With a [`Preview`](super::Preview) it is the position
    /// wanted `ahead` samples later.
    pub reference: f64,
    /// The target of the feed-forward, if it is not the reference (or what the preview makes of it).
    pub target: Option<f64>,
    /// What learning adds to the target of the feed-forward; the feedback goes on with the reference.
    pub correction: f64,
    /// What the feedback takes instead of the measurement: the estimate of an observer. It stands in for up to `max_missing`
    /// measurements in a row that are missing or implausible; these are counted all the same.
    pub estimate: Option<f64>,
    /// Volts that replace the output of the feed-forward for this sample. Its source follows the target all the same.
    pub feedforward: Option<f64>,
}

impl From<f64> for Command {
    #[inline]
    fn from(reference: f64) -> Self {
        Self { reference, target: None, correction: 0.0, estimate: None, feedforward: None }
    }
}
