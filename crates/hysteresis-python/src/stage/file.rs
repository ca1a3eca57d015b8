//! Files of models and stages.

use hysteresis_python_macros::function;
use std::path::{Path, PathBuf};

use hysteresis_control::stage;
use hysteresis_core::{JsonError, Model, SCHEMA, SCHEMA_SPLIT};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use super::object::Stage;
use crate::convert::{arguments, errors, files};
use crate::model::object::object;
use crate::stream::array_file;

/// Reads a stage or a model that `save` wrote.
///
/// Parameters
/// ----------
/// path : str or os.PathLike
///     A JSON file of schema "mpi_hyst/stage/1", "mpi_hyst/model/1" or "mpi_hyst/model/2".
///
/// Returns
/// -------
/// Stage, PrandtlIshlinskii or ModifiedPrandtlIshlinskii
///
/// Raises
/// ------
/// OSError
///     If the file cannot be read.
/// ValueError
///     If it is cut off, of another schema, or holds what no stage or model may have.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh, tempfile, pathlib
/// >>> path = pathlib.Path(tempfile.mkdtemp()) / "stage.json"
/// >>> mh.paper.table_1().save(path)
/// >>> mh.load(path) == mh.paper.table_1()
/// True
#[function]
#[py(-> "Model | Stage")]
pub(crate) fn load(py: Python<'_>, #[py("str | PathLike[str]")] path: &Bound<'_, PyAny>) -> PyResult<Py<PyAny>> {
    let path = arguments::path("path", path)?;
    loaded(py, &path, &files::read(&path)?)
}

/// The bytes of a file, and no more of them than `load` would read.
#[function]
pub(crate) fn read_bytes<'py>(
    py: Python<'py>,
    #[py("str | PathLike[str]")] path: PathBuf,
) -> PyResult<Bound<'py, PyBytes>> {
    Ok(PyBytes::new(py, &py.detach(|| files::bytes(&path))?))
}

/// As `load`, of a file that was read already: a pipe can be read only once.
#[function]
#[py(-> "Model | Stage")]
pub(crate) fn load_from(
    py: Python<'_>,
    #[py("str | PathLike[str]")] path: PathBuf,
    data: &Bound<'_, PyBytes>,
) -> PyResult<Py<PyAny>> {
    loaded(py, &path, &files::text(&path, data.as_bytes().to_vec())?)
}

fn loaded(py: Python<'_>, path: &Path, text: &str) -> PyResult<Py<PyAny>> {
    match Model::from_json(text) {
        Ok(model) => object(py, model),
        Err(JsonError::Schema { got: Some(got) }) if got == stage::SCHEMA => {
            let stage = stage::Stage::from_json(text).map_err(|error| errors::file(path, &error))?;
            Ok(Py::new(py, Stage(stage))?.into_any())
        }
        Err(JsonError::Schema { got: Some(got) }) if got == array_file::SCHEMA => Err(errors::file(
            path,
            &"an array of actuators, which `ActuatorArray.load` reads; expected a stage or a model",
        )),
        Err(JsonError::Schema { got }) => {
            let got = got.map_or("none".to_owned(), |got| format!("{got:?}"));
            let message = format!("schema: expected {:?}, {SCHEMA:?} or {SCHEMA_SPLIT:?}, got {got}", stage::SCHEMA);
            Err(errors::file(path, &message))
        }
        Err(error) => Err(errors::file(path, &error)),
    }
}
