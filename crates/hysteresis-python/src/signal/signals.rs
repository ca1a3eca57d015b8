//! `mpi_hyst.signals`.

use hysteresis_python_macros::function;
use hysteresis_simulate::signals::{self, Error, Wave};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::convert::errors::raise;

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
#[function]
pub(crate) fn sine<'py>(
    py: Python<'py>,
    amplitude: f64,
    frequency: f64,
    #[py(*)] seconds: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(= 0.0)] offset: f64,
) -> Samples<'py> {
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
#[function]
pub(crate) fn triangle<'py>(
    py: Python<'py>,
    amplitude: f64,
    frequency: f64,
    #[py(*)] seconds: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(= 0.0)] offset: f64,
) -> Samples<'py> {
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
#[function]
pub(crate) fn decaying_triangle<'py>(
    py: Python<'py>,
    amplitude: f64,
    frequency: f64,
    #[py(*)] cycles: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(= 0.0)] offset: f64,
) -> Samples<'py> {
    array(py, signals::decaying_triangle(Wave { amplitude, frequency, rate, offset }, cycles))
}
