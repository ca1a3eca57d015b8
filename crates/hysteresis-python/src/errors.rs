//! Every error of the workspace as a Python exception, mapped once.

use hysteresis_core::{ActuatorError, Error, JsonError};
use hysteresis_simulate::plant;
use pyo3::create_exception;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::prelude::*;

create_exception!(
    mpi_hyst,
    NotInvertibleError,
    PyValueError,
    "The model's slope may vanish or turn negative, so an output does not tell its input."
);

/// An error of the core.
pub(crate) fn core(error: Error) -> PyErr {
    match error {
        Error::NotInvertible { .. } => NotInvertibleError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// An error of the core about one actuator of an array.
pub(crate) fn actuator(error: ActuatorError) -> PyErr {
    match error.error {
        Error::NotInvertible { .. } => NotInvertibleError::new_err(error.to_string()),
        _ => PyValueError::new_err(error.to_string()),
    }
}

/// A plant that cannot be.
pub(crate) fn plant(error: plant::Error) -> PyErr {
    PyValueError::new_err(error.to_string())
}

/// A model file that is none.
pub(crate) fn json(path: &str, error: &JsonError) -> PyErr {
    PyValueError::new_err(format!("{path}: {error}"))
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
