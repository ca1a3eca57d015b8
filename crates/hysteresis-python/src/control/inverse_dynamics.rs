//! Dynamics that are inverted for a whole motion, and the preview of a controller.

use hysteresis_control::feedforward::{DynamicsInverse, PreviewCoefficients, PreviewOptions, smoothing_kernel};
use hysteresis_control::linear::{FirstOrder, LinearDynamics};
use hysteresis_core as core;
use hysteresis_python_macros::{function, methods};
use numpy::PyArray1;
use pyo3::exceptions::PyValueError;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;

use crate::argument::{Class, SampleCount};
use crate::convert::arrays::{PASS, check_room, read_only, vector};
use crate::convert::errors::{self, raise};
use crate::convert::objects::{Reduced, keywords, reduce};
use crate::linear::dynamics::{dynamics_object, in_series, linear_dynamics};
use crate::stage::stage::{Keywords, Stage, precompensate as drives};
use crate::trajectories::positions::positions;

/// Makes the target of a `HybridController` of references known beforehand, by a fixed window.
///
/// target(k) = sum_j c_j r(k + ahead - j), j = 0 the newest. References then enter `step` `ahead` samples early; the
/// feedback uses r(k), from the same window, which at the start is full of the first reference.
///
/// While the window fills anew, at the start, after a hold and after a rejected reference, the target rests at the
/// first reference.
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

    /// One that was made elsewhere, for a sampling interval in seconds.
    pub(crate) fn of(preview: core::Preview, dt: f64) -> Self {
        Self { preview, plain: None, made: None, dt: Some(dt) }
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
        ahead: usize,
        #[py(= None)] dt: Option<f64>,
    ) -> PyResult<Self> {
        let coefficients = vector("coefficients", coefficients)?;
        let preview = core::Preview::new(coefficients.as_slice()?, ahead);
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
    /// Target and reference of the feedback are then those of the smoothed references, which come half of `seconds`
    /// earlier. So references may have steps and corners. Means over a period of a resonance leave it at rest: three
    /// periods of the slowest one are a good choice.
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
    /// Only `mpi_hyst.control.preview` knows which dynamics its coefficients invert: a ValueError for coefficients
    /// alone.
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
        let chain = in_series(None, dynamics.unwrap_or_default(), dead_time)?;
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

/// Feed-forward through inverse dynamics, sample by sample: weights of a window of references of which some lie ahead.
///
/// target(k) = sum_j c_j r(k + ahead - j). Polynomials up to a degree are followed exactly; what freedom the window
/// leaves minimises the error over the frequencies up to `band` (least squares). `error(f)` of the result tells what is
/// left of a sine: with 4 ahead and the defaults 2e-11 at 20 Hz and 2e-7 at 100 Hz for 400 Hz, damping 0.95, at 10 kHz.
/// The window must be as long as the inverse remembers: a few samples for resonances, some time constants of
/// antiresonances.
///
/// Parameters
/// ----------
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or None
/// dt : float
///     Sampling interval in seconds.
/// ahead : int
///     How many samples ahead the newest reference is.
/// window : int, optional
///     How many references: by default as many before the moment that the target aims at as after it, and at least 4.
/// degree : int, optional
///     Of the polynomials that are followed exactly; by default 5, or what a window of less than 6 allows.
/// band : float, optional
///     Up to which frequency in Hz errors count; by default 0.4 / dt.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds.
///
/// Returns
/// -------
/// Preview
///     For a `HybridController`.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> made = mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
/// >>> made
/// <Preview of 8 taps, ahead 4>
/// >>> made.error(20.0) < 1e-10, made.error(100.0) < 1e-6
/// (True, True)
#[function]
pub(crate) fn preview(
    dynamics: LinearDynamics,
    dt: f64,
    #[py(*)] ahead: SampleCount,
    #[py(= None)] window: Option<SampleCount>,
    #[py(= None)] degree: Option<SampleCount>,
    #[py(= None)] band: Option<f64>,
    #[py(= None)] amplifier_bandwidth: Option<FirstOrder>,
    #[py(= None)] dead_time: Option<f64>,
) -> PyResult<Preview> {
    let chain = in_series(amplifier_bandwidth, dynamics, dead_time.unwrap_or(0.0))?;
    let options = PreviewOptions {
        ahead: ahead.0,
        window: window.map(|window| window.0),
        degree: degree.map(|degree| degree.0),
        band,
    };
    Preview::made(PreviewCoefficients::new(&chain, dt, &options).map_err(raise)?)
}

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// What must enter linear dynamics so that the position follows a reference: stable inversion over the whole record.
///
/// Minimises sum (y - r)^2 and a small share of the second differences of the input, from rest, exactly sampled. So the
/// input is bounded for any stable dynamics, also with zeros in the right half plane, and does not ring between
/// samples. A reference that is in motion at its end is taken to go on.
///
/// Parameters
/// ----------
/// reference : array of n floats, or one of `trajectories`
///     The position that is read at t_k.
/// dt : float
///     Sampling interval in seconds.
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or None
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds.
/// start : float, optional
///     The position at which the dynamics rest before; by default the first reference.
/// seconds : float, optional
///     How much of a trajectory object; by default one period, or until its end.
///
/// Returns
/// -------
/// array of n floats
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mode = mh.plant.SecondOrder(400.0, 0.95)
/// >>> scan = mh.trajectories.Sine(3.3, 20.0)
/// >>> held = mh.control.invert_dynamics(scan, 1e-4, dynamics=mode)
/// >>> error = mode.response(held, 1e-4) - scan.sample(1e-4)[0]
/// >>> bool(abs(error[100:]).max() < 1e-6)  # um, once the start is over
/// True
#[function]
pub(crate) fn invert_dynamics<'py>(
    py: Python<'py>,
    #[py("ArrayLike | Trajectory")] reference: &Bound<'py, PyAny>,
    dt: f64,
    #[py(*, = None)] dynamics: LinearDynamics,
    #[py(= None)] amplifier_bandwidth: Option<FirstOrder>,
    #[py(= None)] dead_time: Option<f64>,
    #[py(= None)] start: Option<f64>,
    #[py(= None)] seconds: Option<f64>,
) -> Vector<'py> {
    let dynamics = in_series(amplifier_bandwidth, dynamics, dead_time.unwrap_or(0.0))?;
    let reference = positions("reference", reference, dt, seconds)?;
    check_room("reference", reference.len(), PASS)?;
    let inputs = py.detach(|| DynamicsInverse::new(&dynamics, dt)?.invert(&reference, start)).map_err(raise)?;
    Ok(PyArray1::from_vec(py, inputs))
}

/// The drives that move a stage along a reference: `stage.precompensate(reference, dt, ...)`.
///
/// Parameters
/// ----------
/// stage : Stage
/// reference : array of n floats, or one of `trajectories`
/// dt : float
///     Sampling interval in seconds.
/// limits, start, history, lead_in : optional
///     As for `Stage.precompensate`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), dynamics=mh.plant.SecondOrder(400.0, 0.95))
/// >>> moves = mh.trajectories.PointToPoint([0.0, 2.0], velocity=200.0, acceleration=2e5, jerk=4e8)
/// >>> drive = mh.control.precompensate(stage, moves, 1e-4)
/// >>> bool(abs(stage.forward(1e-4).run(drive) - moves.sample(1e-4)[0]).max() < 2e-3)  # um
/// True
#[function]
#[gather(keywords: Keywords)]
pub(crate) fn precompensate<'py>(
    py: Python<'py>,
    stage: Bound<'py, Stage>,
    #[py("ArrayLike | Trajectory")] reference: &Bound<'py, PyAny>,
    dt: f64,
    #[py(*, field, "Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
    #[py(field = None)] start: Option<f64>,
    #[py(field = None)] history: Option<Vec<f64>>,
    #[py(field = None)] lead_in: Option<f64>,
) -> Vector<'py> {
    let (found, _) = drives(&stage.get().0, reference, dt, &keywords, None)?;
    Ok(PyArray1::from_vec(py, found.drive))
}
