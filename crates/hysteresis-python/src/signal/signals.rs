//! `mpi_hyst.signals`.

use hysteresis_simulate::signals::{self, Error, Wave};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::convert::arguments::numbers;
use crate::convert::errors::raise;

/// Samples per second unless told, in Hz.
pub(crate) const RATE: f64 = 1e4;

/// What a signal is in Python.
pub(super) type Samples<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

fn array(py: Python<'_>, samples: Result<Vec<f64>, Error>) -> Samples<'_> {
    samples.map(|samples| PyArray1::from_vec(py, samples)).map_err(raise)
}

/// offset + amplitude sin(2 pi f t).
///
/// Parameters
/// ----------
/// amplitude, offset : float
///     In the unit of the signal.
/// frequency, rate : float
///     Cycles and samples per second, in Hz.
/// seconds : float
///     Duration.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.signals.sine(500.0, 1.0, seconds=2.0, rate=10_000).shape
/// (20000,)
#[pyfunction]
#[pyo3(signature = (amplitude, frequency, *, seconds, rate=None, offset=None),
    text_signature = "(amplitude, frequency, *, seconds, rate=10000.0, offset=0.0)")]
pub(crate) fn sine<'py>(
    py: Python<'py>,
    amplitude: &Bound<'py, PyAny>,
    frequency: &Bound<'py, PyAny>,
    seconds: &Bound<'py, PyAny>,
    rate: Option<&Bound<'py, PyAny>>,
    offset: Option<&Bound<'py, PyAny>>,
) -> Samples<'py> {
    numbers!(amplitude, frequency, seconds, rate = RATE, offset = 0.0);
    array(py, signals::sine(Wave { amplitude, frequency, rate, offset }, seconds))
}

/// A triangle that first rises.
///
/// Parameters
/// ----------
/// amplitude, offset : float
///     In the unit of the signal.
/// frequency, rate : float
///     Cycles and samples per second, in Hz.
/// seconds : float
///     Duration.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.signals.triangle(2.0, 1.0, seconds=1.0, rate=4)
/// array([ 0.,  2.,  0., -2.])
#[pyfunction]
#[pyo3(signature = (amplitude, frequency, *, seconds, rate=None, offset=None),
    text_signature = "(amplitude, frequency, *, seconds, rate=10000.0, offset=0.0)")]
pub(crate) fn triangle<'py>(
    py: Python<'py>,
    amplitude: &Bound<'py, PyAny>,
    frequency: &Bound<'py, PyAny>,
    seconds: &Bound<'py, PyAny>,
    rate: Option<&Bound<'py, PyAny>>,
    offset: Option<&Bound<'py, PyAny>>,
) -> Samples<'py> {
    numbers!(amplitude, frequency, seconds, rate = RATE, offset = 0.0);
    array(py, signals::triangle(Wave { amplitude, frequency, rate, offset }, seconds))
}

/// A triangle of one cycle at full swing, which then shrinks to nothing: a record to identify from, or to demagnetise.
///
/// Parameters
/// ----------
/// amplitude, offset : float
///     Swing at the start, and the value around which the signal swings.
/// frequency, rate : float
///     Cycles and samples per second, in Hz.
/// cycles : float
///     Duration, the first cycle at full swing included.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> mh.signals.decaying_triangle(1.0, 1.0, cycles=3, rate=4)[1::2]  # the reversals
/// array([ 1.   , -1.   ,  0.875, -0.625,  0.375, -0.125])
#[pyfunction]
#[pyo3(signature = (amplitude, frequency, *, cycles, rate=None, offset=None),
    text_signature = "(amplitude, frequency, *, cycles, rate=10000.0, offset=0.0)")]
pub(crate) fn decaying_triangle<'py>(
    py: Python<'py>,
    amplitude: &Bound<'py, PyAny>,
    frequency: &Bound<'py, PyAny>,
    cycles: &Bound<'py, PyAny>,
    rate: Option<&Bound<'py, PyAny>>,
    offset: Option<&Bound<'py, PyAny>>,
) -> Samples<'py> {
    numbers!(amplitude, frequency, cycles, rate = RATE, offset = 0.0);
    array(py, signals::decaying_triangle(Wave { amplitude, frequency, rate, offset }, cycles))
}
