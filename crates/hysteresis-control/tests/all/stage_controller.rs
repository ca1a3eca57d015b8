//! Laws of the controller with an observer and learning.

use core::f64::consts::TAU;
use std::sync::LazyLock;

use crate::support::models::actuator;
use crate::support::{DT, Noise};
use hysteresis_control::learning::{RepetitiveControl, RepetitiveOptions, RepetitiveState};
use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{FeedForwardKind, Stage, StageParts};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{Command, Counters, FeedForward, HybridController};
use proptest::prelude::*;

const PERIOD: u32 = 100;
const LIMITS: (f64, f64) = (-500.0, 500.0);
const SLEW: f64 = 2e5;

fn stage() -> Stage {
    let dynamics = SecondOrder::new(800.0, 0.1).unwrap().into();
    let parts =
        StageParts { dynamics, dead_time: DT, limits: Some(LIMITS), slew: Some(SLEW), ..StageParts::new(actuator()) };
    Stage::new(parts).unwrap()
}

fn hybrid(stage: &Stage, preview: bool) -> HybridController {
    let kind = if preview { FeedForwardKind::Preview { ahead: 6, smoothing: 0.0 } } else { FeedForwardKind::Inverse };
    let mut options = stage.controller_options(DT, None).unwrap();
    (options.measurement_range, options.max_missing, options.bumpless_time) = (Some((-20.0, 20.0)), 4, 2e-3);
    stage.controller(kind, &options).unwrap()
}

fn observer(stage: &Stage) -> Observer {
    Observer::new(stage, DT, &ObserverOptions { noise: 0.016, drift: 0.5 }).unwrap()
}

fn repetitive(stage: &Stage, hybrid: &HybridController) -> RepetitiveControl {
    let options = hybrid.options();
    let around = stage.feedback_loop(DT, (options.kp, options.ki), options.filters).unwrap();
    RepetitiveControl::new(&around, PERIOD as usize, &RepetitiveOptions::new(500.0)).unwrap()
}

/// With a preview or without, an observer, learning: those of one stage, whose design takes its time.
fn made((preview, observes, learns): (bool, bool, bool)) -> StageController {
    static PARTS: LazyLock<([HybridController; 2], Observer, RepetitiveControl)> = LazyLock::new(|| {
        let stage = stage();
        let hybrids = [false, true].map(|preview| hybrid(&stage, preview));
        let learning = repetitive(&stage, &hybrids[0]);
        (hybrids, observer(&stage), learning)
    });
    let (hybrids, observer, learning) = &*PARTS;
    let mut controller = StageController::from(hybrids[usize::from(preview)].clone());
    if observes {
        controller = controller.with_observer(observer.clone()).unwrap();
    }
    if learns {
        controller = controller.with_repetitive(learning.clone()).unwrap();
    }
    controller
}

fn number() -> impl Strategy<Value = f64> {
    prop_oneof![10 => -4.0..4.0, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => -1e6..1e6]
}

/// Samples whose drive is written, and whether it is planned before.
fn samples() -> impl Strategy<Value = Vec<(f64, f64, bool)>> {
    prop::collection::vec((number(), number(), any::<bool>()), 1..250)
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 48, failure_persistence: None, ..ProptestConfig::default() })]

    /// What is planned is what a peek says and what a step does, and a plan that is not committed leaves nothing.
    #[test]
    fn a_plan_that_is_committed_is_a_step(with in any::<(bool, bool, bool)>(), samples in samples()) {
        let (mut stepped, mut planned) = (made(with), made(with));
        for (reference, measurement, twice) in samples {
            let command = Command { correction: 0.01, ..reference.into() };
            if twice {
                planned.plan(0.5.into(), 0.1);
            }
            let drive = stepped.step(command, measurement);
            prop_assert_eq!(planned.peek(command, measurement).to_bits(), drive.to_bits());
            prop_assert_eq!(planned.plan(command, measurement).to_bits(), drive.to_bits());
            prop_assert!(planned.commit());
            prop_assert!(!planned.commit());
            prop_assert_eq!(format!("{:?}", planned.state()), format!("{:?}", stepped.state()));
        }
    }

    #[test]
    fn a_restored_controller_continues_bit_for_bit(with in any::<(bool, bool, bool)>(), samples in samples(), at in 0_usize..100) {
        let (mut one, mut other) = (made(with), made(with));
        for (k, (reference, measurement, _)) in samples.into_iter().enumerate() {
            let drive = one.step(reference.into(), measurement);
            if k == at {
                let saved = serde_json::to_string(&one.state()).unwrap();
                other.set_state(&serde_json::from_str(&saved).unwrap()).unwrap();
            } else if k > at {
                prop_assert_eq!(drive.to_bits(), other.step(reference.into(), measurement).to_bits());
            }
        }
    }

    /// Whatever is estimated and learned, no drive leaves limits and slew.
    #[test]
    fn no_drive_ever_leaves_its_limits_nor_its_slew(with in any::<(bool, bool, bool)>(), samples in samples()) {
        let mut controller = made(with);
        let mut last = controller.controller().drive();
        for (reference, measurement, _) in samples {
            let drive = controller.step(reference.into(), measurement);
            prop_assert!((LIMITS.0..=LIMITS.1).contains(&drive));
            prop_assert!((drive - last).abs() <= SLEW * DT * (1.0 + 1e-12), "{last} {drive}");
            last = drive;
        }
    }

    /// One object does what its parts do by hand.
    #[test]
    fn it_is_its_parts_joined(samples in prop::collection::vec((-3.0..3.0, -3.0..3.0), 1..250)) {
        let mut joined = made((false, true, true));
        let mut parts = made((false, true, true));
        let (mut observer, mut learning) = (parts.take_observer().unwrap(), parts.take_repetitive().unwrap());
        let controller = parts.controller_mut();
        for (reference, measurement) in samples {
            let seen = observer.step(controller.drive(), measurement);
            let command = Command { correction: learning.step_with(reference, reference - measurement), ..f64::into(reference) };
            let command = Command { estimate: Some(seen), ..command };
            let drive = controller.step(command, measurement);
            prop_assert_eq!(joined.step(reference.into(), measurement).to_bits(), drive.to_bits());
        }

        prop_assert_eq!(joined.controller().state(), controller.state());
        // The errors of the start are none that the joined one sees.
        let seen = joined.repetitive().unwrap().state();
        prop_assert_eq!(&RepetitiveState { supervision: seen.supervision.clone(), ..learning.state() }, &seen);
    }
}

/// A stage with another slope than was believed, behind a preview: learning takes the error away, the observer the
/// noise.
#[test]
fn learning_and_observer_work_behind_a_preview() {
    let (mut plant, reference) =
        (stage().forward(DT).unwrap(), |k: u32| 1.5 * (TAU * f64::from(k) / f64::from(PERIOD)).sin());
    let mut worst = [0.0; 2];
    for (learns, worst) in [false, true].into_iter().zip(&mut worst) {
        let (mut controller, mut noise) = (made((true, true, learns)), Noise::new(7));
        let (mut position, ahead) = (plant.settle(0.0), 6);
        for k in 0..40 * PERIOD {
            if k >= 39 * PERIOD {
                *worst = f64::max(*worst, (1.08 * position - reference(k)).abs());
            }
            let drive = controller.step(reference(k + ahead).into(), 1.08 * position + 1e-3 * noise.next());
            position = plant.advance(drive);
        }
    }
    assert!(worst[1] < 0.2 * worst[0] && worst[1] < 0.01, "{worst:?}");
}

/// The observer stands in for measurements that are missing or cannot be, for as many as the controller can do without.
#[test]
fn the_observer_stands_in_for_missing_measurements() {
    for bad in [f64::NAN, 1e3] {
        let mut controller = made((false, true, false));
        let mut plant = stage().forward(DT).unwrap();
        let (mut position, mut held) = (plant.settle(0.0), 0.0);
        for k in 0..400_u32 {
            let measurement = if (200..210).contains(&k) { bad } else { position };
            position = plant.advance(controller.step((1e-3 * f64::from(k)).into(), measurement));
            let Counters { missing_count, implausible_count, .. } = controller.controller().counters();
            // All are counted, and the loop goes on for the four that it can do without.
            assert_eq!(missing_count + implausible_count, u64::from(k.clamp(199, 209) - 199), "{k}");
            let moves = !(204..210).contains(&k) || controller.controller().terms().error == held;
            held = controller.controller().terms().error;
            assert!(moves, "{k}");
        }
        assert_eq!(controller.observer().unwrap().rejected(), 10);
        assert!((position - 0.399).abs() < 0.02);
    }
}

#[test]
fn parts_that_do_not_fit_are_refused() {
    let stage = stage();
    let slow = Observer::new(&stage, 2.0 * DT, &ObserverOptions { noise: 0.016, drift: 0.5 }).unwrap();
    let error = made((false, false, false)).with_observer(slow).unwrap_err();
    assert_eq!(
        error.to_string(),
        "observer.dt: expected 0.0001, the sampling interval of the controller in seconds, got 0.0002"
    );
    let nearly = Observer::new(&stage, DT * (1.0 + 1e-15), &ObserverOptions { noise: 0.016, drift: 0.5 }).unwrap();
    made((false, false, false)).with_observer(nearly).unwrap();
    let mut blind = made((false, false, true));
    let learning = blind.take_repetitive().unwrap();
    blind.controller_mut().set_feedforward(FeedForward::None).unwrap();
    let error = blind.with_repetitive(learning).unwrap_err().to_string();
    assert!(
        error.starts_with("repetitive: expected a controller with a feed-forward that corrections reach, got"),
        "{error}"
    );
    let with = made((false, true, true)).state();
    let mut without = made((false, false, true));
    let error = without.set_state(&with).unwrap_err().to_string();
    assert!(error.contains("an observer if, and only if, the controller has one"), "{error}");
    let mut without = made((false, true, false));
    assert!(without.set_state(&with).unwrap_err().to_string().contains("learning if, and only if"));
    let mut other = made((false, true, true));
    other.step(1.0.into(), 0.0);
    other.reset(Some(0.0)).unwrap();
    assert_eq!(other.state(), with);
    assert!(other.reset(Some(600.0)).is_err());
    assert_eq!(other.state(), with);
}

/// What went out before, and what the amplifier has now, are known to the observer as they are to the controller.
#[test]
fn the_observer_follows_what_the_controller_is_told() {
    let drives: Vec<f64> = (0..300_u32).map(|k| 200.0 * (0.02 * f64::from(k)).sin()).collect();
    let mut plant = stage().forward(DT).unwrap();
    let mut controller = made((false, true, true));
    controller.follow(&drives).unwrap();
    let mut position = drives.iter().map(|drive| plant.advance(*drive)).last().unwrap();
    assert!((controller.observer().unwrap().peek(f64::NAN) - position).abs() < 1e-12);
    assert!(controller.follow(&[0.0, 1e6]).is_err());
    assert!((controller.observer().unwrap().peek(f64::NAN) - position).abs() < 1e-12);
    controller.start_at(-50.0).unwrap();
    position = plant.advance(-50.0);
    assert!((controller.observer().unwrap().peek(f64::NAN) - position).abs() < 1e-12);
    controller.step(0.0.into(), position);
    assert!(controller.observer().unwrap().disturbance().abs() < 1e-12);
}

/// After a hold nothing is learned until the motion is under way: what it cost is gone after a few periods.
#[test]
fn a_hold_is_not_learned() {
    let reference = |k: u32| 1.5 * (TAU * f64::from(k) / f64::from(PERIOD)).sin();
    let (mut controller, mut plant) = (made((true, true, true)), stage().forward(DT).unwrap());
    let mut position = plant.settle(0.0);
    let mut worst = vec![0.0; 40];
    for k in 0..40 * PERIOD {
        match k {
            2030 => controller.controller_mut().hold(),
            2087 => controller.controller_mut().release(),
            _ => {}
        }
        let now = &mut worst[(k / PERIOD) as usize];
        *now = f64::max(*now, (1.08 * position - reference(k)).abs());
        position = plant.advance(controller.step(reference(k + 6).into(), 1.08 * position));
    }
    assert!(worst[25] < 1.5 * worst[19] && worst[39] < worst[19], "{worst:?}");
}

/// A plan does not outlive a change of the parts.
#[test]
fn a_change_of_the_parts_drops_the_plan() {
    let mut controller = made((false, true, true));
    controller.plan(1.0.into(), 0.5);
    let observer = controller.take_observer().unwrap();
    assert!(!controller.commit());
    controller.plan(1.0.into(), 0.5);
    let mut controller = controller.with_observer(observer).unwrap();
    assert!(!controller.commit());
}
