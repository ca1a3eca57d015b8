//! One axis of a scan of any kind, and what all scans offer.

use hysteresis_control::trajectory::{self, Axis, Motion, Scan, Trajectory};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use super::lissajous::Lissajous;
use super::raster::Raster;
use super::spiral::Spiral;
use crate::control::trajectories::{Motions, sample};
use crate::convert::arguments::pair_of_axes;
use crate::convert::objects::{Reduced, keywords, reduce};

/// A scan of any kind.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum AnyScan {
    Raster(trajectory::Raster),
    Spiral(trajectory::Spiral),
    Lissajous(trajectory::Lissajous),
}

impl AnyScan {
    /// The scan as an object.
    fn object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match *self {
            Self::Raster(scan) => Bound::new(py, Raster(scan))?.into_any(),
            Self::Spiral(scan) => Bound::new(py, Spiral(scan))?.into_any(),
            Self::Lissajous(scan) => Bound::new(py, Lissajous(scan))?.into_any(),
        })
    }
}

impl Scan for AnyScan {
    fn motion(&self, axis: Axis, t: f64) -> Motion {
        match self {
            Self::Raster(scan) => scan.motion(axis, t),
            Self::Spiral(scan) => scan.motion(axis, t),
            Self::Lissajous(scan) => scan.motion(axis, t),
        }
    }

    fn duration(&self) -> f64 {
        match self {
            Self::Raster(scan) => scan.duration(),
            Self::Spiral(scan) => scan.duration(),
            Self::Lissajous(scan) => scan.duration(),
        }
    }
}

/// One axis of a scan, with its derivatives: made by `.x` and `.y` of a `Raster`, `Spiral` or `Lissajous`.
///
/// Both axes of a scan take equally long, so their samples belong together.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> raster = mh.trajectories.Raster(10.0, 8.0, 64, line_rate=5.0)  # um, um, lines, Hz
/// >>> position, velocity, acceleration = raster.x.sample(dt=1e-4)
/// >>> position.size == round(raster.x.duration / 1e-4) + 1
/// True
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct ScanAxis(pub(crate) trajectory::ScanAxis<AnyScan>);

#[methods]
impl ScanAxis {
    /// Position, velocity and acceleration at 0, dt, 2 dt and so on: three arrays, in the unit of the position,
    /// per second, and per second squared.
    ///
    /// For `seconds`; by default until the end has come.
    fn sample<'py>(&self, py: Python<'py>, dt: f64, #[py(= None)] seconds: Option<f64>) -> Motions<'py> {
        sample(py, &self.0, dt, seconds)
    }

    /// The scan to which it belongs.
    #[getter]
    #[py(-> "Raster | Spiral | Lissajous")]
    fn scan<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.0.scan().object(py)
    }

    /// "x" or "y".
    #[getter]
    #[py(-> "Literal['x', 'y']")]
    fn name(&self) -> &'static str {
        match self.0.axis() {
            Axis::X => "x",
            Axis::Y => "y",
        }
    }

    /// Seconds until it rests at the end.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self, py: Python<'_>) -> PyResult<isize> {
        (self.0.scan().object(py)?, self.name()).into_pyobject(py)?.hash()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("{}.{}", self.0.scan().object(py)?.repr()?, self.name()))
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let getattr = py.import("builtins")?.getattr("getattr")?;
        reduce(getattr, (self.0.scan().object(py)?, self.name()), keywords!(py), None)
    }
}

// What all scans offer.
#[methods(Raster, Spiral, Lissajous)]
impl Each {
    /// The trajectory of x, the fast axis of a raster.
    #[getter]
    fn x(&self) -> ScanAxis {
        ScanAxis(self.any().x())
    }

    /// The trajectory of y.
    #[getter]
    fn y(&self) -> ScanAxis {
        ScanAxis(self.any().y())
    }

    /// Seconds until both axes rest at the end.
    #[getter]
    fn duration(&self) -> f64 {
        self.0.duration()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }
}

/// The centre, (0, 0) unless given.
pub(super) fn center_of(center: Option<&Bound<'_, PyAny>>) -> PyResult<(f64, f64)> {
    center.map_or(Ok((0.0, 0.0)), |center| pair_of_axes("center", center))
}
