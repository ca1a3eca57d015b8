//! The records that `identify` is given: to fit, and to hold out for validation.

use hysteresis_identify::{Record, RecordError};
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::arrays::vector;
use crate::identify::named;

/// What is held out for validation.
pub(crate) enum HeldOut {
    /// A share at the end of every record.
    Share(f64),
    /// Other records, each with the samples to skip.
    Records(Vec<(Vec<f64>, Vec<f64>, usize)>),
}

impl HeldOut {
    pub(crate) fn from_python(validate: &Bound<'_, PyAny>) -> PyResult<Self> {
        if let Ok(share) = validate.extract::<f64>() {
            return if share > 0.0 && share < 1.0 {
                Ok(Self::Share(share))
            } else {
                Err(PyValueError::new_err(format!("validate: expected a share between 0 and 1, got {share:?}")))
            };
        }
        let one = |validate: &Bound<'_, PyAny>| {
            let wrong =
                |_| PyTypeError::new_err("validate: expected (u, y), (u, y, skip), a list of these, or a share");
            let three: PyResult<(Bound<'_, PyAny>, Bound<'_, PyAny>, usize)> = validate.extract();
            let two = || validate.extract().map(|(u, y)| (u, y, 0)).map_err(wrong);
            let (u, y, skip) = three.or_else(|_| two())?;
            let (u, y) = (vector("validate: u", &u)?, vector("validate: y", &y)?);
            Ok((u.as_slice()?.to_vec(), y.as_slice()?.to_vec(), skip))
        };
        if validate.cast::<PyTuple>().is_ok() {
            return Ok(Self::Records(vec![one(validate)?]));
        }
        let records: Vec<Bound<'_, PyAny>> = validate.extract().map_err(|_| {
            PyTypeError::new_err("validate: expected (u, y), (u, y, skip), a list of these, or a share")
        })?;
        Ok(Self::Records(records.iter().map(one).collect::<PyResult<_>>()?))
    }

    /// Where the held-out part of a record of so many samples begins.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "a share")]
    pub(crate) fn begins(&self, samples: usize) -> usize {
        match self {
            Self::Share(share) => ((1.0 - share) * samples as f64).round() as usize,
            Self::Records(_) => samples,
        }
    }

    /// The records to validate with.
    pub(crate) fn records<'a>(&'a self, fitted: &'a Signals) -> PyResult<Vec<Record<'a>>> {
        let refused = |error: RecordError| PyValueError::new_err(format!("validate: {}", named(&error.to_string())));
        match self {
            Self::Share(_) => {
                fitted.iter().map(|(u, y)| Record::new(u, y, self.begins(u.len())).map_err(refused)).collect()
            }
            Self::Records(records) => {
                records.iter().map(|(u, y, skip)| Record::new(u, y, *skip).map_err(refused)).collect()
            }
        }
    }
}

pub(crate) type Signals = Vec<(Vec<f64>, Vec<f64>)>;

/// One record from two arrays, or several from a list of pairs.
pub(crate) fn signals(u: &Bound<'_, PyAny>, y: Option<&Bound<'_, PyAny>>) -> PyResult<Signals> {
    if let Some(y) = y {
        return Ok(vec![(vector("u", u)?.as_slice()?.to_vec(), vector("y", y)?.as_slice()?.to_vec())]);
    }
    let pairs: Vec<(Bound<'_, PyAny>, Bound<'_, PyAny>)> = u
        .extract()
        .map_err(|_| PyTypeError::new_err("u: expected an array with y beside it, or a list of (u, y) pairs alone"))?;
    let copy = |(i, (u, y)): (usize, &(Bound<'_, PyAny>, Bound<'_, PyAny>))| {
        let (u, y) = (vector(&format!("record {i}: u"), u)?, vector(&format!("record {i}: y"), y)?);
        Ok((u.as_slice()?.to_vec(), y.as_slice()?.to_vec()))
    };
    pairs.iter().enumerate().map(copy).collect()
}

pub(crate) fn skips(skip: Option<&Bound<'_, PyAny>>, records: usize) -> PyResult<Vec<usize>> {
    let Some(skip) = skip else { return Ok(vec![0; records]) };
    if let Ok(all) = skip.extract::<usize>() {
        return Ok(vec![all; records]);
    }
    match skip.extract::<Vec<usize>>() {
        Ok(each) if each.len() == records => Ok(each),
        _ => Err(PyValueError::new_err(format!(
            "skip: expected a number of samples, or a list of {records} of them, got {}",
            skip.repr()?
        ))),
    }
}
