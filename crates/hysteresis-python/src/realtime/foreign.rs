//! Input and output by a Python object: slower, as each call takes the interpreter.

use hysteresis_realtime::io::{Fault, Io};
use pyo3::prelude::*;

use crate::convert::errors::{self, Place, not_converted, unexpected};
use crate::plant::foreign::stated_limits;

/// The methods `read` and `write` of an object, and the first exception that one of them raised.
pub(super) struct ForeignIo {
    read: Py<PyAny>,
    write: Py<PyAny>,
    pub(super) raised: Option<PyErr>,
}

impl ForeignIo {
    /// Refuses limits that the object states and that the `drive` of the controller may leave.
    pub(super) fn new(object: &Bound<'_, PyAny>, drive: (f64, f64)) -> PyResult<Self> {
        let method = |name| object.getattr_opt(name).map(|found| found.filter(PyAnyMethods::is_callable));
        let (Some(read), Some(write)) = (method("read")?, method("write")?) else {
            let expected = "a Plant, Functions, Udp, SharedMemory, or an object with read() and write(drive)";
            return Err(unexpected("io", expected, object));
        };
        let stated = object.getattr_opt("limits")?.filter(|limits| !limits.is_none() && !limits.is_callable());
        if let Some(limits) = stated {
            let place = Place::part("io", "io.limits");
            let (low, high) = stated_limits(place, &limits)?;
            if drive.0 < low || drive.1 > high {
                let expected = format_args!("expected limits that hold those of the controller, {drive:?}");
                return Err(errors::value(place, format_args!("{expected}, got ({low:?}, {high:?})")));
            }
        }
        Ok(Self { read: read.unbind(), write: write.unbind(), raised: None })
    }

    fn attached<T>(&mut self, call: impl FnOnce(&Self, Python<'_>) -> PyResult<T>) -> Result<T, Fault> {
        Python::attach(|py| call(self, py)).map_err(|error| {
            self.raised.get_or_insert(error);
            Fault::Raised
        })
    }
}

impl Io for ForeignIo {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        self.attached(|io, py| {
            let read = io.read.bind(py).call0()?;
            let place = Place::part("io", "io.read");
            read.extract().map_err(|error| not_converted(place, "a number or None", &read, error))
        })
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.attached(|io, py| io.write.call1(py, (drive,)).map(drop))
    }
}
