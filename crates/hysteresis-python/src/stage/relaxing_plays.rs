//! The plays of a stage that relax.

use hysteresis_control::stage;
use hysteresis_python_macros::methods;
use numpy::{PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;

use crate::argument::Argument;
use crate::convert::arrays::{array, matrix, read_only};
use crate::convert::errors::{raise, unexpected};
use crate::convert::objects::{Reduced, hash, keywords, reduce};

/// Plays that relax: what makes loops wider or narrower at other rates of the drive u.
///
/// Loops of plays alone are as wide at any speed. Where a part of the hysteresis follows within a time of its own, as
/// in soft ferroelectrics, polymers and bearings, they are not. Behind the output map, beside the loop shift, the
/// position gains r:
///
/// z_i = P_ri[u - origin], a play that is virgin at the origin;
/// tau_j s_j' = sum_i v_ij z_i - s_j;
/// r = sum_j s_j.
///
/// One threshold of 0 is creep of the drive itself. The creep operators of P. Krejci and K. Kuhnen, IEE Proc. Control
/// Theory Appl. 148 (2001) 185-192, are kin: their thresholds lie within the lag. r follows from past drives alone, so
/// the inverse of the stage stays exact, sample by sample.
///
/// Parameters
/// ----------
/// thresholds : array of n floats
///     r_i, 0 or more, strictly increasing, in the unit of the drive.
/// time_constants : array of m floats
///     tau_j in seconds, above 0, strictly increasing.
/// weights : array of shape (m, n)
///     v_ij, a row for every time constant: position per unit of the drive.
/// origin : float
///     The drive at which all plays are virgin.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> plays = mh.plant.RelaxingPlays([100.0], time_constants=[0.05], weights=[[1e-3]])
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0), relaxing_plays=plays)
/// >>> def width(rate):  # of the loop that the plays add, um
/// ...     drive = mh.signals.sine(500.0, rate, seconds=3.0 / rate, rate=2000)  # V
/// ...     r = stage.forward(5e-4).run(drive) - stage.replace(relaxing_plays=None).forward(5e-4).run(drive)
/// ...     k = round(2000 / rate)  # samples in a period
/// ...     return round(float(r[5 * k // 2] - r[2 * k]), 3)
/// >>> width(1.0), width(4.0)
/// (0.464, 0.514)
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct RelaxingPlays(pub(crate) stage::RelaxingPlays);

#[methods]
impl RelaxingPlays {
    #[new]
    fn new(
        thresholds: PyReadonlyArray1<'_, f64>,
        time_constants: PyReadonlyArray1<'_, f64>,
        #[py("ArrayLike")] weights: &Bound<'_, PyAny>,
        #[py(= 0.0)] origin: f64,
    ) -> PyResult<Self> {
        let weights: PyReadonlyArray2<'_, f64> =
            array("weights", weights, format_args!("a row for every time constant, a number for every threshold"))?;
        let rows: Vec<Vec<f64>> = match weights.shape()[1] {
            0 => vec![Vec::new(); weights.shape()[0]],
            columns => weights.as_slice()?.chunks_exact(columns).map(<[f64]>::to_vec).collect(),
        };
        let made = stage::RelaxingPlays::new(thresholds.as_slice()?, origin, time_constants.as_slice()?, &rows);
        made.map(Self).map_err(raise)
    }

    /// r_i, in the unit of the drive, read-only.
    #[getter]
    fn thresholds<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.thresholds().iter().copied())
    }

    /// tau_j in seconds, read-only.
    #[getter]
    fn time_constants<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.0.time_constants().iter().copied())
    }

    /// v_ij, a row for every time constant, read-only.
    #[getter]
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        matrix(py, self.0.weights(), self.0.thresholds().len())
    }

    /// The drive at which all plays are virgin.
    #[getter]
    fn origin(&self) -> f64 {
        self.0.origin()
    }

    fn __eq__(&self, other: &Self) -> bool {
        self.0 == other.0
    }

    fn __hash__(&self) -> u64 {
        let weights = self.0.weights().iter().flatten();
        hash(self.0.thresholds().iter().chain(self.0.time_constants()).chain(weights).copied().chain([self.0.origin()]))
    }

    fn __repr__(&self) -> String {
        format!(
            "RelaxingPlays(thresholds={:?}, time_constants={:?}, weights={:?}, origin={:?})",
            self.0.thresholds(),
            self.0.time_constants(),
            self.0.weights(),
            self.0.origin()
        )
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arguments = (self.thresholds(py)?, self.time_constants(py)?, self.weights(py)?, self.origin());
        reduce(py.get_type::<Self>().into_any(), arguments, keywords!(py), None)
    }
}

impl Argument<'_> for stage::RelaxingPlays {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        value
            .cast::<RelaxingPlays>()
            .map(|plays| plays.get().0.clone())
            .map_err(|_| unexpected(name, "RelaxingPlays", value))
    }
}
