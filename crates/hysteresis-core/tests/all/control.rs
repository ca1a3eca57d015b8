//! What the controller does on the paper's actuator.

use crate::support::models::actuator;
use hysteresis_core::{
    AntiWindup, Command, CompiledModel, ControllerOptions, Counters, FeedForward, FeedForwardState, HybridController,
    Law, Mode, Preview, Process,
};

const LIMITS: (f64, f64) = (-500.0, 500.0);
const DT: f64 = 1e-4;

fn exact() -> FeedForward {
    actuator().inverse(Some(LIMITS)).unwrap().into()
}

fn made(source: FeedForward, options: &ControllerOptions) -> HybridController {
    HybridController::new(source, None, options).unwrap()
}

/// Largest error of each hundred samples against the paper's actuator without dynamics, measured a sample late.
fn errors(controller: &mut HybridController, references: impl Iterator<Item = f64>) -> Vec<f64> {
    let mut actuator = actuator().forward();
    let mut position = 0.0;
    let all: Vec<f64> = references
        .map(|r| {
            position = actuator.step(controller.step(r.into(), position));
            (r - position).abs()
        })
        .collect();
    all.chunks(100).map(|part| part.iter().copied().fold(0.0, f64::max)).collect()
}

/// Out of reach for a while, then back: 5 um are asked of an actuator that reaches 3.06 um.
fn out_of_reach() -> impl Iterator<Item = f64> {
    (0..4000).map(|k| if (500..2500).contains(&k) { 5.0 } else { 0.0 })
}

#[test]
fn both_anti_windups_recover_at_once_and_the_incremental_law_does_not() {
    let set = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
    let tracking = AntiWindup::BackCalculation { tracking_time: None };
    let after = |law, anti_windup, source| {
        let mut controller = made(source, &ControllerOptions { law, anti_windup, ..set });
        let errors = errors(&mut controller, out_of_reach());
        assert!(errors[24] > 1.9 && controller.counters().saturated_count > 1900);
        errors[26] // from 10 ms after the return
    };
    // The start is over. Feed-forward is exact, so what errs is what the integral has kept.
    let conditional = after(Law::Positional, AntiWindup::Conditional, exact());
    let back = after(Law::Positional, tracking, exact());
    let incremental = after(Law::Incremental, AntiWindup::Conditional, exact());
    assert!(conditional < 0.1, "{conditional}");
    assert!(back < 0.2, "{back}");
    // The incremental law has lost part of its feed-forward (erratum 12), but has not wound up: at the rail it errs by 3.
    assert!(2.0 * back < incremental && incremental < 1.0, "{back}, {incremental}");
}

/// Gains that change every few samples: each change renews the bumpless term before the last one is gone. The integral
/// works all the same once the time of the start is over.
#[test]
fn switches_without_end_do_not_keep_the_integral_at_rest() {
    let options = ControllerOptions::new(5.0, 5e3, DT, (-500.0, 500.0));
    let mut controller = HybridController::new(FeedForward::None, None, &options).unwrap();
    for k in 0..1000_u32 {
        if k % 20 == 0 {
            controller.set_gains(if k % 40 == 0 { 5.0 } else { 6.0 }, 5e3).unwrap();
        }
        controller.step(1.0.into(), 0.0);
    }
    // The start from 0 V, 50 samples that rest, and 949 that count.
    assert_eq!(controller.terms().integral, 949.0 * 0.5);
}

#[test]
fn a_start_ends_in_a_straight_line_and_the_integral_rests_meanwhile() {
    let mut controller = made(FeedForward::Given, &ControllerOptions::new(5.0, 5e3, DT, LIMITS));
    let mut step = |volts| {
        controller.step(Command { feedforward: Some(volts), ..1.0.into() }, 0.75);
        controller.terms()
    };
    // 5 ms of 0.1 ms; the law wants 100 V and kp times 0.25 um
    for left in (0..=50).rev() {
        let terms = step(100.0);
        let wanted = -101.25 * f64::from(left) / 50.0;
        assert!((terms.bumpless - wanted).abs() < 1e-12 && terms.integral == 0.0, "{left}: {terms:?}");
    }
    assert_eq!(step(100.0).integral, 0.125);
    // Where there is nothing to go over to, nothing rests.
    let mut controller = made(FeedForward::None, &ControllerOptions::new(5.0, 5e3, DT, LIMITS));
    controller.step(1.0.into(), 1.0);
    controller.step(1.0.into(), 0.75);
    assert_eq!(controller.terms().integral, 0.125);
}

/// A sensor that misses one sample in twenty: feedback alone still leaves no static error.
#[test]
fn missing_measurements_do_not_stop_the_integral() {
    let mut controller = made(FeedForward::None, &ControllerOptions::new(5.0, 2e4, DT, LIMITS));
    let mut actuator = actuator().forward();
    let mut position = 0.0;
    for k in 0..20_000 {
        let measurement = if k % 20 == 0 { f64::NAN } else { position };
        position = actuator.step(controller.step(1.5.into(), measurement));
    }
    assert!((position - 1.5).abs() < 1e-6, "{position}");
}

#[test]
fn without_measurements_it_holds_and_then_goes_on_with_feedforward_alone() {
    let options = ControllerOptions { max_missing: 3, ..ControllerOptions::new(20.0, 1e4, DT, LIMITS) };
    let mut controller = made(exact(), &options);
    let reference = |k: i32| 1e-3 * f64::from(k);
    for k in 0..1000 {
        controller.step(reference(k).into(), reference(k) - 0.01);
    }
    let (held, integral) = (controller.drive(), controller.terms().integral);
    for k in 1000..1003 {
        assert_eq!(controller.step(reference(k).into(), f64::NAN), held);
    }
    assert_eq!(controller.step(reference(1003).into(), f64::INFINITY), held, "feed-forward goes on from there");
    let mut last = held;
    for k in 1004..2000 {
        let drive = controller.step(reference(k).into(), f64::NAN);
        // 1 nm per sample over the least slope is 0.23 V; the bumpless term, at most 5 V, brings 2 % of it
        assert!(drive > last - 0.05 && drive < last + 0.3, "{last} to {drive}");
        last = drive;
    }
    let terms = controller.terms();
    assert_eq!((terms.proportional, terms.integral), (0.0, integral));
    assert_eq!(controller.counters(), Counters { missing_count: 1000, ..Counters::default() });
    let back = controller.step(reference(2000).into(), reference(2000) - 1.0);
    assert!((back - last).abs() < 1.0 + 0.3, "an error of 1 um comes as ki dt e, not as kp e: {last} to {back}");
    assert!((controller.terms().proportional - 20.0).abs() < 1e-9);
}

#[test]
fn a_hold_keeps_the_drive_and_forgets_nothing() {
    let mut controller = made(exact(), &ControllerOptions::new(5.0, 6e3, DT, LIMITS));
    for k in 0..500 {
        controller.step((2e-3 * f64::from(k)).into(), 0.0);
    }
    controller.set_mode(Mode::Feedforward).unwrap();
    controller.step(1.0.into(), 0.0);
    let before = controller.state();
    controller.set_mode(Mode::Hold).unwrap();
    for bad in [0.0, 9e9, f64::NAN] {
        assert_eq!(controller.step(bad.into(), bad), before.feedback_loop.terms.drive);
    }
    assert_eq!(
        (controller.terms(), controller.counters()),
        (before.feedback_loop.terms, before.feedback_loop.counters)
    );
    assert_eq!(controller.state().feedforward, before.feedforward);
    controller.release();
    assert_eq!(controller.mode(), Mode::Feedforward, "the loop is not closed unasked");
}

#[test]
fn volts_that_are_given_replace_the_feedforward_and_the_memory_goes_on() {
    let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, DT, LIMITS) };
    let (mut own, mut given) = (made(exact(), &options), made(exact(), &options));
    for r in [0.5, 2.0, 1.0] {
        own.step(r.into(), 0.0);
        given.step(Command { feedforward: Some(7.0), ..r.into() }, 0.0);
    }
    assert_eq!(given.terms().feedforward, 7.0);
    assert_eq!(given.step(0.5.into(), 0.0), own.step(0.5.into(), 0.0));
    let mut without = made(FeedForward::Given, &options);
    without.step(Command { feedforward: Some(7.0), ..1.0.into() }, 0.0);
    assert_eq!(without.step(Command { feedforward: Some(9.0), ..1.0.into() }, 0.0), 9.0);
    assert_eq!(without.step(1.0.into(), 0.0), 9.0, "no volts, no motion");
    assert_eq!(without.counters().rejected_count, 1);
}

/// The proportional term goes over the whole bumpless time, also where the start is long over.
#[test]
fn feedback_goes_and_returns_over_the_bumpless_time() {
    let mut controller = made(FeedForward::None, &ControllerOptions::new(20.0, 0.0, DT, LIMITS));
    for _ in 0..60 {
        controller.step(1.0.into(), 0.5);
    }
    assert_eq!((controller.terms().bumpless, controller.drive()), (0.0, 10.0));
    for (mode, sign) in [(Mode::Feedforward, 1.0), (Mode::Run, -1.0)] {
        controller.set_mode(mode).unwrap();
        for left in (0..=50).rev() {
            controller.step(1.0.into(), 0.5);
            assert!((controller.terms().bumpless - sign * 10.0 * f64::from(left) / 50.0).abs() < 1e-12, "{left}");
        }
    }
}

/// Without integral action nothing winds up, and nothing would bring back what back-calculation took.
#[test]
fn back_calculation_leaves_a_proportional_controller_alone() {
    let anti_windup = AntiWindup::BackCalculation { tracking_time: Some(1e-3) };
    let options = ControllerOptions { anti_windup, ..ControllerOptions::new(20.0, 0.0, DT, LIMITS) };
    let mut controller = made(FeedForward::None, &options);
    for _ in 0..100 {
        controller.step(100.0.into(), 0.0);
    }
    assert!(controller.terms().saturated);
    assert_eq!(controller.state().feedback_loop.integral, 0.0);
}

/// Volts that come with the sample know no model: another one moves nothing.
#[test]
fn another_model_does_not_move_volts_that_are_given() {
    let mut controller = made(exact(), &ControllerOptions::new(0.0, 0.0, DT, LIMITS));
    let given = Command { feedforward: Some(7.0), ..1.0.into() };
    while controller.step(given, 0.0) != 7.0 {}
    let below_zero: Vec<f64> = actuator().weights().iter().map(|w| w.max(2e-4)).collect();
    let other = actuator().with_negative_weights(&below_zero).unwrap();
    controller.set_model(&CompiledModel::new(&other)).unwrap();
    assert_eq!(controller.step(given, 0.0), 7.0);
}

/// Volts that came with the last sample are what the new source takes over from, and it takes over the last target.
#[test]
fn another_feedforward_takes_over_from_what_went_out() {
    let options = ControllerOptions::new(0.0, 0.0, DT, LIMITS);
    let mut controller = made(exact(), &options);
    for _ in 0..60 {
        controller.step(Command { feedforward: Some(7.0), ..1.0.into() }, 0.0);
    }
    controller.set_feedforward(FeedForward::None).unwrap();
    assert!((controller.step(1.0.into(), 0.0) - 7.0 * 49.0 / 50.0).abs() < 1e-12);
    let mut inverse = actuator().inverse(Some(LIMITS)).unwrap();
    controller.set_feedforward(inverse.clone().into()).unwrap();
    inverse.step(1.0);
    assert_eq!(controller.state().feedforward, Some(FeedForwardState::Stream(inverse.state())));
    assert_eq!(controller.terms().feedforward, inverse.output());
}

#[test]
fn a_preview_leads_the_target_and_delays_the_reference() {
    let coefficients = [0.5, -0.25, 2.0, 0.125];
    let r = |k: usize| [1.0, 3.0, -2.0, 0.5, 4.0, 1.5, 2.5, -1.0][k];
    for ahead in 0..coefficients.len() {
        let preview = Preview::new(&coefficients, ahead).unwrap();
        let options = ControllerOptions::new(2.0, 0.0, DT, LIMITS);
        let mut controller = HybridController::new(FeedForward::None, Some(preview), &options).unwrap();
        for newest in 0..8 {
            let of_now = controller.reference_of_now(r(newest));
            controller.step(r(newest).into(), 0.0);
            let at = |j: usize| r(newest.saturating_sub(j));
            let seen = |j: usize| if newest < 3 { r(0) } else { at(j) }; // at rest until the window is full
            let target: f64 = coefficients.iter().enumerate().map(|(j, c)| c * seen(j)).sum();
            let terms = controller.terms();
            assert_eq!((terms.target, terms.reference, terms.error), (target, at(ahead), at(ahead)));
            assert_eq!(of_now, at(ahead));
        }
        // A target of its own replaces what the window says, not what it remembers; a missing measurement neither.
        controller.step(Command { target: Some(9.0), ..7.0.into() }, 0.0);
        assert_eq!(controller.terms().target, 9.0);
        controller.step(8.0.into(), f64::NAN);
        controller.step(9.0.into(), 0.0);
        assert_eq!(controller.terms().reference, [9.0, 8.0, 7.0, -1.0][ahead]);
        // After a hold the window fills anew.
        controller.set_mode(Mode::Hold).unwrap();
        controller.release();
        controller.step(1.0.into(), 0.0);
        assert_eq!((controller.terms().target, controller.terms().reference), (2.375, 1.0));
    }
}

/// What learning adds moves the target, of the window or of its own, and nothing else.
#[test]
fn a_correction_is_added_to_the_target_alone() {
    let options = ControllerOptions::new(2.0, 30.0, DT, LIMITS);
    let preview = || Preview::new(&[0.5, -0.25, 2.0], 1).unwrap();
    let terms = |command: Command| {
        let mut controller = HybridController::new(exact(), Some(preview()), &options).unwrap();
        for _ in 0..3 {
            controller.step(0.5.into(), 0.25);
        }
        controller.step(command, 0.25);
        controller.terms()
    };
    let corrected = |command: Command| Command { correction: 0.125, ..command };
    for command in [0.5.into(), Command { target: Some(0.75), ..0.5.into() }] {
        let (plain, with) = (terms(command), terms(corrected(command)));
        assert_eq!(with.target, plain.target + 0.125);
        assert_eq!((with.reference, with.error, with.integral), (plain.reference, plain.error, plain.integral));
        assert!(with.feedforward > plain.feedforward + 5.0);
    }
    let mut controller = HybridController::new(exact(), None, &options).unwrap();
    let drive = controller.step(0.5.into(), 0.25);
    assert_eq!(controller.step(Command { correction: f64::NAN, ..0.6.into() }, 0.25), drive);
    assert_eq!(controller.counters().rejected_count, 1);
}

/// Behind a smoothing the controller does what it would do with the smoothed reference, which it knows as early.
#[test]
fn a_smoothed_preview_is_that_of_a_smoothed_reference() {
    let (coefficients, kernel) = ([0.5, -0.25, 2.0], [0.125, 0.25, 0.25, 0.25, 0.125]);
    let options = ControllerOptions::new(2.0, 30.0, DT, LIMITS);
    let made = |preview| HybridController::new(FeedForward::None, Some(preview), &options).unwrap();
    let plain = Preview::new(&coefficients, 1).unwrap();
    let smoothed = plain.clone().smoothed(&kernel).unwrap();
    assert_eq!((smoothed.ahead(), smoothed.coefficients().len()), (3, 7));
    let (mut of_smooth, mut behind) = (made(plain), made(smoothed.clone()));
    // At rest for longer than both windows, then a step and a ramp.
    let r = |k: usize| [0.0, 1.0, 1.0, 1.5, 2.0, 2.5][k.saturating_sub(9).min(5)];
    for k in 0..30_usize {
        let smooth: f64 = kernel.iter().enumerate().map(|(i, s)| s * r((k + 4).saturating_sub(i + 2))).sum();
        let measurement = 0.3 * r(k);
        let expected = of_smooth.step(smooth.into(), measurement);
        let got = behind.step(r(k + 2).into(), measurement);
        // Products are summed in another order.
        assert!((got - expected).abs() < 1e-12, "{k}: {got} {expected}");
        assert!((behind.terms().reference - of_smooth.terms().reference).abs() < 1e-12);
    }
    assert!(smoothed.clone().smoothed(&kernel).is_err());
    let refused = |kernel: &[f64]| Preview::new(&[1.0], 0).unwrap().smoothed(kernel).unwrap_err().to_string();
    assert_eq!(refused(&[0.5, 0.5]), "kernel: expected an odd number of weights, got 2");
    assert!(refused(&[0.5]).starts_with("kernel: expected"));
    assert!(refused(&[f64::NAN]).starts_with("kernel[0]: expected a finite"));
}

/// Weights that sum to one but for rounding take a reference beyond the largest that a controller accepts.
#[test]
fn a_state_holds_a_smoothed_reference_at_the_bound() {
    let options = ControllerOptions::new(0.0, 0.0, DT, LIMITS);
    let mut beyond = 0;
    for size in (3_u32..100).step_by(2) {
        let kernel = vec![1.0 / f64::from(size); size as usize];
        let preview = Preview::new(&[1.0], 0).unwrap().smoothed(&kernel).unwrap();
        let fresh = HybridController::new(FeedForward::None, Some(preview), &options).unwrap();
        let mut controller = fresh.clone();
        for _ in 0..2 * size {
            controller.step(Command { target: Some(0.0), ..1e100.into() }, 0.0);
        }
        beyond += u32::from(controller.terms().reference > 1e100);
        let mut restored = fresh;
        restored.set_state(&controller.state()).unwrap();
        assert_eq!(restored.state(), controller.state());
    }
    assert!(beyond > 0, "no kernel of the test rounds upwards");
}

#[test]
fn asymmetric_limits_and_slew_are_kept_and_counted() {
    let options = ControllerOptions {
        slew: Some(2e5),
        start_drive: Some(140.0),
        ..ControllerOptions::new(1e3, 0.0, DT, (-20.0, 150.0))
    };
    let mut controller = made(FeedForward::None, &options);
    assert_eq!(controller.step(0.0.into(), 0.0), 140.0);
    assert_eq!(controller.step(1.0.into(), 0.0), 150.0);
    let drives: Vec<f64> = (0..10).map(|_| controller.step((-1.0).into(), 0.0)).collect();
    assert_eq!(drives, [130.0, 110.0, 90.0, 70.0, 50.0, 30.0, 10.0, -10.0, -20.0, -20.0]);
    assert_eq!(controller.counters(), Counters { saturated_count: 11, slewing_count: 8, ..Counters::default() });
    let started = |limits| made(FeedForward::None, &ControllerOptions::new(1.0, 0.0, DT, limits)).drive();
    assert_eq!([started((30.0, 100.0)), started((-9.0, -1.0)), started(LIMITS)], [30.0, -1.0, 0.0]);
}

#[test]
fn it_says_which_measurement_it_would_believe() {
    let mut controller = made(exact(), &ControllerOptions::new(5.0, 6e3, DT, LIMITS));
    controller.step(0.0.into(), 0.0);
    assert!(controller.believes(0.1) && !controller.believes(f64::NAN) && !controller.believes(f64::INFINITY));
}

#[test]
fn a_kernel_that_does_not_sum_to_one_is_named_with_its_bounds() {
    let error = Preview::new(&[1.0], 0).unwrap().smoothed(&[0.5, 0.25, 0.5]).unwrap_err();
    assert_eq!(error.to_string(), "kernel: expected a number from 0.999999999 to 1.000000001, got 1.25");
}

#[test]
fn up_and_down_are_alike() {
    let set = ControllerOptions::new(0.5, 2e3, DT, LIMITS);
    for anti_windup in [AntiWindup::Conditional, AntiWindup::BackCalculation { tracking_time: None }] {
        let [mut up, mut down] = [(); 2].map(|()| made(FeedForward::None, &ControllerOptions { anti_windup, ..set }));
        for r in out_of_reach().map(|r| 400.0 * r) {
            let (high, low) = (up.step(r.into(), 0.5 * r), down.step((-r).into(), -0.5 * r));
            assert_eq!((high, up.terms().integral), (-low, -down.terms().integral), "at {r}");
        }
        assert!(up.counters().saturated_count > 1000);
    }
}
