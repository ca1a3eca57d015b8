//! A stage in files: what `save` wrote, a header for C, and the contents of a functional mock-up unit.

use std::path::{Path, PathBuf};

use hysteresis_control::binary::Binary;
use hysteresis_control::{multi_axis, oscillator, stage};
use hysteresis_core::{JsonError, Model, SCHEMA, SCHEMA_SPLIT};
use hysteresis_export::{HeaderOptions, Kind, MockUp, Settings, Source};
use hysteresis_python_macros::{function, methods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyType};

use super::stage::Stage;
use crate::convert::arguments::{two, word};
use crate::convert::errors::{self, raise, unexpected};
use crate::convert::files;
use crate::model::models::object;
use crate::stream::actuators;

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
pub(crate) fn load(py: Python<'_>, path: PathBuf) -> PyResult<Py<PyAny>> {
    loaded(py, &path, &files::read(&path)?)
}

/// The bytes of a file, and no more of them than `load` would read.
#[function]
pub(crate) fn read_bytes<'py>(py: Python<'py>, path: PathBuf) -> PyResult<Bound<'py, PyBytes>> {
    Ok(PyBytes::new(py, &py.detach(|| files::bytes(&path))?))
}

/// As `load`, of a file that was read already: a pipe can be read only once.
#[function]
#[py(-> "Model | Stage")]
pub(crate) fn load_from(py: Python<'_>, path: PathBuf, data: &Bound<'_, PyBytes>) -> PyResult<Py<PyAny>> {
    loaded(py, &path, &files::text(&path, data.as_bytes().to_vec())?)
}

/// Files of other kinds, and what reads them.
const OTHERS: [(&str, &str, &str); 3] = [
    (actuators::SCHEMA, "an array of actuators", "ActuatorArray.load"),
    (multi_axis::SCHEMA, "a stage of several axes", "MultiAxisStage.load"),
    (oscillator::SCHEMA, "an oscillator with hysteresis", "plant.HystereticOscillator.load"),
];

fn loaded(py: Python<'_>, path: &Path, text: &str) -> PyResult<Py<PyAny>> {
    match Model::from_json(text) {
        Ok(model) => object(py, model),
        Err(JsonError::Schema { got: Some(got) }) if got == stage::SCHEMA => {
            let stage = stage::Stage::from_json(text).map_err(|error| errors::file(path, &error))?;
            Ok(Py::new(py, Stage(stage))?.into_any())
        }
        Err(JsonError::Schema { got }) => {
            let other = OTHERS.iter().find(|(schema, ..)| got.as_deref() == Some(*schema));
            let message = if let Some((_, what, reader)) = other {
                format!("expected a stage or a model, got {what}, which `mh.{reader}` reads")
            } else {
                let got = got.map_or("none".to_owned(), |got| format!("{got:?}"));
                format!("schema: expected {:?}, {SCHEMA:?} or {SCHEMA_SPLIT:?}, got {got}", stage::SCHEMA)
            };
            Err(errors::file(path, &message))
        }
        Err(error) => Err(errors::file(path, &error)),
    }
}

#[methods]
impl Stage {
    /// The stage as bytes, which `from_bytes` and the C library read: smaller than its file. Every number is there bit
    /// for bit.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> stage = mh.Stage(mh.paper.table_1(), limits=(-500.0, 500.0))
    /// >>> mh.Stage.from_bytes(stage.to_bytes()) == stage
    /// True
    fn to_bytes<'py>(&self, py: Python<'py>) -> Bound<'py, PyBytes> {
        PyBytes::new(py, &self.0.to_bytes())
    }

    /// The stage that `to_bytes` wrote.
    ///
    /// Raises ValueError for bytes that are cut off, changed, longer, of something else or of another release.
    #[classmethod]
    fn from_bytes(_: &Bound<'_, PyType>, #[py("bytes")] bytes: &Bound<'_, PyAny>) -> PyResult<Self> {
        let bytes = bytes.extract().map_err(|_| unexpected("bytes", "the bytes that `to_bytes` gave", bytes))?;
        stage::Stage::from_bytes(bytes).map(Self).map_err(raise)
    }
}

/// The text of a header of constants: `mpi_hyst.export.c_header` writes it to a file.
#[function]
pub(crate) fn c_header_text(
    stage: Bound<'_, Stage>,
    name: String,
    #[py(= None)] dt: Option<f64>,
    #[py(= None)] sha256: Option<String>,
) -> PyResult<String> {
    let options = HeaderOptions { name: &name, dt, sha256: sha256.as_deref() };
    hysteresis_export::c_header(&stage.get().0, &options).map_err(raise)
}

/// A name of C made of any text: letters, digits and underscores, no digit first.
#[function]
pub(crate) fn c_name(text: String) -> PyResult<String> {
    Ok(hysteresis_export::c_name(&text))
}

/// The texts of a functional mock-up unit: identifier, description, settings, stage. `mpi_hyst.export.fmu` packs them.
#[function]
pub(crate) fn fmu_texts(
    stage: Bound<'_, Stage>,
    #[py("str")] kind: &Bound<'_, PyAny>,
    name: String,
    dt: f64,
    #[py("str")] feedforward: &Bound<'_, PyAny>,
    #[py("tuple[float, float] | None" = None)] gains: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String, String, String)> {
    let gains = gains.map(|gains| two("gains", "(kp, ki)", gains)).transpose()?;
    let kind = Kind::of(&word("kind", "\"forward\", \"inverse\" or \"controller\"", kind)?).map_err(raise)?;
    let feedforward = Source::of(&word("feedforward", "\"inverse\" or \"preview\"", feedforward)?).map_err(raise)?;
    let settings = Settings { feedforward, gains, ..Settings::new(kind, dt) };
    let unit = MockUp::new(&stage.get().0, &settings, &name).map_err(raise)?;
    Ok((unit.identifier, unit.description, unit.settings, unit.stage))
}
