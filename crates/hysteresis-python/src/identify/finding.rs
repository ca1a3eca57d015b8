//! What diagnostics find.

use hysteresis_identify as identification;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convert::pickling::result_methods;

/// What makes records or a result doubtful: a code, a sentence, a number with the limit that it passed, and what to do.
#[pyclass(module = "mpi_hyst.results", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Finding {
    /// Which finding: one of the names that `diagnose` and `DynamicsIdentification` list.
    code: String,
    /// One sentence with the numbers in it.
    message: String,
    /// The number that was compared.
    value: f64,
    /// What it was compared with.
    limit: f64,
    /// What to do about it.
    hint: String,
    /// The record that shows it most, or None where there is one record only or all count together.
    record: Option<usize>,
}

impl From<identification::Finding> for Finding {
    fn from(found: identification::Finding) -> Self {
        let identification::Finding { code, message, value, limit, hint, record, .. } = found;
        Self { code: code.name().to_owned(), message, value, limit, hint: hint.to_owned(), record }
    }
}

result_methods!(Finding {
    fn __repr__(&self) -> String {
        let Self { code, message, value, limit, record, .. } = self;
        let place = record.map_or_else(String::new, |record| format!("record {record}, "));
        format!("<Finding {code}: {place}value {value:.3}, limit {limit:.3}: {message}>")
    }
});
