//! `mpi_hyst.signals.experiment`: the drives that tell a whole stage.

use hysteresis_python_macros::{function, methods};
use hysteresis_simulate::excitation::{ExperimentOptions, FastSignal, Part, Segment};
use numpy::PyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use super::excitation::shape_of;
use crate::convert::arguments::{OrDefault, count, numbers, pair, unknown};
use crate::convert::arrays::read_only;
use crate::convert::errors::raise;

/// A stretch of a drive with a purpose of its own.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> _, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0)
/// >>> [segment.name for segment in loops.segments][:3]
/// ['start', 'settle', 'major']
#[pyclass(module = "mpi_hyst.signals", frozen, get_all, skip_from_py_object)]
#[derive(Clone, Serialize, Deserialize)]
pub(crate) struct ExperimentSegment {
    /// What it is, in one or two words.
    name: String,
    /// What it tells.
    purpose: String,
    /// Its first sample.
    start: usize,
    /// The sample after its last.
    stop: usize,
    /// The lowest and the highest drive.
    range: (f64, f64),
    /// The lowest and the highest frequency, in Hz: of loops that of a full stroke at their speed, 0 at rest.
    frequencies: (f64, f64),
    /// The fastest step, per second.
    max_slew: f64,
}

impl From<Segment> for ExperimentSegment {
    fn from(segment: Segment) -> Self {
        let Segment { name, purpose, start, stop, range, frequencies, max_slew } = segment;
        Self { name: name.to_owned(), purpose: purpose.to_owned(), start, stop, range, frequencies, max_slew }
    }
}

#[methods]
impl ExperimentSegment {
    fn __repr__(&self) -> String {
        let Self { name, start, stop, range: (low, high), .. } = self;
        format!("<ExperimentSegment {name}: samples {start} to {stop}, {low} to {high}>")
    }
}

/// A drive to play and record in one go, at one sampling rate: made by `experiment`.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> fast, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0, fast_rate=10_000.0)
/// >>> fast.rate, loops.drive.size > loops.rate  # Hz; more than a second
/// (10000.0, True)
#[pyclass(module = "mpi_hyst.signals", frozen)]
#[derive(Serialize, Deserialize)]
pub(crate) struct ExperimentPart {
    name: String,
    rate: f64,
    drive: Vec<f64>,
    segments: Vec<ExperimentSegment>,
    initialization_samples: usize,
}

impl From<Part> for ExperimentPart {
    fn from(part: Part) -> Self {
        let Part { name, rate, drive, segments, initialization_samples } = part;
        let segments = segments.into_iter().map(ExperimentSegment::from).collect();
        Self { name: name.into_owned(), rate, drive, segments, initialization_samples }
    }
}

#[methods]
impl ExperimentPart {
    /// "fast", "loops", or "experiment" if both are joined.
    #[getter]
    fn name(&self) -> &str {
        &self.name
    }

    /// Samples per second, in Hz.
    #[getter]
    fn rate(&self) -> f64 {
        self.rate
    }

    /// The samples, from start to start.
    #[getter]
    fn drive<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        read_only(py, self.drive.iter().copied())
    }

    /// What the samples are for: one segment after the other, none left out.
    #[getter]
    fn segments(&self) -> Vec<ExperimentSegment> {
        self.segments.clone()
    }

    /// How many samples come before both limits were reached: the `skip` of `identify` for an actuator whose history is
    /// unknown. 0 if the limits are never reached.
    #[getter]
    fn initialization_samples(&self) -> usize {
        self.initialization_samples
    }

    fn __repr__(&self) -> String {
        let Self { name, rate, drive, segments, .. } = self;
        format!("<ExperimentPart {name}: {} samples at {rate} Hz, {} segments>", drive.len(), segments.len())
    }
}

/// The drives from which a whole stage is identified, within limits and slew rate.
///
/// The parts in the order in which to play them, each from rest at `start` back to it:
///
/// - "fast": a small chirp or multisine for modes and dead time, at `start` or as near to it as both swings stay within
///   the limits.
/// - "loops": full strokes, decaying and growing loops, small loops about other drives, rests for creep, and full and
///   decaying loops again at a second frequency, which tells rate from amplitude.
///
/// The actuator must rest at `start` before, or come from `demagnetize`: then each record is fitted from its first sample.
/// Give both records to `identify` as one list, each with its own dt.
///
/// Parameters
/// ----------
/// low, high : float
///     Limits of the drive (V): never left, both reached.
/// slew : float
///     Largest speed of the drive (V/s): never exceeded from sample to sample.
/// rate : float
///     Samples per second of the loops, in Hz.
/// fast_rate : float, optional
///     Samples per second of the fast signal, in Hz: that of the loops unless given.
/// frequencies : (float, float)
///     Frequencies of a full stroke in Hz, the lower one first. Where the slew rate is too low for the second one, it is
///     what the slew rate allows. The first one is at most a third of the second one.
/// cycles : int
///     Cycles that the loops take to decay, and again to grow.
/// shape : "triangle" or "sine"
///     Straight moves from reversal to reversal, or half cosines of the same largest speed.
/// center : float, optional
///     What the reversals decay to: the middle of the limits unless given.
/// start : float, optional
///     The rest drive, where every part starts and ends: zero, or the limit nearest to it, unless given.
/// rest : float
///     Duration of each of the four rests, in seconds.
/// fast_signal : "chirp" or "multisine"
///     The fast signal: 20 000 samples, but at least 2 s and at most 10 s.
/// fast_amplitude : float, optional
///     Its largest amplitude (V): 1 % of half the range unless given. At high frequencies the slew rate may ask for less.
/// fast_frequency : float, optional
///     Its highest frequency in Hz: 0.4 of the Nyquist frequency unless given.
/// joined : bool
///     Whether both parts are one drive, at one rate.
///
/// Returns
/// -------
/// list of ExperimentPart
///     With `name`, `rate`, `drive`, `segments` and `initialization_samples`.
///
/// Raises
/// ------
/// ValueError, TypeError
///     That name the argument, what was expected and what came.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> fast, loops = mh.signals.experiment(0.0, 150.0, slew=2000.0, rate=1000.0, fast_rate=10_000.0)
/// >>> fast
/// <ExperimentPart fast: 22009 samples at 10000 Hz, 4 segments>
/// >>> print(*(segment.name for segment in loops.segments), sep=", ")
/// start, settle, major, decaying, growing, inner, rests, fast major, fast decaying, return, end
#[function]
pub(crate) fn experiment(
    py: Python<'_>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    rate: f64,
    #[py(= None)] fast_rate: Option<f64>,
    #[py("tuple[float, float]" = (1.0, 10.0))] frequencies: Option<&Bound<'_, PyAny>>,
    #[py("int" = 20)] cycles: Option<&Bound<'_, PyAny>>,
    #[py("Literal['triangle', 'sine']" = "triangle")] shape: OrDefault<'_>,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
    #[py("float" = 10.0)] rest: Option<&Bound<'_, PyAny>>,
    #[py("Literal['chirp', 'multisine']" = "chirp")] fast_signal: OrDefault<'_>,
    #[py(= None)] fast_amplitude: Option<f64>,
    #[py(= None)] fast_frequency: Option<f64>,
    #[py("bool" = false)] joined: OrDefault<'_>,
) -> PyResult<Vec<ExperimentPart>> {
    numbers!(rest);
    let fast_rate = fast_rate.unwrap_or(rate);
    let default = ExperimentOptions::new(low, high, slew, rate);
    let options = ExperimentOptions {
        fast_rate,
        frequencies: frequencies.map_or(Ok(default.frequencies), |both| pair("frequencies", both))?,
        cycles: cycles.map_or(Ok(default.cycles), |cycles| {
            count("cycles", cycles).map(|cycles| u32::try_from(cycles).unwrap_or(u32::MAX))
        })?,
        shape: shape_of(&shape)?,
        center: center.unwrap_or(default.center),
        start: start.unwrap_or(default.start),
        rest: rest.unwrap_or(default.rest),
        fast_signal: signal_of(&fast_signal)?,
        fast_amplitude: fast_amplitude.unwrap_or(default.fast_amplitude),
        fast_frequency: fast_frequency.unwrap_or_else(|| ExperimentOptions::default_fast_frequency(fast_rate)),
        ..default
    };
    let joined = joined.flag("joined")?;
    let parts = py.detach(|| {
        let made = options.experiment()?;
        if joined { made.joined().map(|part| vec![part]) } else { Ok(made.parts) }
    });
    Ok(parts.map_err(raise)?.into_iter().map(ExperimentPart::from).collect())
}

fn signal_of(signal: &OrDefault<'_>) -> PyResult<FastSignal> {
    let expected = "\"chirp\" or \"multisine\"";
    match signal.word("fast_signal", expected, "chirp")?.as_str() {
        "chirp" => Ok(FastSignal::Chirp),
        "multisine" => Ok(FastSignal::Multisine),
        got => unknown("fast_signal", expected, got),
    }
}
