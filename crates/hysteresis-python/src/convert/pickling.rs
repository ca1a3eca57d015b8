//! What pickle and deepcopy make an object of: a call that makes one like it, and the state from which it goes on.

use hysteresis_control::binary::Binary;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict, PyTuple};
use pythonize::depythonize;
use serde::Deserialize;

use super::errors::value;

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

/// The methods of a result, a frozen class of plain values: pickling by serde, and its own.
macro_rules! result_methods {
    ($class:ident { $($own:tt)* }) => {
        #[pymethods]
        impl $class {
            #[classmethod]
            fn _restored(_: &Bound<'_, pyo3::types::PyType>, values: &Bound<'_, PyAny>) -> PyResult<Self> {
                Ok(pythonize::depythonize(values)?)
            }

            fn __reduce__<'py>(&self, py: Python<'py>) -> $crate::convert::pickling::Reduced<'py> {
                let make = py.get_type::<Self>().getattr(pyo3::intern!(py, "_restored"))?;
                let values = pythonize::pythonize(py, self)?;
                $crate::convert::pickling::reduce(make, (values,), $crate::convert::pickling::keywords!(py), None)
            }

            $($own)*
        }
    };
}

pub(crate) use result_methods;
