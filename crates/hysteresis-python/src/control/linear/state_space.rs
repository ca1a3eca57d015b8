//! The general form of linear dynamics.

use hysteresis_control::linear::{self, LinearDynamics};
use hysteresis_python_macros::methods;
use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::convert::arrays::{array, vector};
use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

/// Stable linear dynamics of one input and one output in continuous time: x' = A x + b u, y = c x + d u.
///
/// Time is in seconds. The static gain d - c A^-1 b is not 0.
///
/// Parameters
/// ----------
/// a : array of shape (n, n)
/// b, c : arrays of n floats
/// d : float
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> lag = mh.plant.StateSpace([[-500.0]], [2.0], [250.0], 0.0)
/// >>> same = mh.plant.StateSpace.from_transfer_function([1.0], [0.002, 1.0])
/// >>> bool(abs(lag.frequency_response([80.0]) - same.frequency_response([80.0]))[0] < 1e-15)
/// True
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct StateSpace(pub(crate) linear::StateSpace);

impl StateSpace {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.clone().into()
    }
}

#[methods]
impl StateSpace {
    #[new]
    fn new(
        #[py("ArrayLike")] a: &Bound<'_, PyAny>,
        #[py("ArrayLike")] b: &Bound<'_, PyAny>,
        #[py("ArrayLike")] c: &Bound<'_, PyAny>,
        #[py(= 0.0)] d: f64,
    ) -> PyResult<Self> {
        let a: PyReadonlyArray2<'_, f64> = array("a", a, format_args!("a matrix of shape (n, n)"))?;
        let (b, c) = (vector("b", b)?, vector("c", c)?);
        let [rows, columns] = [a.shape()[0], a.shape()[1]];
        let a = DMatrix::from_row_slice(rows, columns, a.as_slice()?);
        let (b, c) = (DVector::from_column_slice(b.as_slice()?), DVector::from_column_slice(c.as_slice()?));
        linear::StateSpace::new(a, b, c, d).map(Self).map_err(raise)
    }

    /// From the coefficients of numerator and denominator, the highest power of s (in radians per second) first.
    #[staticmethod]
    fn from_transfer_function(
        #[py("ArrayLike")] numerator: &Bound<'_, PyAny>,
        #[py("ArrayLike")] denominator: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let (numerator, denominator) = (vector("numerator", numerator)?, vector("denominator", denominator)?);
        let made = linear::StateSpace::from_transfer_function(numerator.as_slice()?, denominator.as_slice()?);
        made.map(Self).map_err(raise)
    }

    /// A, in 1/s.
    #[getter]
    fn a<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let a = self.0.a();
        // The matrix is kept column by column.
        let columns = PyArray1::from_iter(py, a.transpose().iter().copied());
        columns.reshape([a.nrows(), a.ncols()])
    }

    /// b.
    #[getter]
    fn b<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.0.b().iter().copied())
    }

    /// c.
    #[getter]
    fn c<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, self.0.c().iter().copied())
    }

    /// The same as a StateSpace of the package control, which must be installed.
    #[py(-> "Any")]
    pub(crate) fn to_control<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("control")?.call_method1("ss", self.matrices(py)?)
    }

    /// The same as a scipy.signal.StateSpace; scipy must be installed.
    #[py(-> "Any")]
    pub(crate) fn to_scipy<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        py.import("scipy.signal")?.call_method1("StateSpace", self.matrices(py)?)
    }

    /// d: what passes at once.
    #[getter]
    fn d(&self) -> f64 {
        self.0.d()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash(self.0.a().iter().chain(self.0.b()).chain(self.0.c()).copied().chain([self.0.d()]))
    }

    fn __repr__(&self) -> String {
        format!("<StateSpace of {} states, static gain {:?}>", self.0.order(), self.0.static_gain())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.a(py)?, self.b(py), self.c(py), self.d()), keywords!(py), None)
    }
}

impl StateSpace {
    /// (A, b as a column, c as a row, d), as other packages take them.
    fn matrices<'py>(&self, py: Python<'py>) -> PyResult<(Matrix<'py>, Matrix<'py>, Matrix<'py>, f64)> {
        let n = self.0.order();
        Ok((self.a(py)?, self.b(py).reshape([n, 1])?, self.c(py).reshape([1, n])?, self.0.d()))
    }
}

type Matrix<'py> = Bound<'py, PyArray2<f64>>;
