//! `mpi_hyst.trajectories.Spiral`.

use hysteresis_control::trajectory::{self, SpiralRate};
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use super::axis::{AnyScan, center_of};
use crate::convert::errors::{raise, value};
use crate::convert::objects::hash;
use crate::convert::objects::{Reduced, keywords, reduce};

/// An Archimedean spiral from the centre outwards: r = pitch theta / (2 pi), x = r cos theta, y = r sin theta.
///
/// Give it a `frequency` for a constant angular velocity (CAV): both axes are sines of one frequency, whose amplitudes grow. Give it a
/// `speed` for a constant linear velocity (CLV): every part of the image is scanned equally fast (Mahmood and Moheimani,
/// Nanotechnology 20, 365503, 2009). Near the centre a constant speed would take any angular velocity. So a spiral starts there at
/// rest, and its rate is full from `inner_radius` on. The acceleration is at most 1.5 speed^2 / inner_radius, and 1.2
/// if the inner radius is a pitch or more. It ends at rest on its radius. Position, velocity and acceleration are continuous.
///
/// Parameters
/// ----------
/// radius : float
///     Where it ends, in the unit of the position (um).
/// pitch : float
///     How far its turns are apart, at most the radius.
/// frequency : float
///     Turns per second, in Hz; or
/// speed : float
///     The speed along the path, in the unit of the position per second.
/// inner_radius : float, optional
///     From where on the rate is full, at most half of the radius; by default a tenth of it.
/// center : (x, y)
///     Where it starts.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import numpy as np
/// >>> import mpi_hyst as mh
/// >>> spiral = mh.trajectories.Spiral(5.0, 0.1, speed=100.0)
/// >>> (x, vx, ax), (y, vy, ay) = spiral.x.sample(dt=1e-4), spiral.y.sample(dt=1e-4)
/// >>> begin, end = (round(t / 1e-4) for t in spiral.steady)
/// >>> bool(np.allclose(np.hypot(vx, vy)[begin:end], 100.0)), round(float(np.hypot(x, y).max()), 6)
/// (True, 5.0)
/// >>> cav = mh.trajectories.Spiral(5.0, 0.1, frequency=30.0)
/// >>> round(cav.duration, 2)  # 50 turns, those near the centre and the end slower
/// 1.84
#[pyclass(module = "mpi_hyst.trajectories", frozen)]
pub(crate) struct Spiral(pub(super) trajectory::Spiral);

/// The inner radius of a spiral that has none of its own, as a share of the radius.
const INNER: f64 = 0.1;

impl Spiral {
    /// As a scan of any kind.
    pub(super) fn any(&self) -> AnyScan {
        AnyScan::Spiral(self.0)
    }
}

#[methods]
impl Spiral {
    #[new]
    fn new(
        radius: f64,
        pitch: f64,
        #[py(*, = None)] frequency: Option<f64>,
        #[py(= None)] speed: Option<f64>,
        #[py(= None)] inner_radius: Option<f64>,
        #[py("tuple[float, float]" = (0.0, 0.0))] center: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let rate = match (frequency, speed) {
            (Some(frequency), None) => SpiralRate::Angular { frequency },
            (None, Some(speed)) => SpiralRate::Linear { speed },
            (None, None) => return Err(value("frequency", "expected a frequency or a speed, got neither")),
            (Some(frequency), Some(speed)) => {
                let got = format_args!("expected a frequency or a speed, got {frequency:?} and {speed:?}");
                return Err(value("frequency", got));
            }
        };
        let inner_radius = inner_radius.unwrap_or(INNER * radius);
        trajectory::Spiral::new(radius, pitch, rate, inner_radius, center_of(center)?).map(Self).map_err(raise)
    }

    /// Where it ends.
    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    /// How far its turns are apart.
    #[getter]
    fn pitch(&self) -> f64 {
        self.0.pitch()
    }

    /// Turns per second, in Hz, if the angular velocity is constant, else None.
    #[getter]
    fn frequency(&self) -> Option<f64> {
        match self.0.rate() {
            SpiralRate::Angular { frequency } => Some(frequency),
            SpiralRate::Linear { .. } => None,
        }
    }

    /// The speed along the path, if it is constant, else None.
    #[getter]
    fn speed(&self) -> Option<f64> {
        match self.0.rate() {
            SpiralRate::Angular { .. } => None,
            SpiralRate::Linear { speed } => Some(speed),
        }
    }

    /// From where on the rate is full.
    #[getter]
    fn inner_radius(&self) -> f64 {
        self.0.inner_radius()
    }

    /// Where it starts.
    #[getter]
    fn center(&self) -> (f64, f64) {
        self.0.center()
    }

    /// The times between which the rate is full, in seconds: (begin, end).
    #[getter]
    fn steady(&self) -> (f64, f64) {
        self.0.steady()
    }

    fn __hash__(&self) -> u64 {
        let (frequency, speed) = (self.frequency().unwrap_or(0.0), self.speed().unwrap_or(0.0));
        let (radius, pitch, inner, center) = (self.radius(), self.pitch(), self.inner_radius(), self.center());
        hash([radius, pitch, frequency, speed, inner, center.0, center.1].into_iter())
    }

    fn __repr__(&self) -> String {
        let rate = match self.0.rate() {
            SpiralRate::Angular { frequency } => format!("frequency={frequency:?}"),
            SpiralRate::Linear { speed } => format!("speed={speed:?}"),
        };
        let (radius, pitch, inner, center) = (self.radius(), self.pitch(), self.inner_radius(), self.center());
        format!("Spiral({radius:?}, {pitch:?}, {rate}, inner_radius={inner:?}, center={center:?})")
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let keywords = keywords!(
            py,
            frequency = self.frequency(),
            speed = self.speed(),
            inner_radius = self.inner_radius(),
            center = self.center()
        );
        reduce(py.get_type::<Self>().into_any(), (self.radius(), self.pitch()), keywords, None)
    }
}
