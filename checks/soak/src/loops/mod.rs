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
mod guard;
mod learning;
mod setup;

pub use array::Actuators;
pub use axes::Axes;
pub use axis::Axis;
pub use bench::Bench;
pub use guard::{Breach, Guard};
pub use learning::Learning;

/// A loop of one random set-up.
pub trait Episode: Sized {
    /// Its name in a report.
    const NAME: &'static str;

    /// A set-up that depends on the seed alone.
    ///
    /// # Errors
    /// What could not be made; none is expected.
    fn new(seed: u64) -> Result<Self, Box<dyn core::error::Error>>;

    /// One sample, or one period.
    ///
    /// # Errors
    /// [`Breach`] of what must hold.
    fn sample(&mut self) -> Result<(), Breach>;

    /// How often the drive was held back by limits or slew, so far: a run in which it never was shows nothing.
    fn held_back(&self) -> u64;
}

/// Runs `episodes` set-ups for that many samples each; how often limits or slew held a drive back.
///
/// # Errors
/// The first breach, with the seed that shows it again.
pub fn run<E: Episode>(first_seed: u64, episodes: u64, samples: u64) -> Result<u64, Box<dyn core::error::Error>> {
    let mut held_back = 0;
    for seed in first_seed..first_seed + episodes {
        let mut episode = E::new(seed).map_err(|error| format!("{}, seed {seed}: {error}", E::NAME))?;
        for sample in 0..samples {
            episode.sample().map_err(|breach| format!("{}, seed {seed}, sample {sample}: {breach}", E::NAME))?;
        }
        held_back += episode.held_back();
    }
    Ok(held_back)
}
