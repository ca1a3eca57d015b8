//! The hybrid controller: feed-forward and proportional-integral feedback, equation (8), within limits at every sample.
//!
//! Each file knows only those above it: `command`, `terms`, `options`; `limiter`, `loop_state`, `gate`, `view`; `law`, `preview`,
//! `source`, `feedforward`, `state`; `controller`, `changes`, which changes a running one, and `saved`. `axes` puts several controllers side by side.
//! `array` is a room of its own: the controller of many actuators, which has the limiter and the modes in common.

#[cfg(feature = "alloc")]
mod array;
#[cfg(feature = "alloc")]
mod axes;
mod changes;
mod command;
mod controller;
#[cfg(feature = "alloc")]
mod feedforward;
mod gate;
mod law;
mod limiter;
mod loop_state;
mod options;
#[cfg(feature = "alloc")]
mod preview;
#[cfg(feature = "alloc")]
mod saved;
mod source;
#[cfg(feature = "alloc")]
mod state;
mod terms;
mod view;
#[cfg(not(feature = "alloc"))]
mod without_alloc;

#[cfg(feature = "alloc")]
pub use array::{ArrayController, ArrayControllerState, ArrayCounters, ArrayOptions, ArraySample, ArrayStop};
#[cfg(feature = "alloc")]
pub use axes::{AxesCommand, AxisMatrix, MultiAxisController, MultiAxisState};
pub use command::{Command, Mode};
pub use controller::HybridController;
pub use feedforward::FeedForward;
#[cfg(feature = "alloc")]
pub use feedforward::FeedForwardState;
pub use loop_state::{LoopState, StopRamp};
pub use options::{AntiWindup, ControllerOptions, Law};
pub use preview::Preview;
#[cfg(feature = "alloc")]
pub use preview::PreviewState;
pub use source::DriveSource;
#[cfg(feature = "alloc")]
pub use state::{ControllerState, DriveLimits};
pub use terms::{Counters, Terms};
#[cfg(not(feature = "alloc"))]
use without_alloc::{self as feedforward, self as preview};
