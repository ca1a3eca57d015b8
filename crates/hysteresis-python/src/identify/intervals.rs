//! Sampling intervals of records, and numbers of samples that may be given as a time.

use hysteresis_identify::Record;
use pyo3::prelude::*;
use pyo3::types::{PyBool, PyString};

use crate::convert::errors::{self, identification, unexpected};

/// The sampling interval of every record in seconds, if it is known.
pub(super) struct Intervals(Vec<Option<f64>>);

impl Intervals {
    /// One for all records, or one for each.
    pub(super) fn from_python(dt: Option<&Bound<'_, PyAny>>, records: usize) -> PyResult<Self> {
        let Some(dt) = dt else { return Ok(Self(vec![None; records])) };
        if let Ok(dt) = dt.extract::<f64>() {
            return Ok(Self(vec![Some(dt); records]));
        }
        match dt.extract::<Vec<f64>>() {
            Ok(each) if each.len() == records => Ok(Self(each.into_iter().map(Some).collect())),
            Ok(each) => {
                let expected = format!("one number of seconds, or one for each of the {records} records");
                Err(errors::value("dt", format_args!("expected {expected}, got {}", each.len())))
            }
            Err(_) => Err(unexpected("dt", "a number of seconds, or a list of one for each record", dt)),
        }
    }

    /// Those that are known of every record.
    pub(super) fn known(dt: &[f64]) -> Self {
        Self(dt.iter().copied().map(Some).collect())
    }

    pub(super) fn of(&self, record: usize) -> Option<f64> {
        self.0.get(record).copied().flatten()
    }

    /// That of all records, unless they differ.
    pub(super) fn common(&self) -> Option<f64> {
        let first = self.of(0);
        first.filter(|_| self.0.iter().all(|dt| *dt == first))
    }

    /// The record with its sampling interval.
    pub(super) fn with<'a>(&self, place: usize, record: Record<'a>) -> PyResult<Record<'a>> {
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

/// The sampling interval of a prediction: above 0, and that of the first record where its standard deviation is asked for.
pub(super) fn check_prediction(dt: Option<f64>, return_std: bool) -> PyResult<()> {
    let Some(dt) = dt else { return Ok(()) };
    let expected = if return_std {
        "None beside return_std, which is for the sampling of the first record"
    } else if dt > 0.0 && dt.is_finite() {
        return Ok(());
    } else {
        "a finite number above 0"
    };
    Err(errors::value("dt", format_args!("expected {expected}, got {dt:?}")))
}
