//! Linear dynamics: a lag, a resonance, an antiresonance, modes in parallel, matrices; and what all of them offer.
//! All are immutable, comparable, hashable, and picklable.

use hysteresis_control::linear::{self, LinearDynamics, Stream};
use hysteresis_core::{Process, check_all_finite};
use hysteresis_python_macros::methods;
use nalgebra::{DMatrix, DVector};
use numpy::{Complex64, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::argument::Class;
use crate::convert::arrays::{array, read_only};
use crate::convert::errors::{Place, raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};
use crate::stream::blocks::{Single, run};

/// Second-order dynamics of unit static gain: y'' + 2 zeta w y' + w^2 y = w^2 u, w = 2 pi f.
///
/// The mass-spring-damper that follows the hysteresis in Remark 1 of the paper.
///
/// Parameters
/// ----------
/// frequency : float
///     Undamped natural frequency f in Hz.
/// damping : float
///     Damping ratio zeta: below 1 the step response rings at f sqrt(1 - zeta^2).
///
/// Raises
/// ------
/// ValueError
///     Unless both are finite and above 0.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.plant.SecondOrder(2000.0, 0.03)
/// >>> stage.response([1.0] * 4, dt=1e-4).round(3)
/// array([0.   , 0.674, 1.733, 1.739])
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct SecondOrder(pub(crate) linear::SecondOrder);

impl Class for SecondOrder {
    const CALLED: &'static str = "a SecondOrder";
}

impl SecondOrder {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.into()
    }
}

#[methods]
impl SecondOrder {
    #[new]
    fn new(frequency: f64, damping: f64) -> PyResult<Self> {
        linear::SecondOrder::new(frequency, damping).map(Self).map_err(raise)
    }

    /// Undamped natural frequency in Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// Damping ratio.
    #[getter]
    fn damping(&self) -> f64 {
        self.0.damping()
    }

    fn __hash__(&self) -> u64 {
        hash([self.frequency(), self.damping()].into_iter())
    }

    pub(super) fn __repr__(&self) -> String {
        format!("SecondOrder(frequency={:?}, damping={:?})", self.frequency(), self.damping())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.frequency(), self.damping()), keywords!(py), None)
    }
}

/// A first-order lag of unit static gain: tau y' + y = u, tau = 1 / (2 pi f).
///
/// Parameters
/// ----------
/// frequency : float
///     Cut-off frequency f in Hz, where a sine passes by 1/sqrt(2).
///
/// Raises
/// ------
/// ValueError
///     Unless it is finite and above 0.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> amplifier = mh.plant.FirstOrder(279.0)
/// >>> amplifier.response([1.0, 1.0, 1.0], dt=1e-4).round(4)
/// array([0.    , 0.1608, 0.2957])
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct FirstOrder(pub(crate) linear::FirstOrder);

impl FirstOrder {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.into()
    }
}

#[methods]
impl FirstOrder {
    #[new]
    fn new(frequency: f64) -> PyResult<Self> {
        linear::FirstOrder::new(frequency).map(Self).map_err(raise)
    }

    /// A lag with the time constant tau in seconds.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> round(mh.plant.FirstOrder.from_time_constant(1e-3).frequency, 3)
    /// 159.155
    #[staticmethod]
    fn from_time_constant(time_constant: f64) -> PyResult<Self> {
        linear::FirstOrder::from_time_constant(time_constant).map(Self).map_err(raise)
    }

    /// Cut-off frequency in Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// tau in seconds.
    #[getter]
    fn time_constant(&self) -> f64 {
        self.0.time_constant()
    }

    fn __hash__(&self) -> u64 {
        hash([self.frequency()].into_iter())
    }

    pub(super) fn __repr__(&self) -> String {
        format!("FirstOrder(frequency={:?})", self.frequency())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.frequency(),), keywords!(py), None)
    }
}

/// An antiresonance and the resonance that belongs to it, of unit static gain.
///
/// G(s) = ((s/w_a)^2 + 2 zeta_a s/w_a + 1) / ((s/w)^2 + 2 zeta s/w + 1): at the antiresonance a part of the structure
/// takes up the force that would move the position.
///
/// Parameters
/// ----------
/// zero, pole : SecondOrder
///     Frequency and damping of the antiresonance, and of the resonance.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> pair = mh.plant.Antiresonance(mh.plant.SecondOrder(600.0, 0.01), mh.plant.SecondOrder(650.0, 0.01))
/// >>> bool(abs(pair.frequency_response([600.0])[0]) < 0.2)
/// True
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Antiresonance(pub(crate) linear::Antiresonance);

impl Antiresonance {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.into()
    }
}

#[methods]
impl Antiresonance {
    #[new]
    fn new(zero: Bound<'_, SecondOrder>, pole: Bound<'_, SecondOrder>) -> PyResult<Self> {
        Ok(Self(linear::Antiresonance::new(zero.get().0, pole.get().0)))
    }

    /// The antiresonance.
    #[getter]
    fn zero(&self) -> SecondOrder {
        SecondOrder(self.0.zero())
    }

    /// The resonance.
    #[getter]
    fn pole(&self) -> SecondOrder {
        SecondOrder(self.0.pole())
    }

    fn __hash__(&self) -> u64 {
        hash([self.0.zero(), self.0.pole()].iter().flat_map(|pair| [pair.frequency(), pair.damping()]))
    }

    fn __repr__(&self) -> String {
        format!("Antiresonance(zero={}, pole={})", self.zero().__repr__(), self.pole().__repr__())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.zero(), self.pole()), keywords!(py), None)
    }
}

/// Second-order modes in parallel: G(s) = sum_i g_i / ((s/w_i)^2 + 2 zeta_i s/w_i + 1).
///
/// The modal form of a mechanical structure. Where neighbours have gains of the same sign there is an antiresonance
/// between them. Dynamics that follow each other are given in a list instead.
///
/// Parameters
/// ----------
/// gains : array of n floats
///     The share of each mode in the static gain; their sum must not be 0.
/// modes : sequence of n SecondOrder
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> modes = mh.plant.Modes([0.8, 0.2], [mh.plant.SecondOrder(800.0, 0.02), mh.plant.SecondOrder(1500.0, 0.01)])
/// >>> modes.static_gain, modes.zeros.size
/// (1.0, 2)
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Modes(pub(crate) linear::Modes);

impl Modes {
    /// As a part of dynamics in series.
    pub(crate) fn dynamics(&self) -> LinearDynamics {
        self.0.clone().into()
    }
}

#[methods]
impl Modes {
    #[new]
    fn new(
        gains: PyReadonlyArray1<'_, f64>,
        #[py("Iterable[SecondOrder]")] modes: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        let Ok(items) = modes.try_iter() else { return Err(unexpected("modes", "a sequence of SecondOrder", modes)) };
        let resonances = items.enumerate().map(|(i, item)| {
            let item = item?;
            let resonance = item.cast::<SecondOrder>().map(|resonance| resonance.get().0);
            resonance.map_err(|_| unexpected(Place::part("modes", &format!("modes[{i}]")), SecondOrder::CALLED, &item))
        });
        let resonances = resonances.collect::<PyResult<Vec<_>>>()?;
        linear::Modes::new(gains.as_slice()?, &resonances).map(Self).map_err(raise)
    }

    /// The share of each mode in the static gain, read-only.
    #[getter]
    fn gains<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.gains().iter().copied())
    }

    /// The resonances.
    #[getter]
    #[py(-> "tuple[SecondOrder, ...]")]
    fn modes<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        PyTuple::new(py, self.0.modes().iter().map(|mode| SecondOrder(*mode)).collect::<Vec<_>>())
    }

    fn __hash__(&self) -> u64 {
        let modes = self.0.modes().iter().flat_map(|mode| [mode.frequency(), mode.damping()]);
        hash(self.0.gains().iter().copied().chain(modes))
    }

    fn __repr__(&self) -> String {
        let modes: Vec<_> = self.0.modes().iter().map(|mode| SecondOrder(*mode).__repr__()).collect();
        format!("Modes(gains={:?}, modes=[{}])", self.0.gains(), modes.join(", "))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        reduce(py.get_type::<Self>().into_any(), (self.gains(py)?, self.modes(py)?), keywords!(py), None)
    }
}

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
        b: PyReadonlyArray1<'_, f64>,
        c: PyReadonlyArray1<'_, f64>,
        #[py(= 0.0)] d: f64,
    ) -> PyResult<Self> {
        let a: PyReadonlyArray2<'_, f64> = array("a", a, format_args!("a matrix of shape (n, n)"))?;
        let [rows, columns] = [a.shape()[0], a.shape()[1]];
        let a = DMatrix::from_row_slice(rows, columns, a.as_slice()?);
        let (b, c) = (DVector::from_column_slice(b.as_slice()?), DVector::from_column_slice(c.as_slice()?));
        linear::StateSpace::new(a, b, c, d).map(Self).map_err(raise)
    }

    /// From the coefficients of numerator and denominator, the highest power of s (in radians per second) first.
    #[staticmethod]
    fn from_transfer_function(
        numerator: PyReadonlyArray1<'_, f64>,
        denominator: PyReadonlyArray1<'_, f64>,
    ) -> PyResult<Self> {
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

/// The response of a stream to finite inputs.
pub(super) fn response<'py>(
    mut stream: impl Process,
    u: &PyReadonlyArray1<'py, f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    check_all_finite("u", u.as_slice()?).map_err(raise)?;
    run(u, None, |block| block.through(u.py(), &mut Single(&mut stream)))
}

// What all linear dynamics offer.
#[methods(SecondOrder, FirstOrder, Antiresonance, Modes, StateSpace)]
impl Each {
    /// The response to `u` from rest at zero, each input held for `dt` seconds, exactly discretised.
    ///
    /// y[k] is the output at the moment at which u[k] is put out: dynamics without direct feedthrough answer to
    /// u[k] from y[k + 1] on.
    fn response<'py>(&self, u: PyReadonlyArray1<'py, f64>, dt: f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        response(Stream::new(self.dynamics().block(dt).map_err(raise)?, 0.0), &u)
    }

    /// The complex gain at frequencies in Hz.
    #[py(-> "ComplexVector")]
    fn frequency_response<'py>(
        &self,
        py: Python<'py>,
        frequencies: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<ComplexArray<'py>> {
        let dynamics = self.dynamics();
        let gains = frequencies.as_slice()?.iter().map(|frequency| dynamics.frequency_response(*frequency));
        Ok(PyArray1::from_iter(py, gains))
    }

    /// The poles in radians per second.
    #[getter]
    #[py(-> "ComplexVector")]
    fn poles<'py>(&self, py: Python<'py>) -> ComplexArray<'py> {
        PyArray1::from_vec(py, self.dynamics().poles())
    }

    /// The finite zeros in radians per second.
    #[getter]
    #[py(-> "ComplexVector")]
    fn zeros<'py>(&self, py: Python<'py>) -> ComplexArray<'py> {
        PyArray1::from_vec(py, self.dynamics().zeros())
    }

    /// The output that a constant input of 1 leads to.
    #[getter]
    fn static_gain(&self) -> f64 {
        self.dynamics().static_gain()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

type ComplexArray<'py> = Bound<'py, PyArray1<Complex64>>;
