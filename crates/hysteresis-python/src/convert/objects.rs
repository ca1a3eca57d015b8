//! Borrowing of objects, after all arguments were converted.
//!
//! A conversion may run Python code and let other threads run: what they would find borrowed would raise for no fault
//! of theirs. So a method that converts takes `slf: &Bound<Self>`, converts, and borrows then.

use std::hash::{DefaultHasher, Hash, Hasher};

use hysteresis_control::binary::Binary;
use pyo3::prelude::*;
use pyo3::pyclass::boolean_struct::False;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pyo3::{PyClass, intern};
use pythonize::depythonize;
use serde::Deserialize;

use crate::convert::errors::{in_use, unexpected, value};

/// The object to read from.
pub(crate) fn shared<'py, C: PyClass>(object: &Bound<'py, C>) -> PyResult<PyRef<'py, C>> {
    object.try_borrow().map_err(|_| busy(object))
}

/// The object to change.
pub(crate) fn exclusive<'py, C: PyClass<Frozen = False>>(object: &Bound<'py, C>) -> PyResult<PyRefMut<'py, C>> {
    object.try_borrow_mut().map_err(|_| busy(object))
}

/// The argument as an object of a class, or an error that says which was expected.
pub(crate) fn instance<'a, 'py, C: PyClass>(
    name: &str,
    expected: &str,
    value: &'a Bound<'py, PyAny>,
) -> PyResult<&'a Bound<'py, C>> {
    value.cast::<C>().map_err(|_| unexpected(name, expected, value))
}

/// The error of an object that another call has not let go of.
#[cold]
fn busy<C: PyClass>(object: &Bound<'_, C>) -> PyErr {
    match object.as_any().get_type().name() {
        Ok(name) => in_use(format_args!("this {name}")),
        Err(error) => error,
    }
}

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

/// Equal models have equal hashes: +0 and -0, which are equal, count as one.
pub(crate) fn hash(values: impl Iterator<Item = f64>) -> u64 {
    let mut hasher = DefaultHasher::new();
    values.for_each(|value| (value + 0.0).to_bits().hash(&mut hasher));
    hasher.finish()
}
