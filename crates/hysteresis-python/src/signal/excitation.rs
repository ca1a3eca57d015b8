//! `mpi_hyst.signals`: drives that make an actuator's memory known.

use hysteresis_python_macros::{function, methods};
use hysteresis_simulate::excitation::{Excitation as Made, ExcitationOptions, Shape};
use numpy::PyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::convert::arguments::{OrDefault, count, unknown};
use crate::convert::arrays::read_only;
use crate::convert::errors::raise;

/// An input to identify from: made by `excitation`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> found = mh.signals.excitation(0.0, 150.0, slew=2000.0, rate=2000.0)
/// >>> bool(found.drive.min() == 0.0 and found.drive.max() == 150.0)
/// True
#[pyclass(module = "mpi_hyst.signals", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct Excitation {
    drive: Vec<f64>,
    initialization_samples: usize,
    reversals: Vec<f64>,
}

impl From<Made> for Excitation {
    fn from(made: Made) -> Self {
        let Made { drive, initialization_samples, reversals } = made;
        Self { drive, initialization_samples, reversals }
    }
}

#[methods]
impl Excitation {
    /// The samples, from start to start.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.drive.iter().copied())
    }

    /// How many samples come before the memory is known: the `skip` of `identify`.
    #[getter]
    fn initialization_samples(&self) -> usize {
        self.initialization_samples
    }

    /// Where the drive turns, in order: one stroke to either limit, one cycle at full swing, the decay.
    #[getter]
    fn reversals<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.reversals.iter().copied())
    }

    fn __repr__(&self) -> String {
        let (samples, reversals) = (self.drive.len(), self.reversals.len());
        let initialization = self.initialization_samples;
        format!("<Excitation: {samples} samples, {initialization} of them to initialize, {reversals} reversals>")
    }
}

/// A drive to identify from: both limits, one cycle at full swing, then decaying reversals, within a slew limit.
///
/// Once both limits were reached, the memory of an actuator that was never driven beyond them is known: `initialization_samples`
/// counts the samples before, to be skipped by `identify`. With as many cycles as the model has operators, a reversal
/// on the way up and one on the way down fall between any two neighbouring uniform thresholds. Every reversal is met by
/// a sample; small loops take less time than large ones.
///
/// Parameters
/// ----------
/// low, high : float
///     Limits of the drive (V): never left, both reached.
/// slew : float
///     Largest speed of the drive (V/s): never exceeded from sample to sample.
/// rate : float
///     Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
/// cycles : int
///     Decaying cycles after the one at full swing.
/// shape : "triangle" or "sine"
///     Straight moves from reversal to reversal, or half cosines of the same largest speed.
/// center : float, optional
///     What the reversals decay to: the middle of the limits unless given.
/// start : float, optional
///     Where the drive starts and ends: zero, or the limit nearest to it, unless given.
///
/// Returns
/// -------
/// Excitation
///     With `drive`, `initialization_samples` and `reversals`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> made = mh.signals.excitation(-500.0, 500.0, slew=2000.0, rate=1000.0)
/// >>> made
/// <Excitation: 11771 samples, 750 of them to initialize, 43 reversals>
/// >>> y = mh.paper.table_1_recovered().forward().run(made.drive)
/// >>> found = mh.identify(made.drive, y, skip=made.initialization_samples, input_offset=0.0, dead_time=0.0)
/// >>> [round(ratio, 4) for ratio in found.ratios]
/// [0.95, 0.3, 0.35]
#[function]
pub(crate) fn excitation(
    py: Python<'_>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    #[py(= 10000.0)] rate: f64,
    #[py("int" = 20)] cycles: Option<&Bound<'_, PyAny>>,
    #[py("Literal['triangle', 'sine']" = "triangle")] shape: OrDefault<'_>,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
) -> PyResult<Excitation> {
    let options = options((low, high), slew, rate, cycles, &shape, (center, start))?;
    py.detach(|| options.excitation()).map(Excitation::from).map_err(raise)
}

/// A decaying alternation that brings an actuator from any history to its virgin state, within a slew limit.
///
/// Let A be the first amplitude, the smaller distance from `center` to a limit. From any history within `center` +- A
/// it leaves every play within A / (4 cycles) of rest, and every coupled play with r >= rb and ra >= rc too, if
/// `center` is the input offset of the model. So the output that is left is at most A / (4 cycles) times the sum of
/// the weights but the first: of what a stroke of A moves, less than 1 / (4 cycles).
///
/// Parameters
/// ----------
/// low, high : float
///     Limits of the drive (V): never left.
/// slew : float
///     Largest speed of the drive (V/s): never exceeded from sample to sample.
/// rate : float
///     Samples per second, in Hz: at least one sample must fit between the nearest reversals on one side.
/// cycles : int
///     Cycles that the alternation takes to decay.
/// shape : "triangle" or "sine"
///     Straight moves from reversal to reversal, or half cosines of the same largest speed.
/// center : float, optional
///     What the alternation decays to: the middle of the limits unless given.
/// start : float, optional
///     Where the drive starts and ends: zero, or the limit nearest to it, unless given.
///
/// Returns
/// -------
/// array of float
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> actuator = mh.paper.table_1_recovered()
/// >>> stream = actuator.forward()
/// >>> left = stream.run([500.0, 0.0])[-1]                  # um
/// >>> drive = mh.signals.demagnetize(-500.0, 500.0, slew=2000.0, rate=1000.0)
/// >>> bool(abs(stream.run(drive)[-1]) < 500.0 / (4 * 20) * actuator.weights[1:].sum())
/// True
/// >>> bool(abs(stream.step(0.0)) < 0.001 * left)
/// True
#[function]
pub(crate) fn demagnetize<'py>(
    py: Python<'py>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    #[py(= 10000.0)] rate: f64,
    #[py("int" = 20)] cycles: Option<&Bound<'py, PyAny>>,
    #[py("Literal['triangle', 'sine']" = "triangle")] shape: OrDefault<'_>,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let options = options((low, high), slew, rate, cycles, &shape, (center, start))?;
    py.detach(|| options.demagnetizing()).map(|drive| PyArray1::from_vec(py, drive)).map_err(raise)
}

fn options(
    (low, high): (f64, f64),
    slew: f64,
    rate: f64,
    cycles: Option<&Bound<'_, PyAny>>,
    shape: &OrDefault<'_>,
    (center, start): (Option<f64>, Option<f64>),
) -> PyResult<ExcitationOptions> {
    let shape = shape_of(shape)?;
    let cycles = cycles.map_or(Ok(20), |cycles| count("cycles", cycles))?;
    Ok(ExcitationOptions {
        low,
        high,
        slew,
        rate,
        cycles: u32::try_from(cycles).unwrap_or(u32::MAX),
        shape,
        center: center.unwrap_or(0.5 * low + 0.5 * high),
        // Not clamp, which panics if low is above high: the plan says what is wrong with them.
        start: start.unwrap_or(0.0_f64.max(low).min(high)),
    })
}

pub(crate) fn shape_of(shape: &OrDefault<'_>) -> PyResult<Shape> {
    let expected = "\"triangle\" or \"sine\"";
    match shape.word("shape", expected, "triangle")?.as_str() {
        "triangle" => Ok(Shape::Triangle),
        "sine" => Ok(Shape::Sine),
        got => unknown("shape", expected, got),
    }
}
