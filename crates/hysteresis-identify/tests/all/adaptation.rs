//! Recursive identification beside a controller: dynamics between the hysteresis and the sensor, split models, and a
//! model that is swapped while the loop runs.

use core::f64::consts::TAU;

use hysteresis_control::linear::{Block, FirstOrder, LinearDynamics, SecondOrder};
use hysteresis_core::{CompiledModel, Model, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
use hysteresis_identify::{RecursiveIdentifier, RecursiveOptions};
use hysteresis_simulate::paper;

const DT: f64 = 1e-4;

fn a1() -> LinearDynamics {
    SecondOrder::new(400.0, 0.95).unwrap().into()
}

/// The recovered model with its weights times `factor`, those below zero times `below`.
fn weighted(factor: impl Fn(usize) -> f64, below: impl Fn(usize) -> f64) -> ModifiedPrandtlIshlinskii {
    let recovered = paper::table_1_recovered();
    let times = |factor: &dyn Fn(usize) -> f64| -> Vec<f64> {
        recovered.weights().iter().enumerate().map(|(i, w)| w * factor(i)).collect()
    };
    let r: Vec<f64> = recovered.operators().iter().map(hysteresis_core::CoupledPlay::r).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&times(&factor), &r, Ratios::PAPER, Offsets::default())
        .and_then(|model| model.with_negative_weights(&times(&below)))
        .unwrap()
}

fn identifier(model: &ModifiedPrandtlIshlinskii, options: &RecursiveOptions) -> RecursiveIdentifier {
    RecursiveIdentifier::new(&model.clone().into(), options).unwrap()
}

/// Swings over the whole range that decay and grow again.
fn swings(samples: u32) -> impl Iterator<Item = f64> {
    (0..samples).map(|k| 500.0 * (0.02 * f64::from(k)).sin() * (0.55 + 0.45 * (0.00071 * f64::from(k)).cos()))
}

/// White noise of about normal distribution and unit variance.
fn noise(random: &mut fastrand::Rng) -> f64 {
    (0..12).map(|_| random.f64()).sum::<f64>() - 6.0
}

fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    one.iter().zip(other).fold(0.0, |largest, (a, b)| largest.max((a - b).abs()))
}

fn modified(model: Model) -> ModifiedPrandtlIshlinskii {
    match model {
        Model::Modified(model) => model,
        Model::Conventional(_) => unreachable!("the given model is a modified one"),
    }
}

/// The weights are exact behind dynamics that are known; unknown ones would leave them off by more than a tenth of w_1.
#[test]
fn dynamics_behind_the_hysteresis_cost_no_accuracy() {
    for dynamics in [a1().with_dead_time(1.4 * DT).unwrap(), FirstOrder::new(279.0).unwrap().into()] {
        let truth = paper::table_1_recovered();
        let error = |given: Option<LinearDynamics>| {
            let options = RecursiveOptions { dynamics: given.map(|given| (given, DT)), ..RecursiveOptions::default() };
            let mut identifier = identifier(&paper::table_1(), &options);
            let (mut stream, mut lag) = (truth.forward(), dynamics.block(DT).unwrap());
            for u in swings(20_000) {
                identifier.update(u, lag.step(stream.step(u)));
            }
            largest_difference(modified(identifier.model()).weights(), truth.weights())
        };
        // 1e-12 of prior information, and the rounding of 20 000 updates.
        assert!(error(Some(dynamics.clone())) < 1e-9);
        assert!(error(None) > 3e-5);
    }
}

/// Weights of their own below zero, the identity shared or not.
#[test]
fn split_models_are_followed() {
    for identity in [1.0, 1.3] {
        let truth =
            weighted(|_| 1.0, |i| if i == 0 { identity } else { 0.6 + 0.05 * f64::from(u8::try_from(i).unwrap()) });
        let given = weighted(|_| 1.1, |i| if i == 0 { identity * 1.1 } else { 0.9 });
        let mut identifier = identifier(&given, &RecursiveOptions::default());
        assert_eq!(identifier.weights().len(), if identity == 1.0 { 39 } else { 40 });
        assert_eq!(identifier.model(), Model::from(given));
        let mut stream = truth.forward();
        for u in swings(20_000) {
            identifier.update(u, stream.step(u) + 0.7);
        }
        let found = modified(identifier.model());
        assert!(largest_difference(found.weights(), truth.weights()) < 1e-9);
        assert!(largest_difference(found.weights_negative(), truth.weights_negative()) < 1e-9);
        assert!((found.offsets().output - 0.7).abs() < 1e-9);
    }
}

#[test]
fn a_split_identifier_behind_dynamics_continues_bit_for_bit() {
    let given = weighted(|_| 1.1, |_| 0.9);
    let options = RecursiveOptions { forgetting: 0.999, dynamics: Some((a1(), DT)), ..RecursiveOptions::default() };
    let mut first = identifier(&given, &options);
    let mut second = identifier(&given, &options);
    let mut stream = paper::table_1_recovered().forward();
    for (k, u) in swings(3000).enumerate() {
        first.update(u, stream.step(u));
        if k == 1500 {
            second.set_state(&first.state()).unwrap();
        } else if k > 1500 {
            second.update(u, stream.peek(u));
        }
    }
    assert_eq!(first.state(), second.state());
    let mut short = first.state();
    short.lags.pop();
    assert!(second.set_state(&short).is_err());
    assert_eq!(first.state(), second.state());
}

/// A1 at 20 Hz and 3.3 um, 16 nm of noise, a model that is wrong by 0.75 % of the range: the model follows the actuator
/// beside the controller and is swapped into its inverse ten times a second. The true position comes down to the noise.
#[test]
fn a_controller_whose_model_follows_the_actuator_comes_down_to_the_noise() {
    let wrong =
        weighted(|i| if i == 0 { 1.0 } else { [1.5, 0.5][i % 2] }, |i| if i == 0 { 1.0 } else { [1.5, 0.5][i % 2] });
    let run = |adapt: bool| {
        let mut random = fastrand::Rng::with_seed(5);
        let options =
            RecursiveOptions { forgetting: 0.9999, dynamics: Some((a1(), DT)), ..RecursiveOptions::default() };
        let mut identifier = identifier(&wrong, &options);
        let mut inverse = wrong.inverse(Some((-560.0, 560.0))).unwrap();
        let (mut actuator, mut lag) = (paper::table_1_recovered().forward(), a1().block(DT).unwrap());
        let (mut position, mut integral, mut worst) = (0.0, 0.0, 0.0_f64);
        for k in 0..35_000 {
            let wt = TAU * 20.0 * DT * f64::from(k);
            let (sin, cos) = (wt + TAU * 20.0 * DT * 0.5).sin_cos();
            let target = 3.3 * (sin * (1.0 - 0.05_f64.powi(2)) + 2.0 * 0.95 * 0.05 * cos);
            let measured = position + 0.016 * noise(&mut random);
            let error = 3.3 * wt.sin() - measured;
            worst = if k < 30_000 { 0.0 } else { worst.max((3.3 * wt.sin() - position).abs()) };
            integral += 0.6 * error;
            let drive = (inverse.step(target) + 60.0 * error + integral).clamp(-560.0, 560.0);
            if adapt {
                identifier.update(drive, measured);
                if k % 1000 == 999 {
                    inverse.set_model(&CompiledModel::new(&modified(identifier.model()))).unwrap();
                }
            }
            position = lag.advance(actuator.step(drive));
        }
        1e3 * worst
    };
    let (adapted, fixed) = (run(true), run(false));
    assert!(fixed > 25.0, "{fixed}");
    assert!(adapted < 12.0, "{adapted}");
}
