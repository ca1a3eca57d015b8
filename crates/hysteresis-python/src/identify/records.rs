//! The records that are given: their signals and sampling intervals, what is skipped, what is held out for validation.

use hysteresis_identify::{Record, RecordError};
use hysteresis_python_macros::py;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyFloat, PyList, PyString, PyTuple};

use crate::argument::Argument;
use crate::convert::arrays::{FIT, check_room, numbers};
use crate::convert::errors::{self, Place, identification, one_record, record, unexpected, wrong_type};

/// Records as they are given. Copies: other threads may change the arrays while the interpreter is let go.
pub(super) struct GivenRecords {
    signals: Vec<(Vec<f64>, Vec<f64>)>,
    dt: Intervals,
    skips: Vec<usize>,
    times: Vec<Option<Vec<f64>>>,
}

impl GivenRecords {
    /// From the arguments of these names; without dt the sampling intervals are those that are known.
    pub(super) fn new(
        u: &Bound<'_, PyAny>,
        y: Option<&Bound<'_, PyAny>>,
        skip: Option<&Skips>,
        dt: Option<Interval>,
        known: &[f64],
    ) -> PyResult<Self> {
        let signals = signals(u, y)?;
        let dt = Intervals::new(dt, known, signals.len())?;
        let skips = skips(skip.map(|skip| skip.0.bind(u.py())), signals.len(), &dt)?;
        Ok(Self { times: vec![None; signals.len()], signals, dt, skips })
    }

    /// The same with the times of their samples: one array, or a list of one for each record.
    pub(super) fn at(self, times: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        Ok(Self { times: times_of(times, self.signals.len())?, ..self })
    }

    /// The sampling interval of all records, unless they differ.
    pub(super) fn common_dt(&self) -> Option<f64> {
        let first = self.dt.of(0);
        first.filter(|_| self.dt.0.iter().all(|dt| *dt == first))
    }

    /// The records, or why one is none.
    pub(super) fn records(&self) -> PyResult<Vec<Record<'_>>> {
        self.fitted(None)
    }

    /// The same, each up to where the part of it begins that is held out.
    pub(super) fn fitted(&self, held_out: Option<&HeldOut>) -> PyResult<Vec<Record<'_>>> {
        let each = self.signals.iter().zip(&self.skips).zip(&self.times).enumerate();
        each.map(|(place, (((u, y), skip), times))| {
            // Unequal lengths are for the record to name.
            let cut = match held_out.filter(|_| u.len() == y.len()) {
                Some(held_out) => Some(held_out.begins_after(*skip, place, u.len())?),
                None => None,
            };
            let record = Record::new(&u[..cut.unwrap_or(u.len())], &y[..cut.unwrap_or(y.len())], *skip);
            let record = record.and_then(|record| at_times(record, times.as_ref()));
            self.dt.with(place, record.map_err(|error| self.refused(place, error))?)
        })
        .collect()
    }

    /// An error about one record: of one alone nobody asks which.
    pub(super) fn refused(&self, place: usize, error: RecordError) -> PyErr {
        one_record(error, (self.signals.len() > 1).then_some(place))
    }
}

/// The number of a record among those that were fitted.
pub(super) fn check_place(place: usize, records: usize) -> PyResult<()> {
    if place < records {
        return Ok(());
    }
    let expected = format_args!("expected a number below {records}, that of the fitted records, got {place}");
    Err(errors::value("record", expected))
}

/// `dt`: one for all records, or one for each.
pub(super) enum Interval {
    OfAll(f64),
    OfEach(Vec<f64>),
}

#[py("float | Sequence[float]")]
impl Argument<'_> for Interval {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(dt) = value.extract() {
            return Ok(Self::OfAll(dt));
        }
        let expected = "a number of seconds, or a list of one for each record";
        value.extract().map(Self::OfEach).map_err(|_| unexpected(name, expected, value))
    }
}

/// `skip`: one for all records, or one for each. What it says is known once their sampling intervals are.
pub(super) struct Skips(pub(super) Py<PyAny>);

#[py("Skip | Sequence[Skip]")]
impl Argument<'_> for Skips {
    fn from_argument(_: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(Self(value.clone().unbind()))
    }
}

/// The sampling interval of every record in seconds, if it is known.
struct Intervals(Vec<Option<f64>>);

impl Intervals {
    /// What is given; else those that are known, if they are of as many records.
    fn new(dt: Option<Interval>, known: &[f64], records: usize) -> PyResult<Self> {
        match dt {
            None if known.len() == records => Ok(Self(known.iter().copied().map(Some).collect())),
            None => Ok(Self(vec![None; records])),
            Some(Interval::OfAll(dt)) => Ok(Self(vec![Some(dt); records])),
            Some(Interval::OfEach(each)) if each.len() == records => Ok(Self(each.into_iter().map(Some).collect())),
            Some(Interval::OfEach(each)) => {
                let expected = format!("one number of seconds, or one for each of the {records} records");
                Err(errors::value("dt", format_args!("expected {expected}, got {}", each.len())))
            }
        }
    }

    fn of(&self, record: usize) -> Option<f64> {
        self.0.get(record).copied().flatten()
    }

    /// The record with its sampling interval.
    fn with<'a>(&self, place: usize, record: Record<'a>) -> PyResult<Record<'a>> {
        self.of(place).map_or(Ok(record), |dt| record.sampled_every(dt).map_err(identification))
    }
}

/// A number of samples: a whole number, or a time such as "2s" or "500ms". Nothing if it is neither.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "checked")]
pub(super) fn duration(name: &str, value: &Bound<'_, PyAny>, dt: Option<f64>) -> PyResult<Option<usize>> {
    let Ok(text) = value.cast::<PyString>() else {
        let whole = !value.is_instance_of::<PyBool>();
        return Ok(value.extract::<usize>().ok().filter(|_| whole));
    };
    let text = text.to_str()?.trim();
    let (number, unit) = match text.strip_suffix("ms") {
        Some(number) => (number, 1e-3),
        None => (text.strip_suffix('s').unwrap_or(""), 1.0),
    };
    let seconds = number.trim().parse::<f64>().ok().map(|number| number * unit);
    let Some(seconds) = seconds.filter(|seconds| (0.0..1e15).contains(seconds)) else {
        let expected = "a number of samples, or a time such as \"2s\" or \"500ms\"";
        return Err(errors::value(name, format_args!("expected {expected}, got \"{text}\"")));
    };
    match dt {
        Some(dt) if dt > 0.0 => Ok(Some((seconds / dt).round() as usize)),
        _ => {
            Err(errors::value(name, format_args!("expected a number of samples where dt is not given, got \"{text}\"")))
        }
    }
}

/// What is held out for validation.
pub(super) enum HeldOut {
    /// A share at the end of every record.
    Share(f64),
    /// What follows from this sample on, in each record or, if it is one number, in every record.
    From(Vec<usize>),
    /// Other records, each with the samples to skip.
    Records(Vec<(Vec<f64>, Vec<f64>, usize)>),
}

impl HeldOut {
    pub(super) fn from_python(validate: &Bound<'_, PyAny>, given: &GivenRecords) -> PyResult<Self> {
        let (records, dt) = (given.signals.len(), &given.dt);
        if let Some(from) = samples(validate, dt)? {
            return match from.len() {
                1 => Ok(Self::From(vec![from[0]; records])),
                count if count == records => Ok(Self::From(from)),
                count => {
                    let expected = format!("one sample, or one for each of the {records} records");
                    Err(errors::value("validate", format_args!("expected {expected}, got {count}")))
                }
            };
        }
        if let Ok(share) = validate.extract::<f64>() {
            return if share > 0.0 && share < 1.0 {
                Ok(Self::Share(share))
            } else {
                Err(errors::value("validate", format_args!("expected a share between 0 and 1, got {share:?}")))
            };
        }
        let one = |validate: &Bound<'_, PyAny>| {
            let wrong = |_| wrong_type("validate", EXPECTED);
            let three: PyResult<(Bound<'_, PyAny>, Bound<'_, PyAny>, Bound<'_, PyAny>)> = validate.extract();
            let (u, y, skip) = match three {
                Ok((u, y, skip)) => {
                    (u, y, duration("validate", &skip, dt.of(0))?.ok_or_else(|| wrong_type("validate", EXPECTED))?)
                }
                Err(_) => validate.extract().map(|(u, y)| (u, y, 0)).map_err(wrong)?,
            };
            let part = |shown, signal| numbers(Place::part("validate", shown), signal);
            Ok((part("validate: u", &u)?, part("validate: y", &y)?, skip))
        };
        if validate.cast::<PyTuple>().is_ok() {
            return Ok(Self::Records(vec![one(validate)?]));
        }
        let records: Vec<Bound<'_, PyAny>> = validate.extract().map_err(|_| wrong_type("validate", EXPECTED))?;
        Ok(Self::Records(records.iter().map(one).collect::<PyResult<_>>()?))
    }

    /// Whether they are judged with the output offset of the record whose end they are.
    pub(super) fn has_own_offsets(&self) -> bool {
        !matches!(self, Self::Records(_))
    }

    /// Where the held-out part of record number `place`, of so many samples, begins.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a share")]
    fn begins(&self, place: usize, samples: usize) -> usize {
        match self {
            Self::From(from) => from[place],
            Self::Share(share) => ((1.0 - share) * samples as f64).round() as usize,
            Self::Records(_) => samples,
        }
    }

    /// The same, if it leaves anything to fit after the samples to skip and anything to hold out.
    fn begins_after(&self, skip: usize, place: usize, samples: usize) -> PyResult<usize> {
        match (self, self.begins(place, samples)) {
            (Self::From(_), begin) if begin <= skip || begin >= samples => {
                let among = if skip > 0 { format!(" after the {skip} skipped ones") } else { String::new() };
                let expected = format!("a sample from 1 to {} of record {place}{among}", samples - 1);
                Err(errors::value("validate", format_args!("expected {expected}, got {begin}")))
            }
            (_, begin) => Ok(begin),
        }
    }

    /// The records to validate with.
    pub(super) fn records<'a>(&'a self, given: &'a GivenRecords) -> PyResult<Vec<Record<'a>>> {
        let GivenRecords { signals: fitted, dt, .. } = given;
        let several = match self {
            Self::Records(records) => records.len() > 1,
            Self::Share(_) | Self::From(_) => fitted.len() > 1,
        };
        let refused = |place, error: RecordError| {
            let error = record(error);
            errors::value("validate", if several { error.in_record(place).to_string() } else { error.to_string() })
        };
        match self {
            Self::Share(_) | Self::From(_) => (fitted.iter().enumerate())
                .map(|(place, (u, y))| {
                    let record = Record::new(u, y, self.begins(place, u.len()));
                    dt.with(place, record.map_err(|error| refused(place, error))?)
                })
                .collect(),
            Self::Records(records) => {
                let record = |(place, (u, y, skip)): (usize, &'a (Vec<f64>, Vec<f64>, usize))| {
                    dt.with(0, Record::new(u, y, *skip).map_err(|error| refused(place, error))?)
                };
                records.iter().enumerate().map(record).collect()
            }
        }
    }
}

/// What `validate` may be.
const EXPECTED: &str = "expected (u, y), (u, y, skip), a list of these, a share, or a sample of each record";

/// One number of samples, or a list of them, if it is that.
fn samples(validate: &Bound<'_, PyAny>, dt: &Intervals) -> PyResult<Option<Vec<usize>>> {
    if let Ok(list) = validate.cast::<PyList>() {
        let each = list.iter().enumerate().map(|(place, one)| duration("validate", &one, dt.of(place)));
        let each: Option<Vec<usize>> = each.collect::<PyResult<Vec<_>>>()?.into_iter().collect();
        return Ok(each.filter(|each| !each.is_empty()));
    }
    if validate.is_instance_of::<PyFloat>() {
        return Ok(None);
    }
    Ok(duration("validate", validate, dt.of(0))?.map(|samples| vec![samples]))
}

/// One record from two arrays, or several from a list of pairs.
fn signals(u: &Bound<'_, PyAny>, y: Option<&Bound<'_, PyAny>>) -> PyResult<Vec<(Vec<f64>, Vec<f64>)>> {
    if let Some(y) = y {
        let signals = vec![(numbers("u", u)?, numbers("y", y)?)];
        return has_room(signals);
    }
    let pairs: Vec<(Bound<'_, PyAny>, Bound<'_, PyAny>)> = u
        .extract()
        .map_err(|_| wrong_type("u", "expected an array with y beside it, or a list of (u, y) pairs alone"))?;
    let copy = |(i, (u, y)): (usize, &(Bound<'_, PyAny>, Bound<'_, PyAny>))| {
        let part = |name, signal| numbers(Place::part(name, &format!("record {i}: {name}")), signal);
        Ok((part("u", u)?, part("y", y)?))
    };
    has_room(pairs.iter().enumerate().map(copy).collect::<PyResult<_>>()?)
}

/// The same signals, if there is memory to fit them.
fn has_room(signals: Vec<(Vec<f64>, Vec<f64>)>) -> PyResult<Vec<(Vec<f64>, Vec<f64>)>> {
    check_room("u", signals.iter().map(|(u, _)| u.len()).sum(), FIT)?;
    Ok(signals)
}

/// When the samples of every record were taken: one array, or a list of one for each record; none where it is not
/// given.
fn times_of(times: Option<&Bound<'_, PyAny>>, records: usize) -> PyResult<Vec<Option<Vec<f64>>>> {
    let Some(times) = times else { return Ok(vec![None; records]) };
    if records == 1
        && let Ok(one) = numbers("times", times)
    {
        return Ok(vec![Some(one)]);
    }
    let expected = format!("one array for each of {records} records");
    let each: Vec<Bound<'_, PyAny>> = times.extract().map_err(|_| unexpected("times", &expected, times))?;
    if each.len() != records {
        return Err(errors::value("times", format_args!("expected {expected}, got {}", each.len())));
    }
    each.iter().map(|one| if one.is_none() { Ok(None) } else { numbers("times", one).map(Some) }).collect()
}

/// The record with the times of its samples, as far as it goes.
fn at_times<'a>(record: Record<'a>, times: Option<&'a Vec<f64>>) -> Result<Record<'a>, RecordError> {
    match times {
        Some(times) => record.at_times(times.get(..record.input().len()).unwrap_or(times)),
        None => Ok(record),
    }
}

/// The leading samples of each record that are not fitted.
fn skips(skip: Option<&Bound<'_, PyAny>>, records: usize, dt: &Intervals) -> PyResult<Vec<usize>> {
    let Some(skip) = skip else { return Ok(vec![0; records]) };
    if duration("skip", skip, dt.of(0)).is_ok_and(|samples| samples.is_some()) || skip.is_instance_of::<PyString>() {
        let each = (0..records).map(|record| Ok(duration("skip", skip, dt.of(record))?.unwrap_or(0)));
        return each.collect();
    }
    let wrong = || {
        let expected = format!("a number of samples, or a list of {records} of them");
        match skip.repr() {
            Ok(got) => errors::value("skip", format_args!("expected {expected}, got {got}")),
            Err(error) => error,
        }
    };
    let each: Vec<Bound<'_, PyAny>> = skip.extract().map_err(|_| wrong())?;
    if each.len() != records {
        return Err(wrong());
    }
    let one = |(record, skip)| duration("skip", skip, dt.of(record))?.ok_or_else(wrong);
    each.iter().enumerate().map(one).collect()
}
