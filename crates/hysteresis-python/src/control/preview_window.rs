//! Feed-forward through inverse dynamics, sample by sample.

use hysteresis_control::feedforward::{PreviewCoefficients, PreviewOptions};
use hysteresis_python_macros::function;
use pyo3::prelude::*;

use super::linear::part::LinearPart;
use super::preview::Preview;
use crate::convert::arguments::samples;
use crate::convert::errors::raise;

/// Feed-forward through inverse dynamics, sample by sample: weights of a window of references of which some lie ahead.
///
/// target(k) = sum_j c_j r(k + ahead - j). Polynomials up to a degree are followed exactly; what freedom the window leaves
/// minimises the error over the frequencies up to `band` (least squares). `error(f)` of the result tells what is left of a
/// sine: with 4 ahead and the defaults 2e-11 at 20 Hz and 2e-7 at 100 Hz for 400 Hz, damping 0.95, at 10 kHz. The window must
/// be as long as the inverse remembers: a few samples for resonances, some time constants of antiresonances.
///
/// Parameters
/// ----------
/// dynamics : FirstOrder, SecondOrder, Antiresonance, Modes, StateSpace, a list of them in series, or None
/// dt : float
///     Sampling interval in seconds.
/// ahead : int
///     How many samples ahead the newest reference is.
/// window : int, optional
///     How many references: by default as many before the moment that the target aims at as after it, and at least 4.
/// degree : int, optional
///     Of the polynomials that are followed exactly; by default 5, or what a window of less than 6 allows.
/// band : float, optional
///     Up to which frequency in Hz errors count; by default 0.4 / dt.
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
#[function]
pub(crate) fn preview(
    #[py("Dynamics | None")] dynamics: Option<&Bound<'_, PyAny>>,
    dt: f64,
    #[py(*, "int")] ahead: &Bound<'_, PyAny>,
    #[py("int | None" = None)] window: Option<&Bound<'_, PyAny>>,
    #[py("int | None" = None)] degree: Option<&Bound<'_, PyAny>>,
    #[py(= None)] band: Option<f64>,
    #[py(= None)] amplifier_bandwidth: Option<f64>,
    #[py(= None)] dead_time: Option<f64>,
) -> PyResult<Preview> {
    let chain = LinearPart { dynamics, amplifier_bandwidth, dead_time }.dynamics()?;
    let options = PreviewOptions {
        ahead: samples("ahead", ahead)?,
        window: window.map(|window| samples("window", window)).transpose()?,
        degree: degree.map(|degree| samples("degree", degree)).transpose()?,
        band,
    };
    Preview::made(PreviewCoefficients::new(&chain, dt, &options).map_err(raise)?)
}
