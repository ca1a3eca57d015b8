//! A loop around the benchmark plant A1, simulated or behind UDP, and what it measured.
//!
//! ```text
//! cargo run --release -p hysteresis-realtime --example loop -- --rate 10000 --seconds 60 --record record.npy
//! cargo run --release -p hysteresis-realtime --example udp_plant -- --rate 1000 --lose 0.05 &
//! cargo run --release -p hysteresis-realtime --example loop -- --rate 1000 --udp
//! ```

use std::error::Error;
use std::fs;
use std::path::PathBuf;
use std::thread;
use std::time::Duration;

use clap::Parser;
use hysteresis_control::StageController;
use hysteresis_control::stage::{FeedForwardKind, Stage};
use hysteresis_core::ControllerOptions;
use hysteresis_realtime::io::{Io, UdpIo};
use hysteresis_realtime::{MissPolicy, Outcome, Reference, Report, Session, Settings, Summary, WatchdogTimes};
use hysteresis_simulate::paper::Benchmark;
use hysteresis_simulate::plant::{Plant, PlantOptions};
use signal_hook::consts::SIGINT;
use signal_hook::flag;

/// A sine of 10 Hz and 3 um on the benchmark plant A1, in real time.
#[derive(Parser)]
struct Arguments {
    /// Samples per second
    #[arg(long, default_value_t = 1e4)]
    rate: f64,
    /// When it ends; without, at Ctrl-C
    #[arg(long)]
    seconds: Option<f64>,
    /// How long it spins before each deadline, in seconds
    #[arg(long, default_value_t = 0.0)]
    spin: f64,
    /// The processor on which it runs
    #[arg(long)]
    cpu: Option<usize>,
    /// The priority of SCHED_FIFO
    #[arg(long)]
    fifo: Option<u8>,
    /// Keep all memory in memory
    #[arg(long)]
    mlock: bool,
    /// Take missed samples late instead of skipping them, at most so many
    #[arg(long)]
    catch_up: Option<u32>,
    /// The plant of the example `udp_plant`, at 127.0.0.1:47001
    #[arg(long)]
    udp: bool,
    /// Where the samples go (npy)
    #[arg(long)]
    record: Option<PathBuf>,
    /// Where the report goes (JSON)
    #[arg(long)]
    report: Option<PathBuf>,
}

fn main() -> Result<(), Box<dyn Error>> {
    let asked = Arguments::parse();
    let (stage, dt) = (Benchmark::A1.stage(), 1.0 / asked.rate);
    let settings = Settings {
        seconds: asked.seconds,
        spin: asked.spin,
        cpu: asked.cpu,
        fifo: asked.fifo,
        lock_memory: asked.mlock,
        misses: asked.catch_up.map_or(MissPolicy::Skip, |at_most| MissPolicy::CatchUp { at_most }),
        watchdog: Some(WatchdogTimes { stale_after: 1.5 * dt, rest_after: 0.1 }),
        record: asked.record,
        ..Settings::new(0.0, 2000.0) // V, V/s
    };
    let controller = controller(&stage, dt)?;
    let report = if asked.udp {
        let outcome = drive(controller, UdpIo::connect("127.0.0.1:47002", "127.0.0.1:47001")?, dt, settings)?;
        println!("datagrams: {:?}", outcome.io.counts());
        outcome.report
    } else {
        drive(controller, Plant::new(&stage, &PlantOptions::new(dt))?, dt, settings)?.report
    };
    show(&report);
    if let Some(path) = asked.report {
        fs::write(path, serde_json::to_string(&report)?)?;
    }
    Ok(())
}

fn controller(stage: &Stage, dt: f64) -> Result<StageController, Box<dyn Error>> {
    let options = ControllerOptions { slew: Some(1e5), ..stage.controller_options(dt, None)? }; // V/s
    Ok(stage.controller(FeedForwardKind::Inverse, &options)?.into())
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand samples")]
fn drive<I: Io + 'static>(
    controller: StageController,
    io: I,
    dt: f64,
    settings: Settings,
) -> Result<Outcome<I>, Box<dyn Error>> {
    let samples = (0.1 / dt).round() as u32;
    let sine = |k: u32| 3.0 * (core::f64::consts::TAU * f64::from(k) / f64::from(samples)).sin(); // um
    let reference = Reference::periodic((0..samples).map(sine).collect())?;
    let session = Session::start(controller, io, reference, settings)?;
    flag::register(SIGINT, session.stop_flag().shared())?;
    let live = session.live();
    while !session.is_finished() {
        thread::sleep(Duration::from_millis(200));
        let (taken, missed, skipped, stale) = (live.taken(), live.missed(), live.skipped(), live.stale());
        let (measurement, drive) = (live.measurement(), live.drive());
        eprint!(
            "\r{taken} samples, {missed} missed, {skipped} skipped, {stale} stale, {measurement:8.3} um, {drive:8.2} V"
        );
    }
    eprintln!();
    Ok(session.wait())
}

fn show(report: &Report) {
    println!("{:?}, at rest: {}, {:.3} s, {:?}", report.end, report.at_rest, report.seconds, report.deadlines);
    println!("{:?}, last fault: {:?}, rows: {:?}", report.counts, report.last_fault, report.recorded_rows);
    println!("{:>10} {:>10} {:>10} {:>10} {:>10} {:>10} us", "", "median", "p99", "p99.9", "p99.99", "max");
    for (name, times) in [("latency", &report.latency), ("compute", &report.compute), ("period", &report.period)] {
        let Summary { median, p99, p999, p9999, max, .. } = *times;
        let [median, p99, p999, p9999, max] = [median, p99, p999, p9999, max].map(|time| 1e6 * time);
        println!("{name:>10} {median:10.2} {p99:10.2} {p999:10.2} {p9999:10.2} {max:10.2}");
    }
    println!("{:?}\n{:?}", report.in_force, report.machine);
    report.warnings.iter().for_each(|warning| println!("warning: {warning}"));
}
