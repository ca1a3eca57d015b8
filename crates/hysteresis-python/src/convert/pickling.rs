//! What pickle and deepcopy make an object of: a call that makes one like it, and the state from which it goes on.

use hysteresis_control::binary::Binary;
use hysteresis_python_macros::methods;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple, PyType};
use pythonize::{depythonize, pythonize};
use serde::Deserialize;

use super::errors::value;
use crate::control::terms::ControllerTerms;
use crate::control::tuning::Margins;
use crate::identify::comparison::{ComparedModel, Comparison};
use crate::identify::finding::Finding;
use crate::identify::identification::Identification;
use crate::identify::left_out::LeftOutLoop;
use crate::identify::many_result::ManyIdentifications;
use crate::identify::quality::Quality;
use crate::plant::run::Metrics;
use crate::realtime::report::{LoopReport, LoopTimes};
use crate::signal::excitation::Excitation;
use crate::signal::experiment::{ExperimentPart, ExperimentSegment};

/// What `__reduce__` returns.
pub(crate) type Reduced<'py> = PyResult<Bound<'py, PyTuple>>;

/// The call `make(*positional, **keywords)`, and then `__setstate__(state)` if there is one.
pub(crate) fn reduce<'py>(
    make: Bound<'py, PyAny>,
    positional: impl IntoPyObject<'py, Target = PyTuple, Output = Bound<'py, PyTuple>, Error: Into<PyErr>>,
    keywords: Bound<'py, PyDict>,
    state: Option<Bound<'py, PyAny>>,
) -> Reduced<'py> {
    let py = make.py();
    let make = if keywords.is_empty() {
        make
    } else {
        py.import(intern!(py, "functools"))?.call_method(intern!(py, "partial"), (make,), Some(&keywords))?
    };
    let positional = positional.into_pyobject(py).map_err(Into::into)?;
    (make, positional, state).into_pyobject(py)
}

/// A saved state from a dictionary.
pub(crate) fn saved<T: for<'de> Deserialize<'de>>(state: &Bound<'_, PyAny>) -> PyResult<T> {
    depythonize(state).map_err(|error| value("state", format_args!("expected what .state returned; {error}")))
}

/// A saved state from a dictionary, or from its bytes.
pub(crate) fn saved_or_bytes<T: Binary + for<'de> Deserialize<'de>>(state: &Bound<'_, PyAny>) -> PyResult<T> {
    bytes_of(state).unwrap_or_else(|| saved(state))
}

/// A saved state from its bytes, if it is bytes.
pub(crate) fn bytes_of<T: Binary>(state: &Bound<'_, PyAny>) -> Option<PyResult<T>> {
    let bytes = state.cast::<PyBytes>().ok()?;
    Some(T::from_bytes(bytes.as_bytes()).map_err(|error| value("state", error)))
}

/// Keyword arguments by their names: `keywords!(py, offset = 0.0, period = None)`.
macro_rules! keywords {
    ($py:expr $(, $name:ident = $value:expr)* $(,)?) => {{
        let keywords = pyo3::types::PyDict::new($py);
        $(keywords.set_item(stringify!($name), $value)?;)*
        keywords
    }};
}

pub(crate) use keywords;

// Results, frozen classes of plain values, are pickled by serde.
#[methods(
    ComparedModel,
    Comparison,
    ControllerTerms,
    Excitation,
    ExperimentPart,
    ExperimentSegment,
    Finding,
    Identification,
    LeftOutLoop,
    LoopReport,
    LoopTimes,
    ManyIdentifications,
    Margins,
    Metrics,
    Quality
)]
impl Each {
    #[classmethod]
    fn _restored(_: &Bound<'_, PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
        Ok(depythonize(values)?)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        reduce(make, (pythonize(py, self)?,), keywords!(py), None)
    }
}
