//! The hybrid controller: feed-forward and proportional-integral feedback, equation (8), within limits at every sample.
//!
//! The way of a sample: `HybridController::step` in `controller` decides what becomes of it, moves the source of the
//! feed-forward on (`source`; `feedforward` has those of models of any size, and previews) and lets `law` make the next
//! state of the loop of the present one; the `limiter` stands in front of every drive. `axes` puts several controllers
//! side by side, behind a matrix. `array` controls many actuators with one integral through their inverses: another
//! law, within the same limiter, modes and checks.
//!
//! # Why it is so
//! - The limiter comes last and knows the last drive alone: no error before it makes the drive leave limits or slew.
//!   The bound last + slew dt is rounded towards the last drive. A stop is a ramp through the same limiter.
//! - The incremental law is the positional one with an integral that takes all that the limiter cut off at once.
//! - Every start and every change of mode is one term in volts, `bumpless`, that goes to zero in a straight line: a
//!   line ends, an exponential does not. The integral is frozen meanwhile, as it would learn the velocity error of the
//!   start.
//! - Filters stand before both gains: limits cut off nothing that they remember. They wait over missing samples.
//! - A missing measurement holds the drive, unless that still comes back from the last hold: then the last error stands
//!   in. A feedback that comes and goes would start its filters anew each time. Its reference still enters the preview:
//!   a gap there would be a jump.
//! - The feed-forward remembers the drives that it asked for: what the feedback adds corrects a model, and must not
//!   move its memory.
//! - The allowed change of a measurement grows over missing ones, and after `max_missing` the next one in range is
//!   taken: no gate locks.

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
pub use array::{
    ArrayController, ArrayControllerState, ArrayCounters, ArrayInverse, ArrayOptions, ArraySample, ArrayStop,
};
#[cfg(feature = "alloc")]
pub use axes::{AxesCommand, AxisMatrix, MultiAxisController, MultiAxisControllerState};
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
