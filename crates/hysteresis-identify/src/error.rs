//! What can go wrong, and what the message says: the argument, what was expected, what came.

use core::fmt;

/// Why a pair of signals is no record.
///
/// ```
/// use hysteresis_identify::Record;
/// let error = Record::new(&[0.0, f64::NAN], &[0.0, 1.0], 0).unwrap_err();
/// assert_eq!(error.to_string(), "input[1]: expected a finite number (at most 1e100 in magnitude), got NaN");
/// assert_eq!(error.in_record(2).to_string(), "record 2: input[1]: expected a finite number (at most 1e100 in \
///     magnitude), got NaN");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum RecordError {
    /// Input and output differ in length.
    Length {
        /// The name of the argument.
        argument: &'static str,
        /// The length it must have.
        expected: usize,
        /// The length that came.
        got: usize,
    },
    /// A sample is NaN, infinite or beyond 1e100 in magnitude.
    NotFinite {
        /// The name of the argument.
        argument: &'static str,
        /// Which sample.
        index: usize,
        /// The sample.
        got: f64,
    },
    /// A sample is not taken after the one before.
    TimeOrder {
        /// Which sample.
        index: usize,
        /// The time of the one before, in seconds.
        before: f64,
        /// Its time.
        got: f64,
    },
    /// The times of samples contradict the sampling interval, by more than 1 % and their jitter: another unit, or
    /// another clock.
    TimeStep {
        /// The sampling interval in seconds.
        expected: f64,
        /// The usual step of the times.
        got: f64,
    },
    /// There is no sample at all.
    Empty {
        /// The name of the argument.
        argument: &'static str,
    },
    /// No sample is left to fit.
    Skip {
        /// The samples of the record.
        samples: usize,
        /// The samples to skip.
        got: usize,
    },
    /// A sample that is left out is none of those behind the one before.
    LeftOut {
        /// Its place among those that are left out.
        place: usize,
        /// The first sample that is not skipped.
        first: usize,
        /// The last sample of the record.
        last: usize,
        /// The sample.
        got: usize,
    },
    /// All fitted samples of a signal are equal.
    Constant {
        /// The name of the argument.
        argument: &'static str,
        /// Its only value.
        value: f64,
    },
    /// The fitted samples of a signal vary by less than 1e-100.
    SmallRange {
        /// The name of the argument.
        argument: &'static str,
        /// By how much they vary.
        got: f64,
    },
}

impl RecordError {
    /// The same error with the place of the record in a list of records.
    #[must_use]
    pub fn in_record(self, record: usize) -> Error {
        Error::Record { record, error: self }
    }

    /// The same error about a signal that is called otherwise where it came from.
    ///
    /// ```
    /// use hysteresis_identify::Record;
    /// let error = Record::new(&[0.0, 0.0], &[0.0, 1.0], 0).unwrap_err();
    /// assert_eq!(error.renamed(|_| "u").to_string(), "u: expected fitted samples that vary, got 0.0 throughout");
    /// ```
    #[must_use]
    pub fn renamed(mut self, name: impl FnOnce(&'static str) -> &'static str) -> Self {
        if let Self::Length { argument, .. }
        | Self::NotFinite { argument, .. }
        | Self::Empty { argument }
        | Self::Constant { argument, .. }
        | Self::SmallRange { argument, .. } = &mut self
        {
            *argument = name(argument);
        }
        self
    }

    /// The name of the argument that is wrong.
    #[must_use]
    pub fn parameter(&self) -> &'static str {
        match *self {
            Self::Length { argument, .. }
            | Self::NotFinite { argument, .. }
            | Self::Empty { argument }
            | Self::Constant { argument, .. }
            | Self::SmallRange { argument, .. } => argument,
            Self::TimeOrder { .. } | Self::TimeStep { .. } => "times",
            Self::Skip { .. } => "skip",
            Self::LeftOut { .. } => "left_out",
        }
    }
}

impl fmt::Display for RecordError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Length { argument, expected, got } => {
                write!(f, "{argument}: expected {expected} samples, got {got}")
            }
            Self::NotFinite { argument, index, got } => {
                write!(f, "{argument}[{index}]: expected a finite number (at most 1e100 in magnitude), got {got:?}")
            }
            Self::TimeOrder { index, before, got } => {
                // Stamps of few digits repeat, and tell no more of the interval than `dt` does.
                let what = if before == got { "; where times are too coarse, leave them out and give dt" } else { "" };
                write!(
                    f,
                    "times[{index}]: expected a time after that of the sample before, {before:?} s, got {got:?} s{what}"
                )
            }
            Self::TimeStep { expected, got } => {
                write!(
                    f,
                    "times: expected steps of dt, {expected:?} s, within 1 % and their jitter, got steps of {got:.4e} s: give that as dt, or \
                     leave the times out"
                )
            }
            Self::Empty { argument } => write!(f, "{argument}: expected samples, got none"),
            Self::Skip { samples, got } => {
                write!(f, "skip: expected fewer than the {samples} samples of the record, got {got}")
            }
            Self::LeftOut { place, first, last, got } => {
                write!(f, "left_out[{place}]: expected samples in increasing order from {first} to {last}, got {got}")
            }
            Self::Constant { argument, value } => {
                write!(f, "{argument}: expected fitted samples that vary, got {value:?} throughout")
            }
            Self::SmallRange { argument, got } => {
                write!(
                    f,
                    "{argument}: expected fitted samples that vary by 1e-100 at least, got a range of {got:?}: take a smaller unit"
                )
            }
        }
    }
}

impl core::error::Error for RecordError {}

/// Why a model could not be identified.
///
/// ```
/// use std::ops::ControlFlow;
/// use hysteresis_identify::{Error, Options, identify};
/// let error = identify(&[], &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap_err();
/// assert_eq!(error, Error::NoRecords);
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub enum Error {
    /// There is no record.
    NoRecords,
    /// A record is unusable.
    Record {
        /// Which record.
        record: usize,
        /// Why.
        error: RecordError,
    },
    /// A model needs at least one operator.
    NoOperators,
    /// The conventional model has no split weights.
    SplitConventional,
    /// Fewer samples to fit than twice the unknowns.
    TooFewSamples {
        /// Twice the number of weights, output offsets and searched parameters.
        expected: usize,
        /// The fitted samples of all records together.
        got: usize,
    },
    /// Too few pairs of places and lengths that say anything.
    TooFewPairs {
        /// How many it takes.
        expected: usize,
        /// How many say something.
        got: usize,
    },
    /// Too few known lengths where no pairs are given.
    TooFewLengths {
        /// How many it takes.
        expected: usize,
        /// How many are given.
        got: usize,
    },
    /// Dynamics and creep need the sampling interval, and several records need one unit of time.
    NoInterval {
        /// The first record without a sampling interval.
        record: usize,
    },
    /// Many actuators at once have hysteresis and a dead time only: neither dynamics nor creep.
    LinearPart,
    /// Many actuators at once have plays alone.
    DuhemMany,
    /// Nobody looks for glitches in the records of many actuators at once.
    RobustMany,
    /// To leave one loop out takes two.
    TooFewLoops {
        /// The loops of all records together.
        got: usize,
    },
    /// The progress function asked to stop.
    Interrupted,
    /// An option, or a model, outside its domain.
    Core(hysteresis_core::Error),
}

impl Error {
    /// An option outside its domain.
    pub(crate) fn domain(parameter: &'static str, index: Option<usize>, expected: &'static str, got: f64) -> Self {
        Self::Core(hysteresis_core::Error::domain(parameter, index, expected, got))
    }

    /// An option that is a count, outside its domain.
    pub(crate) fn whole(parameter: &'static str, expected: &'static str, got: usize) -> Self {
        Self::Core(hysteresis_core::Error::whole(parameter, None, expected, got))
    }

    /// The name of the parameter that is wrong, if it is one.
    #[must_use]
    pub fn parameter(&self) -> Option<&'static str> {
        match self {
            Self::NoRecords | Self::TooFewSamples { .. } | Self::TooFewLoops { .. } => Some("records"),
            Self::TooFewPairs { .. } => Some("pairs"),
            Self::TooFewLengths { .. } => Some("lengths"),
            Self::Record { error, .. } => Some(error.parameter()),
            Self::NoOperators => Some("operators"),
            Self::SplitConventional => Some("weights"),
            Self::NoInterval { .. } => Some("dt"),
            Self::LinearPart => Some("dynamics"),
            Self::DuhemMany => Some("duhem"),
            Self::RobustMany => Some("loss"),
            Self::Core(error) => error.parameter(),
            Self::Interrupted => None,
        }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::NoRecords => write!(f, "records: expected at least one, got none"),
            Self::Record { record, error } => write!(f, "record {record}: {error}"),
            Self::NoOperators => write!(f, "operators: expected at least one, got none"),
            Self::SplitConventional => {
                write!(f, "weights: expected free or quadratic ones for the conventional model, got split ones")
            }
            Self::TooFewSamples { expected, got } => {
                write!(f, "records: expected at least {expected} fitted samples (twice the unknowns), got {got}")
            }
            Self::TooFewPairs { expected, got } => write!(
                f,
                "pairs: expected at least {expected} pairs and lengths that say something (of opposite branches, or of other loops), got {got}"
            ),
            Self::TooFewLengths { expected, got } => {
                write!(f, "lengths: expected at least {expected} where there are no pairs, got {got}")
            }
            Self::NoInterval { record } => write!(
                f,
                "dt: expected the sampling interval of record {record} in seconds, got none: dynamics and creep need it, \
                 and records are all in seconds or all in samples"
            ),
            Self::LinearPart => write!(f, "dynamics: expected neither dynamics nor creep for many actuators at once"),
            Self::DuhemMany => write!(f, "duhem: expected auto or none for many actuators at once"),
            Self::RobustMany => {
                write!(
                    f,
                    "loss: expected auto or squares for many actuators at once, where no glitches are looked for, got robust"
                )
            }
            Self::TooFewLoops { got } => {
                write!(f, "records: expected at least two loops, from one maximum of the input to the next, got {got}")
            }
            Self::Interrupted => write!(f, "identification was interrupted"),
            Self::Core(error) => error.fmt(f),
        }
    }
}

impl core::error::Error for Error {}

impl From<hysteresis_core::Error> for Error {
    fn from(error: hysteresis_core::Error) -> Self {
        Self::Core(error)
    }
}
