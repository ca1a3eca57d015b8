//! Smooth weights, and what cross-validation chooses.

use crate::actuators::{decaying_triangle, noise, output, paper_actuator, run, weights};
use hysteresis_core::{Model, Offsets, Ratios};
use hysteresis_identify::{Identification, ModelKind, Options, RatiosModel, Record, Setting, Thresholds, WeightLaw};

fn noisy(rms: f64) -> (Vec<f64>, Vec<f64>) {
    let input = decaying_triangle(3_000, 500.0, 20.0, 0.0);
    let clean = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let noise = noise(input.len(), rms, 7);
    (input, clean.iter().zip(noise).map(|(y, e)| y + e).collect())
}

/// Everything but the weights known.
fn known(smoothness: f64) -> Options {
    Options {
        weights: WeightLaw::Free,
        thresholds: Thresholds::Given((0..20).map(|i| 25.0 * f64::from(i)).collect()),
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(0.0),
        smoothness: Setting::Fixed(smoothness),
        ..Options::default()
    }
}

fn roughness(w: &[f64]) -> f64 {
    w[1..].windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2)).sum()
}

#[test]
fn the_smoother_the_weights_the_larger_the_error() {
    let (input, output) = noisy(0.03);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let found: Vec<_> = [0.0, 1e-3, 1e-1, 1e1, 1e6].map(|s| run(&record, &known(s)).unwrap()).into();
    for pair in found.windows(2) {
        assert!(roughness(weights(&pair[1])) < roughness(weights(&pair[0])));
        assert!(pair[1].fit.rmse > pair[0].fit.rmse);
        assert!(pair[1].kkt_residual < 1e-12, "{}", pair[1].kkt_residual);
        // A law that is known better than the data alone tell it.
        let errors = |found: &Identification| found.standard_errors.weights[3];
        assert!(errors(&pair[1]) < errors(&pair[0]) || errors(&pair[0]).is_nan());
    }
    // In the end the weights lie on a line: the differences of the truth are 5e-6 each.
    assert!(roughness(weights(&found[4])) < 1e-18);
    assert_eq!(found[1].smoothness, 1e-3);
    assert!(found[1].smoothness_validation.is_empty());
}

/// What is penalised is minimised: no other weights are better.
#[test]
fn a_minimum_of_errors_and_roughness_together() {
    let (input, output) = noisy(0.03);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let mean = input.iter().sum::<f64>() / 3_000.0;
    let strength = 1e-2 * input.iter().map(|u| (u - mean).powi(2)).sum::<f64>();
    let objective = |found: &Identification| found.fit.mse * 3_000.0 + strength * roughness(weights(found));
    let best = objective(&run(&record, &known(1e-2)).unwrap());
    for other in [0.0, 0.9e-2, 1.1e-2, 1.0] {
        assert!(objective(&run(&record, &known(other)).unwrap()) > best, "{other}");
    }
}

#[test]
fn the_unit_of_neither_signal_matters() {
    let (input, output) = noisy(0.03);
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &known(1e-2)).unwrap();
    let scaled = |values: &[f64], unit: f64| values.iter().map(|value| value * unit).collect::<Vec<_>>();
    let (u, y) = (scaled(&input, 1e-3), scaled(&output, 1e3));
    let thresholds = Thresholds::Given((0..20).map(|i| 25e-3 * f64::from(i)).collect());
    let other = run(&[Record::new(&u, &y, 0).unwrap()], &Options { thresholds, ..known(1e-2) }).unwrap();
    for (w, v) in weights(&found).iter().zip(weights(&other)) {
        assert!((w * 1e6 - v).abs() < 1e-9 * v.max(1.0), "{w} {v}");
    }
}

#[test]
fn both_families_of_split_weights_are_smooth() {
    let (input, output) = noisy(0.03);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let found = run(&record, &Options { weights: WeightLaw::Split, ..known(1e6) }).unwrap();
    let Model::Modified(model) = &found.model else { panic!("{found:?}") };
    assert!(roughness(model.weights()) < 1e-18 && roughness(model.weights_negative()) < 1e-18);
    assert!(model.is_split() && model.weights()[5] != model.weights_negative()[5]);
    assert!(found.kkt_residual < 1e-12);
}

/// Cross-validation asks for smoother weights where noise hides them.
#[test]
fn smoothness_by_cross_validation() {
    let auto = Options { smoothness: Setting::Fit, ..known(0.0) };
    let chosen = |rms| {
        let (input, output) = noisy(rms);
        run(&[Record::new(&input, &output, 0).unwrap()], &auto).unwrap()
    };
    let (hidden, exact) = (chosen(0.05), chosen(0.0));
    // A little even without noise: what moves in one stretch only, the others cannot tell.
    assert!(exact.smoothness < 1e-4 && hidden.smoothness > 1e-4, "{} {}", exact.smoothness, hidden.smoothness);
    let tried = &hidden.smoothness_validation;
    let best = tried.iter().min_by(|p, q| p.rmse.total_cmp(&q.rmse)).unwrap();
    assert_eq!(best.smoothness, hidden.smoothness);
    assert!(tried[0].smoothness == 0.0 && tried.len() == 10 && tried[0].rmse > best.rmse);
    assert_eq!(best.stretches.len(), 8);
    let mean = best.stretches.iter().sum::<f64>() / 8.0;
    assert!((mean.sqrt() - best.rmse).abs() < 1e-15);
    let (input, output) = noisy(0.05);
    let free = run(&[Record::new(&input, &output, 0).unwrap()], &known(0.0)).unwrap();
    let truth = paper_actuator(Offsets::default());
    let error = |found: &Identification| {
        let pairs = weights(found).iter().zip(truth.weights());
        pairs.map(|(w, want)| (w - want).powi(2)).sum::<f64>()
    };
    assert!(error(&hidden) < 0.2 * error(&free), "{} {}", error(&hidden), error(&free));
}

/// The law that has as few unknowns as the truth needs; and what is wrong by far is not chosen.
#[test]
fn the_law_by_cross_validation() {
    let auto = |weights| Options { weights, ..known(0.0) };
    let (input, output) = noisy(0.015);
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &auto(WeightLaw::Auto)).unwrap();
    assert_eq!(found.weights, WeightLaw::Quadratic);
    let laws: Vec<_> = found.weights_validation.iter().map(|one| one.weights).collect();
    assert_eq!(laws, [WeightLaw::Quadratic, WeightLaw::Free, WeightLaw::Split]);
    // The search starts where the candidate ended: here nothing is searched, so the fit is the same.
    let same = run(&[Record::new(&input, &output, 0).unwrap()], &auto(WeightLaw::Quadratic)).unwrap();
    assert_eq!(found.model, same.model);
    assert!(same.weights_validation.is_empty() && same.weights == WeightLaw::Quadratic);

    let plain = paper_actuator(Offsets::default());
    let below: Vec<f64> = plain.weights().iter().enumerate().map(|(i, w)| if i == 0 { *w } else { 0.5 * w }).collect();
    let mut split = plain.with_negative_weights(&below).unwrap().forward();
    let bent: Vec<f64> = input.iter().map(|u| hysteresis_core::Process::step(&mut split, *u)).collect();
    let measured: Vec<f64> = bent.iter().zip(noise(3_000, 0.015, 5)).map(|(y, e)| y + e).collect();
    let found = run(&[Record::new(&input, &measured, 0).unwrap()], &auto(WeightLaw::Auto)).unwrap();
    assert_eq!(found.weights, WeightLaw::Split);
    let conventional = Options { model: ModelKind::Conventional, ..auto(WeightLaw::Auto) };
    let found = run(&[Record::new(&input, &measured, 0).unwrap()], &conventional).unwrap();
    assert_eq!(found.weights_validation.len(), 2);
}

#[test]
fn operators_at_quantiles_by_cross_validation() {
    let (input, output) = noisy(0.015);
    let options = Options { thresholds: Thresholds::AutoQuantiles, smoothness: Setting::Fit, ..known(0.0) };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    let operators: Vec<_> = found.cross_validation.iter().map(|one| one.operators).collect();
    assert_eq!(operators, [4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80]);
    assert_eq!(found.smoothness_validation.len(), 10);
    assert!(found.smoothness_validation.iter().all(|one| one.operators == weights(&found).len()));
    let given = Options { thresholds: Thresholds::Quantiles(weights(&found).len()), ..options };
    assert_eq!(run(&[Record::new(&input, &output, 0).unwrap()], &given).unwrap().smoothness, found.smoothness);
}
