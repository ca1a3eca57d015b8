//! Feed-forward through inverse dynamics for references that are known in advance.

use hysteresis_control::feedforward::DynamicsInverse;
use hysteresis_python_macros::function;
use numpy::PyArray1;
use pyo3::prelude::*;

use super::linear::part::LinearPart;
use super::reference::positions;
use crate::convert::errors::raise;
use crate::convert::memory::{PASS, check_room};
use crate::convert::objects::instance;
use crate::stage::object::Stage;
use crate::stage::precompensate::{Keywords, precompensate as drives};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// What must enter linear dynamics so that the position follows a reference: stable inversion over the whole record.
///
/// Minimises sum (y - r)^2 and a small share of the second differences of the input, from rest, exactly sampled. So the input
/// is bounded for any stable dynamics, also with zeros in the right half plane, and does not ring between samples. A
/// reference that is in motion at its end is taken to go on.
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
    #[py(*, "Dynamics | None" = None)] dynamics: Option<&Bound<'py, PyAny>>,
    #[py(= None)] amplifier_bandwidth: Option<f64>,
    #[py(= None)] dead_time: Option<f64>,
    #[py(= None)] start: Option<f64>,
    #[py(= None)] seconds: Option<f64>,
) -> Vector<'py> {
    let dynamics = LinearPart { dynamics, amplifier_bandwidth, dead_time }.dynamics()?;
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
pub(crate) fn precompensate<'py>(
    py: Python<'py>,
    #[py("Stage")] stage: &Bound<'py, PyAny>,
    #[py("ArrayLike | Trajectory")] reference: &Bound<'py, PyAny>,
    dt: f64,
    #[py(*, "Sequence[float] | None" = None)] limits: Option<Bound<'py, PyAny>>,
    #[py("float | None" = None)] start: Option<Bound<'py, PyAny>>,
    #[py("ArrayLike | None" = None)] history: Option<Bound<'py, PyAny>>,
    #[py("float | None" = None)] lead_in: Option<Bound<'py, PyAny>>,
) -> Vector<'py> {
    let stage = instance::<Stage>("stage", "a mh.Stage", stage)?;
    let found = drives(&stage.get().0, reference, dt, &Keywords { limits, start, history, lead_in })?;
    Ok(PyArray1::from_vec(py, found.drive))
}
