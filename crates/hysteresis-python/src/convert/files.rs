//! Files: read here, written by the Python part of the package.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use hysteresis_control::stage::read_file;
use hysteresis_core::JsonError;
use pyo3::intern;
use pyo3::prelude::*;

use super::errors;

/// Writes text to a file that appears only when it is complete.
pub(crate) fn write_file(py: Python<'_>, path: PathBuf, text: &str) -> PyResult<()> {
    let files = py.import(intern!(py, "mpi_hyst._files"))?;
    files.call_method1(intern!(py, "write_file"), (path, text)).map(drop)
}

/// Writes JSON to a file, as lines.
pub(crate) fn write_json(py: Python<'_>, path: PathBuf, mut json: String) -> PyResult<()> {
    json.push('\n');
    write_file(py, path, &json)
}

/// What a file of JSON holds.
pub(crate) fn load<T, E: Display>(path: &Path, from_json: impl FnOnce(&str) -> Result<T, E>) -> PyResult<T> {
    from_json(&read(path)?).map_err(|error| errors::file(path, &error))
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> PyResult<String> {
    text(path, bytes(path)?)
}

/// The bytes of a file.
pub(crate) fn bytes(path: &Path) -> PyResult<Vec<u8>> {
    read_file(path).map_err(|error| errors::io(&path.display().to_string(), &error))
}

/// The text that the bytes of a file are.
pub(crate) fn text(path: &Path, bytes: Vec<u8>) -> PyResult<String> {
    String::from_utf8(bytes).map_err(|_| errors::file(path, &JsonError::Syntax("no UTF-8 text".to_owned())))
}
