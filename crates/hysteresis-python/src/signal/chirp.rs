//! `mpi_hyst.signals.chirp`.

use hysteresis_python_macros::function;
use hysteresis_simulate::signals::{Chirp, Sweep};
use numpy::PyArray1;
use pyo3::prelude::*;

use super::signals::Samples;
use crate::convert::arguments::{OrDefault, unknown};
use crate::convert::errors::raise;

/// A sine whose frequency sweeps: center + amplitude w(t / T) sin(phi(t)), from center to center without a jump.
///
/// The frequency phi' / (2 pi) at the time t is f0 + (f1 - f0) t / T of a linear sweep, f0 (f1 / f0)^(t / T) of a logarithmic
/// one, with T the time from the first sample to the last. w fades in along half a cosine, over the share `taper` of T,
/// and out again. So the signal changes nowhere faster than amplitude (2 pi max(f0, f1) + pi / (2 taper T)) per second.
///
/// Parameters
/// ----------
/// amplitude, center : float
///     Half of the peak-to-peak swing, and where it starts and ends, in the unit of the signal.
/// start_frequency, stop_frequency : float
///     f0 and f1 in Hz, at most half of the rate.
/// seconds, rate : float
///     Duration, and samples per second in Hz.
/// sweep : "linear" or "logarithmic"
///     Every Hz, or every octave, gets the same time.
/// taper : float
///     Share of the duration in which the signal fades in, and out: above 0, at most 0.5.
///
/// Raises
/// ------
/// ValueError
///     That names the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.chirp(2.0, 10.0, 2000.0, seconds=2.0, rate=10_000, center=5.0)
/// >>> u.shape, float(u[0]), float(u[-1]), round(float(u.max()), 3)
/// ((20000,), 5.0, 5.0, 7.0)
#[function]
pub(crate) fn chirp<'py>(
    py: Python<'py>,
    amplitude: f64,
    start_frequency: f64,
    stop_frequency: f64,
    #[py(*)] seconds: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(= 0.0)] center: f64,
    #[py("Literal['linear', 'logarithmic']" = "linear")] sweep: OrDefault<'_>,
    #[py(= 0.05)] taper: f64,
) -> Samples<'py> {
    let expected = "\"linear\" or \"logarithmic\"";
    let sweep = match sweep.word("sweep", expected, "linear")?.as_str() {
        "linear" => Sweep::Linear,
        "logarithmic" => Sweep::Logarithmic,
        got => return unknown("sweep", expected, got),
    };
    let chirp = Chirp { amplitude, center, start_frequency, stop_frequency, seconds, rate, sweep, taper };
    py.detach(|| chirp.sample()).map(|samples| PyArray1::from_vec(py, samples)).map_err(raise)
}
