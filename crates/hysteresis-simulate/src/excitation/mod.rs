//! Drives within limits and slew that make an actuator known: what to identify from, and what demagnetises.
//!
//! | room | what is in it |
//! |---|---|
//! | `moves` | from reversal to reversal, each move as fast as a slew limit and the sampling allow |
//! | `decay` | a full stroke and decaying reversals: one record for the hysteresis, or the demagnetising sequence |
//! | `array_decay` | one demagnetising sequence for all actuators of an array |
//! | `experiment` | loops, rests, a second rate and a small fast signal: records for a whole stage |
//!
//! Every reversal is met with a sample of its own. So small loops take less time than large ones, and no reversal is
//! clipped.

mod array_decay;
mod decay;
mod experiment;
mod moves;

pub use self::array_decay::{ActuatorDrive, demagnetizing_array};
pub use self::decay::{Excitation, ExcitationOptions};
pub use self::experiment::{Experiment, ExperimentOptions, FastSignal, Part, Segment};
pub use self::moves::Shape;
