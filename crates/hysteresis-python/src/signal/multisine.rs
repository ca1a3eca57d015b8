//! `mpi_hyst.signals.multisine`.

use hysteresis_control::sampling::MAX_SAMPLES;
use hysteresis_python_macros::function;
use hysteresis_simulate::signals::{Multisine, Phases};
use numpy::PyArray1;
use pyo3::prelude::*;

use super::signals::Samples;
use crate::convert::arguments::{count, whole};
use crate::convert::arrays::{SPECTRUM, check_room};
use crate::convert::errors::{raise, unexpected, value};

/// Sines of many frequencies at once: center + the sum over k in lines of cos(2 pi k n / samples + phi_k), scaled to a peak of
/// `amplitude`.
///
/// Line k has the frequency k rate / samples. A discrete Fourier transform over one period holds the lines and nothing
/// else, all of one size. The phases are those of Schroeder (1970), which keep the peak low beside the rms: the crest factor
/// of neighbouring lines is 1.7 to 2. With a seed they are random, and the crest factor of many lines is 3 to 4.
///
/// Parameters
/// ----------
/// amplitude, center : float
///     The largest distance from the center, and the center, in the unit of the signal.
/// lines : sequence of int
///     Cycles per period: above 0, below half of `samples`, each once.
/// samples : int
///     Samples of a period.
/// periods : int
///     Whole periods.
/// seed : int, optional
///     Random phases, the same for the same seed. Without it those of Schroeder.
/// fade : int
///     Samples before the whole periods in which the signal fades in from `center`, and as many behind them. Without
///     any the signal begins and ends somewhere within its swing.
///
/// Returns
/// -------
/// array of periods x samples + 2 fade floats
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> u = mh.signals.multisine(2.0, range(1, 400), samples=5000, periods=4, fade=500)
/// >>> u.shape, float(u[0]), float(u[-1]), round(float(abs(u).max()), 6)
/// ((21000,), 0.0, 0.0, 2.0)
#[function]
pub(crate) fn multisine<'py>(
    py: Python<'py>,
    amplitude: f64,
    #[py("Sequence[int]")] lines: &Bound<'py, PyAny>,
    #[py(*, "int")] samples: &Bound<'py, PyAny>,
    #[py("int" = 1)] periods: Option<&Bound<'py, PyAny>>,
    #[py("int | None" = None)] seed: Option<&Bound<'py, PyAny>>,
    #[py("int" = 0)] fade: Option<&Bound<'py, PyAny>>,
    #[py(= 0.0)] center: f64,
) -> Samples<'py> {
    // More than any signal may have stays more.
    let few = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    let samples = count("samples", samples)?;
    // The number of lines first: a range may be longer than memory.
    let most = samples.min(MAX_SAMPLES as usize) / 2;
    if let Some(got) = lines.len().ok().filter(|got| *got > most) {
        return Err(value("lines", format_args!("expected at most {most} lines, half of the samples, got {got}")));
    }
    check_room("samples", samples.min(MAX_SAMPLES as usize), SPECTRUM)?;
    let lines = lines.extract().map_err(|_| unexpected("lines", "whole numbers above 0", lines))?;
    let samples = few(samples);
    let periods = few(periods.map_or(Ok(1), |periods| count("periods", periods))?);
    let fade = few(fade.map_or(Ok(0), |fade| whole("fade", fade))?);
    let phases = match seed {
        None => Phases::Schroeder,
        Some(seed) => Phases::Random(whole("seed", seed)?),
    };
    let multisine = Multisine { amplitude, center, lines, phases, samples, periods, fade };
    py.detach(|| multisine.sample()).map(|samples| PyArray1::from_vec(py, samples)).map_err(raise)
}
