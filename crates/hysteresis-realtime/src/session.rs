//! A loop in a thread of its own.

use std::sync::Arc;
use std::thread::{self, JoinHandle};

use hysteresis_control::StageController;
use hysteresis_control::learning::RepetitiveControl;

use crate::clock::{Clock, RealClock};
use crate::io::Io;
use crate::privileges::{InForce, ask, unlock};
use crate::recorder::{Recorded, Recorder, ring};
use crate::report::{Counts, Learning, Live, Machine, Report, StopFlag};
use crate::runner::{Loop, Surroundings};
use crate::settings::{Error, Reference, Settings};

/// What is left of a loop that ended.
#[derive(Debug)]
pub struct Outcome<I> {
    /// What it did.
    pub report: Report,
    /// The controller, in its stop at the drive written last.
    pub controller: StageController,
    /// Input and output.
    pub io: I,
}

/// A loop that runs in its own thread.
///
/// Dropped, it goes on; its [`StopFlag`] still reaches it.
#[derive(Debug)]
pub struct Session<I> {
    thread: JoinHandle<Outcome<I>>,
    stop: StopFlag,
    live: Arc<Live>,
}

impl<I: Io + 'static> Session<I> {
    /// Starts the loop. The amplifier must have the drive of the controller; the loop goes on from there.
    ///
    /// # Errors
    /// [`Error`] that names the setting; nothing has been written to the amplifier then.
    pub fn start(controller: StageController, io: I, reference: Reference, settings: Settings) -> Result<Self, Error> {
        Self::start_with(controller, io, reference, settings, StopFlag::default())
    }

    /// As [`start`](Self::start), with a flag that others may have already. If it was requested before, the loop goes
    /// to rest at once.
    ///
    /// # Errors
    /// As [`start`](Self::start).
    pub fn start_with(
        controller: StageController,
        io: I,
        reference: Reference,
        settings: Settings,
        stop: StopFlag,
    ) -> Result<Self, Error> {
        settings.check(&controller)?;
        let live = Arc::new(Live::default());
        let (sender, recorder) = recorder(&settings)?.unzip();
        let around = Surroundings { reference, stop: stop.clone(), live: Arc::clone(&live), sender };
        let work = move || {
            let (machine, mut warnings) = (Machine::here(), Vec::new());
            let in_force = ask(&settings, &mut warnings);
            let locked = in_force.locked_memory;
            let made = Loop::new(controller, io, RealClock, &settings, around);
            let mut outcome = run(made, Asked { settings, in_force, warnings, recorder, machine });
            if locked {
                unlock(&mut outcome.report.warnings);
            }
            outcome
        };
        let thread = thread::Builder::new().name("hysteresis-loop".into()).spawn(work).map_err(Error::Thread)?;
        Ok(Self { thread, stop, live })
    }
}

impl<I> Session<I> {
    /// Asks the loop to go to rest and end.
    pub fn stop(&self) {
        self.stop.request();
    }

    /// What [`stop`](Self::stop) sets, for handlers of signals and other threads.
    #[must_use]
    pub fn stop_flag(&self) -> StopFlag {
        self.stop.clone()
    }

    /// What the loop shows while it runs.
    #[must_use]
    pub fn live(&self) -> Arc<Live> {
        Arc::clone(&self.live)
    }

    /// Whether the loop has ended.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.thread.is_finished()
    }

    /// Waits for the end.
    ///
    /// # Panics
    /// If the thread of the loop panicked, which is a bug in this library: panics of input and output are caught.
    #[must_use]
    pub fn wait(self) -> Outcome<I> {
        self.thread.join().unwrap_or_else(|payload| std::panic::resume_unwind(payload))
    }
}

/// Runs a loop in this thread on any clock, without asking for privileges: for tests and simulations.
///
/// # Errors
/// As [`Session::start`].
///
/// ```
/// use hysteresis_control::stage::FeedForwardKind;
/// use hysteresis_realtime::clock::SimulatedClock;
/// use hysteresis_realtime::{EndReason, Reference, Settings, StopFlag, run_on};
/// use hysteresis_simulate::paper::Benchmark;
/// let stage = Benchmark::A1.stage();
/// let controller = stage.controller(FeedForwardKind::Inverse, &stage.controller_options(1e-4, None)?)?;
/// let reference = Reference::once((0..1000).map(|k| 1e-3 * f64::from(k)).collect())?; // um
/// let settings = Settings::new(0.0, 5000.0); // V, V/s
/// let stop = StopFlag::default();
/// let outcome = run_on(SimulatedClock::new(), controller.into(), Benchmark::A1.plant(0), reference, settings, &stop)?;
/// assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::ReferenceOver, true));
/// # Ok::<(), Box<dyn core::error::Error>>(())
/// ```
pub fn run_on<I: Io, C: Clock>(
    clock: C,
    controller: StageController,
    io: I,
    reference: Reference,
    settings: Settings,
    stop: &StopFlag,
) -> Result<Outcome<I>, Error> {
    settings.check(&controller)?;
    let (sender, recorder) = recorder(&settings)?.unzip();
    let around = Surroundings { reference, stop: stop.clone(), live: Arc::default(), sender };
    let made = Loop::new(controller, io, clock, &settings, around);
    let (in_force, warnings, machine) = (InForce::default(), Vec::new(), Machine::here());
    Ok(run(made, Asked { settings, in_force, warnings, recorder, machine }))
}

fn recorder(settings: &Settings) -> Result<Option<(crate::recorder::Sender, Recorder)>, Error> {
    let Some(path) = &settings.record else { return Ok(None) };
    let (sender, receiver) = ring(settings.ring);
    let recorder = Recorder::start(path, receiver).map_err(|error| Error::Record { path: path.clone(), error })?;
    Ok(Some((sender, recorder)))
}

/// What goes into the report besides what the loop did.
struct Asked {
    settings: Settings,
    in_force: InForce,
    warnings: Vec<String>,
    recorder: Option<Recorder>,
    machine: Machine,
}

/// More than one sample in so many that are unusual are worth a word.
const OFTEN: u64 = 100;

/// What is to be said of samples that were unusual often: the loop runs on, and nothing else tells.
fn often(saturated: u64, stale: u64, taken: u64) -> impl Iterator<Item = String> {
    let said = [
        (
            saturated,
            "had the drive at a limit: the reference is out of reach, or the measurement is not that of the stage",
        ),
        (stale, "had no measurement to use: it was missing or implausible"),
    ];
    let is_often = move |(count, _): &(u64, _)| count.saturating_mul(OFTEN) > taken;
    said.into_iter().filter(is_often).map(move |(count, what)| format!("controller: {count} of {taken} samples {what}"))
}

fn run<I: Io, C: Clock>(mut made: Loop<I, C>, asked: Asked) -> Outcome<I> {
    let divergences = made.controller.repetitive().map_or(0, RepetitiveControl::divergence_count);
    let before = made.controller.controller().counters().saturated_count;
    let end = made.run();
    let seconds = made.seconds();
    let mut lost_rows = made.close_ring();
    let Asked { settings, in_force, mut warnings, recorder, machine } = asked;
    let recorded = recorder.map(Recorder::finish);
    if let Some(Recorded { rows, error: Some(error) }) = &recorded {
        // Most of them never came to the ring, or were left in it.
        lost_rows = made.deadlines().taken - rows.unwrap_or(0);
        let up_to = if rows.is_none() { "up to " } else { "" };
        warnings.push(format!("record: {up_to}{lost_rows} rows are missing: {error}"));
    } else if lost_rows > 0 {
        warnings.push(format!("record: the recorder was too slow for {lost_rows} rows"));
    }
    let (sent, rest_refused) = (made.rest.written(), made.rest.refused(&made.io));
    if rest_refused > 0 {
        let said =
            format!("it was sent {sent} times, and {rest_refused} times the other side said that nobody listens");
        warnings.push(format!("io: the rest drive may have reached nobody: {said}"));
    }
    let learning = made.controller.repetitive();
    warnings.extend(learning.and_then(|repetitive| Learning::warning(repetitive, divergences)));
    let learning = learning.map(Learning::of);
    let (observed, controller) = (made.observed(), made.controller.controller());
    let saturated = controller.counters().saturated_count.saturating_sub(before);
    warnings.extend(often(saturated, observed.counts.stale, made.deadlines().taken));
    let report = Report {
        end,
        at_rest: made.rest.is_reached(),
        last_drive: controller.drive(),
        last_fault: observed.last_fault.map(|fault| fault.to_string()),
        seconds,
        dt: controller.options().dt,
        deadlines: made.deadlines(),
        counts: Counts { lost_rows, ..observed.counts },
        datagrams: made.io.datagrams(),
        rest_refused,
        controller: controller.counters(),
        learning,
        latency: observed.latency.summary(),
        compute: observed.compute.summary(),
        period: observed.period.summary(),
        recorded_rows: recorded.and_then(|recorded| recorded.rows),
        settings,
        in_force,
        warnings,
        machine,
    };
    let (controller, io) = made.into_parts();
    Outcome { report, controller, io }
}
