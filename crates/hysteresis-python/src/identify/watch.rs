//! What a search tells its caller, and what ends it.

use std::ops::ControlFlow;

use pyo3::call::PyCallArgs;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use crate::argument::Callable;

/// Tells the caller how far a search is, and ends it on Ctrl-C or when the caller's function raises.
pub(super) struct Watch {
    progress: Option<Callable>,
    raised: Option<PyErr>,
}

impl Watch {
    pub(super) fn new(progress: Option<Callable>) -> Self {
        Self { progress, raised: None }
    }

    /// Calls the caller's function with these numbers.
    pub(super) fn tell<'py>(&self, py: Python<'py>, numbers: impl PyCallArgs<'py>) -> PyResult<()> {
        py.check_signals()?;
        self.progress.as_ref().map_or(Ok(()), |progress| progress.0.call1(py, numbers).map(drop))
    }

    /// The same from a search, while the interpreter is let go.
    pub(super) fn look(&mut self, numbers: impl for<'py> PyCallArgs<'py>) -> ControlFlow<()> {
        let told = Python::attach(|py| self.tell(py, numbers));
        self.goes_on(told)
    }

    /// Goes on, or keeps what ends the search.
    pub(super) fn goes_on(&mut self, told: PyResult<()>) -> ControlFlow<()> {
        match told {
            Ok(()) => ControlFlow::Continue(()),
            Err(error) => {
                self.raised = Some(error);
                ControlFlow::Break(())
            }
        }
    }

    /// Whether a KeyboardInterrupt ended the search.
    pub(super) fn is_interrupted(&self) -> bool {
        let is = |error: &PyErr| Python::attach(|py| error.is_instance_of::<PyKeyboardInterrupt>(py));
        self.raised.as_ref().is_some_and(is)
    }

    /// What ended the search, if it was not the search itself.
    pub(super) fn check(&mut self) -> PyResult<()> {
        self.raised.take().map_or(Ok(()), Err)
    }
}
