//! Deadlines that are missed, on a simulated clock.

use std::sync::{Arc, Mutex};

use crate::setup::{DT, INTERVAL, SLEW, Scripted, controller, run_with, said, settings, sine};
use hysteresis_realtime::clock::{Clock, SimulatedClock};
use hysteresis_realtime::{Deadlines, EndReason, MissPolicy, NpyFile, Reference, Settings, StopFlag, run_on};

/// A loop in which the write of sample 300 takes so many nanoseconds.
fn with_a_slow_write(time: u64, misses: MissPolicy) -> hysteresis_realtime::Outcome<Scripted> {
    let clock = SimulatedClock::new();
    let slow = clock.clone();
    let io = Scripted::writing(move |sample, _| {
        if sample == 300 {
            slow.pass(time);
        }
        Ok(())
    });
    run_with(clock, controller(), io, Settings { misses, ..settings() })
}

#[test]
fn skipped_samples_are_those_of_the_time_that_was_lost() {
    let outcome = with_a_slow_write(5 * INTERVAL / 2, MissPolicy::Skip);
    let report = &outcome.report;
    assert_eq!(report.end, EndReason::TimeOver);
    let Deadlines { taken, missed, late, skipped } = report.deadlines;
    assert_eq!((missed, late, skipped), (1, 0, 2));
    assert_eq!(taken - report.counts.rest_samples, 998, "1000 deadlines, two of them skipped");
    // The reference is that of the time: the next sample is 303.
    let (mut controller, mut plant) = (controller(), Scripted::new().plant);
    for (sample, drive) in (0..=300).chain(303..1000).zip(&outcome.io.drives) {
        assert_eq!(controller.step(sine().at(sample).into(), plant.measured()), *drive);
        plant.step(*drive);
    }
    assert!((report.compute.max / 2.5e-4 - 1.0).abs() < 2e-3 && (report.period.max / 3e-4 - 1.0).abs() < 2e-3);
}

#[test]
fn what_is_caught_up_is_every_sample() {
    let outcome = with_a_slow_write(5 * INTERVAL / 2, MissPolicy::CatchUp { at_most: 5 });
    let report = &outcome.report;
    // 300 and 301 end when the next one is due, 302 begins half an interval late.
    assert_eq!((report.deadlines.missed, report.deadlines.late, report.deadlines.skipped), (2, 1, 0));
    assert_eq!(report.deadlines.taken - report.counts.rest_samples, 1000);
    let (mut controller, mut plant) = (controller(), Scripted::new().plant);
    for (sample, drive) in (0..1000).zip(&outcome.io.drives) {
        // At 301 no time has gone by since the last drive. 302 is on time again, right behind: 303 has half an
        // interval.
        let bound = match sample {
            301 => 0.0,
            303 => 0.5 * SLEW * DT,
            _ => f64::INFINITY,
        };
        controller.controller_mut().bound_step(bound);
        assert_eq!(controller.step(sine().at(sample).into(), plant.measured()), *drive);
        plant.step(*drive);
    }
}

/// When each sample began and was written, in seconds, and its drive.
type Written = (f64, f64, f64);

#[expect(clippy::cast_precision_loss, reason = "a second in nanoseconds")]
fn seconds(clock: &SimulatedClock) -> f64 {
    clock.now() as f64 * 1e-9
}

fn jumps() -> Reference {
    Reference::periodic((0..400).map(|k| if k < 200 { 5.0 } else { -5.0 }).collect()).unwrap() // um
}

/// A loop that jumps between two positions, so that the slew bounds nearly every sample. Reading sample k takes
/// `time(k)` nanoseconds.
fn at_the_slew(
    time: impl Fn(u64) -> u64 + Send + 'static,
    misses: MissPolicy,
) -> (hysteresis_realtime::Outcome<Scripted>, Vec<Written>) {
    let clock = SimulatedClock::new();
    let (reading, writing) = (clock.clone(), clock.clone());
    let began = Arc::new(Mutex::new(0.0));
    let written = Arc::new(Mutex::new(Vec::with_capacity(2000)));
    let (begins, writes) = (Arc::clone(&began), Arc::clone(&written));
    let mut io = Scripted::writing(move |_, drive| {
        writes.lock().unwrap().push((*began.lock().unwrap(), seconds(&writing), drive));
        Ok(())
    });
    io.read = Box::new(move |sample, measured| {
        *begins.lock().unwrap() = seconds(&reading);
        reading.pass(time(sample));
        Ok(Some(measured))
    });
    let asked = Settings { misses, ..settings() };
    let outcome = run_on(clock, controller(), io, jumps(), asked, &StopFlag::default()).unwrap();
    crate::setup::check(&outcome);
    let written = std::mem::take(&mut *written.lock().unwrap());
    (outcome, written)
}

/// How far the drive moved within so many seconds, beyond what the slew gives for that time and `grace` seconds.
fn beyond_the_slew(written: &[Written], grace: f64) -> f64 {
    let later = |first: usize| written[first + 1..].iter().take(300);
    let pairs = (0..written.len()).flat_map(|first| later(first).map(move |then| (&written[first], then)));
    pairs.map(|(first, then)| (then.2 - first.2).abs() - SLEW * (then.1 - first.1 + grace)).fold(f64::MIN, f64::max)
}

/// A read that takes 90 intervals: what was missed is caught up, but the drive moves no faster for that.
#[test]
fn what_is_caught_up_keeps_the_slew_in_time() {
    let (outcome, written) =
        at_the_slew(|k| if k == 390 { 90 * INTERVAL } else { 0 }, MissPolicy::CatchUp { at_most: 1000 });
    let Deadlines { skipped, late, .. } = outcome.report.deadlines;
    assert_eq!((skipped, late), (0, 89), "390 began in time, 480 is on time again");
    // A nanosecond is what the clock counts in.
    let rounding = 2.0 * SLEW * 1e-9;
    assert!(beyond_the_slew(&written, DT) <= rounding);
    // While it is behind there is no grace: the jump of the reference at 400 moves nothing until time goes by.
    let behind = &written[390..480];
    assert!(beyond_the_slew(behind, 0.0) <= rounding);
    assert!(behind.iter().all(|sample| sample.2 == behind[0].2));
    assert!((written[520].2 - behind[0].2).abs() > 39.0 * SLEW * DT, "then the slew is what bounds it");
}

/// A loop that skips what it misses keeps the slew in time by itself: its drives are those of the controller, however
/// late it is.
#[test]
fn what_is_skipped_needs_no_bound() {
    let mut random = fastrand::Rng::with_seed(5);
    let times: Vec<u64> = (0..2000).map(|_| if random.u8(..8) == 0 { random.u64(..400_000) } else { 0 }).collect();
    let (outcome, written) = at_the_slew(move |k| times[usize::try_from(k).unwrap()], MissPolicy::Skip);
    assert!(outcome.report.deadlines.missed > 50);
    assert!(beyond_the_slew(&written, DT) <= 2.0 * SLEW * 1e-9);
    let (mut controller, mut plant) = (controller(), Scripted::new().plant);
    for (began, _, drive) in &written[..written.len() - usize::try_from(outcome.report.counts.rest_samples).unwrap()] {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a thousand samples")]
        let sample = (began / DT).round() as u64 - 1; // the first deadline is at DT
        assert_eq!(controller.step(jumps().at(sample).into(), plant.measured()), *drive);
        plant.step(*drive);
    }
}

#[test]
fn a_loop_that_must_not_miss_goes_to_rest() {
    let outcome = with_a_slow_write(INTERVAL, MissPolicy::Stop);
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::DeadlineMissed, true));
    assert_eq!((outcome.report.deadlines.missed, outcome.report.deadlines.skipped), (1, 1));
    assert_eq!(outcome.report.deadlines.taken - outcome.report.counts.rest_samples, 301);
}

#[test]
fn one_that_is_just_in_time_is_none() {
    let outcome = with_a_slow_write(INTERVAL - 1, MissPolicy::Stop);
    assert_eq!((outcome.report.end, outcome.report.deadlines.missed), (EndReason::TimeOver, 0));
}

#[test]
fn latency_is_how_late_samples_begin() {
    let clock = SimulatedClock::waking_late(|deadline| if deadline == 500 * INTERVAL { 30_000 } else { 2_000 });
    let report = run_with(clock, controller(), Scripted::new(), settings()).report;
    let near = |value: f64, expected: f64| (value / expected - 1.0).abs() < 2e-3;
    assert!(near(report.latency.median, 2e-6) && near(report.latency.max, 3e-5), "{:?}", report.latency);
    assert!(near(report.period.max, 1.28e-4) && report.compute.max < 1e-8);
    assert_eq!(report.deadlines.missed, 0);
}

#[test]
fn the_record_has_every_sample() -> Result<(), Box<dyn core::error::Error>> {
    let folder = tempfile::tempdir()?;
    let record = folder.path().join("record.npy");
    let clock = SimulatedClock::waking_late(|_| 2_000);
    let recorded = Settings { record: Some(record.clone()), ..settings() };
    let outcome = run_with(clock, controller(), Scripted::new(), recorded);
    let taken = outcome.report.deadlines.taken;
    assert_eq!((outcome.report.recorded_rows, outcome.report.counts.lost_rows), (Some(taken), 0));
    let bytes = std::fs::read(&record)?;
    assert_eq!(bytes.len() as u64, 256 + 40 * taken);
    assert!(String::from_utf8_lossy(&bytes[..256]).contains(&format!("'shape': ({taken},)")));
    let numbers: Vec<f64> = bytes[256..].chunks_exact(8).map(|x| f64::from_le_bytes(x.try_into().unwrap())).collect();
    for (k, (row, drive)) in (0..1000_u32).zip(numbers.chunks_exact(5).zip(&outcome.io.drives)) {
        assert!((row[0] - (f64::from(k) * 1e-4 + 2e-6)).abs() < 1e-12);
        assert_eq!((row[1], row[3]), (sine().at(k.into()), *drive));
        assert!(row[2].is_finite() && (row[4] - 2e-6).abs() < 1e-15);
    }
    Ok(())
}

#[test]
fn a_recorder_that_is_too_slow_loses_rows_and_says_so() -> Result<(), Box<dyn core::error::Error>> {
    let folder = tempfile::tempdir()?;
    // The simulated clock is so fast that the recorder sleeps through nearly all of the run.
    let recorded = Settings { record: Some(folder.path().join("record.npy")), ring: 8, ..settings() };
    let report = run_with(SimulatedClock::new(), controller(), Scripted::new(), recorded).report;
    assert!(report.counts.lost_rows > 0);
    assert_eq!(report.recorded_rows.unwrap() + report.counts.lost_rows, report.deadlines.taken);
    assert_eq!(
        said(&report, "record: "),
        [format!("record: the recorder was too slow for {} rows", report.counts.lost_rows)]
    );
    Ok(())
}

#[test]
fn a_record_that_cannot_be_written_is_not_one_for_which_the_recorder_was_too_slow() {
    let folder = tempfile::tempdir().unwrap();
    // The ring is full soon after the recorder has given up.
    let recorded = Settings { record: Some(folder.path().join("record.npy")), ring: 8, ..settings() };
    let mut folder = Some(folder);
    // Before the first rows are written, which need the name of the file.
    let io = Scripted::writing(move |_, _| {
        drop(folder.take());
        Ok(())
    });
    let report = run_with(SimulatedClock::new(), controller(), io, recorded).report;
    let taken = report.deadlines.taken;
    assert_eq!((report.recorded_rows, report.counts.lost_rows), (Some(0), taken));
    let [said] = said(&report, "record: ")[..] else { panic!("{:?}", report.warnings) };
    assert!(said.starts_with(&format!("record: {taken} rows are missing: ")), "{said}");
}

#[test]
fn a_record_that_cannot_be_is_refused() {
    let stop = hysteresis_realtime::StopFlag::default();
    let nowhere = Settings { record: Some("no/such/folder/x.npy".into()), ..settings() };
    let clock = SimulatedClock::new();
    let error =
        hysteresis_realtime::run_on(clock, controller(), Scripted::new(), sine(), nowhere, &stop).err().unwrap();
    assert!(error.to_string().starts_with("record: expected a file to write to, got no/such/folder/x.npy: "));
    assert!(NpyFile::create("no/such/folder/x.npy".as_ref()).is_err());
}
