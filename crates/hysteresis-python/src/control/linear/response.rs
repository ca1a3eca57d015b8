//! What all linear dynamics offer: responses in time and over frequency, poles and zeros.

use hysteresis_control::linear::{LinearDynamics, Stream};
use hysteresis_core::{Process, check_all_finite};
use hysteresis_python_macros::methods;
use numpy::{Complex64, PyArray1};
use pyo3::prelude::*;

use super::lags::{FirstOrder, SecondOrder};
use super::modes::{Antiresonance, Modes};
use super::state_space::StateSpace;
use crate::convert::arrays::{numbers, vector};
use crate::convert::errors::raise;
use crate::stream::blocks::{Single, run};

/// The response of a stream to finite inputs.
pub(super) fn response<'py>(mut stream: impl Process, u: &Bound<'py, PyAny>) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let input = vector("u", u)?;
    check_all_finite("u", input.as_slice()?).map_err(raise)?;
    run(&input, None, |block| block.through(u.py(), &mut Single(&mut stream)))
}

pub(super) fn time_response<'py>(
    dynamics: &LinearDynamics,
    u: &Bound<'py, PyAny>,
    dt: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    response(Stream::new(dynamics.block(dt).map_err(raise)?, 0.0), u)
}

pub(super) fn frequency_response<'py>(
    dynamics: &LinearDynamics,
    frequencies: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, PyArray1<Complex64>>> {
    let values = numbers("frequencies", frequencies)?.into_iter().map(|f| dynamics.frequency_response(f));
    Ok(PyArray1::from_iter(frequencies.py(), values))
}

/// Roots in radians per second as an array.
pub(super) fn roots(py: Python<'_>, roots: Vec<Complex64>) -> Bound<'_, PyArray1<Complex64>> {
    PyArray1::from_vec(py, roots)
}

// What all linear dynamics offer.
#[methods(SecondOrder, FirstOrder, Antiresonance, Modes, StateSpace)]
impl Each {
    /// The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.
    ///
    /// y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
    /// u[k] from y[k + 1] on.
    fn response<'py>(
        &self,
        #[py("ArrayLike")] u: &Bound<'py, PyAny>,
        dt: f64,
    ) -> PyResult<Bound<'py, numpy::PyArray1<f64>>> {
        time_response(&self.dynamics(), u, dt)
    }

    /// The complex gain at frequencies in Hz.
    #[py(-> "ComplexVector")]
    fn frequency_response<'py>(
        &self,
        #[py("ArrayLike")] frequencies: &Bound<'py, PyAny>,
    ) -> PyResult<Bound<'py, numpy::PyArray1<numpy::Complex64>>> {
        frequency_response(&self.dynamics(), frequencies)
    }

    /// The poles in radians per second.
    #[getter]
    #[py(-> "ComplexVector")]
    fn poles<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<numpy::Complex64>> {
        roots(py, self.dynamics().poles())
    }

    /// The finite zeros in radians per second.
    #[getter]
    #[py(-> "ComplexVector")]
    fn zeros<'py>(&self, py: Python<'py>) -> Bound<'py, numpy::PyArray1<numpy::Complex64>> {
        roots(py, self.dynamics().zeros())
    }

    /// The output that a constant input of 1 leads to.
    #[getter]
    fn static_gain(&self) -> f64 {
        self.dynamics().static_gain()
    }
}
