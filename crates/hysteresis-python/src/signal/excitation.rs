//! Drives to identify from: one that makes an actuator's memory known, and those that tell a whole stage.

use hysteresis_python_macros::{function, methods, py};
use hysteresis_simulate::excitation::{
    Excitation as Made, ExcitationOptions, ExperimentOptions, FastSignal, Part, Segment, Shape,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use serde::{Deserialize, Serialize};

use crate::argument::{Argument, Words};
use crate::convert::arguments::count;
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
/// Once both limits were reached, the memory of an actuator that was never driven beyond them is known:
/// `initialization_samples` counts the samples before, to be skipped by `identify`. With as many cycles as the model
/// has operators, a reversal on the way up and one on the way down fall between any two neighbouring uniform
/// thresholds. Every reversal is met by a sample; small loops take less time than large ones.
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
#[gather(options: ExcitationOptions = ExcitationOptions::new(low, high, slew, rate))]
pub(crate) fn excitation(
    py: Python<'_>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(field = 20)] cycles: Cycles,
    #[py(field = "triangle")] shape: Shape,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
) -> PyResult<Excitation> {
    let options = with(options, center, start);
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
#[gather(options: ExcitationOptions = ExcitationOptions::new(low, high, slew, rate))]
pub(crate) fn demagnetize<'py>(
    py: Python<'py>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    #[py(= 10000.0)] rate: f64,
    #[py(field = 20)] cycles: Cycles,
    #[py(field = "triangle")] shape: Shape,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let options = with(options, center, start);
    py.detach(|| options.demagnetizing()).map(|drive| PyArray1::from_vec(py, drive)).map_err(raise)
}

/// The options with what is given of these, in place of the defaults that follow from the limits.
fn with(options: ExcitationOptions, center: Option<f64>, start: Option<f64>) -> ExcitationOptions {
    let (center, start) = (center.unwrap_or(options.center), start.unwrap_or(options.start));
    ExcitationOptions { center, start, ..options }
}

/// A number of cycles. More than any drive may have stay more.
pub(crate) struct Cycles(pub(crate) u32);

#[py("int")]
impl Argument<'_> for Cycles {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        count(name, value).map(|cycles| Self(u32::try_from(cycles).unwrap_or(u32::MAX)))
    }
}

impl From<Cycles> for u32 {
    fn from(Cycles(cycles): Cycles) -> Self {
        cycles
    }
}

impl Words for Shape {
    const WORDS: &'static [(&'static str, Self)] = &[("triangle", Self::Triangle), ("sine", Self::Sine)];
    const REFUSES_NONE: bool = true;
}

impl Words for FastSignal {
    const WORDS: &'static [(&'static str, Self)] = &[("chirp", Self::Chirp), ("multisine", Self::Multisine)];
    const REFUSES_NONE: bool = true;
}

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
/// The actuator must rest at `start` before, or come from `demagnetize`: then each record is fitted from its first
/// sample. Give both records to `identify` as one list, each with its own dt.
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
///     Frequencies of a full stroke in Hz, the lower one first. Where the slew rate is too low for the second one, it
///     is what the slew rate allows. The first one is at most a third of the second one.
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
///     Its largest amplitude (V): 1 % of half the range unless given. At high frequencies the slew rate may ask for
///     less.
/// fast_frequency : float, optional
///     Its highest frequency in Hz: 0.8 of the Nyquist frequency unless given.
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
#[gather(options: ExperimentOptions = ExperimentOptions::new(low, high, slew, rate))]
pub(crate) fn experiment(
    py: Python<'_>,
    low: f64,
    high: f64,
    #[py(*)] slew: f64,
    rate: f64,
    #[py(= None)] fast_rate: Option<f64>,
    #[py(field = (1.0, 10.0))] frequencies: (f64, f64),
    #[py(field = 20)] cycles: Cycles,
    #[py(field = "triangle")] shape: Shape,
    #[py(= None)] center: Option<f64>,
    #[py(= None)] start: Option<f64>,
    #[py(field = 10.0)] rest: f64,
    #[py(field = "chirp")] fast_signal: FastSignal,
    #[py(= None)] fast_amplitude: Option<f64>,
    #[py(= None)] fast_frequency: Option<f64>,
    #[py(= false)] joined: bool,
) -> PyResult<Vec<ExperimentPart>> {
    let fast_rate = fast_rate.unwrap_or(rate);
    let options = ExperimentOptions {
        fast_rate,
        center: center.unwrap_or(options.center),
        start: start.unwrap_or(options.start),
        fast_amplitude: fast_amplitude.unwrap_or(options.fast_amplitude),
        fast_frequency: fast_frequency.unwrap_or_else(|| ExperimentOptions::default_fast_frequency(fast_rate)),
        ..options
    };
    let parts = py.detach(|| {
        let made = options.experiment()?;
        if joined { made.joined().map(|part| vec![part]) } else { Ok(made.parts) }
    });
    Ok(parts.map_err(raise)?.into_iter().map(ExperimentPart::from).collect())
}
