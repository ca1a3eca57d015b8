//! What a stream of a model was made of: enough to make another one.

use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use hysteresis_core::Method;

use super::streams::method_name;
use crate::convert::objects::{Reduced, keywords, reduce};

/// The model, and the arguments of its `forward` or `inverse`.
pub(crate) struct Made {
    pub(crate) model: Py<PyAny>,
    pub(crate) limits: Option<(f64, f64)>,
    pub(crate) initial: Option<Vec<f64>>,
    pub(crate) method: Option<Method>,
}

impl Made {
    /// How `model.forward(initial, method=method)` and then `state` make the stream.
    pub(crate) fn reduce_forward<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "forward"))?;
        reduce(make, PyTuple::empty(py), keywords!(py, initial = &self.initial, method = self.method()), Some(state))
    }

    /// How `model.inverse(limits, initial, method=method)` and then `state` make the stream.
    pub(crate) fn reduce_inverse<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "inverse"))?;
        let keywords = keywords!(py, limits = self.limits, initial = &self.initial, method = self.method());
        reduce(make, PyTuple::empty(py), keywords, Some(state))
    }

    fn method(&self) -> Option<&'static str> {
        self.method.map(method_name)
    }
}
