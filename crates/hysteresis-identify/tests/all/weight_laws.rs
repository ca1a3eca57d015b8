//! Weight laws, thresholds, cross-validation, held-out records.

use crate::actuators::{decaying_triangle, noise, output, paper_actuator, run, samples, weights};
use hysteresis_core::{CoupledPlay, Model, ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    Error, Identification, MapModel, ModelKind, Options, RatiosModel, Record, Setting, Thresholds, WeightLaw,
};

fn given() -> Thresholds {
    Thresholds::Given((0..20).map(|i| 25.0 * f64::from(i)).collect())
}

fn noisy(samples: u32, rms: f64) -> (Vec<f64>, Vec<f64>) {
    let input = decaying_triangle(samples, 500.0, 20.0, 0.0);
    let clean = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let noise = noise(input.len(), rms, 7);
    (input, clean.iter().zip(noise).map(|(y, e)| y + e).collect())
}

/// Everything but the weights known.
fn known() -> Options {
    Options {
        thresholds: given(),
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(0.0),
        input_map: MapModel::None,
        output_map: MapModel::None,
        ..Options::default()
    }
}

#[test]
fn quadratic_weights_follow_four_numbers_and_come_back() {
    let (input, output) = noisy(4_000, 0.0);
    let options = Options { thresholds: given(), weights: WeightLaw::Quadratic, ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    for (got, want) in [(found.ratios.ra, 0.95), (found.ratios.rb, 0.30), (found.ratios.rc, 0.35)] {
        assert!((got - want).abs() < 1e-6, "{:?}", found.ratios);
    }
    let w = weights(&found);
    for (got, want) in w.iter().zip(paper_actuator(Offsets::default()).weights()) {
        assert!((got - want).abs() < 1e-6 * want, "{got} instead of {want}");
    }
    // The third differences of a quadratic vanish: rounding of numbers near 4e-4.
    for i in 1..17 {
        assert!((w[i + 3] - 3.0 * w[i + 2] + 3.0 * w[i + 1] - w[i]).abs() < 1e-17, "{i}");
    }
}

/// Weights that no quadratic without a negative value follows end on the boundary of those that are possible.
#[test]
fn quadratic_weights_stay_above_zero() {
    let input = decaying_triangle(3_000, 500.0, 12.0, 0.0);
    let r: Vec<f64> = (0..20).map(|i| 25.0 * f64::from(i)).collect();
    let w: Vec<f64> = (0..20).map(|i| if i < 3 { 1.0 } else { 0.0 }).collect();
    let actuator = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, Offsets::default()).unwrap();
    let output = output(&actuator, &input, 0.0);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let found = run(&record, &Options { weights: WeightLaw::Quadratic, ..known() }).unwrap();
    let least = weights(&found).iter().copied().fold(f64::INFINITY, f64::min);
    assert!((0.0..1e-12).contains(&least), "{:?}", weights(&found));
    assert!(found.kkt_residual < 1e-12, "{}", found.kkt_residual);
    // Free weights can do all that quadratic ones can.
    assert!(run(&record, &known()).unwrap().fit.rmse < found.fit.rmse);
}

#[test]
fn split_weights_come_back() {
    let plain = paper_actuator(Offsets { input: -20.0, output: 0.0 });
    let below: Vec<f64> =
        plain.weights().iter().enumerate().map(|(i, w)| if i == 0 { *w } else { 0.5 * w + 1e-5 }).collect();
    let actuator = plain.with_negative_weights(&below).unwrap();
    let input = decaying_triangle(6_000, 500.0, 20.0, 0.0);
    let mut stream = actuator.forward();
    let output: Vec<f64> = input.iter().map(|u| hysteresis_core::Process::step(&mut stream, *u)).collect();
    let record = [Record::new(&input, &output, 0).unwrap()];
    let options = Options { thresholds: given(), weights: WeightLaw::Split, ..Options::default() };
    let found = run(&record, &options).unwrap();
    let Model::Modified(model) = &found.model else { panic!("{found:?}") };
    assert!(model.is_split() && found.check_invertible().is_ok());
    let pairs = model.weights().iter().zip(actuator.weights());
    for (got, want) in pairs.chain(model.weights_negative().iter().zip(&below)) {
        assert!((got - want).abs() < 1e-4 * want, "{got} instead of {want}");
    }
    assert!(found.fit.rmse < 1e-9 * found.fit.range && found.kkt_residual < 1e-12);
    assert_eq!(found.standard_errors.weights_negative.len(), 20);
    let prediction = found.predict(&input).unwrap();
    assert!(prediction.iter().zip(&output).all(|(p, y)| (p - y).abs() < 1e-8));
    // One weight for both sides cannot.
    assert!(run(&record, &Options { weights: WeightLaw::Free, ..options }).unwrap().fit.rmse > 1e-3);
}

#[test]
fn the_conventional_model_has_no_split() {
    let (input, output) = noisy(500, 0.0);
    let options = Options { model: ModelKind::Conventional, weights: WeightLaw::Split, ..Options::default() };
    let error = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap_err();
    assert_eq!(error, Error::SplitConventional);
}

fn thresholds(found: &Identification) -> Vec<f64> {
    let Model::Modified(model) = &found.model else { panic!("{found:?}") };
    model.operators().iter().map(CoupledPlay::r).collect()
}

#[test]
fn quantiles_lie_where_the_input_turns_round() {
    // Reversals at +-1 and +-4 about an offset of 10, over and over: knots 0, 1, 4 and the reach, 6.
    let course = [10.0, 11.0, 9.0, 14.0, 6.0, 11.0, 9.0, 16.0, 10.0];
    let input: Vec<f64> = course
        .windows(2)
        .flat_map(|ends| (0..50).map(move |k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / 50.0))
        .collect();
    let output: Vec<f64> = input.iter().map(|u| 2.0 * u).collect();
    let options = Options {
        thresholds: Thresholds::Quantiles(6),
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(10.0),
        dead_time: Setting::Fixed(0.0),
        ..Options::default()
    };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    for (got, want) in thresholds(&found).iter().zip([0.0, 0.5, 1.0, 2.5, 4.0, 5.0]) {
        assert!((got - want).abs() < 1e-12, "{:?}", thresholds(&found));
    }
}

#[test]
fn cross_validation_chooses_few_operators_for_few() {
    let input = decaying_triangle(4_000, 500.0, 16.0, 0.0);
    // Where four uniform thresholds lie: 2 V beside them would be told from the noise.
    let reach = input.iter().fold(0.0_f64, |reach, u| reach.max(u.abs()));
    let r = [0.0, 0.25 * reach, 0.5 * reach, 0.75 * reach];
    let actuator =
        ModifiedPrandtlIshlinskii::from_ratios(&[4e-3, 1e-3, 5e-4, 5e-4], &r, Ratios::PAPER, Offsets::default())
            .unwrap();
    let output: Vec<f64> =
        output(&actuator, &input, 0.0).iter().zip(noise(4_000, 0.01, 3)).map(|(y, e)| y + e).collect();
    let options = Options { thresholds: Thresholds::Auto, dead_time: Setting::Fixed(0.0), ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    assert_eq!(thresholds(&found).len(), 4, "{:?}", found.cross_validation);
    let operators: Vec<_> = found.cross_validation.iter().map(|one| one.operators).collect();
    assert_eq!(operators, [4, 6, 8, 12, 16, 20, 24, 32, 40, 48, 64, 80]);
    // What is predicted from other stretches errs by the noise, and a little for the weights.
    assert!(found.cross_validation.iter().all(|one| one.rmse > 0.0095 && one.rmse < 0.02), "{found:?}");
    assert!(found.cross_validation[0].rmse < 0.0105);
}

#[test]
fn held_out_records_are_judged_with_an_offset() {
    let (input, output) = noisy(4_000, 0.01);
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &known()).unwrap();
    let other = decaying_triangle(3_000, 300.0, 7.0, 40.0);
    let measured: Vec<f64> = crate::actuators::output(&paper_actuator(Offsets::default()), &other, 0.0)
        .iter()
        .zip(noise(3_000, 0.01, 9))
        .map(|(y, e)| 5.0 + y + e)
        .collect();
    let record = Record::new(&other, &measured, 100).unwrap();
    let own = found.validate(&record, None);
    assert!(own.rmse > 0.0095 && own.rmse < 0.0105 && own.samples == 2_900, "{own:?}");
    let given = found.validate(&record, Some(found.output_offsets[0]));
    assert!((given.rmse - 5.0).abs() < 0.01, "{given:?}");
    // The fitted record itself, with its own offset: the quality of the fit.
    let again = found.validate(&Record::new(&input, &output, 0).unwrap(), Some(found.output_offsets[0]));
    assert!((again.rmse - found.fit.rmse).abs() < 1e-12);
}

#[test]
fn standard_errors_of_what_is_linear_are_those_of_regression() {
    // Two operators and an offset by hand: s^2 (J'J)^-1 from the normal equations.
    let input = noisy(2_000, 0.01).0;
    let true_model =
        ModifiedPrandtlIshlinskii::from_ratios(&[0.01, 0.004], &[0.0, 100.0], Ratios::PAPER, Offsets::default());
    let mut output = crate::actuators::output(&true_model.unwrap(), &input, 0.0);
    output.iter_mut().zip(crate::actuators::noise(2_000, 0.01, 5)).for_each(|(y, e)| *y += e);
    let thresholds = Thresholds::Given(vec![0.0, 100.0]);
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &Options { thresholds, ..known() }).unwrap();
    let one = |weights: [f64; 2]| {
        let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 100.0], Ratios::PAPER, Offsets::default());
        let column = crate::actuators::output(&model.unwrap(), &input, 0.0);
        let mean = column.iter().sum::<f64>() / 2_000.0;
        column.into_iter().map(move |z| z - mean).collect::<Vec<_>>()
    };
    let (p, q) = (one([1.0, 0.0]), one([0.0, 1.0]));
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (pp, qq, pq) = (dot(&p, &p), dot(&q, &q), dot(&p, &q));
    let variance = found.fit.mse * 2_000.0 / (2_000.0 - 3.0);
    let expected = [qq, pp].map(|e| (variance * e / (pp * qq - pq * pq)).sqrt());
    for (got, want) in found.standard_errors.weights.iter().zip(expected) {
        assert!((got / want - 1.0).abs() < 1e-8, "{got} instead of {want}");
    }
    // What was given has none.
    let errors = &found.standard_errors;
    assert_eq!((errors.ratios, errors.input_offset, errors.dead_time), ([0.0; 3], 0.0, 0.0));
}

#[test]
fn what_lies_at_a_bound_has_no_standard_error() {
    let (input, output) = noisy(2_000, 0.01);
    // No lag: half of all noises put the estimate at zero; this one does. And an operator that never moves.
    let thresholds = Thresholds::Given(vec![0.0, 100.0, 2_000.0]);
    let options = Options { thresholds, ratios: RatiosModel::Fixed(Ratios::PLAY), ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    assert_eq!(weights(&found)[2], 0.0);
    assert!(found.standard_errors.weights[2].is_nan());
    assert!(found.standard_errors.weights[0] > 0.0);
    assert_eq!(found.standard_errors.dead_time.is_nan(), samples(&found) == 0.0, "{found:?}");
}
