//! The slow gain of a stage.

use hysteresis_control::stage;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use crate::argument::Argument;
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

/// The slow gain: how the size of all loops changes while the drive u cycles, and comes back at rest.
///
/// Measured on piezo stacks: within a minute of cycling all loops become smaller by a few parts in a thousand. No model
/// of Preisach's class has that. Behind output map, loop shift and relaxing plays, in front of the creep,
/// the position h becomes v:
///
/// x = u / half_range;
/// e = x - f, within -1 .. 1, where f follows x with the time constant tau / 4;
/// m' = (e^2 - m) / tau;
/// v = zero + (1 + amplitude m) (h - zero).
///
/// At rest m is 0. A sine over the whole range has m = 1/2 once it has lasted, and no drive more than 1. m follows from
/// past drives alone, so the inverse of the stage stays exact, sample by sample.
///
/// Parameters
/// ----------
/// half_range : float
///     Half of the range of drives.
/// amplitude : float
///     kappa, from -0.5 to 0.5, without a unit: negative where loops become smaller.
/// zero : float
///     The position that the gain leaves where it is.
/// time_constant : float
///     tau in seconds.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> gain = mh.plant.SlowGain(500.0, amplitude=-0.01, zero=0.0, time_constant=5.0)
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), slow_gain=gain)
/// >>> drive = mh.signals.sine(500.0, 1.0, seconds=40.0, rate=100)  # V
/// >>> y = stage.forward(0.01).run(drive)
/// >>> first, last = y[100:200], y[-100:]
/// >>> round(float((last.max() - last.min()) / (first.max() - first.min())), 4)
/// 0.9963
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct SlowGain(pub(crate) stage::SlowGain);

#[methods]
impl SlowGain {
    #[new]
    fn new(half_range: f64, amplitude: f64, zero: f64, time_constant: f64) -> PyResult<Self> {
        stage::SlowGain::new(half_range, amplitude, zero, time_constant).map(Self).map_err(raise)
    }

    /// Half of the range of drives.
    #[getter]
    fn half_range(&self) -> f64 {
        self.0.half_range()
    }

    /// kappa, without a unit.
    #[getter]
    fn amplitude(&self) -> f64 {
        self.0.amplitude()
    }

    /// The position that the gain leaves where it is.
    #[getter]
    fn zero(&self) -> f64 {
        self.0.zero()
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
        hash([self.half_range(), self.amplitude(), self.zero(), self.time_constant()].into_iter())
    }

    fn __repr__(&self) -> String {
        format!(
            "SlowGain(half_range={:?}, amplitude={:?}, zero={:?}, time_constant={:?})",
            self.half_range(),
            self.amplitude(),
            self.zero(),
            self.time_constant()
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = (self.half_range(), self.amplitude(), self.zero(), self.time_constant());
        reduce(py.get_type::<Self>().into_any(), arguments, keywords!(py), None)
    }
}

impl Argument<'_> for stage::SlowGain {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.cast::<SlowGain>().map(|gain| gain.get().0).map_err(|_| unexpected(name, "a SlowGain", value))
    }
}
