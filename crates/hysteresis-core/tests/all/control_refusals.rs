//! What the controller refuses, by name and without a change.

use crate::support::control::{DT, Source};
use crate::support::models::{actuator, parametric_inverse};
use hysteresis_core::{
    AntiWindup, CompiledModel, ControllerOptions, ControllerState, Error, FeedForward, FeedForwardState,
    HybridController, Mode, Preview, QuasiStatic, StopRamp, StreamState,
};

const LIMITS: (f64, f64) = (-500.0, 500.0);

fn made(source: FeedForward, options: &ControllerOptions) -> HybridController {
    HybridController::new(source, None, options).unwrap()
}

/// The state and the options with every bit shown.
fn shown(controller: &HybridController) -> String {
    format!("{:?} {:?}", controller.state(), controller.options())
}

#[test]
fn options_out_of_their_domain_are_named() {
    let set = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
    let message = |options| HybridController::new(FeedForward::None, None, &options).unwrap_err().to_string();
    let tracking = |time| AntiWindup::BackCalculation { tracking_time: Some(time) };
    let cases = [
        (ControllerOptions { kp: -1.0, ..set }, "kp: expected a finite number >= 0, got -1.0"),
        (ControllerOptions { ki: f64::NAN, ..set }, "ki: expected a finite number >= 0, got NaN"),
        (ControllerOptions { dt: 0.0, ..set }, "dt: expected a finite number > 0, got 0.0"),
        (
            ControllerOptions { limits: (5.0, 5.0), ..set },
            "limits[1]: expected a number above the low limit = 5.0, got 5.0",
        ),
        (ControllerOptions { slew: Some(0.0), ..set }, "slew: expected a finite number > 0, got 0.0"),
        (ControllerOptions { bumpless_time: -1.0, ..set }, "bumpless_time: expected a finite number >= 0, got -1.0"),
        (ControllerOptions { ki: 1e99, dt: 1e3, ..set }, "ki: expected a number from 0.0 to 1e97, got 1e99"),
        (
            ControllerOptions { measurement_range: Some((1.0, 1.0)), ..set },
            "measurement_range[1]: expected a number above the lowest measurement = 1.0, got 1.0",
        ),
        (
            ControllerOptions { max_measurement_step: Some(0.0), ..set },
            "max_measurement_step: expected a finite number > 0, got 0.0",
        ),
        (
            ControllerOptions { anti_windup: tracking(0.0), ..set },
            "tracking_time: expected a finite number > 0, got 0.0",
        ),
        (
            ControllerOptions { start_drive: Some(501.0), ..set },
            "start_drive: expected a number from -500.0 to 500.0, got 501.0",
        ),
    ];
    for (options, expected) in cases {
        assert_eq!(message(options), expected);
    }
    let nowhere = ControllerOptions { limits: (f64::NEG_INFINITY, 5.0), ..set };
    assert!(message(nowhere).starts_with("limits[0]: expected a finite number"));
    assert_eq!(Preview::new(&[], 0).unwrap_err().to_string(), "coefficients: expected at least one element, got none");
    assert_eq!(Preview::new(&[1.0], 1).unwrap_err().to_string(), "ahead: expected a whole number from 0 to 0, got 1");
    assert!(
        Preview::new(&[1.0, f64::NAN], 1).unwrap_err().to_string().starts_with("coefficients[1]: expected a finite")
    );
}

#[test]
fn changes_that_cannot_be_are_refused_and_change_nothing() {
    let mut controller = made(Source::Exact(0).make(LIMITS), &ControllerOptions::new(5.0, 6e3, DT, LIMITS));
    controller.step(0.5.into(), 0.0);
    controller.plan(0.6.into(), 0.0);
    let before = controller.state();
    assert!(controller.set_gains(1.0, -1.0).unwrap_err().to_string().starts_with("ki: expected"));
    assert_eq!(
        controller.set_mode(Mode::Stop).unwrap_err().to_string(),
        "mode: expected run, feedforward or hold, got stop; call stop with a rate and a rest drive"
    );
    let stop = |controller: &mut HybridController, rate, rest| controller.stop(rate, rest).unwrap_err().to_string();
    assert_eq!(stop(&mut controller, 0.0, 0.0), "rate: expected a finite number > 0, got 0.0");
    assert!(stop(&mut controller, f64::NAN, 0.0).starts_with("rate: expected"));
    assert_eq!(stop(&mut controller, 1.0, -501.0), "rest_drive: expected a number from -500.0 to 500.0, got -501.0");
    assert!(controller.reset_at(501.0).unwrap_err().to_string().starts_with("drive: expected a number from"));
    let other = CompiledModel::new(&parametric_inverse());
    assert!(matches!(controller.set_model(&other), Err(Error::OtherOperators { .. })));
    assert_eq!((controller.state(), controller.options().kp), (before, 5.0));
    assert!(controller.commit(), "the plan still stands");
    assert!(controller.follow(&[0.0, 501.0]).unwrap_err().to_string().starts_with("drives[1]: expected a number from"));
    let mut parametric = made(Source::Parametric(0).make(LIMITS), &ControllerOptions::new(5.0, 6e3, DT, LIMITS));
    assert_eq!(parametric.follow(&[1.0]), Err(Error::CannotFollow));
    assert_eq!([Error::CannotFollow, Error::StopWithoutRate].map(|e| e.parameter()), [Some("drives"), Some("mode")]);
    assert_eq!(parametric.drive(), 0.0);
    let mut without = made(FeedForward::None, &ControllerOptions::new(5.0, 6e3, DT, LIMITS));
    assert_eq!(without.set_model(&other), Err(Error::NoModel));
    let changes: [fn(&mut HybridController); 9] = [
        |c| c.follow(&[0.0]).unwrap(),
        HybridController::reset,
        |c| c.set_gains(1.0, 1.0).unwrap(),
        HybridController::hold,
        HybridController::release,
        |c| c.stop(1.0, 0.0).unwrap(),
        |c| c.set_feedforward(FeedForward::None).unwrap(),
        |c| c.start_at(0.0).unwrap(),
        |c| c.set_state(&c.state()).unwrap(),
    ];
    for change in changes {
        without.plan(0.5.into(), 0.0);
        change(&mut without);
        assert!(!without.commit(), "a change drops the plan");
    }
}

/// An inverse with other limits than the controller would follow targets that the drive never reaches.
#[test]
fn an_inverse_with_other_limits_is_refused_by_both() {
    let options = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
    let inverse = |limits| FeedForward::from(actuator().inverse(limits).unwrap());
    let expected = "feedforward: expected an inverse with the limits of the controller, (-500.0, 500.0), got one ";
    for (limits, got) in [(Some((-500.0, 499.0)), "with the limits (-500.0, 499.0)"), (None, "without limits")] {
        let error = HybridController::new(inverse(limits), None, &options).unwrap_err();
        assert_eq!((error.parameter(), error.to_string()), (Some("feedforward"), format!("{expected}{got}")));
        let mut controller = made(inverse(Some(LIMITS)), &options);
        controller.step(0.5.into(), 0.0);
        controller.plan(0.5.into(), 0.0);
        let before = shown(&controller);
        assert_eq!(controller.set_feedforward(inverse(limits)).unwrap_err(), error);
        assert_eq!(shown(&controller), before);
        assert!(controller.commit(), "the plan still stands");
        let creeping = QuasiStatic::new(&CompiledModel::new(&actuator())).inverse(limits).unwrap();
        assert_eq!(controller.set_feedforward(creeping.into()).unwrap_err(), error);
    }
}

#[test]
fn a_state_of_other_gains_interval_or_limits_is_refused_by_name() {
    let set = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
    let state = made(FeedForward::None, &set).state();
    let others = [
        (ControllerOptions { kp: 4.0, ..set }, "state.kp: expected 4.0, as in this controller, got 5.0"),
        (ControllerOptions { ki: 0.6, ..set }, "state.ki: expected 0.6, as in this controller, got 6000.0"),
        (ControllerOptions { dt: 1e-3, ..set }, "state.dt: expected 0.001, as in this controller, got 0.0001"),
        (
            ControllerOptions { limits: (-20.0, 500.0), ..set },
            "state.limits.low: expected -20.0, as in this controller, got -500.0",
        ),
        (
            ControllerOptions { limits: (-500.0, 150.0), ..set },
            "state.limits.high: expected 150.0, as in this controller, got 500.0",
        ),
    ];
    for (options, message) in others {
        let mut controller = made(FeedForward::None, &options);
        let before = shown(&controller);
        assert_eq!(controller.set_state(&state).unwrap_err().to_string(), message);
        assert_eq!(shown(&controller), before);
    }
    let mut changed = made(FeedForward::None, &ControllerOptions { kp: 4.0, ..set });
    changed.set_gains(5.0, 6e3).unwrap();
    changed.set_state(&state).unwrap();
}

#[test]
fn a_state_that_is_none_of_this_controller_is_refused_and_changes_nothing() {
    let options = ControllerOptions::new(5.0, 6e3, DT, (-20.0, 150.0));
    let preview = || Preview::new(&[0.5, 0.5], 1).unwrap();
    let source = || Source::Exact(0).make(options.limits);
    let mut controller = HybridController::new(source(), Some(preview()), &options).unwrap();
    controller.step(0.3.into(), 0.1);
    let good = controller.state();
    let refused = |spoil: &dyn Fn(&mut ControllerState)| {
        let (mut state, mut controller) = (good.clone(), controller.clone());
        spoil(&mut state);
        let before = shown(&controller);
        let message = controller.set_state(&state).unwrap_err().to_string();
        assert_eq!(shown(&controller), before);
        message
    };
    assert_eq!(
        refused(&|s| s.feedback_loop.terms.drive = 150.1),
        "state.feedback_loop.terms.drive: expected a number from -20.0 to 150.0, got 150.1"
    );
    assert!(refused(&|s| s.feedback_loop.terms.drive = f64::NAN).ends_with("got NaN"));
    assert!(refused(&|s| s.feedback_loop.integral = 1e251).contains("at most 1e250"));
    assert!(refused(&|s| s.feedback_loop.terms.bumpless = f64::NEG_INFINITY).contains("finite terms"));
    assert!(refused(&|s| s.feedback_loop.terms.target = f64::NAN).contains("terms.target: expected a finite number"));
    assert!(refused(&|s| s.feedback_loop.resumes = Mode::Feedforward).contains("a mode that is the one it resumes"));
    assert!(refused(&|s| s.feedback_loop.resumes = Mode::Hold).contains("a mode that is the one it resumes"));
    let stopped = |s: &mut ControllerState, rate, rest_drive| {
        (s.feedback_loop.mode, s.feedback_loop.stop) = (Mode::Stop, Some(StopRamp { rate, rest_drive }));
    };
    assert!(refused(&|s| s.feedback_loop.mode = Mode::Stop).contains("if, and only if, the mode is a stop"));
    let ramp = StopRamp { rate: 1.0, rest_drive: 0.0 };
    assert!(refused(&|s| s.feedback_loop.stop = Some(ramp)).contains("if, and only if, the mode is a stop"));
    assert!(refused(&|s| stopped(s, -1.0, 0.0)).starts_with("state.feedback_loop.stop.rate: expected"));
    assert!(refused(&|s| stopped(s, 1.0, 151.0)).starts_with("state.feedback_loop.stop.rest_drive: expected"));
    assert!(
        refused(&|s| s.feedback_loop.last_measurement = Some(f64::NAN)).contains("last_measurement: expected a fin")
    );
    assert!(
        refused(&|s| s.preview.as_mut().unwrap().samples = 3).contains("samples: expected a whole number from 0 to 2")
    );
    assert!(refused(&|s| s.preview = None).contains("a preview if, and only if"));
    assert!(refused(&|s| s.preview.as_mut().unwrap().past.push(1.0)).contains("expected 1 elements, got 2"));
    assert!(
        refused(&|s| s.preview.as_mut().unwrap().window += 1)
            .ends_with("the state of a preview with the same coefficients, samples ahead and smoothing")
    );
    assert!(refused(&|s| s.preview.as_mut().unwrap().past[0] = f64::NAN).contains("past[0]: expected a finite number"));
    assert!(refused(&|s| s.feedforward = None).contains("a feed-forward of the kind"));
    let spoil = |s: &mut ControllerState, spoil: &dyn Fn(&mut StreamState)| match &mut s.feedforward {
        Some(FeedForwardState::Stream(stream)) => spoil(stream),
        _ => unreachable!(),
    };
    assert!(refused(&|s| spoil(s, &|f| f.last_output = 151.0)).contains("a drive within the limits"));
    assert!(
        refused(&|s| spoil(s, &|f| f.model += 1)).starts_with("state.model: expected the fingerprint of this model")
    );
    controller.set_state(&good).unwrap();
}

#[test]
fn a_state_of_another_preview_of_the_same_length_is_refused() {
    let options = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
    let behind = |preview: Preview| HybridController::new(FeedForward::None, Some(preview), &options).unwrap();
    let plain = Preview::new(&[0.25, 0.5, 0.25], 1).unwrap();
    let mut controller = behind(plain.clone());
    controller.step(1.0.into(), 0.0);
    let saved = controller.state();
    behind(plain).set_state(&saved).unwrap();
    let others = [
        Preview::new(&[0.25, 0.5, 0.25], 0).unwrap(),
        Preview::new(&[0.25, 0.5, 0.250_000_1], 1).unwrap(),
        Preview::new(&[1.0], 0).unwrap().smoothed(&[0.25, 0.5, 0.25]).unwrap(),
    ];
    let [_, _, smoothed] = &others;
    assert_eq!((smoothed.coefficients(), smoothed.ahead()), (&[0.25, 0.5, 0.25][..], 1), "the smoothing alone differs");
    for other in others {
        let mut other = behind(other);
        let before = other.state();
        let message = other.set_state(&saved).unwrap_err().to_string();
        assert!(message.contains("a preview with the same coefficients, samples ahead and smoothing"), "{message}");
        assert_eq!(other.state(), before);
    }
}
