//! The hybrid controller: feed-forward and proportional-integral feedback, equation (8), within limits at every sample.
//!
//! The way of a sample: `HybridController::step` in `controller` decides what becomes of it, moves the source of the feed-forward on
//! (`source`; `feedforward` has those of models of any size, and previews) and lets `law` make the next state of the loop of the present one; the `limiter`
//! stands in front of every drive. `axes` puts several controllers side by side, behind a matrix. `array` controls many actuators with
//! one integral through their inverses: another law, within the same limiter, modes and checks.

#[cfg(feature = "alloc")]
mod array;
#[cfg(feature = "alloc")]
mod axes;
mod controller;
#[cfg(feature = "alloc")]
mod controller_state;
#[cfg(feature = "alloc")]
mod feedforward;
mod law;
mod limiter;
mod options;
mod source;
#[cfg(not(feature = "alloc"))]
mod without_alloc;

#[cfg(feature = "alloc")]
pub use array::{ArrayController, ArrayControllerState, ArrayCounters, ArrayOptions, ArraySample, ArrayStop};
#[cfg(feature = "alloc")]
pub use axes::{AxesCommand, AxisMatrix, MultiAxisController, MultiAxisState};
pub use controller::{Command, HybridController};
#[cfg(feature = "alloc")]
pub use controller_state::{ControllerState, DriveLimits};
pub use feedforward::{FeedForward, Preview};
#[cfg(feature = "alloc")]
pub use feedforward::{FeedForwardState, PreviewState};
pub use law::{Counters, LoopState, Mode, StopRamp, Terms};
pub use options::{AntiWindup, ControllerOptions, Law};
pub use source::DriveSource;
#[cfg(not(feature = "alloc"))]
use without_alloc as feedforward;
