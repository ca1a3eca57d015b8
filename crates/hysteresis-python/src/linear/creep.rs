//! Creep.

use std::num::NonZeroUsize;

use hysteresis_control::linear::{self, Stream};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use super::sections::response;
use crate::argument::Argument;
use crate::convert::arrays::read_only;
use crate::convert::errors::{self, raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// Log-type creep as a sum of first-order lags: y = x + sum_k c_k x_k, tau_k x_k' + x_k = x.
///
/// After a step of x the output is there at once and then creeps on to (1 + sum_k c_k) x.
///
/// Parameters
/// ----------
/// amplitudes : array of n floats
///     c_k, as shares of x.
/// time_constants : array of n floats
///     tau_k in seconds, strictly increasing.
///
/// Raises
/// ------
/// ValueError
///     That names the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> creep = mh.plant.Creep.logarithmic(0.02, start=0.01, end=1000.0, terms=10)
/// >>> position = creep.response([1.0] * 1000, dt=0.01)
/// >>> round(float(position[999] - position[99]), 4)  # from 1 s to 10 s after the step: 2 % per decade
/// 0.02
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Creep(pub(crate) linear::Creep);

#[methods]
impl Creep {
    #[new]
    fn new(amplitudes: PyReadonlyArray1<'_, f64>, time_constants: PyReadonlyArray1<'_, f64>) -> PyResult<Self> {
        linear::Creep::new(amplitudes.as_slice()?, time_constants.as_slice()?).map(Self).map_err(raise)
    }

    /// The usual law of creep after a step to x: y(t) = x (1 + gamma log10(t / start)), from `start` to `end`.
    ///
    /// Parameters
    /// ----------
    /// gamma : float
    ///     The share by which the position grows per decade: 0.01 to 0.02 for stacks of PZT.
    /// start, end : float
    ///     Seconds after the step: where the law begins (y = x there) and where creep ends.
    /// terms : int
    ///     How many lags: two per decade keep the ripple below 1e-3 gamma.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> mh.plant.Creep.logarithmic(0.01, start=0.1, end=10.0, terms=2).amplitudes
    /// array([0.01, 0.01])
    #[staticmethod]
    fn logarithmic(gamma: f64, start: f64, end: f64, terms: NonZeroUsize) -> PyResult<Self> {
        let terms = u16::try_from(terms.get())
            .map_err(|_| errors::value("terms", format_args!("expected at most 65535, got {terms}")))?;
        linear::Creep::logarithmic(gamma, start, end, terms).map(Self).map_err(raise)
    }

    /// c_k, read-only.
    #[getter]
    fn amplitudes<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.amplitudes().iter().copied())
    }

    /// tau_k in seconds, read-only.
    #[getter]
    fn time_constants<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.time_constants().iter().copied())
    }

    /// The response to `u` from rest at zero, each input held for `dt` seconds: y[k] is the output at the moment at
    /// which u[k] is put out.
    fn response<'py>(&self, u: PyReadonlyArray1<'py, f64>, dt: f64) -> Vector<'py> {
        response(Stream::new(self.0.block(dt).map_err(raise)?, 0.0), &u)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash(self.0.amplitudes().iter().chain(self.0.time_constants()).copied())
    }

    fn __repr__(&self) -> String {
        format!("Creep(amplitudes={:?}, time_constants={:?})", self.0.amplitudes(), self.0.time_constants())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.amplitudes(py)?, self.time_constants(py)?), keywords!(py), None)
    }
}

impl Argument<'_> for linear::Creep {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.cast::<Creep>().map(|creep| creep.get().0.clone()).map_err(|_| unexpected(name, "a Creep", value))
    }
}
