//! Closed loops: a controller, a plant, a reference, and how well the plant followed.

use hysteresis_python_macros::{copies, methods};
use hysteresis_simulate::metrics::{self, LoopRecord};
use numpy::PyArray1;
use pyo3::intern;
use pyo3::prelude::*;
use pyo3::types::PyType;
use serde::{Deserialize, Serialize};

use crate::convert::arrays::{PASS, check_room, read_only};
use crate::convert::errors::raise;
use crate::convert::objects::{Reduced, keywords, reduce};

type Vector<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

/// The errors of a run, or of a part of it.
///
/// The measured error is reference - measured, what the paper plots; the position error is reference - position, what
/// matters, and free of measurement noise. Samples without a reading are left out of the measured errors, those whose
/// position is not known (NaN) out of the position errors. Where nothing is left, these errors are NaN.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.Stage(mh.paper.table_1_recovered(), limits=(-500.0, 500.0))
/// >>> run = stage.simulate(mh.signals.sine(1.0, 10.0, seconds=0.2), dt=1e-4)
/// >>> run.metrics.max_position_error < 0.01, run.metrics.saturated_count  # um
/// (True, 0)
#[copies(metrics::Metrics)]
#[pyclass(module = "mpi_hyst.plant", frozen, get_all)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Metrics {
    /// How many samples they are of.
    samples: usize,
    /// Largest magnitude of the measured error, um.
    max_error: f64,
    /// Root mean square of the measured error, um.
    rmse: f64,
    /// Largest magnitude of the position error, um.
    max_position_error: f64,
    /// Root mean square of the position error, um.
    position_rmse: f64,
    /// Peak-to-peak of the reference, um: the base of `hysteresis_percent`.
    range: f64,
    /// Largest magnitude of the measured error in % of `range`, or None if the reference does not move or nothing was
    /// read. What the paper calls hysteresis in Fig. 12 and 13, but for rounding (erratum 15).
    hysteresis_percent: Option<f64>,
    /// Lowest drive, V.
    drive_low: f64,
    /// Highest drive, V.
    drive_high: f64,
    /// At how many samples the drive was at a limit of the plant.
    saturated_count: usize,
    /// At how many samples there was no reading.
    #[serde(default)]
    missing_count: usize,
}

#[methods]
impl Metrics {
    fn __repr__(&self) -> String {
        format!(
            "<Metrics: measured error max {:.4e} rms {:.4e}, position error max {:.4e} rms {:.4e}, {} samples, {} \
             saturated{}>",
            self.max_error,
            self.rmse,
            self.max_position_error,
            self.position_rmse,
            self.samples,
            self.saturated_count,
            if self.missing_count > 0 { format!(", {} without a reading", self.missing_count) } else { String::new() }
        )
    }
}

/// The samples of a closed loop and the errors in them: made by `simulate`, or from a record of your own.
///
/// At the moment of sample k the position is position[k]; the controller reads measured[k], knows reference[k], and
/// puts out drive[k], which is held until the next sample.
///
/// Parameters
/// ----------
/// reference, measured, position, drive : arrays of n floats
///     um, um, um and V.
/// limits : (low, high), optional
///     Of the drive: what counts as saturated.
/// period : float, optional
///     Of the reference, in samples: `settled` leaves out the first.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument and the sample: four arrays of the same length, at least one sample, all finite.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> run = mh.plant.Run([0.0, 2.0, 0.0, -2.0], [0.0, 1.5, 0.25, -2.0], [0.0, 1.75, 0.0, -2.0], [9.0, 0.0, -9.0, 0.0],
/// ...              limits=(-9.0, 9.0), period=2)
/// >>> run.metrics.max_error, run.metrics.max_position_error, run.metrics.saturated_count
/// (0.5, 0.25, 2)
/// >>> run.metrics.hysteresis_percent, run.settled.max_error
/// (12.5, 0.25)
#[pyclass(module = "mpi_hyst.plant", frozen)]
pub(crate) struct Run(pub(crate) metrics::Run);

#[methods]
impl Run {
    #[new]
    fn new(
        reference: Vec<f64>,
        measured: Vec<f64>,
        position: Vec<f64>,
        drive: Vec<f64>,
        #[py(*, "Sequence[float] | None" = None)] limits: Option<(f64, f64)>,
        #[py(= None)] period: Option<f64>,
    ) -> PyResult<Self> {
        let record = LoopRecord { reference, measured, position, drive };
        check_room("reference", record.reference.len(), PASS)?;
        metrics::Run::new(record, limits, period).map(Self).map_err(raise)
    }

    /// Where the position should be, um.
    #[getter]
    fn reference<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.record().reference.iter().copied())
    }

    /// What the controller read, um; NaN where there was no reading.
    #[getter]
    fn measured<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.record().measured.iter().copied())
    }

    /// Where the position was, um; NaN where it is not known.
    #[getter]
    fn position<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.record().position.iter().copied())
    }

    /// What was put out, V: quantised, within the limits, held where the controller gave no number.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> Vector<'py> {
        read_only(py, self.0.record().drive.iter().copied())
    }

    /// The limits of the drive (low, high), or None.
    #[getter]
    fn limits(&self) -> Option<(f64, f64)> {
        self.0.limits()
    }

    /// The period of the reference in samples, or None.
    #[getter]
    fn period(&self) -> Option<f64> {
        self.0.period()
    }

    /// The errors of the whole run.
    #[getter]
    fn metrics(&self) -> Metrics {
        self.0.metrics().into()
    }

    /// The errors after the first period, or None if no period was given.
    #[getter]
    fn settled(&self) -> Option<Metrics> {
        self.0.settled().map(Metrics::from)
    }

    fn __len__(&self) -> usize {
        self.0.record().reference.len()
    }

    fn __repr__(&self) -> String {
        format!("<Run: {}>", self.metrics().__repr__().trim_matches(['<', '>']))
    }

    /// From what was kept, in which readings may be missing.
    #[classmethod]
    fn _restored(
        _: &Bound<'_, PyType>,
        arrays: [Vec<f64>; 4],
        limits: Option<(f64, f64)>,
        period: Option<f64>,
    ) -> PyResult<Self> {
        let [reference, measured, position, drive] = arrays;
        let record = LoopRecord { reference, measured, position, drive };
        metrics::Run::with_missing(record, limits, period).map(Self).map_err(raise)
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> Reduced<'py> {
        let arrays = (self.reference(py)?, self.measured(py)?, self.position(py)?, self.drive(py)?);
        let make = py.get_type::<Self>().getattr(intern!(py, "_restored"))?;
        reduce(make, (arrays, self.limits(), self.period()), keywords!(py), None)
    }
}
