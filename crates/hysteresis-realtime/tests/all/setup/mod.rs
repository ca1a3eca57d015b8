//! A loop on a simulated clock, around a plant that fails as a test wants it to.

use std::sync::OnceLock;

use hysteresis_control::StageController;
use hysteresis_control::stage::FeedForwardKind;
use hysteresis_core::ControllerOptions;
use hysteresis_realtime::clock::SimulatedClock;
use hysteresis_realtime::io::{Fault, Io};
use hysteresis_realtime::{Outcome, Reference, Report, Settings, StopFlag, run_on};
use hysteresis_simulate::paper::Benchmark;
use hysteresis_simulate::plant::Plant;

pub(crate) const DT: f64 = 1e-4;
/// In nanoseconds.
pub(crate) const INTERVAL: u64 = 100_000;
pub(crate) const SLEW: f64 = 20_000.0; // V/s, 2 V per sample
pub(crate) const RATE: f64 = 5_000.0; // V/s, 0.5 V per sample
pub(crate) const REST: f64 = -10.0; // V

/// Called with the number of the sample and the measurement or the drive.
pub(crate) type Answer<T> = Box<dyn FnMut(u64, f64) -> Result<T, Fault> + Send>;

/// A plant whose reads and writes are answered by a test.
pub(crate) struct Scripted {
    pub(crate) plant: Plant,
    pub(crate) read: Answer<Option<f64>>,
    pub(crate) write: Answer<()>,
    /// The sample of the next write.
    pub(crate) sample: u64,
    /// What was written without a fault.
    pub(crate) drives: Vec<f64>,
}

impl Scripted {
    pub(crate) fn new() -> Self {
        Self {
            plant: Benchmark::A1.plant(3),
            read: Box::new(|_, measured| Ok(Some(measured))),
            write: Box::new(|_, _| Ok(())),
            sample: 0,
            drives: Vec::with_capacity(20_000),
        }
    }

    pub(crate) fn reading(answer: impl FnMut(u64, f64) -> Result<Option<f64>, Fault> + Send + 'static) -> Self {
        Self { read: Box::new(answer), ..Self::new() }
    }

    pub(crate) fn writing(answer: impl FnMut(u64, f64) -> Result<(), Fault> + Send + 'static) -> Self {
        Self { write: Box::new(answer), ..Self::new() }
    }

    /// The drives from which the amplifier came: the start, then what was written.
    pub(crate) fn largest_move(&self) -> f64 {
        let from = [0.0].into_iter().chain(self.drives.iter().copied());
        from.zip(&self.drives).map(|(from, to)| (to - from).abs()).fold(0.0, f64::max)
    }
}

impl Io for Scripted {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        (self.read)(self.sample, self.plant.measured())
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        let sample = self.sample;
        self.sample += 1;
        (self.write)(sample, drive)?;
        self.plant.step(drive);
        self.drives.push(drive);
        Ok(())
    }
}

pub(crate) fn controller() -> StageController {
    controller_with(|_| {})
}

pub(crate) fn controller_with(change: impl FnOnce(&mut ControllerOptions)) -> StageController {
    // Tuning takes a second.
    static OPTIONS: OnceLock<ControllerOptions> = OnceLock::new();
    let stage = Benchmark::A1.stage();
    let mut options = *OPTIONS.get_or_init(|| stage.controller_options(DT, None).unwrap());
    options.slew = Some(SLEW);
    change(&mut options);
    stage.controller(FeedForwardKind::Inverse, &options).unwrap().into()
}

/// 50 Hz, 2 um.
pub(crate) fn sine() -> Reference {
    let positions = (0..200).map(|k| 2.0 * (core::f64::consts::TAU * f64::from(k) / 200.0).sin()).collect();
    Reference::periodic(positions).unwrap()
}

pub(crate) fn settings() -> Settings {
    Settings { seconds: Some(0.1), ..Settings::new(REST, RATE) }
}

pub(crate) fn run(io: Scripted, settings: Settings) -> Outcome<Scripted> {
    run_with(SimulatedClock::new(), controller(), io, settings)
}

/// Runs, and checks what holds for every loop.
pub(crate) fn run_with(
    clock: SimulatedClock,
    controller: StageController,
    io: Scripted,
    settings: Settings,
) -> Outcome<Scripted> {
    let outcome = run_on(clock, controller, io, sine(), settings, &StopFlag::default()).unwrap();
    check(&outcome);
    outcome
}

/// The warnings of a part.
pub(crate) fn said<'a>(report: &'a Report, part: &str) -> Vec<&'a str> {
    report.warnings.iter().map(String::as_str).filter(|warning| warning.starts_with(part)).collect()
}

pub(crate) fn check(outcome: &Outcome<Scripted>) {
    let (report, io) = (&outcome.report, &outcome.io);
    let counts = report.counts;
    assert!(io.largest_move() <= SLEW * DT, "{} V in a sample", io.largest_move());
    assert_eq!(report.last_drive, io.drives.last().copied().unwrap_or(0.0), "the report knows what the amplifier has");
    assert_eq!(report.at_rest, report.last_drive == REST && io.drives.last() == Some(&REST));
    assert_eq!(report.deadlines.taken, io.sample, "one write for each sample");
    assert_eq!(report.deadlines.taken, io.drives.len() as u64 + counts.write_faults);
    assert_eq!(report.deadlines.taken, counts.fresh + counts.stood_in + counts.stale);
    assert_eq!(report.deadlines.taken, report.latency.count);
    assert_eq!(report.deadlines.taken, report.compute.count);
    assert_eq!(report.deadlines.taken, report.period.count + 1);
}
