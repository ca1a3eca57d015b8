//! The real clock, in a thread of its own. Only counts are looked at: what a loaded machine does to times is not for a
//! test.

use std::time::Duration;

use crate::setup::{REST, Scripted, controller, controller_with, settings, sine};
use core::ffi::{c_int, c_void};
use hysteresis_realtime::io::FunctionIo;
use hysteresis_realtime::{EndReason, MissPolicy, Session, Settings, StopFlag};
use hysteresis_simulate::paper::Benchmark;
use hysteresis_simulate::plant::Plant;

#[test]
fn every_deadline_is_accounted_for() {
    let folder = tempfile::tempdir().unwrap();
    let record = folder.path().join("record.npy");
    let asked = Settings { record: Some(record), misses: MissPolicy::CatchUp { at_most: 1_000_000 }, ..settings() };
    let outcome = Session::start(controller(), Benchmark::A1.plant(0), sine(), asked).unwrap().wait();
    let report = outcome.report;
    assert_eq!((report.end, report.at_rest, report.last_drive), (EndReason::TimeOver, true, REST));
    assert_eq!(report.deadlines.taken - report.counts.rest_samples, 1000);
    assert_eq!(report.recorded_rows, Some(report.deadlines.taken));
    assert!(report.seconds >= 0.1 && report.period.count == report.deadlines.taken - 1);
    assert!(report.in_force.absolute_deadlines == cfg!(target_os = "linux"));
    assert!(serde_json::to_string(&report).unwrap().contains("\"end\":\"time_over\""));
}

/// Without a slew, which is what time has a say in, every drive is that of the plain loop over `step`, bit for bit.
#[test]
fn the_drives_are_those_of_the_controller() {
    let free = || controller_with(|options| options.slew = None);
    let asked = Settings { seconds: Some(0.2), misses: MissPolicy::CatchUp { at_most: 1_000_000 }, ..settings() };
    let outcome = Session::start(free(), Scripted::new(), sine(), asked).unwrap().wait();
    assert_eq!(outcome.report.deadlines.taken - outcome.report.counts.rest_samples, 2000);
    let (mut controller, mut plant) = (free(), Scripted::new().plant);
    for (sample, drive) in (0..2000).zip(&outcome.io.drives) {
        assert_eq!(controller.step(sine().at(sample).into(), plant.measured()), *drive);
        plant.step(*drive);
    }
}

/// A processor that no machine has, and a priority that a test may or may not be given.
#[test]
fn what_is_refused_is_a_warning() {
    let asked = Settings { cpu: Some(1_000_000), fifo: Some(1), seconds: Some(0.01), ..settings() };
    let outcome = Session::start(controller(), Benchmark::A1.plant(0), sine(), asked).unwrap().wait();
    let (in_force, warnings) = (outcome.report.in_force, outcome.report.warnings);
    assert_eq!(in_force.cpu, None);
    assert!(warnings.iter().any(|warning| warning.starts_with("processor 1000000: refused, the loop runs without: ")));
    let refused = warnings.iter().any(|warning| warning.starts_with("SCHED_FIFO with priority 1: refused"));
    assert!(refused != (in_force.fifo == Some(1)), "granted or refused, never silent: {warnings:?}");
}

/// How much memory of this process is locked.
#[cfg(target_os = "linux")]
fn locked_memory() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("VmLck:")).unwrap();
    line.trim().trim_end_matches(" kB").parse().unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn memory_is_locked_as_long_as_a_loop_runs_that_wants_it() {
    let asked = || Settings { lock_memory: true, seconds: None, ..settings() };
    let start = || Session::start(controller(), Benchmark::A1.plant(0), sine(), asked()).unwrap();
    let sessions = [start(), start()];
    while sessions.iter().any(|session| session.live().taken() == 0) {
        std::thread::sleep(Duration::from_millis(1));
    }
    let [first, second] = sessions;
    first.stop();
    let locked = first.wait().report.in_force.locked_memory;
    // A test may not be allowed to lock memory: then nothing is.
    assert_eq!(locked_memory() > 0, locked, "the second one goes on");
    second.stop();
    assert_eq!(second.wait().report.in_force.locked_memory, locked);
    assert_eq!(locked_memory(), 0);
}

#[test]
fn a_flag_that_was_requested_before_ends_the_loop_at_once() {
    let stop = StopFlag::default();
    stop.request();
    let asked = Settings { seconds: None, ..settings() };
    let session = Session::start_with(controller(), Benchmark::A1.plant(0), sine(), asked, stop).unwrap();
    let report = session.wait().report;
    assert_eq!((report.end, report.at_rest), (EndReason::Requested, true));
    assert_eq!(report.deadlines.taken, report.counts.rest_samples);
}

unsafe extern "C" fn read(plant: *mut c_void, measurement: *mut f64) -> c_int {
    // SAFETY: the test hands over a plant that outlives the loop.
    unsafe { *measurement = (*plant.cast::<Plant>()).measured() };
    0
}

unsafe extern "C" fn write(plant: *mut c_void, drive: f64) -> c_int {
    // SAFETY: as above.
    unsafe { (*plant.cast::<Plant>()).step(drive) };
    0
}

#[test]
fn functions_of_c_drive_until_somebody_stops() {
    let mut plant = Benchmark::A1.plant(0);
    // SAFETY: the plant outlives the session, which is waited for, and nobody else touches it meanwhile.
    let io = unsafe { FunctionIo::new(read, write, (&raw mut plant).cast()) };
    let asked = Settings { seconds: None, ..settings() };
    let session = Session::start(controller(), io, sine(), asked).unwrap();
    while session.live().taken() < 100 {
        assert!(!session.is_finished());
        std::thread::sleep(Duration::from_millis(1));
    }
    session.stop();
    let report = session.wait().report;
    assert_eq!((report.end, report.at_rest), (EndReason::Requested, true));
    assert_eq!(plant.drive(), REST);
}
