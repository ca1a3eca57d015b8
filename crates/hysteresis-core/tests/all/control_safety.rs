//! What keeps a stage safe: gates for measurements, stops, starts, previews that fill.

use crate::support::models::actuator;
use hysteresis_core::{
    AntiWindup, Command, CompiledModel, ControllerOptions, Counters, CreepTerms, FeedForward, FeedForwardState,
    HybridController, Mode, Preview, Process, QuasiStatic,
};

const LIMITS: (f64, f64) = (-500.0, 500.0);
const DT: f64 = 1e-4;

fn options() -> ControllerOptions {
    ControllerOptions::new(5.0, 6e3, DT, LIMITS)
}

fn exact() -> FeedForward {
    actuator().inverse(Some(LIMITS)).unwrap().into()
}

fn made(source: FeedForward, options: &ControllerOptions) -> HybridController {
    HybridController::new(source, None, options).unwrap()
}

/// A controller under way, at a reference of 0.5 um.
fn moving(options: &ControllerOptions) -> HybridController {
    let mut controller = made(exact(), options);
    for _ in 0..200 {
        controller.step(0.5.into(), 0.5);
    }
    controller
}

fn acted(controller: &HybridController) -> bool {
    controller.state().feedback_loop.started
}

#[test]
fn a_spike_of_the_sensor_is_not_followed() {
    for gate in [
        ControllerOptions { measurement_range: Some((-4.0, 4.0)), ..options() },
        ControllerOptions { max_measurement_step: Some(0.1), ..options() },
    ] {
        let (mut guarded, mut open) = (moving(&gate), moving(&options()));
        let held = guarded.drive();
        open.step(0.5.into(), 40.0);
        assert!((open.drive() - held).abs() > 100.0, "without a gate the drive jumps");
        assert_eq!(guarded.step(0.5.into(), 40.0), held);
        assert_eq!(guarded.counters(), Counters { implausible_count: 1, ..Counters::default() });
        for _ in 0..100 {
            assert!((guarded.step(0.5.into(), 0.5) - held).abs() < 1e-9);
        }
    }
}

#[test]
fn a_new_level_is_taken_after_max_missing_in_a_row() {
    for (max_missing, held) in [(3, 3), (1, 1)] {
        let set = ControllerOptions { max_measurement_step: Some(1e-3), max_missing, ..options() };
        let mut controller = moving(&set);
        let drive = controller.drive();
        for _ in 0..held {
            assert_eq!(controller.step(0.5.into(), 0.4), drive);
            assert!(!acted(&controller));
        }
        controller.step(0.5.into(), 0.4);
        assert!(acted(&controller));
        assert_eq!(controller.drive(), drive, "without a jump");
        assert!((controller.terms().error - 0.1).abs() < 1e-15);
        assert_eq!(controller.counters().implausible_count, held);
    }
    // Where no measurement may be missing, a single spike is left out all the same: feed-forward goes on alone.
    let mut controller = moving(&ControllerOptions { max_measurement_step: Some(1e-3), max_missing: 0, ..options() });
    controller.step(0.5.into(), 40.0);
    assert_eq!((controller.terms().proportional, controller.counters().implausible_count), (0.0, 1));
}

/// What lies out of the range never enters, however often it comes.
#[test]
fn out_of_range_stays_out_and_feedforward_goes_on_alone() {
    let mut controller =
        moving(&ControllerOptions { measurement_range: Some((-4.0, 4.0)), max_missing: 3, ..options() });
    let held = controller.drive();
    for k in 0..200 {
        let outside = if k % 2 == 0 { 4.0 } else { -4.0 } * (1.0 + 1e-12);
        controller.step((0.5 + 1e-3 * f64::from(k)).into(), outside);
    }
    assert!(controller.drive() > held + 10.0, "the reference is followed");
    assert_eq!(controller.terms().proportional, 0.0);
    assert_eq!(controller.counters(), Counters { implausible_count: 200, ..Counters::default() });
    for bound in [4.0, -4.0] {
        controller.step(0.7.into(), bound);
    }
    assert_eq!(controller.counters().implausible_count, 200, "the bounds belong to the range");
}

/// The step counts from one sample to the next: over missing ones it grows.
#[test]
fn the_measurement_may_move_on_while_it_is_missing() {
    let set = ControllerOptions { max_measurement_step: Some(0.01), ..options() };
    for (missing, move_by, taken) in [(0, 0.0099, true), (0, 0.0101, false), (2, 0.0299, true), (2, 0.0301, false)] {
        let mut controller = moving(&set);
        for _ in 0..missing {
            controller.step(0.5.into(), f64::NAN);
        }
        controller.step(0.5.into(), 0.5 + move_by);
        assert_eq!(acted(&controller), taken, "{missing} {move_by}");
    }
    // After a hold the position may be anywhere.
    let mut controller = moving(&set);
    controller.hold();
    controller.release();
    controller.step(0.5.into(), 1.5);
    assert!(acted(&controller));
}

#[test]
fn exactly_max_missing_measurements_hold_the_drive() {
    for max_missing in [0, 1, 3] {
        let mut controller = moving(&ControllerOptions { max_missing, ..options() });
        for k in 0..=max_missing {
            controller.step(0.5.into(), f64::NAN);
            assert_eq!(acted(&controller), k == max_missing, "sample {k} of {max_missing}");
        }
    }
    // In a row: a measurement between two gaps ends the count.
    let mut controller = moving(&ControllerOptions { max_missing: 3, ..options() });
    for measurement in [f64::NAN, f64::NAN, 0.5, f64::NAN, f64::NAN] {
        controller.step(0.5.into(), measurement);
        assert_eq!(acted(&controller), measurement == 0.5);
    }
}

#[test]
fn a_stop_ramps_at_its_rate_and_no_faster_than_the_slew() {
    let slewing = ControllerOptions { slew: Some(1e4), ..options() };
    for (set, rate, steps) in [(options(), 2e4, 2.0), (slewing, 2e4, 1.0), (slewing, 5e3, 0.5)] {
        let mut controller = moving(&ControllerOptions { start_drive: Some(0.0), ..set });
        let start = controller.drive();
        assert!(start > 90.0);
        controller.stop(rate, 10.0).unwrap();
        assert_eq!(
            (controller.mode(), controller.drive()),
            (Mode::Stop, start),
            "nothing moves before the next sample"
        );
        assert!((controller.step(3.0.into(), f64::NAN) - (start - steps)).abs() < 1e-12);
        assert_eq!(controller.terms().slewing, steps == 1.0);
        for _ in 0..1000 {
            controller.step(f64::NAN.into(), 0.0);
        }
        assert_eq!(controller.drive(), 10.0);
        let counters = controller.counters();
        assert_eq!((counters.rejected_count, counters.missing_count, counters.saturated_count), (0, 0, 0));
        // And goes on from there, without a jump, in the mode before.
        controller.release();
        assert_eq!((controller.mode(), controller.step(0.5.into(), 0.1)), (Mode::Run, 10.0));
    }
}

/// After a stop from a drive of feed-forward and feedback, the inverse knows all of the way.
#[test]
fn the_feedforward_remembers_the_drives_of_a_stop() {
    let mut controller = moving(&ControllerOptions { kp: 100.0, ..options() });
    controller.step(0.5.into(), 0.1);
    let start = controller.drive();
    let mut other = actuator().inverse(Some(LIMITS)).unwrap();
    other.step(0.5);
    assert!(start > other.output() + 30.0);
    controller.stop(1e5, -20.0).unwrap();
    for k in 0..30 {
        // At once, or planned and committed.
        let drive = if k % 2 == 0 { controller.step(0.0.into(), 0.0) } else { controller.plan(0.0.into(), 0.0) };
        assert_eq!(controller.commit(), k % 2 == 1);
        other.follow(&[drive]).unwrap();
        assert_eq!(controller.state().feedforward, Some(FeedForwardState::Stream(other.state())));
    }
    assert_eq!(controller.drive(), -20.0);
}

#[test]
fn a_controller_takes_over_what_was_driven_before() {
    let history = [0.0, 300.0, -50.0, 120.0];
    let mut controller = made(exact(), &ControllerOptions { bumpless_time: 0.0, ..options() });
    controller.step(1.0.into(), 0.5);
    controller.follow(&history).unwrap();
    assert_eq!(controller.drive(), 120.0);
    let mut bench = actuator().forward();
    bench.follow(&history).unwrap();
    let here = bench.output();
    for _ in 0..2 {
        assert_eq!(controller.step(here.into(), here), 120.0, "a motion that starts where the stage is");
    }
    let state = controller.state();
    controller.follow(&[]).unwrap();
    assert_eq!(controller.state(), state);
}

/// Creep goes on while the drive is held: by a hold, by missing measurements, by rejected references.
#[test]
fn creep_goes_on_while_the_drive_is_held() {
    let creep = CreepTerms::new(&[0.1], &[0.99]).unwrap();
    let stage = QuasiStatic::new(&CompiledModel::new(&actuator())).with_creep(creep);
    let cases = [(true, 0.5, 0.5), (false, 0.5, f64::NAN), (false, f64::NAN, 0.5)];
    for (hold, reference, measurement) in cases {
        let set = ControllerOptions { max_missing: u32::MAX, ..options() };
        let mut alone = stage.inverse(Some(LIMITS)).unwrap();
        let mut controller = made(alone.clone().into(), &set);
        for _ in 0..60 {
            controller.step(0.5.into(), 0.5);
            alone.step(0.5);
        }
        if hold {
            controller.hold();
        }
        let position = alone.position();
        for _ in 0..300 {
            controller.step(Command::from(reference), measurement);
            alone.follow_drive(alone.output());
        }
        assert!(alone.position() > position + 0.01, "creep went on");
        assert_eq!(controller.state().feedforward, Some(FeedForwardState::QuasiStatic(alone.state())));
    }
}

#[test]
fn a_stop_can_be_held_replaced_and_saved_on_its_way() {
    let mut controller = moving(&options());
    controller.set_mode(Mode::Feedforward).unwrap();
    controller.stop(1e4, -20.0).unwrap();
    let drive = controller.step(0.5.into(), 0.5);
    let state = controller.state();
    controller.hold();
    assert_eq!(controller.step(0.5.into(), 0.5), drive);
    controller.stop(2e4, 20.0).unwrap();
    assert!((controller.step(0.5.into(), 0.5) - (drive - 2.0)).abs() < 1e-12);
    controller.set_state(&state).unwrap();
    assert!((controller.step(0.5.into(), 0.5) - (drive - 1.0)).abs() < 1e-12, "the first ramp");
    controller.start_at(-19.5).unwrap();
    assert_eq!(controller.step(0.5.into(), 0.5), -20.0);
    controller.release();
    assert_eq!(controller.mode(), Mode::Feedforward);
}

/// A stage at 100 V is told to go on from there: no sample exceeds the slew, and the lead-in says how long it takes.
#[test]
fn the_first_drive_is_the_stated_one_and_the_lead_in_is_kept() {
    let set = ControllerOptions { start_drive: Some(100.0), slew: Some(2e5), ..options() };
    let mut controller = made(exact(), &set);
    assert!((controller.lead_in() - set.bumpless_time).abs() < 1e-15);
    let mut last = controller.drive();
    assert_eq!(controller.step(0.2.into(), 0.2), 100.0);
    let mut samples = 1;
    while controller.lead_in() > 0.0 {
        let drive = controller.step(0.2.into(), 0.2);
        assert!((drive - last).abs() <= 2e5 * DT);
        (last, samples) = (drive, samples + 1);
    }
    assert_eq!(samples, 50);
    controller.step(0.2.into(), 0.2);
    let terms = controller.terms();
    assert_eq!((terms.bumpless, terms.drive), (0.0, terms.feedforward));
    controller.hold();
    assert!((controller.lead_in() - set.bumpless_time).abs() < 1e-15);
}

/// The largest step of the drive over a motion of 1 nm per sample that begins at the first sample.
fn largest_step(controller: &mut HybridController) -> f64 {
    let mut last = controller.drive();
    let mut largest = 0.0_f64;
    for k in 0..300 {
        let drive = controller.step((0.5 + 1e-3 * f64::from(k)).into(), f64::NAN);
        (largest, last) = (largest.max((drive - last).abs()), drive);
    }
    largest
}

/// Coefficients that differentiate twice: a window that pretended a rest before the motion would ask for 0.1 um at
/// once. And when the window is full, the motion is 20 nm ahead.
#[test]
fn a_preview_that_fills_gives_no_kick() {
    let set = ControllerOptions { max_missing: 0, ..ControllerOptions::new(0.0, 0.0, DT, LIMITS) };
    let mut coefficients = [0.0; 41];
    coefficients[19..22].copy_from_slice(&[100.0, -199.0, 100.0]);
    let preview = || Some(Preview::new(&coefficients, 20).unwrap());
    let plain = largest_step(&mut made(exact(), &set));
    let with_preview = || HybridController::new(exact(), preview(), &set).unwrap();
    let mut from_start = with_preview();
    let largest = largest_step(&mut from_start);
    assert!(largest < 1.5 * plain, "{largest} V and {plain} V");
    // The window fills anew after a hold, after a rejected reference and after a reset.
    let interruptions: [fn(&mut HybridController); 4] = [
        |c| {
            c.hold();
            c.release();
        },
        |c| _ = c.step(f64::NAN.into(), 0.0),
        |c| {
            c.stop(1.0, 0.0).unwrap();
            c.release();
        },
        HybridController::reset,
    ];
    for interrupt in interruptions {
        let mut controller = with_preview();
        largest_step(&mut controller);
        let mut without = made(exact(), &set);
        largest_step(&mut without);
        interrupt(&mut controller);
        interrupt(&mut without);
        let (with, without) = (largest_step(&mut controller), largest_step(&mut without));
        assert!(with < 1.5 * without, "{with} V and {without} V");
    }
}

/// A reference that rests for a window's length hands over nothing.
#[test]
fn a_preview_that_fills_at_rest_has_no_difference_to_take() {
    let preview = Preview::new(&[2.0, -3.0, 2.0], 1).unwrap();
    let set = ControllerOptions { start_drive: Some(0.0), bumpless_time: 2.0 * DT, ..options() };
    let mut controller = HybridController::new(exact(), Some(preview), &set).unwrap();
    assert!(
        (controller.lead_in() - 4.0 * DT).abs() < 1e-15,
        "two samples until the window is full, and the bumpless time"
    );
    for _ in 0..3 {
        controller.step(0.5.into(), 0.5);
    }
    assert_eq!((controller.terms().target, controller.terms().bumpless), (0.5, 0.0));
    controller.step(0.6.into(), 0.5);
    assert_eq!((controller.terms().target, controller.terms().bumpless), (2.0 * 0.6 - 3.0 * 0.5 + 2.0 * 0.5, 0.0));
}

/// A target or volts of the user's own may jump at the sample that fills the window: nothing takes the difference.
#[test]
fn what_is_given_is_not_smoothed_where_a_preview_fills() {
    let jump = |first: Command, second: Command| {
        let preview = Preview::new(&[1.0, 0.0, 0.0], 0).unwrap();
        let set = ControllerOptions { bumpless_time: DT, ..options() };
        let mut controller = HybridController::new(exact(), Some(preview), &set).unwrap();
        for command in [first, first, second] {
            controller.step(command, first.reference);
        }
        controller.terms().bumpless
    };
    let target = |target| Command { target: Some(target), ..0.5.into() };
    assert_eq!(jump(target(0.5), target(1.0)), 0.0);
    let volts = |volts| Command { feedforward: Some(volts), ..0.5.into() };
    assert_eq!(jump(volts(9.0), volts(20.0)), 0.0);
    assert!(jump(0.5.into(), 1.0.into()) < -50.0, "a target of the window");
}

/// A rejected reference leaves a gap in the trajectory: what was in the window no longer belongs to what comes.
#[test]
fn a_rejected_reference_empties_the_preview() {
    let preview = Preview::new(&[0.0, 0.0, 1.0], 2).unwrap();
    let mut controller = HybridController::new(FeedForward::None, Some(preview), &options()).unwrap();
    for r in [1.0, 2.0, 3.0, f64::NAN, 7.0] {
        controller.step(r.into(), 0.0);
    }
    assert_eq!((controller.terms().target, controller.terms().reference), (7.0, 7.0));
    let saved = controller.state().preview.unwrap();
    assert_eq!((saved.past, saved.samples), (vec![7.0, 7.0], 1));
}

#[test]
fn a_restored_controller_has_no_plan_left() {
    let mut controller = moving(&options());
    let state = controller.state();
    controller.plan(2.0.into(), 0.0);
    controller.set_state(&state).unwrap();
    assert!(!controller.commit());
    assert_eq!(controller.state(), state);
}

/// More than all of what was cut off cannot be taken: a tracking time below a sample acts as one sample.
#[test]
fn a_tracking_time_below_the_interval_is_the_interval() {
    let integral = |time| {
        let anti_windup = AntiWindup::BackCalculation { tracking_time: Some(time) };
        let mut controller = made(FeedForward::None, &ControllerOptions { anti_windup, ..options() });
        for _ in 0..100 {
            controller.step(1e3.into(), 0.0);
        }
        controller.state().feedback_loop.integral
    };
    assert_eq!(integral(DT / 10.0), integral(DT));
    assert!(integral(DT) != integral(2.0 * DT));
}
