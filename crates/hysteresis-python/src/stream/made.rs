//! What a stream of a model was made of: enough to make another one.

use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::convert::pickling::{Reduced, keywords, reduce};

/// The model, and the arguments of its `forward` or `inverse`.
pub(crate) struct Made {
    pub(crate) model: Py<PyAny>,
    pub(crate) limits: Option<(f64, f64)>,
    pub(crate) initial: Option<Vec<f64>>,
}

impl Made {
    /// How `model.forward(initial)` and then `state` make the stream.
    pub(crate) fn reduce_forward<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "forward"))?;
        reduce(make, PyTuple::empty(py), keywords!(py, initial = &self.initial), Some(state))
    }

    /// How `model.inverse(limits, initial)` and then `state` make the stream.
    pub(crate) fn reduce_inverse<'py>(&self, state: Bound<'py, PyAny>) -> Reduced<'py> {
        let py = state.py();
        let make = self.model.bind(py).getattr(intern!(py, "inverse"))?;
        reduce(make, PyTuple::empty(py), keywords!(py, limits = self.limits, initial = &self.initial), Some(state))
    }
}
