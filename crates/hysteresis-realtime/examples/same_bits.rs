//! The loop of `same-bits` as a loop in real time on a simulated clock, with its record: same_bits STAGE.json
//! RECORD.npy.
//!
//! Prints the digest of the recorded drives up to the end of the reference.

use std::error::Error;
use std::fs;
use std::path::Path;

use hysteresis_control::stage::{FeedForwardKind, Stage, StageForward};
use hysteresis_realtime::clock::SimulatedClock;
use hysteresis_realtime::io::{Fault, Io};
use hysteresis_realtime::{COLUMNS, Reference, Settings, StopFlag, run_on};
use same_bits::{DT, SAMPLES, digest, finite_references, readings};

/// A plant whose sensor shows what is not finite now and then.
struct Bench<R> {
    plant: StageForward,
    position: f64,
    readings: R,
}

impl<R: Iterator<Item = F> + Send, F: Fn(f64) -> f64> Io for Bench<R> {
    fn read(&mut self) -> Result<Option<f64>, Fault> {
        Ok(self.readings.next().map(|read| read(self.position)))
    }

    fn write(&mut self, drive: f64) -> Result<(), Fault> {
        self.position = self.plant.advance(drive);
        Ok(())
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [stage, record] = &arguments[..] else { return Err("expected STAGE.json RECORD.npy".into()) };
    let stage = Stage::from_json(&fs::read_to_string(stage)?)?;
    let controller = stage.controller(FeedForwardKind::Inverse, &stage.controller_options(DT, None)?)?;
    let settings = Settings {
        watchdog: None, // what is not finite goes on to the controller, which holds the drive and counts it
        record: Some(record.into()),
        ring: 2 * SAMPLES, // a simulated clock waits for no recorder
        ..Settings::new(stage.rest_drive(), 1e4)
    };
    let bench = Bench { plant: stage.forward(DT)?, position: 0.0, readings: readings() };
    let reference = Reference::once(finite_references().take(SAMPLES).collect())?;
    let outcome = run_on(SimulatedClock::new(), controller.into(), bench, reference, settings, &StopFlag::default())?;
    let report = outcome.report;
    if !report.at_rest || report.counts.lost_rows > 0 || report.deadlines.missed > 0 {
        return Err(format!("the loop did not go as it should: {report:?}").into());
    }
    println!("loop {}", digest(&drives(Path::new(record))?));
    Ok(())
}

/// The drives of a record, up to the end of the reference.
fn drives(record: &Path) -> Result<Vec<f64>, Box<dyn Error>> {
    let bytes = fs::read(record)?;
    let (numbers, _) = bytes.get(256..).ok_or("expected a record with a header")?.as_chunks::<8>();
    let column = COLUMNS.iter().position(|name| *name == "drive").ok_or("expected a column of drives")?;
    let drives = numbers.iter().skip(column).step_by(COLUMNS.len()).take(SAMPLES);
    Ok(drives.map(|bytes| f64::from_le_bytes(*bytes)).collect())
}
