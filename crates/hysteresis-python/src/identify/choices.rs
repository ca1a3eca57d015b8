//! What cross-validation chose, and what it said of the rest.

use pyo3::prelude::*;

use super::identification::Identification;
use super::options::{law_name, loop_shift_name};

#[pymethods]
impl Identification {
    /// What cross-validation said of every number of operators: pairs (operators, rms error); empty unless "auto".
    #[getter]
    fn cross_validation(&self) -> Vec<(usize, f64)> {
        self.found.cross_validation.iter().map(|one| (one.operators, one.rmse)).collect()
    }

    /// What the weights might be: as given, or as cross-validation chose.
    #[getter]
    fn weights_law(&self) -> &'static str {
        law_name(self.found.weights)
    }

    /// What cross-validation said of every weight law: pairs (law, rms error); empty unless "auto".
    #[getter]
    fn weights_validation(&self) -> Vec<(&'static str, f64)> {
        self.found.weights_validation.iter().map(|one| (law_name(one.weights), one.rmse)).collect()
    }

    /// How smooth the weights were asked to be: as given, or as cross-validation chose.
    #[getter]
    fn smoothness(&self) -> f64 {
        self.found.smoothness
    }

    /// What cross-validation said of the terms that may be left out: (number of amplitudes of creep, loop shift, rms error), the
    /// best of every kind, the simplest first; empty if there was nothing to choose.
    #[getter]
    fn terms_validation(&self) -> Vec<(usize, String, f64)> {
        self.found.terms_validation.iter().map(|one| (one.creep, loop_shift_name(one.loop_shift), one.rmse)).collect()
    }

    /// What cross-validation said of every smoothness: pairs (smoothness, rms error); empty unless "auto".
    #[getter]
    fn smoothness_validation(&self) -> Vec<(f64, f64)> {
        self.found.smoothness_validation.iter().map(|one| (one.smoothness, one.rmse)).collect()
    }
}
