//! Every error as a Python exception, mapped once.
//!
//! What an argument is refused for is a ValueError or TypeError whose message begins with the name of the argument, and
//! whose attribute `parameter` is that name.

use std::ffi::CString;
use std::fmt::{self, Display};
use std::path::Path;

use hysteresis_control::{sampling, stage};
use hysteresis_core::{self as core, ActuatorError};
use hysteresis_identify::{self as identify, RecordError};
use hysteresis_simulate::plant;
use pyo3::PyTypeInfo;
use pyo3::create_exception;
use pyo3::exceptions::{
    PyMemoryError, PyOSError, PyRuntimeError, PyTypeError, PyUnicodeEncodeError, PyUserWarning, PyValueError,
};
use pyo3::prelude::*;

create_exception!(
    mpi_hyst,
    NotInvertibleError,
    PyValueError,
    "The model's slope may vanish or turn negative, so one output may belong to several inputs.

Examples
--------
>>> import mpi_hyst as mh
>>> falling = mh.PrandtlIshlinskii([1.0, -2.0], [0.0, 1.0])  # the slope turns negative
>>> try:
...     falling.inverse()
... except mh.NotInvertibleError as error:
...     print(\"refused\")
refused"
);

create_exception!(
    mpi_hyst,
    StartError,
    PyValueError,
    "A reference does not begin where the stage is: lead it there, with `lead_in`.

Examples
--------
>>> import mpi_hyst as mh
>>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
>>> try:
...     stage.precompensate([2.0, 2.0], dt=1e-4)  # um, from rest
... except mh.StartError:
...     drive = stage.precompensate([2.0, 2.0], dt=1e-4, lead_in=0.1)
>>> len(drive)
1002"
);

create_exception!(
    mpi_hyst,
    HeldBackWarning,
    PyUserWarning,
    "Limits or the slew rate of a stage held drives back, so it will not follow its reference.

Examples
--------
To be refused such drives rather than warned of them:

>>> import mpi_hyst as mh
>>> import warnings
>>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-50.0, 50.0))
>>> way = mh.signals.triangle(5.0, 1.0, seconds=1.0, rate=1000)  # um: too far
>>> with warnings.catch_warnings():
...     warnings.simplefilter(\"error\", mh.HeldBackWarning)
...     try:
...         drive = stage.precompensate(way, dt=1e-3)
...     except mh.HeldBackWarning:
...         print(\"refused\")
refused"
);

/// Where an argument is wrong: its name, and how a message names the place in it.
#[derive(Clone, Copy)]
pub(crate) struct Place<'a> {
    parameter: &'a str,
    shown: &'a str,
}

impl<'a> Place<'a> {
    /// A part of an argument, such as "record 2: u".
    pub(crate) fn part(parameter: &'a str, shown: &'a str) -> Self {
        Self { parameter, shown }
    }
}

impl Display for Place<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.shown)
    }
}

impl<'a> From<&'a str> for Place<'a> {
    fn from(parameter: &'a str) -> Self {
        Self { parameter, shown: parameter }
    }
}

/// The exception, with the name of the argument as an attribute.
fn with_parameter(error: PyErr, parameter: &str) -> PyErr {
    // An exception without the attribute still tells what is wrong.
    let _ = Python::attach(|py| error.value(py).setattr("parameter", parameter));
    error
}

/// A ValueError about an argument: "name: message".
pub(crate) fn value<'a>(place: impl Into<Place<'a>>, message: impl Display) -> PyErr {
    let Place { parameter, shown } = place.into();
    with_parameter(PyValueError::new_err(format!("{shown}: {message}")), parameter)
}

/// A MemoryError about an argument of so many samples.
pub(crate) fn no_memory<'a>(place: impl Into<Place<'a>>, samples: usize) -> PyErr {
    let Place { parameter, shown } = place.into();
    let message = format!("{shown}: expected samples that fit in memory with what is made of them, got {samples}");
    with_parameter(PyMemoryError::new_err(message), parameter)
}

/// A TypeError about an argument: "name: message".
pub(crate) fn wrong_type<'a>(place: impl Into<Place<'a>>, message: impl Display) -> PyErr {
    let Place { parameter, shown } = place.into();
    with_parameter(PyTypeError::new_err(format!("{shown}: {message}")), parameter)
}

/// A TypeError about an argument that shows what came.
pub(crate) fn unexpected<'a>(place: impl Into<Place<'a>>, expected: impl Display, got: &Bound<'_, PyAny>) -> PyErr {
    match got.repr() {
        Ok(got) => wrong_type(place, format_args!("expected {expected}, got {got}")),
        Err(error) => error,
    }
}

/// What to raise where an argument could not be converted: that it is not what was expected, caused by the TypeError or
/// by the text that cannot be encoded. Whatever else was raised is of the object's own methods, and stays.
#[cold]
pub(crate) fn not_converted<'a>(
    place: impl Into<Place<'a>>,
    expected: impl Display,
    got: &Bound<'_, PyAny>,
    error: PyErr,
) -> PyErr {
    let py = got.py();
    if !(error.is_instance_of::<PyTypeError>(py) || error.is_instance_of::<PyUnicodeEncodeError>(py)) {
        return error;
    }
    let refused = unexpected(place, expected, got);
    refused.set_cause(py, Some(error));
    refused
}

/// An object or array that a call uses which has not returned: of another thread, or of a function that this call
/// calls.
pub(crate) fn in_use(what: impl Display) -> PyErr {
    PyRuntimeError::new_err(format!("{what} is in use by a call that has not returned"))
}

/// A UserWarning, which shows the line that calls: compiled functions have no frame of their own.
pub(crate) fn warn(py: Python<'_>, message: &str) -> PyResult<()> {
    warn_of::<PyUserWarning>(py, message)
}

/// A HeldBackWarning that says of how many drives which limit held back so many.
pub(crate) fn warn_held_back(py: Python<'_>, count: u64, drives: usize, by: impl Display) -> PyResult<()> {
    if count == 0 {
        return Ok(());
    }
    warn_of::<HeldBackWarning>(py, &format!("reference: {count} of {drives} drives were held back by {by}"))
}

fn warn_of<W: PyTypeInfo>(py: Python<'_>, message: &str) -> PyResult<()> {
    PyErr::warn(py, &py.get_type::<W>(), &CString::new(message)?, 1)
}

/// The exception of a refusal.
#[derive(Clone, Copy)]
pub(crate) enum Kind {
    Value,
    NotInvertible,
    Start,
    NoMemory,
}

/// What the crates refuse.
pub(crate) trait Refusal: Display {
    /// The name of the Python argument, if it is about one.
    fn parameter(&self) -> Option<&str>;

    /// Which exception it is.
    fn kind(&self) -> Kind {
        Kind::Value
    }
}

/// An error of the crates as an exception.
pub(crate) fn raise(error: impl Refusal) -> PyErr {
    let message = error.to_string();
    let exception = match error.kind() {
        Kind::Value => PyValueError::new_err(message),
        Kind::NotInvertible => NotInvertibleError::new_err(message),
        Kind::Start => StartError::new_err(message),
        Kind::NoMemory => PyMemoryError::new_err(message),
    };
    match error.parameter() {
        Some(parameter) => with_parameter(exception, parameter),
        None => exception,
    }
}

impl Refusal for core::Error {
    fn parameter(&self) -> Option<&str> {
        core::Error::parameter(self)
    }

    fn kind(&self) -> Kind {
        if let Self::NotInvertible { .. } = self { Kind::NotInvertible } else { Kind::Value }
    }
}

impl<E: Refusal> Refusal for ActuatorError<E> {
    fn parameter(&self) -> Option<&str> {
        self.error.parameter()
    }

    fn kind(&self) -> Kind {
        self.error.kind()
    }
}

impl Refusal for sampling::Error {
    fn parameter(&self) -> Option<&str> {
        Some(sampling::Error::parameter(self))
    }

    fn kind(&self) -> Kind {
        if let Self::OutOfMemory { .. } = self { Kind::NoMemory } else { Kind::Value }
    }
}

impl Refusal for stage::Error {
    fn parameter(&self) -> Option<&str> {
        stage::Error::parameter(self)
    }

    fn kind(&self) -> Kind {
        match self {
            Self::Core(error) => error.kind(),
            Self::Start { .. } => Kind::Start,
            _ => Kind::Value,
        }
    }
}

impl Refusal for hysteresis_export::Error {
    fn parameter(&self) -> Option<&str> {
        hysteresis_export::Error::parameter(self)
    }

    fn kind(&self) -> Kind {
        if let Self::Stage(error) = self { error.kind() } else { Kind::Value }
    }
}

impl Refusal for plant::Error {
    fn parameter(&self) -> Option<&str> {
        plant::Error::parameter(self)
    }
}

impl Refusal for RecordError {
    fn parameter(&self) -> Option<&str> {
        Some(RecordError::parameter(self))
    }
}

impl Refusal for identify::Error {
    fn parameter(&self) -> Option<&str> {
        identify::Error::parameter(self)
    }

    fn kind(&self) -> Kind {
        if let Self::Core(error) = self { error.kind() } else { Kind::Value }
    }
}

/// The signals of a record as Python calls them: u and y.
fn signal(argument: &'static str) -> &'static str {
    match argument {
        "input" => "u",
        "output" => "y",
        other => other,
    }
}

/// An error about the signals `u` and `y`, by these names.
pub(crate) fn record(error: RecordError) -> RecordError {
    error.renamed(signal)
}

/// An error about records whose signals are called `u` and `y`.
pub(crate) fn identification(error: identify::Error) -> PyErr {
    match error {
        identify::Error::Record { record, error } => {
            raise(identify::Error::Record { record, error: self::record(error) })
        }
        error => raise(error),
    }
}

/// An error of a call with so many records: with the place of the record if there are several.
pub(crate) fn of_records(error: identify::Error, records: usize) -> PyErr {
    match error {
        identify::Error::Record { record, error } => one_record(error, (records > 1).then_some(record)),
        error => raise(error),
    }
}

/// An error about one record, with its place if there are several.
pub(crate) fn one_record(error: RecordError, place: Option<usize>) -> PyErr {
    match place {
        Some(place) => identification(error.in_record(place)),
        None => raise(record(error)),
    }
}

/// A file that is not what it should be.
pub(crate) fn file(path: &Path, error: &impl Display) -> PyErr {
    PyValueError::new_err(format!("{}: {error}", path.display()))
}

/// A file that cannot be read or written, with its name.
pub(crate) fn io(path: &str, error: &std::io::Error) -> PyErr {
    match error.raw_os_error() {
        // Python picks the subclass (FileNotFoundError and so on) by the number.
        Some(number) => PyOSError::new_err((number, message(error), path.to_owned())),
        None => PyOSError::new_err(format!("{path}: {error}")),
    }
}

/// The operating system's words without Rust's " (os error 2)".
fn message(error: &std::io::Error) -> String {
    let text = error.to_string();
    text.split(" (os error").next().unwrap_or_default().to_owned()
}
