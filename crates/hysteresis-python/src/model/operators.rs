//! Single operators.

use hysteresis_core::{self as core, Process, Tracked};
use hysteresis_python_macros::methods;
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, exclusive, keywords, reduce, shared};
use crate::stream::single_argument::Stepper;

/// The play operator, equations (1)-(3): z(k) = max(x - r, min(x + r, z(k-1))).
///
/// Parameters
/// ----------
/// r : float
///     Threshold, at least 0, in the unit of the input.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> play = mh.Play(10.0)
/// >>> play.step(25.0), play.step(20.0), play.step(0.0)
/// (15.0, 15.0, 10.0)
#[pyclass(module = "mpi_hyst")]
pub(crate) struct Play(Tracked<core::Play>);

/// The coupled-play (CP) operator, equation (5): z(k) = max(lo, min(hi, z(k-1))).
///
/// lo(x) = max(x - r, min(0, x - rc)) and hi(x) = min(x + ra, max(0, x + rb)). Rising, z follows x - rc below zero,
/// sticks at zero from x = rc to x = r, then follows x - r. Falling, it follows x + rb above zero, sticks at zero from
/// x = -rb to x = -ra, then follows x + ra.
///
/// Parameters
/// ----------
/// r, ra, rb, rc : float
///     Thresholds in the unit of the input, r >= rc >= 0 (rising) and ra >= rb >= 0 (falling).
///
/// Examples
/// --------
/// The walk of Fig. 5 of the paper:
///
/// >>> import mpi_hyst as mh
/// >>> mh.CoupledPlay(10, 8, 3, 4).run([0, 20, -20, 15, 6, 25, -15, -5])
/// array([  0.,  10., -12.,   5.,   5.,  15.,  -7.,  -7.])
#[pyclass(module = "mpi_hyst")]
pub(crate) struct CoupledPlay(Tracked<core::CoupledPlay>);

impl Stepper for Play {
    fn process(&self) -> &impl Process {
        &self.0
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.0
    }

    fn rejected(&self) -> u64 {
        self.0.rejected()
    }
}

// What both operators offer.
#[methods(Play, CoupledPlay)]
impl Each {
    /// Takes over the inputs before, oldest first.
    fn follow(slf: &Bound<'_, Self>, inputs: PyReadonlyArray1<'_, f64>) -> PyResult<()> {
        exclusive(slf)?.0.follow(inputs.as_slice()?).map_err(raise)
    }

    /// The last output z: the whole memory. Set it to continue from there.
    #[getter]
    fn state(slf: &Bound<'_, Self>) -> PyResult<f64> {
        Ok(shared(slf)?.0.state())
    }

    #[setter]
    fn set_state(slf: &Bound<'_, Self>, state: f64) -> PyResult<()> {
        exclusive(slf)?.0.set_state(state).map_err(raise)
    }
}

#[methods]
impl Play {
    #[new]
    fn new(r: f64) -> PyResult<Self> {
        Ok(Self(Tracked::new(core::Play::new(r).map_err(raise)?)))
    }

    /// The threshold.
    #[getter]
    fn r(&self) -> f64 {
        self.0.operator().r()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let state = self.0.state().into_pyobject(py)?.into_any();
        reduce(py.get_type::<Self>().into_any(), (self.r(),), keywords!(py), Some(state))
    }

    fn __repr__(&self) -> String {
        format!("Play(r={})", self.r())
    }
}

impl Stepper for CoupledPlay {
    fn process(&self) -> &impl Process {
        &self.0
    }

    fn process_mut(&mut self) -> &mut impl Process {
        &mut self.0
    }

    fn rejected(&self) -> u64 {
        self.0.rejected()
    }
}

#[methods]
impl CoupledPlay {
    #[new]
    fn new(r: f64, ra: f64, rb: f64, rc: f64) -> PyResult<Self> {
        Ok(Self(Tracked::new(core::CoupledPlay::new(r, ra, rb, rc).map_err(raise)?)))
    }

    /// Rising above zero: z = x - r.
    #[getter]
    fn r(&self) -> f64 {
        self.0.operator().r()
    }

    /// Falling below zero: z = x + ra.
    #[getter]
    fn ra(&self) -> f64 {
        self.0.operator().ra()
    }

    /// Falling above zero: z = x + rb.
    #[getter]
    fn rb(&self) -> f64 {
        self.0.operator().rb()
    }

    /// Rising below zero: z = x - rc.
    #[getter]
    fn rc(&self) -> f64 {
        self.0.operator().rc()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let (thresholds, state) = ((self.r(), self.ra(), self.rb(), self.rc()), self.0.state().into_pyobject(py)?);
        reduce(py.get_type::<Self>().into_any(), thresholds, keywords!(py), Some(state.into_any()))
    }

    fn __repr__(&self) -> String {
        format!("CoupledPlay(r={}, ra={}, rb={}, rc={})", self.r(), self.ra(), self.rb(), self.rc())
    }
}
