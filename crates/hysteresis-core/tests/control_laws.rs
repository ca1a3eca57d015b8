//! Laws of the controller, whatever happens to it; the same names as in `test_control_laws.py`.

mod support;

use hysteresis_core::{AntiWindup, ControllerOptions, ControllerState, HybridController, Law, Mode};
use proptest::collection::vec;
use proptest::prelude::*;
use support::control::{Event, Setup, command, event, happen, setup, switch, upheaval};

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
    [t.feedforward, t.proportional, t.integral, t.transition, t.demanded].into_iter().fold(1.0, |m, x| m.max(x.abs()))
}

/// The same controller where nothing can be limited and equal references mean equal targets.
fn unlimited(setup: &Setup) -> Setup {
    let law = if setup.options.law.is_sound() { setup.options.law } else { Law::Positional };
    let options = ControllerOptions { limits: (-1e100, 1e100), slew: None, transition: 1.0, law, ..setup.options };
    Setup { options, window: None, source: setup.source }
}

/// A motion under way: whether it goes on.
fn in_motion(controller: &mut HybridController, samples: &[(f64, f64)]) -> bool {
    for (reference, y) in samples {
        controller.step((*reference).into(), *y);
    }
    controller.state().feedback_loop.started
}

/// The gain with which the next error counts: none while the integral rests.
fn ki(controller: &HybridController) -> f64 {
    if controller.state().feedback_loop.resting > 0 { 0.0 } else { controller.options().ki }
}

fn smooth() -> impl Strategy<Value = Vec<(f64, f64)>> {
    vec((-4.0..4.0, -4.0..4.0), 2..20)
}

proptest! {
    #[test]
    fn the_drive_never_leaves_limits_nor_slew(setup in setup(), events in vec(upheaval(), 1..60)) {
        let mut controller = setup.make();
        let (low, high) = setup.options.limits;
        let step = setup.options.slew.map_or(f64::INFINITY, |slew| slew * setup.options.dt);
        let (mut last, mut saved) = (controller.drive(), None);
        for event in events {
            let told = happen(&mut controller, event, &mut saved);
            let drive = controller.drive();
            prop_assert!(drive.is_finite() && low <= drive && drive <= high, "{drive}");
            prop_assert!(told || (last - step <= drive && drive <= last + step), "{last} to {drive}");
            let moves = matches!(event, Event::Sample(..) | Event::Plan(..));
            prop_assert!(told || moves || drive == last, "{event:?} moves from {last} to {drive}");
            last = drive;
        }
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
    fn a_motion_starts_from_the_present_drive(setup in setup(), x in vec(upheaval(), 0..40), how in 0..4, r in -4.0..4.0, y in -4.0..4.0) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in x {
            happen(&mut controller, event, &mut saved);
        }
        match how {
            0 => controller.reset(),
            1 => controller.set_mode(Mode::Hold),
            2 => _ = controller.step(f64::NAN.into(), y),
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
        // The same sample once more: only the change of ki shows, and what the transition loses of the difference.
        let (was, is) = (controller.peek(reference.into(), y), switched.peek(reference.into(), y));
        let change = (ki(&switched) - ki(&controller)) * error;
        // A second of transition: 10 000 samples, of which at most 20 have gone before the switch began it anew.
        let lost = 2e-4 * switched.terms().transition.abs().max(controller.terms().transition.abs());
        let tolerance = lost + ROUNDING * scale(&controller).max(scale(&switched)).max(change.abs());
        prop_assert!((is - was - change).abs() <= tolerance, "{was} to {is}, {change} of it by ki");
    }

    #[test]
    fn feedback_goes_and_returns_without_a_jump(setup in setup(), samples in smooth()) {
        let mut controller = unlimited(&setup).make();
        prop_assume!(in_motion(&mut controller, &samples));
        let (reference, y) = samples[samples.len() - 1];
        let mut without = controller.clone();
        without.set_mode(Mode::Feedforward);
        let ki = ki(&controller);
        let (was, is) = (controller.step(reference.into(), y), without.step(reference.into(), f64::NAN));
        let integrated = ki * controller.terms().error;
        let tolerance = |c: &HybridController| 3e-4 * c.terms().transition.abs() + ROUNDING * scale(c);
        prop_assert!((was - is - integrated).abs() <= tolerance(&controller) + tolerance(&without), "{was} to {is}");
        let mut back = without.clone();
        back.set_mode(Mode::Run);
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
            if positional.counters().saturated > 0 {
                break;
            }
        }
    }

    #[test]
    fn the_integral_does_not_wind_up(setup in setup(), r in 4.0..1e3_f64, kp in 0.0..100.0, ki in 0.01..10.0) {
        let limits = (-500.0, 500.0);
        let set = ControllerOptions { kp, ki, limits, law: Law::Positional, ..setup.options };
        let tracking = matches!(set.anti_windup, AntiWindup::BackCalculation { tracking_time: Some(_) });
        let anti_windup = if tracking { AntiWindup::BackCalculation { tracking_time: None } } else { set.anti_windup };
        let options = ControllerOptions { anti_windup, ..set };
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
        // Conditional: no more than the limits and one step. Back-calculation: what one more error per integral time adds.
        let (span, most) = (1000.0, (ki / kp).min(1.0).recip() * ki * r + ki * r);
        prop_assert!((kept(&controller) - wound).abs() <= span + most, "{wound} to {}", kept(&controller));
        prop_assert!(kept(&controller) <= 2.0 * span + 2.0 * most);
    }
}

#[test]
fn a_state_that_is_none_of_this_controller_is_refused_and_changes_nothing() {
    let options = ControllerOptions::new(5.0, 0.6, (-20.0, 150.0));
    let preview = || hysteresis_core::Preview::new(&[0.5, 0.5], 1).unwrap();
    let source = || support::control::Source::Exact(0).make(options.limits);
    let mut controller = HybridController::new(source(), Some(preview()), &options).unwrap();
    controller.step(0.3.into(), 0.1);
    let good = controller.state();
    let refused = |spoil: fn(&mut ControllerState)| {
        let (mut state, mut controller) = (good.clone(), controller.clone());
        spoil(&mut state);
        let before = shown(&controller);
        let message = controller.set_state(&state).unwrap_err().to_string();
        assert_eq!(shown(&controller), before);
        message
    };
    assert_eq!(
        refused(|s| s.feedback_loop.terms.drive = 150.1),
        "state.feedback_loop.terms.drive: expected a number from -20.0 to 150.0, got 150.1"
    );
    assert!(refused(|s| s.feedback_loop.terms.drive = f64::NAN).ends_with("got NaN"));
    assert!(refused(|s| s.feedback_loop.integral = 1e251).contains("at most 1e250"));
    assert!(refused(|s| s.feedback_loop.terms.transition = f64::NEG_INFINITY).contains("finite terms"));
    assert!(refused(|s| s.feedback_loop.terms.target = f64::NAN).contains("terms.target: expected a finite number"));
    assert!(refused(|s| s.feedback_loop.resumes = Mode::Feedforward).contains("a mode that is the one it resumes"));
    assert!(refused(|s| s.feedback_loop.resumes = Mode::Hold).contains("a mode that is the one it resumes"));
    assert!(refused(|s| s.preview = None).contains("a preview if, and only if"));
    assert!(refused(|s| s.preview.as_mut().unwrap().past.push(1.0)).contains("expected 1 elements, got 2"));
    assert!(refused(|s| s.preview.as_mut().unwrap().past[0] = f64::NAN).contains("past[0]: expected a finite number"));
    assert!(refused(|s| s.feedforward = None).contains("a feed-forward if, and only if"));
    assert!(refused(|s| s.feedforward.as_mut().unwrap().last_output = 151.0).contains("a drive within the limits"));
    controller.set_state(&good).unwrap();
}
