//! What makes a model a Python value: its hash, and the arguments that make an equal one.

use std::hash::{DefaultHasher, Hash, Hasher};

use hysteresis_core::Offsets;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyTuple};

/// The arguments that make an equal model: positional and by keyword.
pub(crate) type Arguments<'py> = PyResult<(Bound<'py, PyTuple>, Bound<'py, PyDict>)>;

/// Equal models have equal hashes: +0 and -0, which are equal, count as one.
pub(crate) fn hash(values: impl Iterator<Item = f64>) -> u64 {
    let mut hasher = DefaultHasher::new();
    values.for_each(|value| (value + 0.0).to_bits().hash(&mut hasher));
    hasher.finish()
}

pub(crate) fn offset_keywords(py: Python<'_>, offsets: Offsets) -> PyResult<Bound<'_, PyDict>> {
    let keywords = PyDict::new(py);
    keywords.set_item("input_offset", offsets.input)?;
    keywords.set_item("output_offset", offsets.output)?;
    Ok(keywords)
}
