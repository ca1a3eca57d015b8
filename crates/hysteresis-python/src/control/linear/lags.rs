//! A lag, and a resonance.

use hysteresis_control::linear::{self, LinearDynamics};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use crate::convert::errors::raise;
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

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

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
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

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
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
