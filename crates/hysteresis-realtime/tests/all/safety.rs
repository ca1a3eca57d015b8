//! Every state of the safety table, on a simulated clock.

use crate::setup::{
    DT, INTERVAL, RATE, REST, Scripted, controller, controller_with, run, run_with, said, settings, sine,
};
use hysteresis_core::{Error as CoreError, FeedForward, HybridController, Mode};
use hysteresis_realtime::clock::SimulatedClock;
use hysteresis_realtime::io::Fault;
use hysteresis_realtime::{EndReason, Outcome, Reference, Settings, StopFlag, WatchdogTimes, run_on};

fn watched(stale_samples: f64, rest_samples: f64) -> Settings {
    let times = WatchdogTimes { stale_after: stale_samples * DT, rest_after: rest_samples * DT };
    Settings { watchdog: Some(times), ..settings() }
}

#[test]
fn it_runs_for_its_time_then_rests() {
    let outcome = run(Scripted::new(), settings());
    let report = &outcome.report;
    assert_eq!((report.end, report.at_rest, report.last_drive), (EndReason::TimeOver, true, REST));
    assert_eq!(report.counts.fresh, report.deadlines.taken);
    assert_eq!(report.deadlines.taken - report.counts.rest_samples, 1000);
    let left = &outcome.io.drives[999..];
    assert!(left.windows(2).all(|pair| (pair[1] - pair[0]).abs() <= RATE * DT + 1e-12));
    assert_eq!((report.deadlines.missed, report.deadlines.skipped, report.last_fault.as_ref()), (0, 0, None));
    assert_eq!(outcome.controller.controller().mode(), Mode::Stop);
}

/// The loop is the plain loop over `step`, bit for bit.
#[test]
fn the_drives_are_those_of_the_controller() {
    let outcome = run(Scripted::new(), settings());
    let (mut controller, mut plant, reference) = (controller(), Scripted::new().plant, sine());
    for (sample, drive) in (0..1000).zip(&outcome.io.drives) {
        assert_eq!(controller.step(reference.at(sample).into(), plant.measured()), *drive);
        plant.step(*drive);
    }
}

/// What the loop looks at before it spins changes nothing.
#[test]
fn spinning_changes_no_drive() {
    let plain = run(Scripted::new(), settings());
    let spinning = run(Scripted::new(), Settings { spin: 3e-5, ..settings() });
    assert_eq!(plain.io.drives, spinning.io.drives);
    assert_eq!(plain.report.controller, spinning.report.controller);
}

#[test]
fn a_reference_that_is_over_ends_it() {
    let reference = Reference::once(vec![0.5; 321]).unwrap();
    let (clock, stop) = (SimulatedClock::new(), StopFlag::default());
    let outcome = run_on(clock, controller(), Scripted::new(), reference, settings(), &stop).unwrap();
    crate::setup::check(&outcome);
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::ReferenceOver, true));
    assert_eq!(outcome.report.deadlines.taken - outcome.report.counts.rest_samples, 321);
}

#[test]
fn it_rests_when_it_is_asked_to() {
    let stop = StopFlag::default();
    let asked = stop.clone();
    let io = Scripted::writing(move |sample, _| {
        if sample == 99 {
            asked.request();
        }
        Ok(())
    });
    let outcome = run_on(SimulatedClock::new(), controller(), io, sine(), settings(), &stop).unwrap();
    crate::setup::check(&outcome);
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::Requested, true));
    assert_eq!(outcome.report.deadlines.taken - outcome.report.counts.rest_samples, 100);
}

#[test]
fn the_last_measurement_stands_in_until_it_is_stale() {
    let io = Scripted::reading(|sample, measured| Ok((sample % 4 == 0).then_some(measured)));
    let outcome = run(io, watched(2.0, 50.0));
    let counts = outcome.report.counts;
    assert_eq!(outcome.report.end, EndReason::TimeOver);
    // Of four samples one is fresh, the next one stands in, two are stale.
    assert!(counts.stood_in.abs_diff(counts.fresh) <= 1 && counts.stale.abs_diff(2 * counts.fresh) <= 2, "{counts:?}");
    assert_eq!(
        outcome.report.controller.missing_count + counts.rest_samples / 2,
        counts.stale,
        "the controller saw NaN"
    );
}

#[test]
fn without_measurements_the_drive_is_held_then_goes_to_rest() {
    let io = Scripted::reading(|sample, measured| Ok((sample < 300).then_some(measured)));
    let outcome = run(io, watched(0.0, 100.0));
    let report = &outcome.report;
    assert_eq!((report.end, report.at_rest), (EndReason::Watchdog, true));
    // The last fresh one came at sample 299; 100 intervals later it is time.
    let held = &outcome.io.drives[300..399];
    assert!(held.iter().all(|drive| *drive == outcome.io.drives[299]), "not a move");
    assert!(outcome.io.drives[399] != outcome.io.drives[398]);
    let max_missing = u64::from(outcome.controller.controller().options().max_missing);
    assert_eq!(report.counts.held, 99 - max_missing, "after those the controller itself waits for");
}

#[test]
fn measurements_that_return_end_the_hold_without_a_jump() {
    let io = Scripted::reading(|sample, measured| Ok((!(300..350).contains(&sample)).then_some(measured)));
    let outcome = run(io, watched(0.0, 100.0));
    assert_eq!(outcome.report.end, EndReason::TimeOver);
    let drives = &outcome.io.drives;
    assert!(drives[300..=350].iter().all(|drive| *drive == drives[299]), "the motion starts from the held drive");
    assert!(drives[351] != drives[350] && drives[900] != drives[350]);
    assert_eq!(outcome.report.counts.stale, 50);
}

#[test]
fn without_a_watchdog_it_holds_for_ever() {
    let io = Scripted::reading(|sample, measured| Ok((sample < 300).then_some(measured)));
    let outcome = run(io, Settings { watchdog: None, ..settings() });
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::TimeOver, true));
    assert!(outcome.io.drives[300..1000].iter().all(|drive| *drive == outcome.io.drives[299]));
}

#[test]
fn what_cannot_be_a_measurement_is_none() {
    for nonsense in [f64::NAN, f64::INFINITY, 1e9] {
        let io = Scripted::reading(move |sample, measured| Ok(Some(if sample < 300 { measured } else { nonsense })));
        let outcome = run(io, watched(0.0, 100.0));
        assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::Watchdog, true), "{nonsense}");
        assert_eq!(outcome.report.counts.fresh, 300);
    }
}

#[test]
fn reads_that_fail_are_no_measurements() {
    let io =
        Scripted::reading(|sample, measured| if sample < 300 { Ok(Some(measured)) } else { Err(Fault::Status(-5)) });
    let outcome = run(io, watched(0.0, 100.0));
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::Watchdog, true));
    assert_eq!(outcome.report.last_fault.as_deref(), Some("status -5"));
    assert_eq!(outcome.report.counts.read_faults, outcome.report.deadlines.taken - 300);
}

#[test]
fn a_write_that_fails_is_tried_again_from_the_drive_that_there_is() {
    let io = Scripted::writing(|sample, _| if sample % 3 == 1 { Err(Fault::Status(2)) } else { Ok(()) });
    let outcome = run(io, settings());
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::TimeOver, true));
    assert!(outcome.report.counts.write_faults > 300);
}

#[test]
fn writes_that_go_on_failing_end_it() {
    let io = Scripted::writing(|sample, _| if sample < 300 { Ok(()) } else { Err(Fault::Status(2)) });
    let outcome = run(io, Settings { write_faults: 20, ..settings() });
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::WriteFailed, false));
    assert_eq!((outcome.report.deadlines.taken, outcome.report.counts.write_faults), (320, 20));
}

#[test]
fn writes_that_fail_on_the_way_to_rest_end_it_too() {
    let io = Scripted::writing(|sample, _| if sample < 1005 { Ok(()) } else { Err(Fault::Status(2)) });
    let outcome = run(io, Settings { write_faults: 20, ..settings() });
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::WriteFailed, false));
    assert_eq!(outcome.report.deadlines.taken, 1025);
}

#[test]
fn a_panic_is_caught_and_the_drive_goes_to_rest() {
    let io = Scripted::reading(|sample, measured| if sample == 300 { panic!("a driver") } else { Ok(Some(measured)) });
    let outcome = run(io, settings());
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::Panicked, true));
    assert_eq!(outcome.report.last_fault.as_deref(), Some("panicked"));
    let io = Scripted::writing(|sample, _| if sample == 300 { panic!("a driver") } else { Ok(()) });
    let outcome = run(io, settings());
    assert_eq!((outcome.report.end, outcome.report.at_rest), (EndReason::Panicked, true));
}

#[test]
fn the_slew_bounds_the_way_to_rest() {
    let fast = Settings { rest_rate: 1e9, ..settings() };
    let outcome = run(Scripted::new(), fast);
    assert!(outcome.report.at_rest, "and `run` has checked the slew");
    assert!(outcome.report.counts.rest_samples > 5);
}

#[test]
fn a_rest_has_an_end_while_samples_are_missed() {
    let clock = SimulatedClock::waking_late(|deadline| if deadline % 3 == 0 { 7 * INTERVAL } else { 0 });
    let outcome = run_with(clock, controller(), Scripted::new(), settings());
    assert!(outcome.report.at_rest && outcome.report.deadlines.missed > 100);
}

#[test]
fn what_cannot_be_is_refused_before_anything_is_written() {
    let refused = |settings: Settings| {
        let stop = StopFlag::default();
        let error = run_on(SimulatedClock::new(), controller(), Scripted::new(), sine(), settings, &stop).err();
        error.expect("it is refused").to_string()
    };
    let all = [
        (
            Settings { rest_drive: 561.0, ..settings() },
            "rest_drive: expected a drive within the limits of the controller, got 561.0",
        ),
        (
            Settings { rest_drive: f64::NAN, ..settings() },
            "rest_drive: expected a drive within the limits of the controller, got NaN",
        ),
        (
            Settings { rest_rate: 0.0, ..settings() },
            "rest_rate: expected a rate above 0 that moves the drive at every sample, got 0.0",
        ),
        (
            Settings { rest_rate: 1e-9, ..settings() },
            "rest_rate: expected a rate above 0 that moves the drive at every sample, got 1e-9",
        ),
        (
            Settings { seconds: Some(0.0), ..settings() },
            "seconds: expected a time from the sampling interval to 9e6 seconds, got 0.0",
        ),
        (watched(3.0, 2.0), "stale_after: expected a time from 0 to rest_after, got 0.00030000000000000003"),
        (watched(0.0, 0.5), "rest_after: expected a time from the sampling interval to 9e6 seconds, got 5e-5"),
        (Settings { spin: -1.0, ..settings() }, "spin: expected a time from 0 to 10 seconds, got -1.0"),
        (Settings { fifo: Some(100), ..settings() }, "fifo: expected a priority from 1 to 99, got 100"),
        (Settings { write_faults: 0, ..settings() }, "write_faults: expected a whole number from 1, got 0"),
        (Settings { ring: 0, ..settings() }, "ring: expected a whole number from 1, got 0"),
    ];
    for (settings, message) in all {
        assert_eq!(refused(settings), message);
    }
}

#[test]
fn a_controller_that_cannot_follow_references_is_refused() -> Result<(), CoreError> {
    let options = *controller().controller().options();
    let given = HybridController::new(FeedForward::Given, None, &options)?;
    let stop = StopFlag::default();
    let error = run_on(SimulatedClock::new(), given.into(), Scripted::new(), sine(), settings(), &stop).err().unwrap();
    assert_eq!(error.parameter(), Some("controller"));
    for (rest, mode) in [(true, "stop"), (false, "hold")] {
        let mut resting = controller();
        if rest {
            resting.controller_mut().stop(RATE, REST)?;
        } else {
            resting.controller_mut().hold();
        }
        let error = run_on(SimulatedClock::new(), resting.clone(), Scripted::new(), sine(), settings(), &stop).err();
        let message = format!("controller: expected one that moves, got one in its {mode}; `release` lets it go on");
        assert_eq!(error.unwrap().to_string(), message);
        resting.controller_mut().release();
        assert!(run_on(SimulatedClock::new(), resting, Scripted::new(), sine(), settings(), &stop).is_ok());
    }
    let slow = controller_with(|options| options.dt = 1e-7);
    let error = run_on(SimulatedClock::new(), slow, Scripted::new(), sine(), settings(), &stop).err().unwrap();
    assert_eq!(error.parameter(), Some("dt"));
    Ok(())
}

/// A reference of 2 um at 5 Hz, which drive and slew follow, for one second.
fn slow(io: Scripted) -> Outcome<Scripted> {
    let positions = (0..2000).map(|k| 2.0 * (core::f64::consts::TAU * f64::from(k) / 2000.0).sin()).collect();
    let (reference, settings) =
        (Reference::periodic(positions).unwrap(), Settings { seconds: Some(1.0), ..settings() });
    run_on(SimulatedClock::new(), controller(), io, reference, settings, &StopFlag::default()).unwrap()
}

#[test]
fn what_was_unusual_often_is_told() {
    let told = |io: Scripted| {
        let outcome = slow(io);
        let most = outcome.io.drives.iter().copied().fold(0.0, f64::max);
        (most, said(&outcome.report, "controller: ").join("; "))
    };
    let (most, healthy) = told(Scripted::new());
    assert!(most > 200.0 && healthy.is_empty(), "{most} V, {healthy}");
    // A sensor of the other sign drives to the limits.
    let (_, reversed) = told(Scripted::reading(|_, measured| Ok(Some(-measured))));
    assert!(reversed.contains("had the drive at a limit: the reference is out of reach"), "{reversed}");
    // A sensor half as fast as the loop: the drive goes on, and that there was nothing new is told.
    let (half, slower) = told(Scripted::reading(|k, measured| Ok((k % 2 == 0).then_some(measured))));
    assert!((half - most).abs() < 0.05 * most, "{half} V, not {most} V");
    assert!(slower.starts_with("controller: 5029 of 10059 "), "{slower}");
    assert!(slower.ends_with("samples had no measurement to use: it was missing or implausible"), "{slower}");
}
