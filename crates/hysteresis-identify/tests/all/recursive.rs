//! Recursive identification: equal to least squares, bounded, non-negative, never stopped by a bad sample.

use faer::Mat;
use faer::linalg::solvers::SolveLstsq;
use hysteresis_core::{
    CompiledModel, Forward, Inverse, Model, ModifiedPrandtlIshlinskii, Offsets, Operator, PrandtlIshlinskii, Process,
};
use hysteresis_identify::{Frozen, MIN_IDENTITY_SHARE, RecursiveIdentifier, RecursiveOptions, Setting};
use hysteresis_simulate::paper;
use proptest::prelude::*;

/// The actuator of the paper, and the scale of its thresholds (475 V) as the identifier has it.
fn actuator() -> ModifiedPrandtlIshlinskii {
    paper::table_1_recovered()
}
const SCALE: f64 = 512.0;

/// The same operators, other weights.
fn scaled(factor: impl Fn(usize) -> f64, output: f64) -> ModifiedPrandtlIshlinskii {
    let model = actuator();
    let weights: Vec<f64> = model.weights().iter().enumerate().map(|(i, w)| w * factor(i)).collect();
    let r: Vec<f64> = model.operators().iter().map(hysteresis_core::CoupledPlay::r).collect();
    let offsets = Offsets { input: 0.0, output };
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, hysteresis_core::Ratios::PAPER, offsets).unwrap()
}

fn identifier(model: ModifiedPrandtlIshlinskii, options: &RecursiveOptions) -> RecursiveIdentifier {
    RecursiveIdentifier::new(&model.into(), options).unwrap()
}

fn forgetting(forgetting: f64) -> RecursiveOptions {
    RecursiveOptions { forgetting, ..RecursiveOptions::default() }
}

/// Swings over the whole range that decay and grow again.
fn swings(samples: u32) -> impl Iterator<Item = f64> {
    (0..samples).map(|k| 500.0 * (0.02 * f64::from(k)).sin() * (0.55 + 0.45 * (0.00071 * f64::from(k)).cos()))
}

/// Uniform noise without end, of unit variance.
fn noise() -> impl FnMut() -> f64 {
    let mut state = 1_u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        f64::from(u32::try_from(state >> 33).unwrap()) / f64::from(1_u32 << 31) * 12.0_f64.sqrt() - 3.0_f64.sqrt()
    }
}

/// WeightLaw (and the offset, if `offset`) of least squares over rows that count `weight` each, by the QR of faer.
fn batch(model: &ModifiedPrandtlIshlinskii, record: &[(f64, f64)], counts: &[f64], offset: bool) -> Vec<f64> {
    let n = model.weights().len();
    let mut z = vec![0.0; n];
    let mut rows = Vec::new();
    for (u, _) in record {
        for (z, operator) in z.iter_mut().zip(model.operators()) {
            *z = operator.next(*z, u - model.offsets().input);
        }
        rows.push(z.iter().map(|z| z / SCALE).chain(offset.then_some(1.0)).collect::<Vec<_>>());
    }
    let root = |k: usize| counts[k].sqrt();
    let a = Mat::from_fn(rows.len(), rows[0].len(), |k, j| root(k) * rows[k][j]);
    let b = Mat::from_fn(rows.len(), 1, |k, _| root(k) * record[k].1);
    let x = a.col_piv_qr().solve_lstsq(&b);
    (0..rows[0].len()).map(|j| x[(j, 0)] / if j < n { SCALE } else { 1.0 }).collect()
}

/// The estimate before the projection.
fn estimate(identifier: &RecursiveIdentifier) -> Vec<f64> {
    let n = identifier.weights().len();
    let state = identifier.state();
    let place = |i: usize| state.order.iter().position(|unknown| *unknown == i).unwrap();
    let unit = |i: usize| if i < n { SCALE } else { 1.0 };
    (0..state.estimate.len()).map(|i| state.estimate[place(i)] / unit(i)).collect()
}

/// The largest difference, an output offset counted at the scale of the input.
fn difference(one: &[f64], other: &[f64]) -> f64 {
    assert_eq!(one.len(), other.len());
    let unit = |i: usize| if i < 20 { 1.0 } else { 1.0 / SCALE };
    one.iter().zip(other).enumerate().map(|(i, (a, b))| (a - b).abs() * unit(i)).fold(0.0, f64::max)
}

#[test]
fn without_forgetting_it_is_least_squares() {
    let plant = scaled(|_| 1.0, 0.7);
    for (held, offset) in [(Setting::Fit, 0.0), (Setting::Fixed(0.7), 0.7)] {
        let mut random = noise();
        let mut stream = plant.forward();
        let record: Vec<(f64, f64)> = swings(20_000).map(|u| (u, stream.step(u) + 0.016 * random())).collect();
        let options = RecursiveOptions { output_offset: held, ..forgetting(1.0) };
        let mut identifier = identifier(paper::table_1(), &options);
        for (u, y) in &record {
            identifier.update(*u, *y);
            assert_eq!(identifier.frozen(), None);
        }
        let shifted: Vec<_> = record.iter().map(|(u, y)| (*u, y - offset)).collect();
        let expected = batch(&plant, &shifted, &vec![1.0; record.len()], held == Setting::Fit);
        // The weights are 3e-4 to 4e-3 um/V and the given ones up to 3e-5 off, which count as 1e-12 of a sample; the
        // rest is rounding, 1e-16 of the largest times the condition of the problem, about 1e3.
        let largest = difference(&estimate(&identifier), &expected);
        assert!(largest < 1e-13, "{largest}");
        // The noise matters: far more than that tolerance.
        assert!(difference(&expected[..20], plant.weights()) > 1e-6);
    }
}

#[test]
fn with_forgetting_it_is_weighted_least_squares_over_the_samples_taken() {
    let lambda: f64 = 0.999;
    let mut random = noise();
    let mut stream = actuator().forward();
    let options = RecursiveOptions { covariance_limit: 1e30, ..forgetting(lambda) };
    let mut identifier = identifier(paper::table_1(), &options);
    let (mut record, mut taken) = (Vec::new(), Vec::new());
    for u in swings(8000) {
        let y = stream.step(u) + 0.016 * random();
        identifier.update(u, y);
        record.push((u, y));
        taken.push(identifier.frozen().is_none());
    }
    let mut count = 1.0;
    let mut counts = vec![0.0; taken.len()];
    for k in (0..taken.len()).rev() {
        if taken[k] {
            counts[k] = count;
            count *= lambda;
        }
    }
    assert!(taken.iter().filter(|taken| **taken).count() > 7000);
    let expected = batch(&actuator(), &record, &counts, true);
    // As without forgetting.
    let largest = difference(&estimate(&identifier), &expected);
    assert!(largest < 1e-13, "{largest}");
}

#[test]
fn the_error_is_that_of_the_model_before() {
    let mut identifier = identifier(paper::table_1(), &forgetting(0.99));
    let (mut plant, mut random) = (scaled(|i| if i % 3 == 0 { 0.2 } else { 1.2 }, 0.3).forward(), noise());
    let mut memory = Forward::new(&compiled(&identifier.model()));
    for u in swings(3000) {
        memory.set_model(&compiled(&identifier.model())).unwrap();
        let y = plant.step(u) + 0.05 * random();
        let expected = y - memory.step(u);
        let error = identifier.update(u, y);
        // Sums of numbers of about 10 um, in another order.
        assert!((error - expected).abs() < 1e-13, "{error} is not {expected}");
    }
}

fn compiled(model: &Model) -> CompiledModel {
    match model {
        Model::Conventional(model) => CompiledModel::new(&model.into()),
        Model::Modified(model) => CompiledModel::new(model),
    }
}

#[test]
fn a_changed_actuator_is_followed() {
    let mut identifier = identifier(actuator(), &forgetting(0.999));
    let (old, new) = (actuator(), scaled(|i| if i < 10 { 1.3 } else { 0.8 }, -0.4));
    let (mut before, mut after) = (old.forward(), new.forward());
    for (k, u) in swings(40_000).enumerate() {
        let (one, other) = (before.step(u), after.step(u));
        identifier.update(u, if k < 10_000 { one } else { other });
    }
    for (w, expected) in identifier.weights().zip(new.weights()) {
        // 30 memory lengths after the change, e^-30 of it is left; the bound of the covariance slows weak directions.
        assert!((w - expected).abs() < 1e-9, "{w} is not {expected}");
    }
    assert!((identifier.output_offset() + 0.4).abs() < 1e-9);
}

#[test]
fn at_standstill_it_freezes_by_name_and_wakes() {
    let mut identifier = identifier(paper::table_1(), &forgetting(0.999));
    let (mut plant, mut random) = (actuator().forward(), noise());
    let mut last = 0.0;
    for u in swings(10_000) {
        last = u;
        identifier.update(u, plant.step(u) + 0.016 * random());
    }
    // Two memory lengths suffice from any state.
    for _ in 0..2000 {
        identifier.update(last, plant.step(last) + 0.016 * random());
    }
    assert_eq!(identifier.frozen(), Some(Frozen::PoorExcitation));
    let frozen = identifier.state();
    for _ in 0..100_000 {
        // Creep that the model does not know.
        assert!((identifier.update(last, plant.step(last) + 0.5) - 0.5).abs() < 0.1);
        assert_eq!(identifier.frozen(), Some(Frozen::PoorExcitation));
    }
    assert_eq!(identifier.state().estimate, frozen.estimate);
    assert_eq!((&identifier.state().upper, &identifier.state().diagonal), (&frozen.upper, &frozen.diagonal));
    identifier.update(last - 100.0, plant.step(last - 100.0));
    assert_eq!(identifier.frozen(), None);
}

#[test]
fn without_forgetting_nothing_is_lost_at_standstill() {
    let mut identifier = identifier(paper::table_1(), &forgetting(1.0));
    for _ in 0..10_000 {
        identifier.update(100.0, 0.4);
        assert_eq!(identifier.frozen(), None);
    }
}

#[test]
fn the_covariance_stays_bounded_whatever_is_excited() {
    let lambda: f64 = 0.99;
    let limit = 100.0;
    let options = RecursiveOptions { covariance: limit, covariance_limit: limit, ..forgetting(lambda) };
    let mut identifier = identifier(actuator(), &options);
    let mut random = noise();
    // A limit cycle of a few volts around an operating point: enough news not to freeze, of few directions.
    let mut unfrozen = 0;
    for k in 0..200_000_u32 {
        let u = 200.0 + 8.0 * (0.3 * f64::from(k)).sin() + 3.0 * random();
        identifier.update(u, 0.01 * u + 0.05 * random());
        unfrozen += u32::from(identifier.frozen().is_none());
    }
    assert!(unfrozen > 50_000, "{unfrozen}");
    let covariance = identifier.covariance();
    let m = identifier.unknowns();
    let unit = |i: usize| if i < 20 { SCALE } else { 1.0 };
    let p = Mat::from_fn(m, m, |i, j| covariance[i * m + j] * unit(i) * unit(j));
    let eigenvalues = p.self_adjoint_eigenvalues(faer::Side::Lower).unwrap();
    let bound = limit / lambda.powi(i32::try_from(m).unwrap());
    assert!(eigenvalues.iter().all(|e| *e > 0.0 && *e <= bound * (1.0 + 1e-9)), "{eigenvalues:?}, {bound}");
    // Without the bound, 1 / 0.99 a sample would long have overflowed; what is not excited is at the limit.
    assert!(eigenvalues.iter().any(|e| *e > 0.5 * limit));
}

#[test]
fn samples_that_are_not_finite_hold_the_model_and_are_counted() {
    let mut identifier = identifier(paper::table_1(), &forgetting(0.999));
    let mut plant = actuator().forward();
    for u in swings(500) {
        identifier.update(u, plant.step(u));
    }
    let before = identifier.state();
    for (bad, rejected) in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 1e300].into_iter().zip(1..) {
        assert_eq!(identifier.update(bad, 1.0), before.last_error);
        assert_eq!((identifier.frozen(), identifier.rejected()), (Some(Frozen::NotFinite), rejected));
    }
    let mut after = identifier.state();
    (after.frozen, after.rejected) = (before.frozen, 0);
    assert_eq!(after, before);
    // Without an output the operators still follow the input.
    let mut other = identifier.clone();
    assert_eq!(identifier.update(450.0, f64::NAN), before.last_error);
    assert_eq!((identifier.frozen(), identifier.rejected()), (Some(Frozen::NotFinite), 5));
    let moved = identifier.state();
    assert_eq!((&moved.estimate, &moved.diagonal), (&before.estimate, &before.diagonal));
    assert_eq!(moved.outputs[0], 450.0);
    other.update(450.0, 1.0);
    assert_eq!(moved.outputs, other.state().outputs);
}

#[test]
fn the_largest_and_smallest_numbers_leave_finite_weights() {
    for forgotten in [1.0, 0.9] {
        let mut identifier = identifier(actuator(), &forgetting(forgotten));
        for k in 0..2000_i32 {
            let size = 10.0_f64.powi((k * 37) % 200 - 100);
            identifier.update(if k % 2 == 0 { size } else { -size }, 10.0_f64.powi((k * 61) % 200 - 100));
            assert!(identifier.weights().all(|w| w.is_finite() && w >= 0.0));
            let _ = identifier.model();
        }
    }
}

/// Of a split model both sides count together: one must not outweigh the identity of the other by so much that the
/// model has no inverse.
#[test]
fn a_split_model_is_invertible_whatever_is_measured() {
    let given = actuator();
    let below: Vec<f64> = given.weights().iter().map(|w| 0.9 * w).collect();
    let given = given.with_negative_weights(&below).unwrap();
    for (u, y) in [(500.0, 1e60), (-500.0, -1e60), (500.0, 1e20)] {
        let mut identifier = identifier(given.clone(), &forgetting(1.0));
        for step in [1.0, 1.1, 1.2] {
            identifier.update(u * step, y);
            assert!(Inverse::new(&compiled(&identifier.model()), None).is_ok(), "{u} {y}");
        }
    }
}

/// Beside a controller: the model of every tenth sample goes into the inverse that drives the actuator.
#[test]
fn a_model_that_follows_the_actuator_makes_its_inverse_follow_too() {
    let true_model = scaled(|i| if i % 2 == 0 { 1.25 } else { 0.7 }, 0.2);
    let mut identifier = identifier(actuator(), &forgetting(0.9995));
    let mut inverse = Inverse::new(&CompiledModel::new(&actuator()), Some((-500.0, 500.0))).unwrap();
    let mut plant = true_model.forward();
    let mut errors = Vec::new();
    for k in 0..40_000_u32 {
        let target = 2.5 * (0.01 * f64::from(k)).sin() * (0.6 + 0.4 * (0.00037 * f64::from(k)).cos());
        let drive = inverse.step(target);
        let y = plant.step(drive);
        identifier.update(drive, y);
        errors.push((y - target).abs());
        if k % 10 == 0 {
            inverse.set_model(&compiled(&identifier.model())).unwrap();
            assert_eq!(inverse.peek(f64::NAN), drive);
        }
    }
    let largest = |errors: &[f64]| errors.iter().fold(0.0_f64, |largest, e| largest.max(*e));
    assert!(largest(&errors[..1000]) > 0.1);
    assert!(largest(&errors[30_000..]) < 1e-3, "{}", largest(&errors[30_000..]));
}

#[test]
fn a_state_of_another_identifier_is_refused_and_changes_nothing() {
    let mut identifier = identifier(actuator(), &forgetting(0.999));
    for u in swings(300) {
        identifier.update(u, 0.01 * u);
    }
    let good = identifier.state();
    let mut bad = vec![good.clone(); 8];
    bad[0].outputs.pop();
    bad[1].estimate[3] = f64::NAN;
    bad[2].diagonal[4] = -1.0;
    bad[3].published[5] = -1e-9;
    bad[4].turn = 21;
    bad[5].order[3] = 4;
    bad[6].upper.push(0.0);
    bad[7].published[0] = 0.0;
    for state in bad {
        let error = identifier.set_state(&state).unwrap_err();
        assert!(error.to_string().starts_with("state: expected "), "{error}");
        assert_eq!(identifier.state(), good);
    }
}

proptest! {
    /// The inverse of the model exists at every sample, whatever is measured.
    #[test]
    fn the_model_is_invertible_at_every_sample(
        samples in prop::collection::vec((-600.0..600.0_f64, -5.0..5.0_f64), 1..300),
        lambda in prop_oneof![Just(1.0), 0.5..1.0_f64],
        covariance in prop_oneof![Just(1e12), 1e-3..1e6_f64],
    ) {
        let mut identifier = identifier(actuator(), &RecursiveOptions { covariance, ..forgetting(lambda) });
        let least = MIN_IDENTITY_SHARE * actuator().weights()[0];
        for (u, y) in samples {
            identifier.update(u, y);
            prop_assert!(identifier.weights().next().unwrap() >= least * (1.0 - 1e-15));
            prop_assert!(identifier.weights().all(|w| w >= 0.0));
            prop_assert!(Inverse::new(&compiled(&identifier.model()), None).is_ok());
        }
    }

    #[test]
    fn a_restored_state_continues_bit_for_bit(
        samples in prop::collection::vec((-600.0..600.0_f64, -5.0..5.0_f64), 1..100),
        more in prop::collection::vec((-600.0..600.0_f64, -5.0..5.0_f64), 1..100),
        lambda in prop_oneof![Just(1.0), 0.9..1.0_f64],
    ) {
        let fresh = identifier(actuator(), &forgetting(lambda));
        let mut one = fresh.clone();
        for (u, y) in &samples {
            one.update(*u, *y);
        }
        one.update(f64::NAN, 0.0);
        let mut other = fresh.clone();
        other.set_state(&one.state()).unwrap();
        prop_assert_eq!(other.state(), one.state());
        for (u, y) in &more {
            prop_assert_eq!(one.update(*u, *y).to_bits(), other.update(*u, *y).to_bits());
        }
        prop_assert_eq!(other.state(), one.state());
        one.reset();
        prop_assert_eq!(one.state(), fresh.state());
    }
}

#[test]
fn at_the_start_the_model_is_the_given_one_bit_for_bit() {
    let conventional = PrandtlIshlinskii::new(&[1.1, 0.3, 0.7], &[0.0, 0.3, 77.7], Offsets { input: 1.3, output: 0.1 });
    for model in [Model::from(conventional.unwrap()), Model::from(actuator())] {
        let identifier = RecursiveIdentifier::new(&model, &RecursiveOptions::default()).unwrap();
        assert_eq!(identifier.model(), model);
    }
}
