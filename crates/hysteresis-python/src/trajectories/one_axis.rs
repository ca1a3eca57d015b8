//! Trajectories of one axis: `Sine`, `RoundedTriangle` and `PointToPoint` of `mpi_hyst.trajectories`.

use hysteresis_control::trajectory::{self, MotionLimits, Trajectory};
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyReadonlyArray1};
use pyo3::prelude::*;

use crate::convert::arrays::read_only;
use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, hash, keywords, reduce};

type Vector<'py> = Bound<'py, PyArray1<f64>>;
pub(super) type Motions<'py> = PyResult<(Vector<'py>, Vector<'py>, Vector<'py>)>;

pub(super) fn sample<'py>(
    py: Python<'py>,
    trajectory: &impl Trajectory,
    dt: f64,
    seconds: Option<f64>,
) -> Motions<'py> {
    let motions = trajectory.sample(dt, seconds).map_err(raise)?;
    let column = |of: fn(&trajectory::Motion) -> f64| PyArray1::from_iter(py, motions.iter().map(of));
    Ok((column(|motion| motion.position), column(|motion| motion.velocity), column(|motion| motion.acceleration)))
}

// What all trajectories offer; those of a scan are in `scans`.
#[methods(Sine, RoundedTriangle, PointToPoint)]
impl Each {
    /// Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
    /// per second, and per second squared.
    ///
    /// For `seconds`; by default for one period, or until the end has come.
    fn sample<'py>(&self, py: Python<'py>, dt: f64, #[py(= None)] seconds: Option<f64>) -> Motions<'py> {
        sample(py, &self.0, dt, seconds)
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

/// r(t) = offset + amplitude sin(2 pi f t), with its derivatives.
///
/// Parameters
/// ----------
/// amplitude, offset : float
///     In the unit of the position.
/// frequency : float
///     Cycles per second, in Hz.
///
/// Raises
/// ------
/// ValueError
///     That names the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> position, velocity, acceleration = mh.trajectories.Sine(3.0, 1.0).sample(dt=0.25)
/// >>> position.round(12), velocity.round(2)
/// (array([ 0.,  3.,  0., -3.]), array([ 18.85,   0.  , -18.85,  -0.  ]))
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct Sine(pub(crate) trajectory::Sine);

#[methods]
impl Sine {
    #[new]
    fn new(amplitude: f64, frequency: f64, #[py(*, = 0.0)] offset: f64) -> PyResult<Self> {
        trajectory::Sine::new(amplitude, frequency, offset).map(Self).map_err(raise)
    }

    /// Half of the peak-to-peak swing.
    #[getter]
    fn amplitude(&self) -> f64 {
        self.0.amplitude()
    }

    /// Cycles per second, in Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// The value around which it swings.
    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset()
    }

    /// Seconds until it starts again.
    #[getter]
    fn period(&self) -> f64 {
        self.0.duration()
    }

    fn __hash__(&self) -> u64 {
        hash([self.amplitude(), self.frequency(), self.offset()].into_iter())
    }

    fn __repr__(&self) -> String {
        format!("Sine({:?}, {:?}, offset={:?})", self.amplitude(), self.frequency(), self.offset())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keywords = keywords!(py, offset = self.offset());
        reduce(py.get_type::<Self>().into_any(), (self.amplitude(), self.frequency()), keywords, None)
    }
}

/// A triangle with rounded corners, with its derivatives: straight sides, and a smooth change of velocity at the turns.
///
/// It first rises from its offset and reaches offset +- amplitude exactly. Velocity, acceleration and its derivative
/// are continuous.
///
/// Parameters
/// ----------
/// amplitude, offset : float
///     In the unit of the position.
/// frequency : float
///     Cycles per second, in Hz.
/// corner : float
///     How many seconds a turn takes, at most half a period.
///
/// Raises
/// ------
/// ValueError
///     That names the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> scan = mh.trajectories.RoundedTriangle(3.0, 1.0, corner=0.1)
/// >>> position, velocity, acceleration = scan.sample(dt=0.25)
/// >>> position, abs(velocity).round(3)
/// (array([ 0.,  3.,  0., -3.]), array([12.8,  0. , 12.8,  0. ]))
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct RoundedTriangle(pub(crate) trajectory::RoundedTriangle);

#[methods]
impl RoundedTriangle {
    #[new]
    fn new(amplitude: f64, frequency: f64, #[py(*)] corner: f64, #[py(= 0.0)] offset: f64) -> PyResult<Self> {
        trajectory::RoundedTriangle::new(amplitude, frequency, corner, offset).map(Self).map_err(raise)
    }

    /// Half of the peak-to-peak swing.
    #[getter]
    fn amplitude(&self) -> f64 {
        self.0.amplitude()
    }

    /// Cycles per second, in Hz.
    #[getter]
    fn frequency(&self) -> f64 {
        self.0.frequency()
    }

    /// How many seconds a turn takes.
    #[getter]
    fn corner(&self) -> f64 {
        self.0.corner()
    }

    /// The value around which it swings.
    #[getter]
    fn offset(&self) -> f64 {
        self.0.offset()
    }

    /// Seconds until it starts again.
    #[getter]
    fn period(&self) -> f64 {
        self.0.duration()
    }

    fn __hash__(&self) -> u64 {
        hash([self.amplitude(), self.frequency(), self.corner(), self.offset()].into_iter())
    }

    fn __repr__(&self) -> String {
        let (corner, offset) = (self.corner(), self.offset());
        format!("RoundedTriangle({:?}, {:?}, corner={corner:?}, offset={offset:?})", self.amplitude(), self.frequency())
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keywords = keywords!(py, corner = self.corner(), offset = self.offset());
        reduce(py.get_type::<Self>().into_any(), (self.amplitude(), self.frequency()), keywords, None)
    }
}

/// Moves from point to point with rests between, with their derivatives: S-curves, the fastest within the limits.
///
/// Each move starts and ends at rest, on its point exactly, has constant jerk on up to seven pieces and never
/// overshoots. Velocity and acceleration are continuous.
///
/// Parameters
/// ----------
/// points : array of n floats
///     Where it starts, and where each move ends.
/// velocity, acceleration, jerk : float
///     The most of each, in the unit of the position per second, per second squared, and cubed.
/// dwell : float
///     Seconds of rest at each point between the first and the last.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> moves = mh.trajectories.PointToPoint([0.0, 3.0], velocity=100.0, acceleration=1e4, jerk=1e6)
/// >>> round(moves.duration, 6)  # 3 um at 100 um/s, and twice 10 ms of jerk
/// 0.05
/// >>> position, velocity, acceleration = moves.sample(dt=0.01)
/// >>> position.round(6)
/// array([0.      , 0.166667, 1.      , 2.      , 2.833333, 3.      ])
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct PointToPoint(pub(crate) trajectory::PointToPoint);

#[methods]
impl PointToPoint {
    #[new]
    fn new(
        points: PyReadonlyArray1<'_, f64>,
        #[py(*)] velocity: f64,
        acceleration: f64,
        jerk: f64,
        #[py(= 0.0)] dwell: f64,
    ) -> PyResult<Self> {
        let limits = MotionLimits { velocity, acceleration, jerk };
        trajectory::PointToPoint::new(points.as_slice()?, limits, dwell).map(Self).map_err(raise)
    }

    /// Where it starts, and where each move ends, read-only.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Vector<'py>> {
        read_only(py, self.0.points().iter().copied())
    }

    /// The most velocity.
    #[getter]
    fn velocity(&self) -> f64 {
        self.0.limits().velocity
    }

    /// The most acceleration.
    #[getter]
    fn acceleration(&self) -> f64 {
        self.0.limits().acceleration
    }

    /// The most jerk.
    #[getter]
    fn jerk(&self) -> f64 {
        self.0.limits().jerk
    }

    /// Seconds of rest at each point between the first and the last.
    #[getter]
    fn dwell(&self) -> f64 {
        self.0.dwell()
    }

    /// Seconds until it rests at the last point.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn __hash__(&self) -> u64 {
        let limits = [self.velocity(), self.acceleration(), self.jerk(), self.dwell()];
        hash(self.0.points().iter().copied().chain(limits))
    }

    fn __repr__(&self) -> String {
        let (points, dwell) = (self.0.points(), self.dwell());
        let (velocity, acceleration, jerk) = (self.velocity(), self.acceleration(), self.jerk());
        let limits = format!("velocity={velocity:?}, acceleration={acceleration:?}, jerk={jerk:?}");
        format!("PointToPoint({points:?}, {limits}, dwell={dwell:?})")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let MotionLimits { velocity, acceleration, jerk } = self.0.limits();
        let keywords =
            keywords!(py, velocity = velocity, acceleration = acceleration, jerk = jerk, dwell = self.dwell());
        reduce(py.get_type::<Self>().into_any(), (self.points(py)?,), keywords, None)
    }
}
