//! Loops with plants that show and do anything: what must hold at every sample, whatever comes.
//!
//! - A drive is finite, within the limits, and no farther than slew times dt from the last one, without any tolerance.
//! - Every counter grows by what came, and by no more.
//! - A peek changes nothing, and a plan that is committed is a step. A sample whose drive could not be written is none.
//! - A fresh object that is given the state goes on bit for bit.

mod array;
mod axes;
mod axis;
mod bench;
mod episode;
mod learning;
mod setup;

pub use array::Actuators;
pub use axes::Axes;
pub use axis::Axis;
pub use bench::Bench;
pub use episode::{Breach, Episode, Guard, run};
pub use learning::Learning;
