//! What diagnostics find.

use hysteresis_identify as identification;
use pyo3::prelude::*;

/// One thing that `diagnose` found: a name, a sentence, and a number with the limit that it passed.
#[pyclass(module = "mpi_hyst", frozen, get_all)]
pub(crate) struct Finding {
    /// Which defect: one of the names that `diagnose` lists.
    name: &'static str,
    /// One sentence with the numbers in it.
    message: String,
    /// The number that was compared.
    value: f64,
    /// What it was compared with.
    limit: f64,
    /// The record that shows it most, or None where there is one record only or all count together.
    record: Option<usize>,
}

impl From<identification::Finding> for Finding {
    fn from(found: identification::Finding) -> Self {
        let identification::Finding { defect, message, value, limit, record, .. } = found;
        Self { name: defect.name(), message, value, limit, record }
    }
}

#[pymethods]
impl Finding {
    fn __repr__(&self) -> String {
        let Self { name, message, value, limit, record } = self;
        let place = record.map_or_else(String::new, |record| format!("record {record}, "));
        format!("<Finding {name}: {place}value {value:.3}, limit {limit:.3}: {message}>")
    }
}
