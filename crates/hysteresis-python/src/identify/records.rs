//! The records that `identify` is given: to fit, and to hold out for validation.

use hysteresis_identify::{Record, RecordError};
use pyo3::prelude::*;
use pyo3::types::{PyFloat, PyList, PyString, PyTuple};

use super::intervals::{Intervals, duration};
use crate::convert::arrays::numbers;
use crate::convert::arrays::{FIT, check_room};
use crate::convert::errors::{self, Place, one_record, record, unexpected, wrong_type};

/// What is held out for validation.
pub(crate) enum HeldOut {
    /// A share at the end of every record.
    Share(f64),
    /// What follows from this sample on, in each record or, if it is one number, in every record.
    From(Vec<usize>),
    /// Other records, each with the samples to skip.
    Records(Vec<(Vec<f64>, Vec<f64>, usize)>),
}

impl HeldOut {
    pub(crate) fn from_python(validate: &Bound<'_, PyAny>, records: usize, dt: &Intervals) -> PyResult<Self> {
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

    /// Where the held-out part of record number `place`, of so many samples, begins.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a share")]
    pub(crate) fn begins(&self, place: usize, samples: usize) -> usize {
        match self {
            Self::From(from) => from[place],
            Self::Share(share) => ((1.0 - share) * samples as f64).round() as usize,
            Self::Records(_) => samples,
        }
    }

    /// The same, if it leaves anything to fit after the samples to skip and anything to hold out.
    pub(crate) fn begins_after(&self, skip: usize, place: usize, samples: usize) -> PyResult<usize> {
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
    pub(crate) fn records<'a>(&'a self, fitted: &'a Signals, dt: &Intervals) -> PyResult<Vec<Record<'a>>> {
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

pub(crate) type Signals = Vec<(Vec<f64>, Vec<f64>)>;

/// One record from two arrays, or several from a list of pairs.
pub(crate) fn signals(u: &Bound<'_, PyAny>, y: Option<&Bound<'_, PyAny>>) -> PyResult<Signals> {
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
fn has_room(signals: Signals) -> PyResult<Signals> {
    check_room("u", signals.iter().map(|(u, _)| u.len()).sum(), FIT)?;
    Ok(signals)
}

/// When the samples of every record were taken: one array, or a list of one for each record; none where it is not given.
pub(crate) fn times(times: Option<&Bound<'_, PyAny>>, records: usize) -> PyResult<Vec<Option<Vec<f64>>>> {
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
pub(crate) fn at_times<'a>(record: Record<'a>, times: Option<&'a Vec<f64>>) -> Result<Record<'a>, RecordError> {
    match times {
        Some(times) => record.at_times(times.get(..record.input().len()).unwrap_or(times)),
        None => Ok(record),
    }
}

/// The leading samples of each record that are not fitted.
pub(crate) fn skips(skip: Option<&Bound<'_, PyAny>>, records: usize, dt: &Intervals) -> PyResult<Vec<usize>> {
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

/// The records of these signals, or why one is none.
pub(crate) fn checked<'a>(
    signals: &'a Signals,
    skips: Vec<usize>,
    dt: &Intervals,
    times: &'a [Option<Vec<f64>>],
) -> PyResult<Vec<Record<'a>>> {
    (signals.iter().zip(skips).enumerate())
        .map(|(i, ((u, y), skip))| {
            let times = times.get(i).and_then(Option::as_ref);
            let record = Record::new(u, y, skip).and_then(|record| at_times(record, times));
            dt.with(i, record.map_err(|error| one_record(error, (signals.len() > 1).then_some(i)))?)
        })
        .collect()
}
