//! Model files.

use std::path::PathBuf;

use hysteresis_core::Model;
use pyo3::prelude::*;

use super::object::object;
use crate::convert::{errors, files};

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
    let text = files::read(&path)?;
    object(py, Model::from_json(&text).map_err(|error| errors::json(&path.display().to_string(), &error))?)
}
