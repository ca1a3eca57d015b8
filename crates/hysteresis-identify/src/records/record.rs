//! One measured record, checked once; and the sampling intervals of several.

use hysteresis_core::is_admissible;

use crate::error::{Error, RecordError};
use crate::records::signal::{UsualStep, as_f64, bounds, usual_step};

/// Checks a sampling interval in seconds.
pub(crate) fn check_interval(dt: f64) -> Result<(), Error> {
    if is_admissible(dt) && dt > 1e-90 {
        return Ok(());
    }
    Err(Error::domain("dt", None, "a finite number of seconds above 0", dt))
}

/// The least range of a signal: far below it squares are zero, and so is what tells one fit from another.
const MIN_RANGE: f64 = 1e-100;

/// A record of input and output, sample by sample, of which the first `skip` samples set the memory only.
///
/// The record starts from the virgin state (every operator at rest at zero, projected by the first sample, as in
/// the core). What happened before is unknown to the model, so the first samples may lie on no loop of it; they are
/// taken by the operators like all others, but their outputs are not fitted and enter no metric.
///
/// ```
/// use hysteresis_identify::Record;
/// let record = Record::new(&[0.0, 1.0, 2.0, 1.0], &[0.0, 0.9, 2.1, 1.3], 1)?;
/// assert_eq!(record.fitted_samples(), 3);
/// # Ok::<(), hysteresis_identify::RecordError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    input: &'a [f64],
    output: &'a [f64],
    skip: usize,
    input_bounds: (f64, f64),
    output_range: f64,
    dt: Option<f64>,
    times: Option<&'a [f64]>,
    /// Samples behind the skipped ones whose output is not fitted, in order.
    left_out: &'a [usize],
}

impl<'a> Record<'a> {
    /// A record of equally long `input` and `output`; the first `skip` samples are not fitted.
    ///
    /// # Errors
    /// [`RecordError::Length`] for unequal lengths, [`RecordError::Empty`] without samples, [`RecordError::Skip`] if
    /// nothing is left to fit, [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond 1e100,
    /// [`RecordError::Constant`] if the fitted part of either signal is constant: it says nothing about weights, and a
    /// constant output is no base for an error in per cent, and [`RecordError::SmallRange`] if it varies by less than
    /// 1e-100.
    pub fn new(input: &'a [f64], output: &'a [f64], skip: usize) -> Result<Self, RecordError> {
        if output.len() != input.len() {
            return Err(RecordError::Length { argument: "output", expected: input.len(), got: output.len() });
        }
        check_skip("input", input.len(), skip)?;
        for (argument, values) in [("input", input), ("output", output)] {
            check_finite(argument, values)?;
            check_varies(argument, bounds(&values[skip..]))?;
        }
        let (low, high) = bounds(&output[skip..]);
        let (input_bounds, output_range) = (bounds(input), high - low);
        Ok(Self { input, output, skip, input_bounds, output_range, dt: None, times: None, left_out: &[] })
    }

    /// The same record with a sampling interval of its own, in seconds; the others have that of the options.
    ///
    /// # Errors
    /// [`Error::Core`] unless it is finite and above 0.
    pub fn sampled_every(self, dt: f64) -> Result<Self, Error> {
        check_interval(dt)?;
        Ok(Self { dt: Some(dt), ..self })
    }

    /// The same record with the time at which every sample was taken, in seconds. They change no fit, and are no
    /// sampling interval: it is said if they are uneven, and a fit refuses those that contradict the interval.
    ///
    /// # Errors
    /// [`RecordError::Length`] unless there is one for each sample, [`RecordError::NotFinite`] for a NaN, an infinity
    /// or a magnitude beyond 1e100, [`RecordError::TimeOrder`] unless they increase.
    pub fn at_times(self, times: &'a [f64]) -> Result<Self, RecordError> {
        if times.len() != self.input.len() {
            return Err(RecordError::Length { argument: "times", expected: self.input.len(), got: times.len() });
        }
        check_finite("times", times)?;
        match times.windows(2).position(|pair| pair[1] <= pair[0]) {
            Some(k) => Err(RecordError::TimeOrder { index: k + 1, before: times[k], got: times[k + 1] }),
            None => Ok(Self { times: Some(times), ..self }),
        }
    }

    /// Refuses times whose usual step is not this sampling interval: whatever has a time would be wrong by their ratio.
    fn check_step(&self, dt: f64) -> Result<(), RecordError> {
        /// Two clocks are never the same: a quartz is 1e-4 off, what times a microcontroller without one about this
        /// share.
        const CLOCK: f64 = 0.01;
        let Some(times) = self.times.filter(|times| times.len() > 1) else { return Ok(()) };
        let UsualStep { step: got, jitter } = usual_step(times, times.len() - 1);
        if (got - dt).abs() <= CLOCK * dt + jitter { Ok(()) } else { Err(RecordError::TimeStep { expected: dt, got }) }
    }

    /// The same record with samples whose output is wrong: their input sets the memory like every other, but their
    /// output is not fitted and enters no metric.
    ///
    /// # Errors
    /// [`RecordError::LeftOut`] unless they are strictly increasing, from `skip` on and of the record, and
    /// [`RecordError::Constant`] or [`RecordError::SmallRange`] if what is left of the output is constant, hardly
    /// varies or is nothing.
    ///
    /// ```
    /// use hysteresis_identify::Record;
    /// let record = Record::new(&[0.0, 1.0, 2.0, 1.0], &[0.0, 0.9, 99.0, 1.3], 0)?.leaving_out(&[2])?;
    /// assert_eq!(record.fitted_samples(), 3);
    /// # Ok::<(), hysteresis_identify::RecordError>(())
    /// ```
    pub fn leaving_out(self, samples: &'a [usize]) -> Result<Self, RecordError> {
        let follows = |k: &usize| {
            let first = k.checked_sub(1).map_or(self.skip, |before| samples[before] + 1);
            !(first..self.input.len()).contains(&samples[*k])
        };
        if let Some(place) = (0..samples.len()).find(follows) {
            let (first, last) = (self.skip, self.input.len() - 1);
            return Err(RecordError::LeftOut { place, first, last, got: samples[place] });
        }
        let record = Self { left_out: samples, ..self };
        let (low, high) = record.output_bounds();
        check_varies("output", (low, high))?;
        Ok(Self { output_range: high - low, ..record })
    }

    /// The same record with another output, all of whose samples count but the skipped ones.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub(crate) fn with_output<'b>(self, output: &'b [f64]) -> Result<Record<'b>, RecordError>
    where
        'a: 'b,
    {
        Ok(Record { dt: self.dt, times: self.times, ..Record::new(self.input, output, self.skip)? })
    }

    /// The samples whose output is left out, in order.
    #[must_use]
    pub fn left_out(&self) -> &'a [usize] {
        self.left_out
    }

    /// When every sample was taken, in seconds, if it is known.
    #[must_use]
    pub fn times(&self) -> Option<&'a [f64]> {
        self.times
    }

    /// The sampling interval in seconds, if the record has its own.
    #[must_use]
    pub fn dt(&self) -> Option<f64> {
        self.dt
    }

    /// The input, in the unit of the drive.
    #[must_use]
    pub fn input(&self) -> &'a [f64] {
        self.input
    }

    /// The measured output.
    #[must_use]
    pub fn output(&self) -> &'a [f64] {
        self.output
    }

    /// How many leading samples are not fitted.
    #[must_use]
    pub fn skip(&self) -> usize {
        self.skip
    }

    /// How many samples are fitted.
    #[must_use]
    pub fn fitted_samples(&self) -> usize {
        self.input.len() - self.skip - self.left_out.len()
    }

    /// The fitted samples, in order.
    pub(crate) fn fitted(&self) -> impl Iterator<Item = usize> + use<'a> {
        let mut left_out = self.left_out.iter().copied().peekable();
        (self.skip..self.input.len()).filter(move |k| left_out.next_if_eq(k).is_none())
    }

    /// What of a signal of this record belongs to fitted samples.
    pub(crate) fn fitted_of(&self, signal: &[f64]) -> Vec<f64> {
        self.fitted().map(|k| signal[k]).collect()
    }

    /// Smallest and largest output of the fitted samples.
    pub(crate) fn output_bounds(&self) -> (f64, f64) {
        self.fitted().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), k| {
            (low.min(self.output[k]), high.max(self.output[k]))
        })
    }

    /// Smallest and largest input of the whole record, skipped samples included: they set the memory too.
    pub(crate) fn input_bounds(&self) -> (f64, f64) {
        self.input_bounds
    }

    /// Peak-to-peak of the fitted output.
    pub(crate) fn output_range(&self) -> f64 {
        self.output_range
    }
}

/// Checks that there are samples, and that some are left to fit.
pub(crate) fn check_skip(argument: &'static str, samples: usize, skip: usize) -> Result<(), RecordError> {
    match samples {
        0 => Err(RecordError::Empty { argument }),
        _ if skip >= samples => Err(RecordError::Skip { samples, got: skip }),
        _ => Ok(()),
    }
}

/// Checks every number, or names the first that is not admissible.
pub(crate) fn check_finite(argument: &'static str, values: &[f64]) -> Result<(), RecordError> {
    match values.iter().position(|value| !is_admissible(*value)) {
        Some(index) => Err(RecordError::NotFinite { argument, index, got: values[index] }),
        None => Ok(()),
    }
}

/// Checks that the fitted samples of a signal vary, by no less than the squares of residuals need to be numbers.
pub(crate) fn check_varies(argument: &'static str, (low, high): (f64, f64)) -> Result<(), RecordError> {
    if low >= high {
        return Err(RecordError::Constant { argument, value: low });
    }
    let got = high - low;
    if got < MIN_RANGE { Err(RecordError::SmallRange { argument, got }) } else { Ok(()) }
}

/// The longest dead time that is searched, as a share of the shortest record.
const MAX_DEAD_TIME_SHARE: f64 = 0.1;

/// The earliest that an output may be, in samples, where dynamics are fitted: rows that pair a drive with the position
/// at the end of its interval have -1.
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
    /// `dt` is the interval of records that have none of their own.
    ///
    /// # Errors
    /// [`Error::NoInterval`] if some intervals are known and others not, or one is needed and not known.
    pub(crate) fn of(records: &[Record<'_>], dt: Option<f64>, is_needed: bool) -> Result<Self, Error> {
        let all: Vec<Option<f64>> = records.iter().map(|record| record.dt().or(dt)).collect();
        let are_seconds = all.iter().any(Option::is_some);
        let is_needed = are_seconds || is_needed;
        if let Some(record) = all.iter().position(Option::is_none).filter(|_| is_needed) {
            return Err(Error::NoInterval { record });
        }
        let all: Vec<f64> = all.into_iter().map(|dt| dt.unwrap_or(1.0)).collect();
        let durations = records.iter().zip(&all).map(|(record, dt)| as_f64(record.input().len()) * dt);
        let shortest = durations.clone().fold(f64::INFINITY, f64::min);
        let longest = durations.fold(0.0, f64::max);
        Ok(Self { all, are_seconds, shortest, longest })
    }

    pub(crate) fn of_record(&self, record: usize) -> f64 {
        self.all[record]
    }

    /// The length of the shortest record.
    pub(crate) fn shortest_record(&self) -> f64 {
        self.shortest
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

/// The largest range of positions of some records.
pub(crate) fn largest_range(records: &[Record<'_>]) -> f64 {
    records.iter().map(Record::output_range).fold(0.0, f64::max)
}

/// The same records without these samples.
///
/// # Errors
/// [`Error::Record`] if nothing of a record is left that varies.
pub(crate) fn leaving_out<'b>(records: &[Record<'b>], samples: &'b [Vec<usize>]) -> Result<Vec<Record<'b>>, Error> {
    let leave_out = |(place, (record, samples)): (usize, (&Record<'b>, &'b Vec<usize>))| {
        record.leaving_out(samples).map_err(|error| error.in_record(place))
    };
    records.iter().zip(samples).enumerate().map(leave_out).collect()
}
