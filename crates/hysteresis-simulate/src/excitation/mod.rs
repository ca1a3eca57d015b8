//! Drives within limits and slew that make an actuator known: what to identify from, and what demagnetises.
//!
//! - `decay`: a full stroke and decaying reversals, each move as fast as a slew limit and the sampling allow: one
//!   record for the hysteresis, or the demagnetising sequence, of one actuator or of all of an array.
//! - `experiment`: loops, rests, a second rate and a small fast signal: records for a whole stage.
//!
//! Every reversal is met with a sample of its own. So small loops take less time than large ones, and no reversal is
//! clipped.

mod decay;
mod experiment;

pub use decay::{ActuatorDrive, Excitation, ExcitationOptions, Shape, demagnetizing_array};
pub use experiment::{Experiment, ExperimentOptions, FastSignal, Part, Segment};
