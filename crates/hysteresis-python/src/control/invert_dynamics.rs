//! Feed-forward through inverse dynamics for trajectories that are known in advance.

use std::ffi::CString;

use hysteresis_control::feedforward::{Shaper, worst_miss};
use hysteresis_control::linear::LinearDynamics;
use hysteresis_core::{Inverse, Process};
use numpy::PyArray1;
use pyo3::exceptions::PyUserWarning;
use pyo3::prelude::*;

use super::linear::part::LinearPart;
use super::reference::positions;
use super::trajectories::trajectory;
use crate::convert::arguments::{numbers, pair, samples};
use crate::convert::errors::raise;
use crate::model::object::kernel_of;

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// The share of peak-to-peak by which the position may miss samples without a warning.
const ROUGH: f64 = 0.01;

/// The samples that a derivative is taken from, unless told.
const WINDOW: usize = 8;

/// A trajectory as it came: samples or an object, and how it is to be sampled.
struct Course<'a, 'py> {
    trajectory: &'a Bound<'py, PyAny>,
    dt: f64,
    seconds: Option<f64>,
}

impl Course<'_, '_> {
    /// The positions at the sampling instants.
    fn positions(&self) -> PyResult<Vec<f64>> {
        positions("trajectory", self.trajectory, self.dt, self.seconds)
    }

    /// The targets behind which the trajectory follows; warns where samples are too rough for that.
    fn targets(
        &self,
        py: Python<'_>,
        dynamics: &LinearDynamics,
        window: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Vec<f64>> {
        let shaper = Shaper::new(dynamics, self.dt).map_err(raise)?;
        let window = window.map_or(Ok(WINDOW), |window| samples("window", window))?;
        if let Some(trajectory) = trajectory(self.trajectory) {
            // As long as the positions, and their memory is known to be there.
            let mut targets = self.positions()?;
            for (target, k) in targets.iter_mut().zip(0_u32..) {
                *target = shaper.target(trajectory, f64::from(k) * self.dt);
            }
            return Ok(targets);
        }
        let positions = self.positions()?;
        let targets = shaper.shape(&positions, window).map_err(raise)?;
        let miss = worst_miss(dynamics, self.dt, &positions, &targets).map_err(raise)?;
        let (low, high) = positions.iter().fold((f64::MAX, f64::MIN), |(low, high), r| (low.min(*r), high.max(*r)));
        if let Some(miss) = miss.filter(|miss| miss.error > ROUGH * (high - low)) {
            let (sample, error) = (miss.sample, miss.error);
            let message = format!(
                "trajectory: too rough for its dynamics: derivatives are smoothed over {window} samples, and the \
                 position misses sample {sample} by {error:.3}, more than 1 % of peak-to-peak"
            );
            PyErr::warn(py, &py.get_type::<PyUserWarning>(), &CString::new(message)?, 1)?;
        }
        Ok(targets)
    }
}

/// The displacement that the hysteresis has to put out, so that the position behind the dynamics follows a trajectory.
///
/// target[k] = r + a_1 r' + a_2 r'' + a_3 r''' at t_k + dt/2 + dead_time: 1 + a_1 s + a_2 s^2 + a_3 s^3 is the inverse of
/// dynamics and amplifier, half a sample the lag of the hold.
///
/// Parameters
/// ----------
/// trajectory : array of n floats, or one of `trajectories`
///     Samples dt apart, or an object whose derivatives are exact. Derivatives of samples are those of the polynomial of
///     degree 5 that fits `window` samples best; a corner, which has no second derivative, is rounded over the window.
/// dt : float
///     Sampling interval in seconds.
/// dynamics : SecondOrder, FirstOrder, or a list of them in series, optional
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds.
/// window : int
///     Samples that a derivative is taken from; more of them smooth more.
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
/// Warns
/// -----
/// UserWarning
///     Where the dynamics cannot follow samples within 1 % of peak-to-peak, as the smoothed derivatives are too far from
///     theirs, once the start is over.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.plant.SecondOrder(400.0, 0.95)
/// >>> scan = mh.trajectories.Sine(3.3, 20.0)
/// >>> target = mh.control.invert_dynamics(scan, 1e-4, dynamics=stage)
/// >>> position, _, _ = scan.sample(1e-4)
/// >>> missed = stage.response(target, 1e-4) - position
/// >>> bool(abs(missed[100:]).max() < 1e-4)  # um, once the start is over
/// True
#[pyfunction]
#[pyo3(signature = (trajectory, dt, *, dynamics=None, amplifier_bandwidth=None, dead_time=None,
    window=None, seconds=None), text_signature = "(trajectory, dt, *, dynamics=None, amplifier_bandwidth=None, dead_time=None, \
    window=8, seconds=None)")]
#[expect(clippy::too_many_arguments, reason = "one per argument of the Python function")]
pub(crate) fn invert_dynamics<'py>(
    py: Python<'py>,
    trajectory: &Bound<'py, PyAny>,
    dt: &Bound<'py, PyAny>,
    dynamics: Option<&Bound<'py, PyAny>>,
    amplifier_bandwidth: Option<&Bound<'py, PyAny>>,
    dead_time: Option<&Bound<'py, PyAny>>,
    window: Option<&Bound<'py, PyAny>>,
    seconds: Option<&Bound<'py, PyAny>>,
) -> Vector<'py> {
    numbers!(dt, amplifier_bandwidth, dead_time, seconds);
    let part = LinearPart { dynamics, amplifier_bandwidth, dead_time };
    let course = Course { trajectory, dt, seconds };
    Ok(PyArray1::from_vec(py, course.targets(py, &part.dynamics()?, window)?))
}

/// The drive that makes the position follow a trajectory: the exact inverse of the hysteresis, after the inverse of the
/// dynamics where there are any.
///
/// With `dynamics`, `amplifier_bandwidth` or `dead_time` the hysteresis has to put out the target of `invert_dynamics`. Without any of them
/// the position is taken to follow the hysteresis at once, and the drive is the inverse of the samples as they are.
/// The actuator starts from the virgin state.
///
/// Parameters
/// ----------
/// model : PrandtlIshlinskii or ModifiedPrandtlIshlinskii
/// trajectory : array of n floats, or one of `trajectories`
///     Samples dt apart, or an object whose derivatives are exact. Derivatives of samples are those of the polynomial of
///     degree 5 that fits `window` samples best; a corner, which has no second derivative, is rounded over the window.
/// dt : float
///     Sampling interval in seconds.
/// dynamics : SecondOrder, FirstOrder, or a list of them in series, optional
///     As for `invert_dynamics`.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     In seconds, as for `invert_dynamics`.
/// limits : (low, high), optional
///     Of the drive (V): where the target is out of reach, the drive stays at a limit.
/// window : int
///     Samples that a derivative is taken from; more of them smooth more.
/// seconds : float, optional
///     How much of a trajectory object; by default one period, or until its end.
///
/// Returns
/// -------
/// array of n floats
///     The drive (V).
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
/// NotInvertibleError
///     If the model has no inverse.
///
/// Warns
/// -----
/// UserWarning
///     Where samples are too rough for the dynamics, as for `invert_dynamics`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> model, stage = mh.paper.table_1_recovered(), mh.plant.SecondOrder(400.0, 0.95)
/// >>> moves = mh.trajectories.PointToPoint([0.0, 2.0], velocity=200.0, acceleration=2e5, jerk=4e8)
/// >>> drive = mh.control.precompensate(model, moves, 1e-4, dynamics=stage, limits=(-500.0, 500.0))
/// >>> position = stage.response(model.forward().run(drive), 1e-4)
/// >>> bool(abs(position - moves.sample(1e-4)[0]).max() < 2e-3)  # um: starts from rest
/// True
#[pyfunction]
#[pyo3(signature = (model, trajectory, dt, *, dynamics=None, amplifier_bandwidth=None, dead_time=None, limits=None,
    window=None, seconds=None), text_signature = "(model, trajectory, dt, *, dynamics=None, amplifier_bandwidth=None, dead_time=None, limits=None, \
    window=8, seconds=None)")]
#[expect(clippy::too_many_arguments, reason = "one per argument of the Python function")]
pub(crate) fn precompensate<'py>(
    py: Python<'py>,
    model: &Bound<'py, PyAny>,
    trajectory: &Bound<'py, PyAny>,
    dt: &Bound<'py, PyAny>,
    dynamics: Option<&Bound<'py, PyAny>>,
    amplifier_bandwidth: Option<&Bound<'py, PyAny>>,
    dead_time: Option<&Bound<'py, PyAny>>,
    limits: Option<&Bound<'py, PyAny>>,
    window: Option<&Bound<'py, PyAny>>,
    seconds: Option<&Bound<'py, PyAny>>,
) -> Vector<'py> {
    numbers!(dt, amplifier_bandwidth, dead_time, seconds);
    let part = LinearPart { dynamics, amplifier_bandwidth, dead_time };
    let mut inverse =
        Inverse::new(&kernel_of("model", model)?, limits.map(|limits| pair("limits", limits)).transpose()?)
            .map_err(raise)?;
    let course = Course { trajectory, dt, seconds };
    let chain = part.dynamics()?;
    let targets = if part.is_absent() { course.positions()? } else { course.targets(py, &chain, window)? };
    Ok(PyArray1::from_iter(py, targets.into_iter().map(|target| inverse.step(target))))
}
