//! The sampling intervals of records.

use crate::error::Error;
use crate::numeric::as_f64;
use crate::options::{Options, Setting};
use crate::record::Record;

/// The longest dead time that is searched, as a share of the shortest record.
const MAX_DEAD_TIME_SHARE: f64 = 0.1;

/// The earliest that an output may be, in samples, where dynamics are fitted: rows that pair a drive with the position at
/// the end of its interval have -1.
const MIN_DEAD_TIME_SAMPLES: f64 = -1.5;

/// The sampling interval of every record, in seconds; or 1, in samples, if none is known.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Intervals {
    all: Vec<f64>,
    are_seconds: bool,
    /// Of the shortest record in time.
    shortest: f64,
    longest: f64,
}

/// Refuses records whose times contradict their sampling interval, or that of the options.
///
/// # Errors
/// [`Error::Record`] for the first of them.
pub(crate) fn check_times(records: &[Record<'_>], dt: Option<f64>) -> Result<(), Error> {
    for (place, record) in records.iter().enumerate() {
        record.dt().or(dt).map_or(Ok(()), |dt| record.check_step(dt)).map_err(|error| error.in_record(place))?;
    }
    Ok(())
}

impl Intervals {
    /// # Errors
    /// [`Error::NoInterval`] if some intervals are known and others not, or one is needed and not known;
    /// [`Error::Core`] for a dead time that is given and longer than a record.
    pub(crate) fn of(records: &[Record<'_>], options: &Options) -> Result<Self, Error> {
        let all: Vec<Option<f64>> = records.iter().map(|record| record.dt().or(options.dt)).collect();
        let are_seconds = all.iter().any(Option::is_some);
        let is_needed = are_seconds || options.needs_seconds();
        if let Some(record) = all.iter().position(Option::is_none).filter(|_| is_needed) {
            return Err(Error::NoInterval { record });
        }
        let all: Vec<f64> = all.into_iter().map(|dt| dt.unwrap_or(1.0)).collect();
        let durations = records.iter().zip(&all).map(|(record, dt)| as_f64(record.input().len()) * dt);
        let shortest = durations.clone().fold(f64::INFINITY, f64::min);
        let longest = durations.fold(0.0, f64::max);
        let intervals = Self { all, are_seconds, shortest, longest };
        match options.dead_time {
            Setting::Fixed(dead_time) if !(dead_time >= 0.0 && dead_time < shortest) => {
                let expected = "a number >= 0 below the length of the shortest record";
                Err(Error::domain("dead_time", None, expected, dead_time))
            }
            _ => Ok(intervals),
        }
    }

    pub(crate) fn of_record(&self, record: usize) -> f64 {
        self.all[record]
    }

    /// In seconds, if they are known.
    pub(crate) fn seconds(&self) -> Vec<f64> {
        if self.are_seconds { self.all.clone() } else { Vec::new() }
    }

    pub(crate) fn are_seconds(&self) -> bool {
        self.are_seconds
    }

    /// The one of all records, if they have the same.
    pub(crate) fn common(&self) -> Option<f64> {
        let first = self.all[0];
        self.all.iter().all(|dt| *dt == first).then_some(first)
    }

    pub(crate) fn smallest(&self) -> f64 {
        self.all.iter().copied().fold(f64::INFINITY, f64::min)
    }

    /// The length of the longest record.
    pub(crate) fn longest_record(&self) -> f64 {
        self.longest
    }

    /// Where the dead time is searched.
    pub(crate) fn dead_times(&self, with_dynamics: bool) -> (f64, f64) {
        let lower = if with_dynamics { MIN_DEAD_TIME_SAMPLES * self.smallest() } else { 0.0 };
        (lower, MAX_DEAD_TIME_SHARE * self.shortest)
    }
}
