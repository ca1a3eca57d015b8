//! Feed-forward through inverse dynamics, sample by sample.

use hysteresis_control::feedforward::{PreviewOptions, Shaper};
use pyo3::prelude::*;

use super::linear::part::LinearPart;
use super::preview::Preview;
use crate::convert::arguments::{numbers, samples};
use crate::convert::errors::raise;

/// Feed-forward through inverse dynamics, sample by sample: weights of a window of references of which some lie ahead.
///
/// The target of the sample k is r + a_1 r' + a_2 r'' + a_3 r''' at t_k + dt/2 + dead_time: 1 + a_1 s + a_2 s^2 + a_3 s^3
/// is the inverse of dynamics and amplifier, half a sample the lag of the hold. The derivatives are those of the
/// polynomial that fits the window best (Savitzky and Golay), so polynomials up to the degree are exact; `error` of the
/// result tells how well sines come through. With 4 ahead and the defaults that is 2e-11 at 20 Hz and 2e-7 at 100 Hz for
/// a stage of 400 Hz, damping 0.95, at 10 kHz.
///
/// Parameters
/// ----------
/// dynamics : SecondOrder, FirstOrder, a list of them in series, or None
/// dt : float
///     Sampling interval in seconds.
/// ahead : int
///     How many samples ahead the newest reference is.
/// window : int, optional
///     How many references: by default as many before the moment that the target aims at as after it, and at least 4.
/// degree : int, optional
///     Of the polynomials; by default 5, or what a window of less than 6 allows. A longer window smooths, a higher degree
///     follows faster references.
/// amplifier_bandwidth : float, optional
///     Cut-off frequency in Hz of an amplifier in series.
/// dead_time : float, optional
///     What the sensor shows later than the dynamics explain, in seconds.
///
/// Returns
/// -------
/// Preview
///     For a `HybridController`.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> made = mh.control.preview(mh.plant.SecondOrder(400.0, 0.95), 1e-4, ahead=4)
/// >>> made
/// <Preview of 8 taps, ahead 4>
/// >>> made.error(20.0) < 1e-10, made.error(100.0) < 1e-6
/// (True, True)
#[pyfunction]
#[pyo3(signature = (dynamics, dt, *, ahead, window=None, degree=None, amplifier_bandwidth=None, dead_time=None))]
pub(crate) fn preview(
    dynamics: Option<&Bound<'_, PyAny>>,
    dt: &Bound<'_, PyAny>,
    ahead: &Bound<'_, PyAny>,
    window: Option<&Bound<'_, PyAny>>,
    degree: Option<&Bound<'_, PyAny>>,
    amplifier_bandwidth: Option<&Bound<'_, PyAny>>,
    dead_time: Option<&Bound<'_, PyAny>>,
) -> PyResult<Preview> {
    numbers!(dt, amplifier_bandwidth, dead_time);
    let chain = LinearPart { dynamics, amplifier_bandwidth, dead_time }.dynamics()?;
    let options = PreviewOptions {
        ahead: samples("ahead", ahead)?,
        window: window.map(|window| samples("window", window)).transpose()?,
        degree: degree.map(|degree| samples("degree", degree)).transpose()?,
    };
    let made = Shaper::new(&chain, dt).and_then(|shaper| shaper.preview(&options));
    Preview::made(made.map_err(raise)?)
}
