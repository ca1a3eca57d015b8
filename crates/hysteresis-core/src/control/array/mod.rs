//! A controller for an array of actuators: exact inverses, an integral through a reconstruction matrix, limits of every
//! drive and of the differences between neighbours.
//!
//! The integral is a displacement in front of the inverses, so the loop is linear and one gain suits all. Here the
//! inverses remember the drives that go out: feedback is a part of the target, so the memory has to follow it. Of a
//! change of the integral only that part is kept which the limited actuator follows; what the reference alone asks too
//! much takes nothing from it.
//!
//! The positions that satisfy all limits of a sample are a convex set, as a position rises with its drive, and the
//! present ones lie in it. `pairs` never leaves it: targets too far apart are drawn together, then all actuators go
//! along a straight line, then each by itself as far as its pairs allow. The line alone would stop the whole mirror at
//! the first pair; single moves alone would bring it up one difference at a time. The numbers of sweeps are fixed, so
//! the time is bounded.
//!
//! A position with creep or a loop shift goes on by itself, by an amount that is known before the drives of a sample
//! are: it is a displacement that look, step and a drive that stays have in common, so the set is convex there too. But
//! drives that stay need not lie in it. So `present` is there the positions of the last sample, as far as drives may
//! keep them: what creeps is countered, and a pair cannot creep away from its limit sample by sample. A sample in which
//! a drive stays moves the memory on all the same.

mod controller;
mod inverse;
mod law;
mod options;
mod pairs;

pub use controller::{ArrayController, ArrayControllerState, ArrayStop};
pub use inverse::ArrayInverse;
pub use law::{ArrayCounters, ArraySample};
pub use options::ArrayOptions;
