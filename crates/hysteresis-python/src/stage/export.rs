//! A stage for other tools: as bytes, as a header for C, and the contents of a functional mock-up unit.

use hysteresis_control::binary::Binary;
use hysteresis_control::stage;
use hysteresis_export::{HeaderOptions, Kind, MockUp, Settings, Source};
use hysteresis_python_macros::{function, methods};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyType};

use super::object::Stage;
use crate::convert::arguments::{two, word};
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::instance;

#[methods]
impl Stage {
    /// The stage as bytes, which `from_bytes` and the C library read: smaller than its file. Every number is there bit for bit.
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
    #[py("Stage")] stage: &Bound<'_, PyAny>,
    #[py("str")] name: &Bound<'_, PyAny>,
    #[py(= None)] dt: Option<f64>,
    #[py(= None)] sha256: Option<String>,
) -> PyResult<String> {
    let (stage, name) = (instance::<Stage>("stage", "a mh.Stage", stage)?, &word("name", "a text", name)?);
    hysteresis_export::c_header(&stage.get().0, &HeaderOptions { name, dt, sha256: sha256.as_deref() }).map_err(raise)
}

/// A name of C made of any text: letters, digits and underscores, no digit first.
#[function]
pub(crate) fn c_name(text: String) -> PyResult<String> {
    Ok(hysteresis_export::c_name(&text))
}

/// The texts of a functional mock-up unit: identifier, description, settings, stage. `mpi_hyst.export.fmu` packs them.
#[function]
pub(crate) fn fmu_texts(
    #[py("Stage")] stage: &Bound<'_, PyAny>,
    #[py("str")] kind: &Bound<'_, PyAny>,
    #[py("str")] name: &Bound<'_, PyAny>,
    dt: f64,
    #[py("str")] feedforward: &Bound<'_, PyAny>,
    #[py("tuple[float, float] | None" = None)] gains: Option<&Bound<'_, PyAny>>,
) -> PyResult<(String, String, String, String)> {
    let gains = gains.map(|gains| two("gains", "(kp, ki)", gains)).transpose()?;
    let kind = Kind::of(&word("kind", "\"forward\", \"inverse\" or \"controller\"", kind)?).map_err(raise)?;
    let feedforward = Source::of(&word("feedforward", "\"inverse\" or \"preview\"", feedforward)?).map_err(raise)?;
    let name = word("name", "a text", name)?;
    let settings = Settings { feedforward, gains, ..Settings::new(kind, dt) };
    let stage = instance::<Stage>("stage", "a mh.Stage", stage)?;
    let unit = MockUp::new(&stage.get().0, &settings, &name).map_err(raise)?;
    Ok((unit.identifier, unit.description, unit.settings, unit.stage))
}
