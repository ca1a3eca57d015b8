//! An experiment: all that identification needs to tell a stage, in two records.
//!
//! The small fast signal comes first: at rest it leaves hardly a trace, and what it finds is the stage at rest. Loops
//! and rests are one record, as each record is fitted from rest, without what crept or turned before it.

mod course;
mod fast;
mod loops;
mod options;

use std::borrow::Cow;

use hysteresis_control::sampling::{Error, check_count, reserve};

pub use self::fast::FastSignal;
pub use self::options::ExperimentOptions;

/// A stretch of a drive with a purpose of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Segment {
    /// What it is, in one or two words.
    pub name: &'static str,
    /// What it tells.
    pub purpose: &'static str,
    /// Its first sample.
    pub start: usize,
    /// The sample behind its last one.
    pub stop: usize,
    /// The lowest and the highest drive.
    pub range: (f64, f64),
    /// The lowest and the highest frequency, in Hz; of loops that of a full stroke at their speed, 0 at rest.
    pub frequencies: (f64, f64),
    /// The fastest step, per second.
    pub max_slew: f64,
}

/// A drive to play and record in one go, at one sampling rate. It starts and ends at the rest drive.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// `"fast"`, `"loops"`, or `"experiment"` if both are joined.
    pub name: Cow<'static, str>,
    /// Samples per second, in Hz.
    pub rate: f64,
    /// The samples.
    pub drive: Vec<f64>,
    /// What the samples are for: one segment after the other, none left out.
    pub segments: Vec<Segment>,
    /// How many samples come before both limits were reached, for an actuator whose history is unknown: 0 if it never
    /// reaches them.
    pub initialization_samples: usize,
}

/// The drives of an experiment, in the order in which to play them.
#[derive(Clone, Debug, PartialEq)]
pub struct Experiment {
    /// The fast one and the loops.
    pub parts: Vec<Part>,
}

impl Experiment {
    /// One drive: the parts one after the other. All start and end at the same drive.
    ///
    /// # Errors
    /// [`Error`] if their rates differ, or the samples do not fit in memory.
    pub fn joined(self) -> Result<Part, Error> {
        let total: usize = self.parts.iter().map(|part| part.drive.len()).sum();
        let rate = self.parts.last().map_or(0.0, |part| part.rate);
        // Far below 2^53.
        #[expect(clippy::cast_precision_loss, reason = "at most twice 2^27")]
        let drive = reserve("rate", check_count("rate", total as f64)?)?;
        let name = Cow::Borrowed("experiment");
        let mut joined = Part { name, rate, drive, segments: Vec::new(), initialization_samples: 0 };
        for part in self.parts {
            if part.rate.to_bits() != rate.to_bits() {
                let expected = format!("{rate:?} Hz, the rate of the loops, for a drive in one part");
                return Err(Error::domain("fast_rate", expected, part.rate));
            }
            joined.append(part);
        }
        Ok(joined)
    }
}

impl Part {
    fn append(&mut self, part: Self) {
        let before = self.drive.len();
        self.drive.extend(part.drive);
        self.segments.extend(part.segments.into_iter().map(|segment| Segment {
            start: before + segment.start,
            stop: before + segment.stop,
            ..segment
        }));
        if part.initialization_samples > 0 {
            self.initialization_samples = before + part.initialization_samples;
        }
    }
}

#[cfg(test)]
mod tests;
