//! What every loop has: a set-up and its samples, the laws that they must keep, and the guard of its drives.

use core::error::Error;
use core::fmt;

/// A loop of one random set-up.
pub trait Episode: Sized {
    /// Its name in a report.
    const NAME: &'static str;

    /// A set-up that depends on the seed alone.
    ///
    /// # Errors
    /// What could not be made; none is expected.
    fn new(seed: u64) -> Result<Self, Box<dyn Error>>;

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
pub fn run<E: Episode>(first_seed: u64, episodes: u64, samples: u64) -> Result<u64, Box<dyn Error>> {
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

/// What must hold and did not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Breach {
    /// What must hold.
    pub law: &'static str,
    /// What was there.
    pub got: f64,
    /// What it was compared with.
    pub beside: f64,
}

impl fmt::Display for Breach {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {:?} beside {:?}", self.law, self.got, self.beside)
    }
}

impl Error for Breach {}

/// Whether two numbers are the same, to the bit.
pub(super) fn same(law: &'static str, got: f64, beside: f64) -> Result<(), Breach> {
    holds(law, got.to_bits() == beside.to_bits(), (got, beside))
}

pub(super) fn holds(law: &'static str, holds: bool, (got, beside): (f64, f64)) -> Result<(), Breach> {
    if holds { Ok(()) } else { Err(Breach { law, got, beside }) }
}

/// Whether a counter grew by what it should.
#[expect(clippy::cast_precision_loss, reason = "only shown")]
pub(super) fn grows(law: &'static str, (before, after): (u64, u64), by: u64) -> Result<(), Breach> {
    holds(law, after == before + by, (after as f64, (before + by) as f64))
}

/// Whether a counter grew by one at most.
pub(super) fn grows_by_one_at_most(law: &'static str, (before, after): (u64, u64)) -> Result<(), Breach> {
    grows(law, (before, after), u64::from(after > before))
}

/// Looks at every drive that goes out.
#[derive(Clone, Debug)]
pub struct Guard {
    limits: (f64, f64),
    /// Slew times dt.
    step: f64,
    last: f64,
}

impl Guard {
    /// For an amplifier that is at the drive `last`.
    #[must_use]
    pub fn new(limits: (f64, f64), slew: Option<f64>, dt: f64, last: f64) -> Self {
        Self { limits, step: slew.map_or(f64::INFINITY, |slew| slew * dt), last }
    }

    /// The next drive.
    ///
    /// # Errors
    /// [`Breach`] for one that is not finite, outside the limits or too far from the last one.
    pub fn pass(&mut self, drive: f64) -> Result<(), Breach> {
        let (low, high) = self.limits;
        holds("the drive is finite", drive.is_finite(), (drive, self.last))?;
        holds("the drive is above its low limit", low <= drive, (drive, low))?;
        holds("the drive is below its high limit", drive <= high, (drive, high))?;
        holds("the drive keeps its slew rate", (drive - self.last).abs() <= self.step, (drive, self.last))?;
        self.last = drive;
        Ok(())
    }

    /// The last drive.
    #[must_use]
    pub fn last(&self) -> f64 {
        self.last
    }

    /// The amplifier was brought to another drive by somebody else.
    pub fn told(&mut self, drive: f64) {
        self.last = drive;
    }
}
