//! The loop shift of a stage.

use hysteresis_control::stage;
use hysteresis_python_macros::methods;
use pyo3::prelude::*;

use crate::argument::Argument;
use crate::convert::arguments::two;
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

/// The shift of a loop: what motion of the drive u adds to the position.
///
/// Measured on piezo stacks: the centre of a loop moves with its amplitude, or rate. No model of Preisach's class has
/// that. Behind the output map, in front of the creep, the position gains s = c_1 m + c_2 n:
///
/// x = (u - center) / half_range;
/// e = x - f, within -limit .. limit, where f follows x with the time constant tau / 4;
/// m' = (e^2 - m) / tau, n' = (x abs(e) - n) / tau.
///
/// For a motion that is slow beside tau, e is about (tau / 4) x'. c_1 moves the centre of every loop, c_2 that of a
/// loop that lies off the centre of the range. At rest s is 0. It follows from past drives alone, so the inverse of the
/// stage stays exact, sample by sample. A shift says nothing of other rates than those of its records: `limit`, the
/// largest e there, keeps it from growing hundredfold at ten times the rate.
///
/// Parameters
/// ----------
/// center : float
///     The drive in the middle of the range.
/// half_range : float
///     Half of the range of drives.
/// amplitudes : (float, float)
///     c_1 and c_2, in the unit of the position.
/// time_constant : float
///     tau in seconds.
/// limit : float
///     The largest magnitude of e, without a unit.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> shift = mh.plant.LoopShift(0.0, 500.0, amplitudes=(-0.6, 0.0), time_constant=0.2, limit=0.5)
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), loop_shift=shift)
/// >>> drive = mh.signals.sine(400.0, 1.0, seconds=4.0, rate=1e3)  # V
/// >>> moved = stage.forward(1e-3).run(drive) - stage.replace(loop_shift=None).forward(1e-3).run(drive)
/// >>> round(float(moved[-1000:].mean()), 4)  # um
/// -0.0172
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct LoopShift(pub(crate) stage::LoopShift);

#[methods]
impl LoopShift {
    #[new]
    fn new(
        center: f64,
        half_range: f64,
        #[py("Sequence[float]")] amplitudes: &Bound<'_, PyAny>,
        time_constant: f64,
        limit: f64,
    ) -> PyResult<Self> {
        let amplitudes = two("amplitudes", "(c_1, c_2)", amplitudes)?.into();
        stage::LoopShift::new(center, half_range, amplitudes, time_constant, limit).map(Self).map_err(raise)
    }

    /// The drive in the middle of the range.
    #[getter]
    fn center(&self) -> f64 {
        self.0.center()
    }

    /// Half of the range of drives.
    #[getter]
    fn half_range(&self) -> f64 {
        self.0.half_range()
    }

    /// c_1 and c_2, in the unit of the position.
    #[getter]
    fn amplitudes(&self) -> (f64, f64) {
        self.0.amplitudes().into()
    }

    /// tau in seconds.
    #[getter]
    fn time_constant(&self) -> f64 {
        self.0.time_constant()
    }

    /// The largest magnitude of e.
    #[getter]
    fn limit(&self) -> f64 {
        self.0.limit()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        let [square, product] = self.0.amplitudes();
        let numbers = [self.0.center(), self.0.half_range(), square, product, self.0.time_constant(), self.0.limit()];
        hash(numbers.into_iter())
    }

    fn __repr__(&self) -> String {
        format!(
            "LoopShift(center={:?}, half_range={:?}, amplitudes={:?}, time_constant={:?}, limit={:?})",
            self.center(),
            self.half_range(),
            self.amplitudes(),
            self.time_constant(),
            self.limit()
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = (self.center(), self.half_range(), self.amplitudes(), self.time_constant(), self.limit());
        reduce(py.get_type::<Self>().into_any(), arguments, keywords!(py), None)
    }
}

impl Argument<'_> for stage::LoopShift {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value.cast::<LoopShift>().map(|shift| shift.get().0).map_err(|_| unexpected(name, "a LoopShift", value))
    }
}
