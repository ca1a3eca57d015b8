//! The hybrid controller: feed-forward and proportional-integral feedback, equation (8), within limits at every sample.
//!
//! Each file knows only those above it: `command`, `terms`, `options`; `limiter`, `loop_state`, `gate`; `law`, `preview`,
//! `feedforward`, `state`; `controller`, and `changes`, which changes a running one. `axes` puts several controllers side by side.
//! `array` is a room of its own: the controller of many actuators, which has the limiter and the modes in common.

mod array;
mod axes;
mod changes;
mod command;
mod controller;
mod feedforward;
mod gate;
mod law;
mod limiter;
mod loop_state;
mod options;
mod preview;
mod state;
mod terms;

pub use array::{ArrayController, ArrayControllerState, ArrayCounters, ArrayOptions, ArraySample, ArrayStop};
pub use axes::{AxesCommand, AxisMatrix, MultiAxisController, MultiAxisState};
pub use command::{Command, Mode};
pub use controller::HybridController;
pub use feedforward::{FeedForward, FeedForwardState};
pub use loop_state::{LoopState, StopRamp};
pub use options::{AntiWindup, ControllerOptions, Law};
pub use preview::{Preview, PreviewState};
pub use state::{ControllerState, DriveLimits};
pub use terms::{Counters, Terms};
