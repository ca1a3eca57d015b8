//! Files: written whole or not at all.

use std::fs;
use std::path::{Path, PathBuf};

use hysteresis_core::{JsonError, Model};
use pyo3::prelude::*;

use crate::errors;
use crate::models;

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

/// Reads a model that `save` wrote.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     A JSON file of schema "mpi_hyst/model/1".
///
/// Returns
/// -------
/// PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///
/// Raises
/// ------
/// OSError
///     If the file cannot be read.
/// ValueError
///     If it is cut off, of another schema, or holds what no model may have.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh, tempfile, pathlib
/// >>> path = pathlib.Path(tempfile.mkdtemp()) / "stage.json"
/// >>> mh.paper.table_1().save(path)
/// >>> mh.load(path) == mh.paper.table_1()
/// True
#[pyfunction]
pub(crate) fn load(py: Python<'_>, path: PathBuf) -> PyResult<Py<PyAny>> {
    let text = read(&path)?;
    models::object(py, Model::from_json(&text).map_err(|error| errors::json(&path.display().to_string(), &error))?)
}

fn read(path: &Path) -> PyResult<String> {
    let shown = path.display().to_string();
    let bytes = fs::read(path).map_err(|error| errors::io(&shown, &error))?;
    String::from_utf8(bytes).map_err(|_| errors::json(&shown, &JsonError::Syntax("no UTF-8 text".to_owned())))
}
