//! Files: written whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use hysteresis_core::JsonError;
use pyo3::prelude::*;

use super::errors;

/// Writes text to a file that appears only when it is complete: to a temporary neighbour first, then renamed.
#[pyfunction]
pub(crate) fn write_file(path: PathBuf, text: &str) -> PyResult<()> {
    let shown = path.display().to_string();
    // A link stays a link: what it points to is replaced.
    let path = fs::canonicalize(&path).unwrap_or(path);
    let mut name = path.file_name().unwrap_or_default().to_owned();
    name.push(format!(".{}.tmp", std::process::id()));
    let temporary = path.with_file_name(name);
    let written = fs::write(&temporary, text).and_then(|()| fs::rename(&temporary, &path));
    written.map_err(|error| {
        // Nothing is left behind; that the temporary file may not even exist is no second error.
        let _ = fs::remove_file(&temporary);
        errors::io(&shown, &error)
    })
}

/// The text of a file.
pub(crate) fn read(path: &Path) -> PyResult<String> {
    let shown = path.display().to_string();
    let bytes = fs::read(path).map_err(|error| errors::io(&shown, &error))?;
    String::from_utf8(bytes).map_err(|_| errors::file(path, &JsonError::Syntax("no UTF-8 text".to_owned())))
}
