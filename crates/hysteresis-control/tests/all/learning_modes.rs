//! Learning where modes are lightly damped, and of motions on demand.

use hysteresis_control::filters::{Notch, sections};
use hysteresis_control::learning::{
    FeedbackLoop, IterativeLearning, LearningOptions, RepetitiveControl, RepetitiveOptions,
};
use hysteresis_control::linear::{Block, LinearDynamics, SecondOrder};
use hysteresis_core::{Filter, Process, Sections};

const DT: f64 = 1e-4;

/// A loop without feedback.
fn open(dynamics: SecondOrder) -> FeedbackLoop {
    FeedbackLoop { kp: 0.0, ki: 0.0, filters: Sections::default(), slope: 1.0, dynamics: dynamics.into(), dt: DT }
}

/// Well damped.
fn a1() -> SecondOrder {
    SecondOrder::new(400.0, 0.95).unwrap()
}

/// A mode of damping 0.02 that is 4 % higher than believed, and damped half as much, behind a notch where it is
/// believed. Errors reach up to it.
#[test]
fn a_lightly_damped_mode_that_is_elsewhere_is_learned() {
    let dynamics = |frequency, damping| LinearDynamics::from(SecondOrder::new(frequency, damping).unwrap());
    let filters = sections(&[Notch::new(800.0, 0.0, 1.5).unwrap().into()], DT).unwrap();
    let believed = FeedbackLoop { kp: 0.1, ki: 800.0, filters, slope: 0.7, dynamics: dynamics(800.0, 0.02), dt: DT };
    let actual = FeedbackLoop { dynamics: dynamics(832.0, 0.01), ..believed.clone() };
    let response = actual.impulse_response(1000).unwrap();
    let disturbance = |k: usize| {
        [1.0, 31.0, 60.0, 83.0]
            .map(|j| (core::f64::consts::TAU * j * f64::from(u32::try_from(k).unwrap()) / 1000.0).sin())
    };
    let run = |target: &[f64]| -> Vec<f64> {
        let output = |k: usize| (0..1000).map(|j| response[j] * target[(k + 1000 - j) % 1000]).sum::<f64>();
        (0..1000).map(|k| 0.05 * disturbance(k).iter().sum::<f64>() - output(k)).collect()
    };
    let mut learning = IterativeLearning::new(&believed, &[0.0; 1000], &LearningOptions::default()).unwrap();
    for _ in 0..10 {
        let error = run(learning.target());
        learning.update(&error).unwrap();
    }
    let rmse: Vec<f64> = learning.trials().iter().map(|trial| trial.rmse).collect();
    assert!(rmse[9] < 0.02 * rmse[0], "{rmse:?}");
}

/// A disturbance that comes while learning is under way: what was best is no longer, so learning begins again from
/// there.
#[test]
fn learning_goes_on_when_something_changes_before_it_has_finished() {
    let response = open(a1()).impulse_response(400).unwrap();
    let wave = |j: u32| {
        move |k: usize| {
            0.1 * (core::f64::consts::TAU * f64::from(j) * f64::from(u32::try_from(k).unwrap()) / 400.0).sin()
        }
    };
    let run = |target: &[f64], changed: bool| -> Vec<f64> {
        let output = |k: usize| (0..400).map(|j| response[j] * target[(k + 400 - j) % 400]).sum::<f64>();
        (0..400).map(|k| wave(2)(k) + if changed { 3.0 * wave(5)(k) } else { 0.0 } - output(k)).collect()
    };
    let mut learning = IterativeLearning::new(&open(a1()), &[0.0; 400], &LearningOptions::default()).unwrap();
    for period in 0..20 {
        let error = run(learning.target(), period >= 4);
        learning.update(&error).unwrap();
    }
    let rmse: Vec<f64> = learning.trials().iter().map(|trial| trial.rmse).collect();
    assert!(rmse[4] > 100.0 * rmse[3] && rmse[19] < 0.01 * rmse[4], "{rmse:?}");
}

/// From rest to rest on demand: what comes after the motion is no part of it.
#[test]
fn a_motion_on_demand_is_learned() {
    let options = LearningOptions { on_demand: true, ..LearningOptions::default() };
    let base: Vec<f64> = (0..400_i32).map(|k| if (60..250).contains(&k) { 1.0 } else { 0.0 }).collect();
    let smooth: Vec<f64> =
        (0..400).map(|k| base[k.max(20) - 20..(k + 20).min(400)].iter().sum::<f64>() / 40.0).collect();
    let mut learning = IterativeLearning::new(&open(a1()), &smooth, &options).unwrap();
    for _ in 0..8 {
        let (mut plant, mut position) = (a1().block(DT).unwrap(), 0.0);
        let mut error = Vec::new();
        for (target, reference) in learning.target().iter().zip(&smooth) {
            error.push(reference - position);
            position = plant.advance(*target);
        }
        learning.update(&error).unwrap();
    }
    let rmse: Vec<f64> = learning.trials().iter().map(|trial| trial.rmse).collect();
    assert!(rmse[7] < 0.01 * rmse[0], "{rmse:?}");
}

/// What is corrected where a motion rests at its ends would be cut off there, and ring after it: it comes and goes
/// smoothly. Without that the last correction is a hundredth of the motion and grows, and the lightly damped mode rings
/// on by 0.013.
#[test]
fn on_demand_nothing_rings_on_after_the_motion() {
    let dynamics = |frequency, damping| LinearDynamics::from(SecondOrder::new(frequency, damping).unwrap());
    let filters = sections(&[Notch::new(800.0, 0.0, 1.5).unwrap().into()], DT).unwrap();
    let believed = FeedbackLoop { kp: 0.1, ki: 600.0, filters, slope: 0.9, dynamics: dynamics(800.0, 0.02), dt: DT };
    let base: Vec<f64> = (0..400_i32).map(|k| if (60..250).contains(&k) { 1.0 } else { 0.0 }).collect();
    let mean = |base: &[f64], k: usize| base[k.max(20) - 20..(k + 20).min(400)].iter().sum::<f64>() / 40.0;
    let once: Vec<f64> = (0..400).map(|k| mean(&base, k)).collect();
    let reference: Vec<f64> = (0..400).map(|k| mean(&once, k)).collect();
    let run = |target: &[f64]| -> Vec<f64> {
        let mut plant = dynamics(815.0, 0.015).block(DT).unwrap();
        let (mut filter, mut position, mut sum) = (Filter::new(filters.as_slice()).unwrap(), 0.0, 0.0);
        let at = |samples: &[f64], k: usize| samples.get(k).copied().unwrap_or_default();
        let step = |k: usize| {
            let wave =
                if (40..360).contains(&k) { (0.05 * f64::from(u32::try_from(k - 40).unwrap())).sin() } else { 0.0 };
            let error = at(&reference, k) - position - 0.02 * wave * wave;
            let filtered = filter.step(error);
            sum += believed.ki * DT * filtered;
            position = plant.advance(at(target, k) + believed.slope * (believed.kp * filtered + sum));
            error
        };
        (0..800).map(step).collect()
    };
    let largest = |samples: &[f64]| samples.iter().fold(0.0_f64, |max, sample| max.max(sample.abs()));
    let options = LearningOptions { on_demand: true, ..LearningOptions::default() };
    let mut learning = IterativeLearning::new(&believed, &reference, &options).unwrap();
    let first = run(learning.target());
    for _ in 0..6 {
        let error = run(learning.target());
        learning.update(&error[..400]).unwrap();
    }
    let correction: Vec<f64> = learning.correction().collect();
    assert_eq!((correction[0], correction[399]), (0.0, 0.0));
    assert!(largest(&correction[..3]) < 1e-3 && largest(&correction[397..]) < 1e-3);
    let last = run(learning.target());
    assert!(largest(&last[..400]) < 0.2 * largest(&first[..400]), "{} {}", largest(&first), largest(&last[..400]));
    assert!(largest(&last[400..]) < 3e-3, "{}", largest(&last[400..]));
}

/// Without a bandwidth it is as wide as every loop allows that the true one may be.
#[test]
fn repetitive_control_finds_its_bandwidth() {
    let found = RepetitiveControl::new(&open(a1()), 500, &RepetitiveOptions::default()).unwrap();
    assert!(found.bandwidth() > 150.0, "{}", found.bandwidth());
    let filters = sections(&[Notch::new(800.0, 0.0, 2.2).unwrap().into()], DT).unwrap();
    let light = FeedbackLoop { kp: 0.2, ki: 900.0, filters, ..open(SecondOrder::new(800.0, 0.02).unwrap()) };
    let members = [(760.0, 0.01), (760.0, 0.04), (800.0, 0.01), (840.0, 0.04)].map(|(frequency, damping)| {
        let dynamics = SecondOrder::new(frequency, damping).unwrap().into();
        FeedbackLoop { dynamics, ..light.clone() }
    });
    let found = RepetitiveControl::new(&light, 1000, &RepetitiveOptions::default()).unwrap();
    assert!(found.bandwidth() > 800.0, "behind its notch beyond the mode: {}", found.bandwidth());
    assert!(members.iter().all(|member| found.convergence_rate(member).unwrap() < 1.0));
    let wider = RepetitiveOptions::new(2.0 * found.bandwidth());
    let wider = RepetitiveControl::new(&light, 1000, &wider).unwrap();
    assert!(members.iter().any(|member| wider.convergence_rate(member).unwrap() > 1.0));
}

/// A proportional gain below 0 damps, but only behind filters; nothing else may be below 0.
#[test]
fn what_a_loop_must_not_have_below_0_is_named() {
    let plain = open(a1());
    let filters = sections(&[Notch::new(800.0, 0.0, 1.5).unwrap().into()], DT).unwrap();
    let filtered = FeedbackLoop { filters, ..plain.clone() };
    assert!(FeedbackLoop { kp: -0.1, ..filtered.clone() }.impulse_response(1000).is_ok());
    for (feedback, parameter) in [
        (FeedbackLoop { kp: -0.1, ..plain.clone() }, "kp"),
        (FeedbackLoop { ki: -0.1, ..plain.clone() }, "ki"),
        (FeedbackLoop { slope: -0.1, ..plain.clone() }, "slope"),
        (FeedbackLoop { ki: -0.1, ..filtered.clone() }, "ki"),
        (FeedbackLoop { slope: -0.1, ..filtered.clone() }, "slope"),
    ] {
        let refused = feedback.impulse_response(1000).unwrap_err().to_string();
        assert_eq!(refused, format!("{parameter}: expected a finite number >= 0 (at most 1e100), got -0.1"));
    }
    for (feedback, parameter) in [
        (FeedbackLoop { kp: f64::INFINITY, ..filtered.clone() }, "kp"),
        (FeedbackLoop { ki: f64::NAN, ..plain.clone() }, "ki"),
        (FeedbackLoop { slope: 1e200, ..plain }, "slope"),
    ] {
        assert_eq!(feedback.impulse_response(1000).unwrap_err().parameter(), Some(parameter));
    }
}
