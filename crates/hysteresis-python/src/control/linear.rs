//! The parameters of linear dynamics: immutable, comparable, hashable, picklable.

use hysteresis_control::linear::{self, Block, Dynamics, Error, Stream};
use hysteresis_core::is_admissible;
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyTuple;

use crate::convert::arguments::{count, numbers};
use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::{self, Place, raise, unexpected};
use crate::convert::values::hash;
use crate::stream::blocks::{Single, run};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// The response from rest at zero.
fn response<'py>(block: Result<impl Block, Error>, u: &Bound<'py, PyAny>) -> Vector<'py> {
    let mut stream = Stream::new(block.map_err(raise)?, 0.0);
    let input = vector("u", u)?;
    if let Some((index, got)) = input.as_slice()?.iter().enumerate().find(|(_, u)| !is_admissible(**u)) {
        let expected = "a finite number (at most 1e100 in magnitude)";
        let place = format!("u[{index}]");
        return Err(errors::value(Place::part("u", &place), format_args!("expected {expected}, got {got:?}")));
    }
    run(&input, None, |block| block.through(u.py(), &mut Single(&mut stream)))
}

/// Dynamics of either kind as a Python object.
pub(crate) fn dynamics(py: Python<'_>, dynamics: Dynamics) -> PyResult<Py<PyAny>> {
    match dynamics {
        Dynamics::FirstOrder(lag) => Ok(Py::new(py, FirstOrder(lag))?.into_any()),
        Dynamics::SecondOrder(resonance) => Ok(Py::new(py, SecondOrder(resonance))?.into_any()),
    }
}

/// Dynamics of either kind from a Python object.
pub(crate) fn given_dynamics(dynamics: &Bound<'_, PyAny>) -> PyResult<Dynamics> {
    if let Ok(lag) = dynamics.cast::<FirstOrder>() {
        Ok(lag.get().0.into())
    } else if let Ok(resonance) = dynamics.cast::<SecondOrder>() {
        Ok(resonance.get().0.into())
    } else {
        Err(unexpected("dynamics", "a SecondOrder or a FirstOrder", dynamics))
    }
}

/// Creep from a Python object.
pub(crate) fn given_creep(creep: &Bound<'_, PyAny>) -> PyResult<linear::Creep> {
    match creep.cast::<Creep>() {
        Ok(creep) => Ok(creep.get().0.clone()),
        Err(_) => Err(unexpected("creep", "a Creep", creep)),
    }
}

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
/// array([0.674, 1.733, 1.739, 0.761])
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct SecondOrder(pub(crate) linear::SecondOrder);

#[pymethods]
impl SecondOrder {
    #[new]
    fn new(frequency: &Bound<'_, PyAny>, damping: &Bound<'_, PyAny>) -> PyResult<Self> {
        numbers!(frequency, damping);
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

    /// The response to `u` from rest at zero, exactly discretised for an input held over `dt` seconds.
    ///
    /// y[k] is the position at the end of the interval over which u[k] is held.
    fn response<'py>(&self, u: &Bound<'py, PyAny>, dt: &Bound<'py, PyAny>) -> Vector<'py> {
        numbers!(dt);
        response(self.0.block(dt), u)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash([self.frequency(), self.damping()].into_iter())
    }

    fn __repr__(&self) -> String {
        format!("SecondOrder(frequency={:?}, damping={:?})", self.frequency(), self.damping())
    }

    fn __getnewargs__(&self) -> (f64, f64) {
        (self.frequency(), self.damping())
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
/// >>> amplifier.response([1.0, 1.0], dt=1e-4).round(4)
/// array([0.1608, 0.2957])
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct FirstOrder(pub(crate) linear::FirstOrder);

#[pymethods]
impl FirstOrder {
    #[new]
    fn new(frequency: &Bound<'_, PyAny>) -> PyResult<Self> {
        numbers!(frequency);
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
    fn from_time_constant(time_constant: &Bound<'_, PyAny>) -> PyResult<Self> {
        numbers!(time_constant);
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

    /// The response to `u` from rest at zero, exactly discretised for an input held over `dt` seconds.
    ///
    /// y[k] is the output at the end of the interval over which u[k] is held.
    fn response<'py>(&self, u: &Bound<'py, PyAny>, dt: &Bound<'py, PyAny>) -> Vector<'py> {
        numbers!(dt);
        response(self.0.block(dt), u)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        hash([self.frequency()].into_iter())
    }

    fn __repr__(&self) -> String {
        format!("FirstOrder(frequency={:?})", self.frequency())
    }

    fn __getnewargs__(&self) -> (f64,) {
        (self.frequency(),)
    }
}

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

#[pymethods]
impl Creep {
    #[new]
    fn new(amplitudes: &Bound<'_, PyAny>, time_constants: &Bound<'_, PyAny>) -> PyResult<Self> {
        let (amplitudes, times) = (vector("amplitudes", amplitudes)?, vector("time_constants", time_constants)?);
        linear::Creep::new(amplitudes.as_slice()?, times.as_slice()?).map(Self).map_err(raise)
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
    fn logarithmic(
        gamma: &Bound<'_, PyAny>,
        start: &Bound<'_, PyAny>,
        end: &Bound<'_, PyAny>,
        terms: &Bound<'_, PyAny>,
    ) -> PyResult<Self> {
        numbers!(gamma, start, end);
        let terms =
            u16::try_from(count("terms", terms)?).map_err(|_| errors::value("terms", "expected at most 65535"))?;
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

    /// The response to `u` from rest at zero, for an input held over `dt` seconds.
    ///
    /// y[k] is the output at the end of the interval over which u[k] is held.
    fn response<'py>(&self, u: &Bound<'py, PyAny>, dt: &Bound<'py, PyAny>) -> Vector<'py> {
        numbers!(dt);
        response(self.0.block(dt), u)
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

    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyTuple>> {
        (self.amplitudes(py)?, self.time_constants(py)?).into_pyobject(py)
    }
}
