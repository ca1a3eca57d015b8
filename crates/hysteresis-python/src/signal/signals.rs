//! Test signals: sines and triangles, a chirp, a multisine.

use std::num::NonZeroUsize;

use hysteresis_control::sampling::MAX_SAMPLES;
use hysteresis_python_macros::function;
use hysteresis_simulate::signals::{self, Chirp, Error, Multisine, Phases, Sweep, Wave};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::argument::Words;
use crate::convert::arrays::{SPECTRUM, check_room};
use crate::convert::errors::{raise, unexpected, value};

/// What a signal is in Python.
type Signal<'py> = PyResult<Bound<'py, PyArray1<f64>>>;

fn array(py: Python<'_>, samples: Result<Vec<f64>, Error>) -> Signal<'_> {
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
) -> Signal<'py> {
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
) -> Signal<'py> {
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
) -> Signal<'py> {
    array(py, signals::decaying_triangle(Wave { amplitude, frequency, rate, offset }, cycles))
}

impl Words for Sweep {
    const WORDS: &'static [(&'static str, Self)] = &[("linear", Self::Linear), ("logarithmic", Self::Logarithmic)];
    const REFUSES_NONE: bool = true;
}

/// A sine whose frequency sweeps: center + amplitude w(t / T) sin(phi(t)), from center to center without a jump.
///
/// The frequency phi' / (2 pi) at the time t is f0 + (f1 - f0) t / T of a linear sweep, f0 (f1 / f0)^(t / T) of a
/// logarithmic one, with T the time from the first sample to the last. w fades in along half a cosine, over the share
/// `taper` of T, and out again. So the signal changes nowhere faster than amplitude (2 pi max(f0, f1) + pi / (2 taper
/// T)) per second.
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
    #[py(= "linear")] sweep: Sweep,
    #[py(= 0.05)] taper: f64,
) -> Signal<'py> {
    let chirp = Chirp { amplitude, center, start_frequency, stop_frequency, seconds, rate, sweep, taper };
    array(py, py.detach(|| chirp.sample()))
}

/// Sines of many frequencies at once: center + the sum over k in lines of cos(2 pi k n / samples + phi_k), scaled to a
/// peak of `amplitude`.
///
/// Line k has the frequency k rate / samples. A discrete Fourier transform over one period holds the lines and nothing
/// else, all of one size. The phases are those of Schroeder (1970), which keep the peak low beside the rms: the crest
/// factor of neighbouring lines is 1.7 to 2. With a seed they are random, and the crest factor of many lines is 3 to 4.
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
    #[py(*)] samples: NonZeroUsize,
    #[py(= 1)] periods: NonZeroUsize,
    #[py(= None)] seed: Option<u64>,
    #[py(= 0)] fade: usize,
    #[py(= 0.0)] center: f64,
) -> Signal<'py> {
    // More than any signal may have stays more.
    let few = |number: usize| u32::try_from(number).unwrap_or(u32::MAX);
    // The number of lines first: a range may be longer than memory.
    let most = samples.get().min(MAX_SAMPLES as usize) / 2;
    if let Some(got) = lines.len().ok().filter(|got| *got > most) {
        return Err(value("lines", format_args!("expected at most {most} lines, half of the samples, got {got}")));
    }
    check_room("samples", samples.get().min(MAX_SAMPLES as usize), SPECTRUM)?;
    let lines = lines.extract().map_err(|_| unexpected("lines", "whole numbers above 0", lines))?;
    let (samples, periods, fade) = (few(samples.get()), few(periods.get()), few(fade));
    let phases = seed.map_or(Phases::Schroeder, Phases::Random);
    let multisine = Multisine { amplitude, center, lines, phases, samples, periods, fade };
    array(py, py.detach(|| multisine.sample()))
}
