//! A loop on the clock.

use std::net::{SocketAddr, ToSocketAddrs};
use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::thread;
use std::time::{Duration, Instant};

use hysteresis_control::StageController;
use hysteresis_core::{self as core, Mode};
use hysteresis_python_macros::{function, py};
use hysteresis_realtime::io::{Io, SharedMemoryIo, UdpIo};
use hysteresis_realtime::{
    self as realtime, Live, MissPolicy, Outcome, Reference, Session, Settings, StopFlag, WatchdogTimes,
};
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;

use super::other_side::{ForeignIo, Functions, SharedMemory, Udp};
use super::report::LoopReport;
use super::stop::{Signals, Stop};
use crate::argument::{Argument, Asked, Callable, Words};
use crate::control::controller::HybridController;
use crate::control::shared_by_controllers::check_interval;
use crate::convert::arguments::{two, whole_number};
use crate::convert::errors::{self, Refusal, raise};
use crate::convert::objects::{exclusive, instance, keywords, shared};
use crate::plant::plant::Plant;
use crate::stage::stage::Stage;

/// How often signals are looked at, and `progress` is called.
const PAUSE: Duration = Duration::from_millis(100);

impl Refusal for realtime::Error {
    fn parameter(&self) -> Option<&str> {
        realtime::Error::parameter(self)
    }
}

/// Runs the loop of a stage at a fixed rate, in a thread outside the interpreter.
///
/// At every deadline the loop reads a measurement, computes a drive and writes it. It ends by a ramp to `rest_drive` at
/// `rest_rate`, or at the slew if that is slower: after `seconds`, at the end of a reference that is not repeated, at
/// Ctrl-C, when measurements are missing for too long, and when input or output raises. Ctrl-C ends the loop and not
/// the program: the report says "requested". So does `stop`, from any thread. SIGTERM and SIGHUP end the loop, and then
/// the program: where it has no handler of its own for them, and the main thread calls. Limits and slew hold all the
/// time: in any time T the drive moves by at most slew (T + dt), counting writes that succeed. The drive written last
/// is the rest drive, unless writing itself fails.
///
/// A measurement that does not come is replaced by the last one for `stale_after` seconds. Then the controller is told
/// that there is none, and holds the drive; if it is still coming back from the last loss, the last error stands in for
/// up to `max_missing` samples first. After `rest_after` seconds without one the drive goes to rest. Of a sensor that
/// is slower than the loop let `stale_after` be its interval.
///
/// Parameters
/// ----------
/// controller : HybridController or Stage
///     The amplifier must have its drive. It goes on from there, and is in its stop afterwards:
///     `controller.hold = False` lets it run again. A stage makes one with the exact inverse, for `rate`.
/// io : Plant, Functions, Udp, SharedMemory or object
///     What is read from and written to. An object has `read()`, which returns a number or None if there is none that
///     is newer, and `write(drive)`; its `limits` (low, high), if it states some, must hold those of the controller.
///     Each call of it takes the interpreter: some ten microseconds, or as long as another thread of Python keeps it.
///     What it raises is raised again when the loop has ended, with the LoopReport as its attribute `report`.
/// reference : array of n floats
///     Where the position should be, one for each sample.
/// rest_drive : float
///     The drive at which the loop ends, V.
/// rest_rate : float
///     How fast it goes there, V/s.
/// rate : float, optional
///     Samples per second, for a stage. A controller has its own.
/// seconds : float, optional
///     When it ends.
/// repeat : bool
///     Whether the reference is followed again and again.
/// misses : "skip", "catch_up" or "stop"
///     When a deadline is missed, go on with the next one that is still to come; take what is due without pause, at
///     most `most_caught_up` samples, while the drive moves by what the slew gives for the time that goes by; or go to
///     rest.
/// most_caught_up : int
///     What lies further back is skipped.
/// watchdog : (stale_after, rest_after) or None
///     In seconds. Without, the drive is held for ever.
/// most_write_faults : int
///     After so many writes in a row that failed the loop ends where it is.
/// spin : float
///     For how many seconds before each deadline the loop spins instead of sleeping: less latency for a busy processor.
/// cpu : int, optional
///     The processor on which the loop runs.
/// fifo : int, optional
///     The priority of SCHED_FIFO, 1 to 99.
/// lock_memory : bool
///     Whether all memory of the process stays in memory, until the loop has ended. Where the program had locked memory
///     before, for ever. What is refused of these three is one of the `warnings` of the report.
/// record : path-like, optional
///     The file to which samples go: npy, with the fields time, reference, measurement, drive and lateness. It can be
///     read at any moment, also if the process is killed. One that is there is replaced when the first samples are
///     written.
/// progress : callable, optional
///     Called ten times per second with a dictionary: taken, missed, skipped, stale, measurement, drive, and `waiting`:
///     for how many seconds no sample has been taken. While a read or a write does not return nothing can end the loop,
///     and nothing moves the drive.
/// stop : Stop, optional
///     What others end the loop with, from any thread.
///
/// Returns
/// -------
/// LoopReport
///
/// Raises
/// ------
/// ValueError, TypeError, OSError
///     That name the argument, what was expected and what came. Nothing was written then.
///
/// Examples
/// --------
/// >>> import mpi_hyst as mh
/// >>> stage = mh.paper.plant("A1").stage
/// >>> reference = mh.signals.sine(2.0, 10.0, seconds=0.1, rate=1000)  # um
/// >>> plant = mh.plant.Plant(stage, dt=1e-3)
/// >>> report = mh.realtime.run(stage, plant, reference, rest_drive=0.0, rest_rate=5e3, rate=1000, seconds=0.3)
/// >>> report.end, report.at_rest, plant.drive
/// ('time_over', True, 0.0)
#[function]
#[gather(settings: Settings = Settings::new(rest_drive, rest_rate))]
pub(crate) fn run<'py>(
    #[py("HybridController | Stage")] controller: &Bound<'py, PyAny>,
    #[py("Plant | Functions | Udp | SharedMemory | InputOutput")] io: &Bound<'py, PyAny>,
    reference: Vec<f64>,
    #[py(*)] rest_drive: f64,
    rest_rate: f64,
    #[py(= None)] rate: Option<f64>,
    #[py(field = None)] seconds: Option<f64>,
    #[py(= true)] repeat: bool,
    #[py(= "skip")] misses: Misses,
    #[py(= 100)] most_caught_up: Asked<NonZeroUsize>,
    #[py(field = (0.0, 0.1))] watchdog: Watchdog,
    #[py(field(write_faults) = 100)] most_write_faults: WriteFaults,
    #[py(field = 0.0)] spin: f64,
    #[py(field = None)] cpu: Option<usize>,
    #[py(= None)] fifo: Option<Priority>,
    #[py(field = false)] lock_memory: bool,
    #[py(field = None)] record: Option<PathBuf>,
    #[py("Callable[[dict[str, Any]], object] | None" = None)] progress: Option<Callable>,
    #[py(= None)] stop: Option<Bound<'py, Stop>>,
) -> PyResult<LoopReport> {
    let settings = Settings { misses: policy(misses, most_caught_up)?, fifo: fifo.map(|fifo| fifo.0), ..settings };
    let reference = if repeat { Reference::periodic(reference) } else { Reference::once(reference) }.map_err(raise)?;
    let stop = stop.map_or_else(StopFlag::default, |stop| stop.get().0.clone());
    let controller = checked_controller(controller, rate, io)?;
    // Nobody else changes the controller while it drives.
    let mut held = exclusive(&controller)?;
    let mut signals = Signals::end(io.py(), &stop)?;
    let start = Start { controller: held.stage_controller.clone(), reference, settings, progress, stop };
    let ended = start.on(io).map(|Ended { report, controller, raised }| {
        held.stage_controller = controller;
        (LoopReport(report), raised)
    });
    // Also where the loop could not begin: a signal that came meanwhile is not lost.
    signals.restore_and_pass_on()?;
    let (report, raised) = ended?;
    match raised {
        Some(error) => Err(with_report(io.py(), error, report)),
        None => Ok(report),
    }
}

/// The exception with what became of the loop: as its attribute `report`, and in words where Python shows notes (3.11).
fn with_report(py: Python<'_>, error: PyErr, report: LoopReport) -> PyErr {
    let realtime::Report { at_rest, last_drive, .. } = report.0;
    let rest = if at_rest { "at rest" } else { "NOT at rest" };
    let note = format!("the loop ended {rest}, the last drive that was written is {last_drive:?}");
    let value = error.value(py);
    // An exception that takes neither still tells what was raised.
    let _ = value.setattr("report", report);
    let _ = value.call_method1("add_note", (note,));
    error
}

/// A loop that only needs something to read from and write to.
struct Start {
    controller: StageController,
    reference: Reference,
    settings: Settings,
    progress: Option<Callable>,
    stop: StopFlag,
}

/// A loop that has ended, with what Python raised meanwhile.
struct Ended {
    report: realtime::Report,
    controller: StageController,
    raised: Option<PyErr>,
}

impl Start {
    fn on(self, io: &Bound<'_, PyAny>) -> PyResult<Ended> {
        let py = io.py();
        if let Ok(plant) = io.cast::<Plant>() {
            let mut plant = exclusive(plant)?;
            check_interval("io", Some(plant.plant.dt()), self.controller.controller().options().dt)?;
            let (after, ended) = self.run(py, plant.plant.clone())?;
            plant.plant = after;
            return Ok(ended);
        }
        if let Ok(functions) = io.cast::<Functions>() {
            return Ok(self.run(py, functions.get().io())?.1);
        }
        if let Ok(udp) = io.cast::<Udp>() {
            let Udp { plant, local } = udp.get();
            let address = |at: &String| -> PyResult<Vec<SocketAddr>> {
                Ok(at.to_socket_addrs().map_err(|error| errors::io(at, &error))?.collect())
            };
            let (there, here) = (address(plant)?, address(local)?);
            let both = format!("{plant} from {local}");
            let io = UdpIo::connect(&here[..], &there[..]).map_err(|error| errors::io(&both, &error))?;
            return Ok(self.run(py, io)?.1);
        }
        if let Ok(memory) = io.cast::<SharedMemory>() {
            let path = &memory.get().path;
            let io = SharedMemoryIo::create(path).map_err(|error| errors::io(&path.display().to_string(), &error))?;
            return Ok(self.run(py, io)?.1);
        }
        let limits = self.controller.controller().options().limits;
        let (io, ended) = self.run(py, ForeignIo::new(io, limits)?)?;
        Ok(Ended { raised: io.raised.or(ended.raised), ..ended })
    }

    /// Runs to the end, also when Python wants to stop.
    fn run<I: Io + 'static>(self, py: Python<'_>, io: I) -> PyResult<(I, Ended)> {
        let session =
            Session::start_with(self.controller, io, self.reference, self.settings, self.stop).map_err(refused)?;
        let live = session.live();
        let mut raised = None;
        let mut newest = (live.taken(), Instant::now());
        while !py.detach(|| pause(&session)) {
            if live.taken() != newest.0 {
                newest = (live.taken(), Instant::now());
            }
            let waiting = newest.1.elapsed().as_secs_f64();
            let progress = |Callable(progress): &Callable| progress.call1(py, (shown(py, &live, waiting)?,)).map(drop);
            let looked = py.check_signals().and_then(|()| self.progress.as_ref().map_or(Ok(()), progress));
            if let Err(error) = looked {
                session.stop();
                raised.get_or_insert(error);
            }
        }
        let Outcome { report, controller, io } = py.detach(|| session.wait());
        // What came at the very end still finds its handler.
        if let Err(error) = py.check_signals() {
            raised.get_or_insert(error);
        }
        // Ctrl-C has ended the loop: that is what it was for.
        let raised = raised.filter(|error| !error.is_instance_of::<PyKeyboardInterrupt>(py));
        Ok((io, Ended { report, controller, raised }))
    }
}

/// Waits a moment; true at the end of the loop.
fn pause<I>(session: &Session<I>) -> bool {
    let step = Duration::from_millis(5);
    for _ in 0..PAUSE.as_millis() / step.as_millis() {
        if session.is_finished() {
            return true;
        }
        thread::sleep(step);
    }
    false
}

fn shown<'py>(py: Python<'py>, live: &Live, waiting: f64) -> PyResult<Bound<'py, PyAny>> {
    let shown = keywords!(
        py,
        taken = live.taken(),
        missed = live.missed(),
        skipped = live.skipped(),
        stale = live.stale(),
        measurement = live.measurement(),
        drive = live.drive(),
        waiting = waiting,
    );
    Ok(shown.into_any())
}

/// A controller as it came, or one that a stage makes.
pub(super) fn checked_controller<'py>(
    given: &Bound<'py, PyAny>,
    rate: Option<f64>,
    io: &Bound<'py, PyAny>,
) -> PyResult<Bound<'py, HybridController>> {
    if given.cast::<Stage>().is_ok() {
        let Some(rate) = rate else {
            return Err(errors::value("rate", "expected samples per second beside a Stage, got None"));
        };
        check_rate(rate, io)?;
        let made = given.call_method1("controller", (1.0 / rate,));
        return Ok(made.map_err(|error| about_rate(io.py(), error))?.cast_into::<HybridController>()?);
    }
    let controller = instance::<HybridController>("controller", "a HybridController or a Stage", given)?;
    let own = 1.0 / shared(controller)?.stage_controller.controller().options().dt;
    match rate {
        Some(rate) if (rate / own - 1.0).abs() > 1e-9 => {
            Err(errors::value("rate", format_args!("expected {own:?}, as the controller has, got {rate:?}")))
        }
        _ => Ok(controller.clone()),
    }
}

/// Refuses a rate that no loop has, or another one than that of a simulated plant.
fn check_rate(rate: f64, io: &Bound<'_, PyAny>) -> PyResult<()> {
    let expected = if !(0.1..=1e6).contains(&rate) {
        "0.1 to 1e6 samples per second".to_owned()
    } else if let Ok(plant) = io.cast::<Plant>() {
        let own = 1.0 / shared(plant)?.plant.dt();
        if (rate / own - 1.0).abs() <= 1e-9 {
            return Ok(());
        }
        format!("{own:?}, for which the Plant that is `io` was made")
    } else {
        return Ok(());
    };
    Err(errors::value("rate", format_args!("expected {expected}, got {rate:?}")))
}

/// What the controller of a stage says of its interval, as about the rate.
fn about_rate(py: Python<'_>, error: PyErr) -> PyErr {
    let parameter = error.value(py).getattr("parameter").and_then(|parameter| parameter.extract::<String>());
    let message = error.to_string();
    match message.split_once("dt: ") {
        Some((_, said)) if parameter.is_ok_and(|parameter| parameter == "dt") => {
            errors::value("rate", format_args!("its sampling interval 1 / rate: {said}"))
        }
        _ => error,
    }
}

/// What to do when a deadline is missed.
#[derive(Clone, Copy, PartialEq)]
enum Misses {
    Skip,
    CatchUp,
    Stop,
}

impl Words for Misses {
    const WORDS: &'static [(&'static str, Self)] =
        &[("skip", Self::Skip), ("catch_up", Self::CatchUp), ("stop", Self::Stop)];
    const REFUSES_NONE: bool = true;
}

fn policy(misses: Misses, most_caught_up: Asked<NonZeroUsize>) -> PyResult<MissPolicy> {
    let at_most = u32::try_from(most_caught_up.value.get()).unwrap_or(u32::MAX);
    match misses {
        Misses::CatchUp => Ok(MissPolicy::CatchUp { at_most }),
        _ if most_caught_up.is_given => {
            Err(errors::value("most_caught_up", "expected None without misses=\"catch_up\""))
        }
        Misses::Skip => Ok(MissPolicy::Skip),
        Misses::Stop => Ok(MissPolicy::Stop),
    }
}

/// How long a measurement may be missing until it counts, and until the loop goes to rest; None for ever.
struct Watchdog(Option<WatchdogTimes>);

#[py("tuple[float, float] | None")]
impl Argument<'_> for Watchdog {
    const TAKES_NONE: bool = true;

    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        if value.is_none() {
            return Ok(Self(None));
        }
        let (stale_after, rest_after) = two(name, "(stale_after, rest_after) or None", value)?;
        Ok(Self(Some(WatchdogTimes { stale_after, rest_after })))
    }
}

impl From<Watchdog> for Option<WatchdogTimes> {
    fn from(Watchdog(times): Watchdog) -> Self {
        times
    }
}

/// After how many writes that failed the loop ends.
struct WriteFaults(u32);

#[py("int")]
impl Argument<'_> for WriteFaults {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        whole_number(name, "a whole number from 1 to 4294967295", value).map(Self)
    }
}

impl From<WriteFaults> for u32 {
    fn from(WriteFaults(writes): WriteFaults) -> Self {
        writes
    }
}

/// A priority of SCHED_FIFO.
struct Priority(u8);

#[py("int")]
impl Argument<'_> for Priority {
    fn from_argument(name: &'static str, value: &Bound<'_, PyAny>) -> PyResult<Self> {
        whole_number(name, "a priority from 1 to 99", value).map(Self)
    }
}

/// What could not start, by the names of the arguments.
pub(super) fn refused(error: realtime::Error) -> PyErr {
    match error {
        realtime::Error::Record { path, error } => errors::io(&path.display().to_string(), &error),
        realtime::Error::Rests(mode) => {
            let mode = if mode == Mode::Stop { "stop" } else { "hold" };
            let expected = "expected one that moves: set its `hold` to False";
            errors::value("controller", format_args!("{expected}, got one in mode \"{mode}\""))
        }
        realtime::Error::Parameter(core::Error::Domain { parameter, index, expected, got }) => {
            raise(core::Error::Domain { parameter: argument(parameter), index, expected, got })
        }
        realtime::Error::Parameter(core::Error::Whole { parameter, index, expected, got }) => {
            raise(core::Error::Whole { parameter: argument(parameter), index, expected, got })
        }
        error => raise(error),
    }
}

/// What the argument is called that a setting comes from.
fn argument(setting: &'static str) -> &'static str {
    match setting {
        "dt" => "controller",
        "write_faults" => "most_write_faults",
        "stale_after" | "rest_after" => "watchdog",
        other => other,
    }
}
