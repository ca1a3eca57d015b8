//! The terms of a controller as an object.

use hysteresis_core::Terms;
use pyo3::prelude::*;

/// What a sample of a `HybridController` was made of: positions in um, terms in volts.
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct ControllerTerms(pub(crate) Terms);

#[pymethods]
impl ControllerTerms {
    /// The reference of the feedback.
    #[getter]
    fn reference(&self) -> f64 {
        self.0.reference
    }

    /// What the feed-forward was to reach.
    #[getter]
    fn target(&self) -> f64 {
        self.0.target
    }

    /// Reference minus measurement; without a measurement the last one there was.
    #[getter]
    fn error(&self) -> f64 {
        self.0.error
    }

    /// The output of the feed-forward, or the number given instead.
    #[getter]
    fn feedforward(&self) -> f64 {
        self.0.feedforward
    }

    /// kp times the error.
    #[getter]
    fn proportional(&self) -> f64 {
        self.0.proportional
    }

    /// The sum of ki times the errors, this sample included.
    #[getter]
    fn integral(&self) -> f64 {
        self.0.integral
    }

    /// What keeps starts and switches from being jumps; it fades.
    #[getter]
    fn transition(&self) -> f64 {
        self.0.transition
    }

    /// What the law asks for: the sum of the four terms.
    #[getter]
    fn demanded(&self) -> f64 {
        self.0.demanded
    }

    /// What the limiter lets through.
    #[getter]
    fn drive(&self) -> f64 {
        self.0.drive
    }

    /// Whether the demand lay beyond the limits.
    #[getter]
    fn saturated(&self) -> bool {
        self.0.saturated
    }

    /// Whether the demand was farther from the last drive than the slew allows.
    #[getter]
    fn slewing(&self) -> bool {
        self.0.slewing
    }

    fn __repr__(&self) -> String {
        let Terms { error, feedforward, proportional, integral, transition, drive, .. } = self.0;
        format!(
            "<ControllerTerms drive {drive:?} of feedforward {feedforward:?}, proportional {proportional:?}, integral \
             {integral:?}, transition {transition:?}; error {error:?}>"
        )
    }
}
