//! Laws of the controller, whatever happens to it; the same names as in `test_control_laws.py`.

use crate::support::control::{DT, Event, Setup, Source, command, event, filters, happen, setup, switch, upheaval};
use hysteresis_core::{
    AntiWindup, Biquad, ControllerOptions, Counters, Filter, HybridController, Law, Mode, Process, Sections,
};
use proptest::collection::vec;
use proptest::prelude::*;

/// Roundings of the terms, relative to the largest of them: sums of four in different orders.
const ROUNDING: f64 = 1e-14;

fn drives(controller: &mut HybridController, events: &[Event]) -> Vec<u64> {
    let mut drive = |e: &Event| {
        happen(controller, *e, &mut None);
        controller.drive().to_bits()
    };
    events.iter().map(&mut drive).collect()
}

/// The state with every bit shown, and the sign of zero.
fn shown(controller: &HybridController) -> String {
    format!("{:?} {:?}", controller.state(), controller.options())
}

/// The scale of the terms.
fn scale(controller: &HybridController) -> f64 {
    let t = controller.terms();
    [t.feedforward, t.proportional, t.integral, t.bumpless, t.unlimited_drive]
        .into_iter()
        .fold(1.0, |m, x| m.max(x.abs()))
}

/// The same controller where nothing can be limited, equal references mean equal targets and equal errors equal
/// feedback.
fn unlimited(setup: &Setup) -> Setup {
    let set = ControllerOptions { limits: (-1e100, 1e100), slew: None, bumpless_time: 1.0, dt: DT, ..setup.options };
    let options = ControllerOptions { measurement_range: None, max_measurement_step: None, ..set };
    let options = ControllerOptions { filters: Sections::default(), kp: set.kp.abs(), ..options };
    Setup { options, window: None, source: setup.source }
}

/// The same with filters and gains of the order of a real loop, and a feed-forward that stays at a target.
fn filtered(setup: &Setup, filters: Sections, (kp, ki_dt): (f64, f64)) -> Setup {
    let source = if matches!(setup.source, Source::Exact(_)) { setup.source } else { Source::None };
    let plain = unlimited(&Setup { source, ..setup.clone() });
    Setup { options: ControllerOptions { filters, kp, ki: ki_dt / DT, ..plain.options }, ..plain }
}

/// A low-pass of first order, whose step response does not overshoot.
fn low_pass(pole: f64) -> Sections {
    Sections::new(&[Biquad::new([1.0 - pole, 0.0, 0.0], [-pole, 0.0]).unwrap()]).unwrap()
}

/// A motion under way: whether it goes on.
fn in_motion(controller: &mut HybridController, samples: &[(f64, f64)]) -> bool {
    for (reference, y) in samples {
        controller.step((*reference).into(), *y);
    }
    controller.state().feedback_loop.started
}

/// The gain, per sample, with which the next error counts: none while the integral rests.
fn ki_dt(controller: &HybridController) -> f64 {
    let ControllerOptions { ki, dt, .. } = controller.options();
    if controller.state().feedback_loop.integral_rest_samples > 0 { 0.0 } else { ki * dt }
}

fn smooth() -> impl Strategy<Value = Vec<(f64, f64)>> {
    vec((-4.0..4.0, -4.0..4.0), 2..20)
}

proptest! {
    #[test]
    fn the_drive_never_leaves_limits_nor_slew(setup in setup(), events in vec(upheaval(), 1..60)) {
        let mut controller = setup.make();
        let (low, high) = setup.options.limits;
        // Exactly: the difference of two drives, in doubles, is never above slew times dt.
        let step = setup.options.slew.map_or(f64::INFINITY, |slew| slew * setup.options.dt);
        let (mut last, mut saved) = (controller.drive(), None);
        for event in events {
            let told = happen(&mut controller, event, &mut saved);
            let drive = controller.drive();
            prop_assert!(drive.is_finite() && low <= drive && drive <= high, "{drive}");
            prop_assert!(told || (drive - last).abs() <= step, "{last} to {drive}");
            let moves = matches!(event, Event::Sample(..) | Event::Plan(..));
            prop_assert!(told || moves || drive == last, "{event:?} moves from {last} to {drive}");
            last = drive;
        }
    }

    #[test]
    fn a_stop_reaches_its_rest_drive_and_stays(setup in setup(), x in vec(upheaval(), 0..40), rate in 1e4..1e6, where_to in 0.0..1.0, c in command(), y in -4.0..4.0_f64) {
        let limits = (-500.0, 500.0);
        let options = ControllerOptions { limits, ..setup.options };
        let (slew, dt) = (options.slew.unwrap_or(f64::INFINITY), options.dt);
        let mut controller = Setup { options, ..setup }.make();
        let mut saved = None;
        for event in x {
            happen(&mut controller, event, &mut saved);
        }
        let (rest, mode) = (-500.0 + 1000.0 * where_to, controller.state().feedback_loop.resumes);
        controller.stop(rate, rest).unwrap();
        let mut samples = 0;
        while controller.drive() != rest {
            let last = controller.drive();
            let peeked = controller.peek(c, y);
            let drive = controller.step(c, y);
            prop_assert_eq!(drive.to_bits(), peeked.to_bits());
            prop_assert!((drive - last).abs() <= (rate * dt).min(slew * dt));
            prop_assert!((drive - rest).abs() < (last - rest).abs());
            samples += 1;
            prop_assert!(f64::from(samples) < 1.001 * 1000.0 / (rate.min(slew) * dt) + 2.0);
        }
        for command in [c, f64::NAN.into()] {
            prop_assert_eq!(controller.step(command, y).to_bits(), rest.to_bits());
        }
        prop_assert_eq!(controller.mode(), Mode::Stop);
        controller.release();
        prop_assert_eq!((controller.mode(), controller.drive()), (mode, rest));
    }

    #[test]
    fn an_implausible_measurement_is_a_missing_one(setup in setup(), x in vec(event(), 1..60)) {
        let mut controller = setup.make();
        let without_counts = |controller: &HybridController| {
            let mut state = controller.state();
            state.feedback_loop.counters = Counters::default();
            format!("{state:?}")
        };
        for event in x {
            let mut other = controller.clone();
            let before = controller.counters();
            happen(&mut controller, event, &mut None);
            let after = controller.counters();
            if let (Event::Sample(command, _), true) = (event, after.implausible_count > before.implausible_count) {
                other.step(command, f64::NAN);
                prop_assert_eq!(without_counts(&other), without_counts(&controller));
                let counts = Counters { implausible_count: before.implausible_count + 1, ..other.counters() };
                prop_assert_eq!(after, Counters { missing_count: before.missing_count, ..counts });
            }
        }
    }

    #[test]
    fn no_gate_shuts_out_a_new_level_for_ever(setup in setup(), x in vec(event(), 0..40), r in -4.0..4.0, y in -2.0..2.0_f64) {
        let mut controller = setup.make();
        drives(&mut controller, &x);
        controller.release();
        let command = hysteresis_core::Command { feedforward: Some(0.0), ..f64::into(r) };
        for _ in 0..=setup.options.max_missing.max(1) {
            controller.step(command, y);
        }
        prop_assert_eq!(controller.state().feedback_loop.last_measurement, Some(y));
        prop_assert_eq!(controller.terms().error, controller.terms().reference - y);
    }

    #[test]
    fn save_and_restore_continue_bit_for_bit(setup in setup(), x in vec(event(), 0..40), y in vec(event(), 1..40)) {
        let mut controller = setup.make();
        drives(&mut controller, &x);
        let state = controller.state();
        let mut other = setup.make();
        drives(&mut other, &y);
        other.set_state(&state).unwrap();
        prop_assert_eq!(shown(&other), shown(&controller));
        prop_assert_eq!(drives(&mut other, &y), drives(&mut controller, &y));
        prop_assert_eq!(shown(&other), shown(&controller));
    }

    #[test]
    fn plan_and_commit_equal_step(setup in setup(), samples in vec((command(), -4.0..4.0_f64), 1..60)) {
        let (mut one, mut other) = (setup.make(), setup.make());
        for (command, y) in samples {
            let y = if y > 3.0 { f64::NAN } else { y };
            let planned = other.plan(command, y);
            prop_assert_eq!(planned.to_bits(), one.step(command, y).to_bits());
            prop_assert!(other.commit() && !other.commit());
            prop_assert_eq!(shown(&one), shown(&other));
        }
    }

    #[test]
    fn run_equals_step(setup in setup(), samples in vec((-4.0..4.0_f64, -4.0..4.0_f64), 0..60), other in 0..60_usize) {
        let (references, measurements): (Vec<f64>, Vec<f64>) =
            samples.iter().map(|(r, y)| (*r, if *y > 3.0 { f64::NAN } else { *y })).unzip();
        let (mut one, mut block) = (setup.make(), setup.make());
        let stepped: Vec<u64> =
            references.iter().zip(&measurements).map(|(r, y)| one.step((*r).into(), *y).to_bits()).collect();
        let mut drives = vec![0.0; samples.len()];
        let mut wrong = vec![0.0; other];
        prop_assert_eq!(block.run(&references, &measurements, &mut wrong).is_err(), other != samples.len());
        if other == samples.len() {
            drives = wrong;
        } else {
            block.run(&references, &measurements, &mut drives).unwrap();
        }
        prop_assert_eq!(drives.iter().map(|drive| drive.to_bits()).collect::<Vec<_>>(), stepped);
        prop_assert_eq!(shown(&block), shown(&one));
    }

    #[test]
    fn peek_and_a_plan_that_is_dropped_change_nothing(setup in setup(), x in vec(upheaval(), 0..40), c in command(), y in -4.0..4.0_f64) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in x {
            happen(&mut controller, event, &mut saved);
        }
        let before = shown(&controller);
        let peeked = controller.peek(c, y);
        prop_assert_eq!(controller.plan(c, y).to_bits(), peeked.to_bits());
        prop_assert_eq!(shown(&controller), before);
        prop_assert_eq!(controller.step(c, y).to_bits(), peeked.to_bits());
        prop_assert!(!controller.commit());
    }

    #[test]
    fn a_motion_starts_from_the_present_drive(setup in setup(), x in vec(upheaval(), 0..40), how in 0..5, r in -4.0..4.0, y in -4.0..4.0) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in x {
            happen(&mut controller, event, &mut saved);
        }
        match how {
            0 => controller.reset(),
            1 => controller.hold(),
            2 => _ = controller.step(f64::NAN.into(), y),
            3 => {
                controller.stop(1e4, 50.0).unwrap();
                controller.step(f64::NAN.into(), y);
            }
            _ => {
                let mut state = controller.state();
                state.feedback_loop.started = false;
                controller.set_state(&state).unwrap();
            }
        }
        controller.release();
        let held = controller.drive();
        let volts = hysteresis_core::Command { feedforward: Some(100.0), ..f64::into(r) };
        prop_assert_eq!(controller.step(volts, y).to_bits(), held.to_bits());
    }

    #[test]
    fn a_switch_is_no_jump(setup in setup(), samples in smooth(), event in switch()) {
        let mut controller = unlimited(&setup).make();
        prop_assume!(in_motion(&mut controller, &samples));
        let mut switched = controller.clone();
        happen(&mut switched, event, &mut None);
        prop_assume!(switched.state().feedback_loop.started); // not so if volts are to be given
        let (reference, y) = samples[samples.len() - 1];
        let error = controller.terms().error;
        // The same sample once more: only the change of ki shows, and what the bumpless term loses of the difference.
        let (was, is) = (controller.peek(reference.into(), y), switched.peek(reference.into(), y));
        let change = (ki_dt(&switched) - ki_dt(&controller)) * error;
        // A second of bumpless_time: 10 000 samples, of which at most 20 have gone before the switch began it anew.
        let lost = (switched.terms().bumpless.abs() + controller.terms().bumpless.abs()) / (10_000.0 - 20.0);
        let tolerance = lost + ROUNDING * scale(&controller).max(scale(&switched)).max(change.abs());
        prop_assert!((is - was - change).abs() <= tolerance, "{was} to {is}, {change} of it by ki");
    }

    #[test]
    fn feedback_goes_and_returns_without_a_jump(setup in setup(), samples in smooth()) {
        let mut controller = unlimited(&setup).make();
        prop_assume!(in_motion(&mut controller, &samples));
        let (reference, y) = samples[samples.len() - 1];
        let mut without = controller.clone();
        without.set_mode(Mode::Feedforward).unwrap();
        let ki_dt = ki_dt(&controller);
        let (was, is) = (controller.step(reference.into(), y), without.step(reference.into(), f64::NAN));
        let integrated = ki_dt * controller.terms().error;
        let tolerance = |c: &HybridController| 3e-4 * c.terms().bumpless.abs() + ROUNDING * scale(c);
        prop_assert!((was - is - integrated).abs() <= tolerance(&controller) + tolerance(&without), "{was} to {is}");
        let mut back = without.clone();
        back.set_mode(Mode::Run).unwrap();
        let (was, is) = (without.step(reference.into(), y), back.step(reference.into(), y));
        prop_assert!((is - was - integrated).abs() <= tolerance(&back), "{was} to {is}");
    }

    #[test]
    fn incremental_is_positional_where_nothing_is_limited(setup in setup(), events in vec(event(), 1..60)) {
        let setup = unlimited(&setup);
        let law = |law| Setup { options: ControllerOptions { law, ..setup.options }, ..setup.clone() }.make();
        let (mut positional, mut incremental) = (law(Law::Positional), law(Law::Incremental));
        for event in events {
            // Bit for bit: what is taken off the integral is exactly zero.
            prop_assert_eq!(drives(&mut positional, &[event]), drives(&mut incremental, &[event]));
            if positional.counters().saturated_count > 0 {
                break;
            }
        }
    }

    #[test]
    fn filters_shape_the_error_and_nothing_else(setup in setup(), filters in filters(), gains in (0.0..100.0_f64, 0.0..10.0_f64), samples in smooth()) {
        let setup = filtered(&setup, filters, gains);
        // The integral does not rest.
        let setup = Setup { options: ControllerOptions { bumpless_time: 0.0, ..setup.options }, ..setup };
        let without = ControllerOptions { filters: Sections::default(), ..setup.options };
        let (mut controller, mut plain) = (setup.make(), Setup { options: without, ..setup }.make());
        let mut filter = Filter::new(filters.as_slice()).unwrap();
        filter.settle(samples[0].0 - samples[0].1).unwrap();
        for (k, (reference, y)) in samples.into_iter().enumerate() {
            // Where the feedback begins the filters are at rest.
            let error = if k == 0 { filter.state().output } else { filter.step(reference - y) };
            let (one, other) = (controller.step(reference.into(), y), plain.step(reference.into(), reference - error));
            let rounding = 100.0 * ROUNDING * (1.0 + error.abs() + y.abs()) * (1.0 + gains.0 + gains.1);
            prop_assert!((one - other).abs() <= rounding * 20.0 + ROUNDING * scale(&plain), "{one} {other}");
            prop_assert_eq!(controller.terms().filtered_error, error);
        }
    }

    #[test]
    fn a_change_of_filters_is_no_jump(setup in setup(), both in (filters(), filters()), gains in (0.0..100.0_f64, 0.0..10.0_f64), samples in smooth()) {
        let mut controller = filtered(&setup, both.0, gains).make();
        prop_assume!(in_motion(&mut controller, &samples));
        let was = controller.terms().unlimited_drive;
        controller.set_filters(&both.1).unwrap();
        let (reference, y) = samples[samples.len() - 1];
        // The same sample once more: the integral goes on by what the new filters put out.
        let change = ki_dt(&controller) * controller.terms().filtered_error;
        let is = controller.peek(reference.into(), y);
        let largest = controller.terms().filtered_error.abs().max(scale(&controller)) * (1.0 + gains.0);
        let tolerance = 3e-4 * controller.terms().bumpless.abs() + 100.0 * ROUNDING * largest;
        prop_assert!((is - was - change).abs() <= tolerance, "{was} to {is}, {change} of it by ki");
    }

    #[test]
    fn the_integral_does_not_wind_up(setup in setup(), r in 4.0..1e3_f64, kp in 0.0..100.0_f64, ki in 0.01..10.0_f64, pole in 0.0..0.99_f64) {
        let limits = (-500.0, 500.0);
        let set = ControllerOptions { kp, ki: ki / DT, dt: DT, limits, law: Law::Positional, ..setup.options };
        let tracking = matches!(set.anti_windup, AntiWindup::BackCalculation { tracking_time: Some(_) });
        let anti_windup = if tracking { AntiWindup::BackCalculation { tracking_time: None } } else { set.anti_windup };
        let filters = if pole < 0.3 { Sections::default() } else { low_pass(pole) };
        let options = ControllerOptions { anti_windup, filters, ..set };
        let mut controller = Setup { options, window: None, ..setup }.make();
        let command = |r| hysteresis_core::Command { feedforward: Some(0.0), ..f64::into(r) };
        let kept = |c: &HybridController| c.state().feedback_loop.integral;
        for _ in 0..3000 {
            controller.step(command(r), 0.0);
        }
        let wound = kept(&controller);
        for _ in 0..3000 {
            controller.step(command(r), 0.0);
        }
        // Conditional: no more than the limits and one step. Back-calculation: what one more error per integral time
        // adds.
        let (span, most) = (1000.0, (ki / kp).min(1.0).recip() * ki * r + ki * r);
        prop_assert!((kept(&controller) - wound).abs() <= span + most, "{wound} to {}", kept(&controller));
        prop_assert!(kept(&controller) <= 2.0 * span + 2.0 * most);
    }
}
