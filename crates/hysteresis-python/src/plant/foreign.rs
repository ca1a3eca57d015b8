//! Plants of the user: any Python object that can be read and written to.

use std::fmt;

use hysteresis_core::is_admissible;
use hysteresis_simulate::driven::{Driven, DrivenAxes, Reading};
use numpy::PyArray1;
use numpy::ndarray::Ix2;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::intern;
use pyo3::prelude::*;

use crate::convert::arguments::pair;
use crate::convert::arrays::{array, numbers};
use crate::convert::errors::{self, Place, unexpected};

/// An object with read() and write(drive), and what else it shows.
pub(crate) struct ForeignPlant<'a, 'py> {
    object: &'a Bound<'py, PyAny>,
    read: Bound<'py, PyAny>,
    write: Bound<'py, PyAny>,
    /// Whether it has attributes `position` and `drive`.
    shows: [bool; 2],
    limits: Vec<(f64, f64)>,
}

/// An object that reads and writes a number for each axis.
pub(crate) struct ForeignAxes<'a, 'py> {
    pub(crate) plant: ForeignPlant<'a, 'py>,
    pub(crate) axes: usize,
}

/// The moment of a reading or a drive, for messages.
struct At(Option<usize>);

impl fmt::Display for At {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(k) => write!(f, "at sample {k}"),
            None => f.write_str("before sample 0, while the window of the preview fills"),
        }
    }
}

/// A part of the argument `plant`.
fn part(shown: &str) -> Place<'_> {
    Place::part("plant", shown)
}

/// The number that `shown` gave. What the object's own conversion raises passes through.
fn number(value: &Bound<'_, PyAny>, shown: &str, at: &At) -> PyResult<f64> {
    value.extract().map_err(|error: PyErr| {
        let is_no_number = error.is_instance_of::<PyTypeError>(value.py());
        if is_no_number { unexpected(part(shown), format_args!("a number {at}"), value) } else { error }
    })
}

/// Refuses a drive that is not finite, or outside the limits that the object states: nobody knows what it would do with
/// it.
fn check_drive(drive: f64, limits: Option<(f64, f64)>, at: &At) -> PyResult<()> {
    let place = || Place::part("controller", "controller.step");
    match limits {
        _ if !is_admissible(drive) => {
            Err(errors::value(place(), format_args!("expected a finite number {at}, got {drive:?}")))
        }
        Some((low, high)) if drive < low || drive > high => {
            let expected = format_args!("expected a drive from {low:?} to {high:?} {at}, got {drive:?}");
            Err(errors::value(place(), expected))
        }
        _ => Ok(()),
    }
}

/// Refuses a drive that the object shows and that cannot be.
fn check_put_out(drive: f64, at: &At) -> PyResult<f64> {
    if is_admissible(drive) {
        return Ok(drive);
    }
    Err(errors::value(part("plant.drive"), format_args!("expected a finite number {at}, got {drive:?}")))
}

/// The limits that an object states.
pub(crate) fn stated_limits(place: Place<'_>, limits: &Bound<'_, PyAny>) -> PyResult<(f64, f64)> {
    let Ok((low, high)) = pair("limits", limits) else {
        return Err(unexpected(place, "two numbers (low, high) or None", limits));
    };
    if low < high {
        return Ok((low, high));
    }
    Err(errors::value(place, format_args!("expected (low, high) with low below high, got ({low:?}, {high:?})")))
}

impl<'a, 'py> ForeignPlant<'a, 'py> {
    /// Looks at what the object has, without reading or writing.
    pub(crate) fn new(object: &'a Bound<'py, PyAny>) -> PyResult<Self> {
        let py = object.py();
        let method = |name| object.getattr_opt(name).map(|found| found.filter(PyAnyMethods::is_callable));
        let (Some(read), Some(write)) = (method(intern!(py, "read"))?, method(intern!(py, "write"))?) else {
            return Err(unexpected("plant", "a Plant, or an object with read() and write(drive)", object));
        };
        // Many drivers of hardware have methods of these names.
        let shown = |name| {
            let found = object.getattr_opt(name)?;
            Ok::<_, PyErr>(found.is_some_and(|value| !value.is_none() && !value.is_callable()))
        };
        let shows = [shown(intern!(py, "position"))?, shown(intern!(py, "drive"))?];
        Ok(Self { object, read, write, shows, limits: Vec::new() })
    }

    /// With its limits, as far as it has any.
    pub(crate) fn with_limits(self) -> PyResult<Self> {
        let Some(limits) = self.attribute("limits")? else { return Ok(self) };
        Ok(Self { limits: vec![stated_limits(part("plant.limits"), &limits)?], ..self })
    }

    /// An attribute that is there and not None.
    fn attribute(&self, name: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        Ok(self.object.getattr_opt(name)?.filter(|value| !value.is_none()))
    }

    /// Its sampling interval, if it has one.
    pub(crate) fn dt(&self) -> PyResult<Option<f64>> {
        let Some(dt) = self.attribute("dt")? else { return Ok(None) };
        match dt.extract() {
            Ok(seconds) if is_admissible(seconds) && seconds > 0.0 => Ok(Some(seconds)),
            _ => Err(unexpected(part("plant.dt"), "a number of seconds above 0, or None", &dt)),
        }
    }
}

impl Driven<PyErr> for ForeignPlant<'_, '_> {
    const WRITE_MAY_FAIL: bool = true;

    fn read(&mut self, sample: Option<usize>) -> PyResult<Reading> {
        let (py, at) = (self.object.py(), At(sample));
        let measured = number(&self.read.call0()?, "plant.read", &at)?;
        let position = match self.shows {
            [true, _] => number(&self.object.getattr(intern!(py, "position"))?, "plant.position", &at)?,
            _ => measured,
        };
        Ok(Reading { measured, position })
    }

    fn write(&mut self, sample: Option<usize>, drive: f64) -> PyResult<()> {
        check_drive(drive, self.limits(), &At(sample))?;
        self.write.call1((drive,)).map(drop)
    }

    fn put_out(&mut self, sample: Option<usize>, drive: f64) -> PyResult<f64> {
        let (py, at) = (self.object.py(), At(sample));
        match self.shows {
            [_, true] => {
                let put_out = number(&self.object.getattr(intern!(py, "drive"))?, "plant.drive", &at)?;
                check_put_out(put_out, &at)
            }
            _ => Ok(drive),
        }
    }

    fn limits(&self) -> Option<(f64, f64)> {
        self.limits.first().copied()
    }
}

impl<'a, 'py> ForeignAxes<'a, 'py> {
    /// An object for so many axes, with its limits as far as it has any.
    pub(crate) fn new(object: &'a Bound<'py, PyAny>, axes: usize) -> PyResult<Self> {
        let mut plant = ForeignPlant::new(object)?;
        if let Some(limits) = plant.attribute("limits")? {
            let expected = format!("an array of shape ({axes}, 2) or None");
            let rows = array::<Ix2>(part("plant.limits"), &limits, format_args!("{expected}"))?;
            let rows = rows.as_array();
            if rows.dim() != (axes, 2) || !rows.rows().into_iter().all(|row| row[0] < row[1]) {
                return Err(unexpected(part("plant.limits"), format_args!("{expected}, low below high"), &limits));
            }
            plant.limits = rows.rows().into_iter().map(|row| (row[0], row[1])).collect();
        }
        Ok(Self { plant, axes })
    }

    /// The numbers that `shown` gave, one for each axis.
    fn fill(&self, into: &mut [f64], value: &Bound<'py, PyAny>, shown: &str, at: &At) -> PyResult<()> {
        let py = value.py();
        let wrong = || unexpected(part(shown), format_args!("{} numbers {at}", self.axes), value);
        let found = numbers(part(shown), value).map_err(|error| {
            let is_about_it = error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyValueError>(py);
            if is_about_it { wrong() } else { error }
        })?;
        if found.len() != self.axes {
            return Err(wrong());
        }
        into.copy_from_slice(&found);
        Ok(())
    }
}

impl DrivenAxes<PyErr> for ForeignAxes<'_, '_> {
    const WRITE_MAY_FAIL: bool = true;

    fn read(&mut self, sample: Option<usize>, measured: &mut [f64], position: &mut [f64]) -> PyResult<()> {
        let (py, at) = (self.plant.object.py(), At(sample));
        self.fill(measured, &self.plant.read.call0()?, "plant.read", &at)?;
        if self.plant.shows[0] {
            let shown = self.plant.object.getattr(intern!(py, "position"))?;
            self.fill(position, &shown, "plant.position", &at)
        } else {
            position.copy_from_slice(measured);
            Ok(())
        }
    }

    fn write(&mut self, sample: Option<usize>, drives: &[f64]) -> PyResult<()> {
        let (py, at) = (self.plant.object.py(), At(sample));
        let actuators = drives.iter().enumerate();
        actuators.into_iter().try_for_each(|(i, drive)| check_drive(*drive, self.limits(i), &at))?;
        self.plant.write.call1((PyArray1::from_slice(py, drives),)).map(drop)
    }

    fn put_out(&mut self, sample: Option<usize>, drives: &[f64], put_out: &mut [f64]) -> PyResult<()> {
        let (py, at) = (self.plant.object.py(), At(sample));
        if self.plant.shows[1] {
            let shown = self.plant.object.getattr(intern!(py, "drive"))?;
            self.fill(put_out, &shown, "plant.drive", &at)?;
            put_out.iter().try_for_each(|drive| check_put_out(*drive, &at).map(drop))
        } else {
            put_out.copy_from_slice(drives);
            Ok(())
        }
    }

    fn limits(&self, actuator: usize) -> Option<(f64, f64)> {
        self.plant.limits.get(actuator).copied()
    }
}
