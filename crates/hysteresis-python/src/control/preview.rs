//! The preview of a controller.

use hysteresis_control::feedforward::{PreviewCoefficients, smoothing_kernel};
use hysteresis_control::linear::LinearDynamics;
use hysteresis_core as core;
use hysteresis_python_macros::methods;
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;

use super::linear::part::{dynamics_object, linear_dynamics};
use crate::argument::Class;
use crate::convert::arguments::whole;
use crate::convert::arrays::{read_only, vector};
use crate::convert::errors::{self, raise};
use crate::convert::pickling::{Reduced, keywords, reduce};

/// Makes the target of a `HybridController` of references known beforehand, by a fixed window.
///
/// target(k) = sum_j c_j r(k + ahead - j), j = 0 the newest. References then enter `step` `ahead` samples early; the
/// feedback uses r(k), from the same window, which at the start is full of the first reference.
///
/// While the window fills anew, at the start, after a hold and after a rejected reference, the target rests at the first
/// reference.
///
/// Parameters
/// ----------
/// coefficients : array of shape (taps,)
///     c_j, that of the newest reference first.
/// ahead : int
///     How many samples the references are early: less than there are taps.
/// dt : float, optional
///     The sampling interval in seconds for which the window was made: a controller of another one then refuses it.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> half_a_sample = mh.control.Preview([0.5, 0.5], 1)
/// >>> controller = mh.control.HybridController(
/// ...     None, kp=5.0, ki=6e3, dt=1e-4, limits=(-500, 500), preview=half_a_sample)
/// >>> for reference in (1.0, 2.0, 3.0):
/// ...     drive = controller.step(reference, 0.0)
/// >>> controller.terms.reference, controller.terms.target
/// (2.0, 2.5)
#[pyclass(module = "mpi_hyst.control", frozen)]
pub(crate) struct Preview {
    pub(crate) preview: core::Preview,
    /// The same without smoothing, and over how many seconds it is smoothed, if it is.
    plain: Option<(core::Preview, f64)>,
    /// What it was made of, if it was made by `preview`.
    made: Option<PreviewCoefficients>,
    /// The sampling interval for which it was made, if that is known.
    dt: Option<f64>,
}

impl Preview {
    pub(crate) fn made(made: PreviewCoefficients) -> PyResult<Self> {
        let preview = core::Preview::new(made.coefficients(), made.ahead()).map_err(raise)?;
        Ok(Self { preview, plain: None, dt: Some(made.dt()), made: Some(made) })
    }

    /// The same with smoothed references.
    pub(crate) fn behind_smoothing(&self, seconds: f64) -> PyResult<Self> {
        let Some(dt) = self.dt else {
            return Err(errors::value("dt", "expected the sampling interval of the preview, got None"));
        };
        if let Some((_, seconds)) = self.plain {
            let expected = "expected a preview that is not smoothed yet, got one that is over";
            return Err(errors::value("seconds", format_args!("{expected} {seconds:?} s")));
        }
        let plain = self.preview.clone();
        let preview = plain.clone().smoothed(&smoothing_kernel(seconds, dt).map_err(raise)?).map_err(raise)?;
        Ok(Self { preview, plain: Some((plain, seconds)), made: self.made.clone(), dt: self.dt })
    }

    /// The sampling interval for which it was made, if that is known.
    pub(crate) fn dt(&self) -> Option<f64> {
        self.dt
    }
}

impl Class for Preview {
    const CALLED: &'static str = "a mh.control.Preview";
}

#[methods]
impl Preview {
    #[new]
    fn new(
        #[py("ArrayLike")] coefficients: &Bound<'_, PyAny>,
        #[py("int")] ahead: &Bound<'_, PyAny>,
        #[py(= None)] dt: Option<f64>,
    ) -> PyResult<Self> {
        let coefficients = vector("coefficients", coefficients)?;
        let preview = core::Preview::new(coefficients.as_slice()?, whole("ahead", ahead)?);
        Ok(Self { preview: preview.map_err(raise)?, plain: None, made: None, dt })
    }

    /// The sampling interval in seconds for which it was made, or None: a controller of another one refuses it.
    #[getter(dt)]
    fn sampling_interval(&self) -> Option<f64> {
        self.dt
    }

    /// The coefficients c_j, read-only.
    #[getter]
    fn coefficients<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.preview.coefficients().iter().copied())
    }

    /// How many samples the references are early.
    #[getter]
    fn ahead(&self) -> usize {
        self.preview.ahead()
    }

    /// Over how many seconds references are smoothed, or None.
    #[getter]
    fn smoothing(&self) -> Option<f64> {
        self.plain.as_ref().map(|(_, seconds)| *seconds)
    }

    /// The same behind a smoothing of the references: three means of a third of `seconds`, one behind the other.
    ///
    /// Target and reference of the feedback are then those of the smoothed references, which come half of `seconds` earlier. So
    /// references may have steps and corners. Means over a period of a resonance leave it at rest: three periods of the slowest one
    /// are a good choice.
    ///
    /// Examples
    /// --------
    /// >>> import mpi_hyst as mh
    /// >>> preview = mh.control.preview(mh.plant.SecondOrder(800.0, 0.02), 1e-4, ahead=4)
    /// >>> smoothed = preview.smoothed(3.7e-3)
    /// >>> preview.ahead, smoothed.ahead, smoothed.smoothing
    /// (4, 21, 0.0037)
    fn smoothed(&self, seconds: f64) -> PyResult<Self> {
        self.behind_smoothing(seconds)
    }

    /// The error of the position for a sine of this frequency in Hz, relative to the sine, or to the smoothed one.
    ///
    /// Only `mpi_hyst.control.preview` knows which dynamics its coefficients invert: a ValueError for coefficients alone.
    fn error(&self, frequency: f64) -> PyResult<f64> {
        let expected = "error: expected a preview that was made by mpi_hyst.control.preview, got coefficients alone";
        self.made.as_ref().map(|made| made.error(frequency)).ok_or_else(|| PyValueError::new_err(expected))
    }

    #[classmethod]
    fn _restored(
        _: &Bound<'_, PyType>,
        coefficients: Vec<f64>,
        ahead: usize,
        dt: f64,
        dynamics: Option<&Bound<'_, PyAny>>,
        dead_time: f64,
    ) -> PyResult<Self> {
        let dynamics = dynamics.map(|parts| linear_dynamics("dynamics", parts)).transpose()?;
        let chain = dynamics.unwrap_or_else(LinearDynamics::none).with_dead_time(dead_time).map_err(raise)?;
        Self::made(PreviewCoefficients::restored(&chain, dt, &coefficients, ahead).map_err(raise)?)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        if let Some((plain, seconds)) = &self.plain {
            let plain = Self { preview: plain.clone(), plain: None, made: self.made.clone(), dt: self.dt };
            let make = py.get_type::<Self>().getattr(intern!(py, "smoothed"))?;
            return reduce(make, (plain, *seconds), keywords!(py), None);
        }
        if let Some(made) = &self.made {
            let dynamics = (dynamics_object(py, made.dynamics())?, made.dynamics().dead_time());
            let values = (made.coefficients().to_vec(), made.ahead(), made.dt(), dynamics.0, dynamics.1);
            let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
            return reduce(make, values, keywords!(py), None);
        }
        reduce(py.get_type::<Self>().into_any(), (self.coefficients(py)?, self.ahead(), self.dt), keywords!(py), None)
    }

    fn __repr__(&self) -> String {
        format!("<Preview of {} taps, ahead {}>", self.preview.coefficients().len(), self.preview.ahead())
    }
}
