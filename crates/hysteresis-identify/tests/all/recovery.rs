//! Known models come back from their own output.

use crate::actuators::{decaying_triangle, input_offset, noise, output, paper_actuator, run, samples, weights};
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Ratios};
use hysteresis_identify::{
    Error, Identification, ModelKind, Options, RatiosModel, Record, Setting, Thresholds, WeightLaw,
};

/// The paper's thresholds.
fn given() -> Thresholds {
    Thresholds::Given((0..20).map(|i| 25.0 * f64::from(i)).collect())
}

fn check(found: &Identification, actuator: &ModifiedPrandtlIshlinskii, ratios: Ratios, delay: f64) {
    let got = found.ratios;
    for (name, got, want) in [
        ("ra", got.ra, ratios.ra),
        ("rb", got.rb, ratios.rb),
        ("rc", got.rc, ratios.rc),
        ("input offset", input_offset(found), actuator.offsets().input),
        ("output offset", found.output_offsets[0], actuator.offsets().output),
        ("dead time", samples(found), delay),
    ] {
        assert!((got - want).abs() < 1e-6, "{name}: {got} instead of {want}");
    }
    for (i, (got, want)) in weights(found).iter().zip(actuator.weights()).enumerate() {
        assert!((got - want).abs() < 1e-4 * want, "weight {i}: {got} instead of {want}");
    }
    assert!(found.fit.rmse < 1e-9 * found.fit.range, "{:?}", found.fit);
}

#[test]
fn the_papers_actuator_with_everything_searched() {
    let actuator = paper_actuator(Offsets { input: 12.5, output: -3.0 });
    let input = decaying_triangle(12_000, 500.0, 20.0, 0.0);
    let output = output(&actuator, &input, 2.35);
    let record = Record::new(&input, &output, 0).unwrap();
    let found = run(&[record], &Options { thresholds: given(), ..Options::default() }).unwrap();
    check(&found, &actuator, Ratios::PAPER, 2.35);
    let prediction = found.predict(&input).unwrap();
    assert!(prediction.iter().zip(&output).all(|(p, y)| (p - y).abs() < 1e-9));
}

/// Uniform thresholds reach to the largest |u - offset|, which moves with the offset that is searched.
#[test]
fn a_unipolar_drive_with_uniform_thresholds() {
    let ratios = Ratios { ra: 0.8, rb: 0.5, rc: 0.6 };
    let input = decaying_triangle(6_000, 50.0, 12.0, 60.0);
    let largest = input.iter().copied().fold(0.0, f64::max);
    let smallest = input.iter().copied().fold(f64::INFINITY, f64::min);
    let reach = (largest - 70.0).max(70.0 - smallest);
    let r: Vec<f64> = (0..8).map(|i| f64::from(i) * reach / 8.0).collect();
    let weights = [0.2, 0.05, 0.04, 0.03, 0.03, 0.02, 0.02, 0.01];
    let offsets = Offsets { input: 70.0, output: 5.0 };
    let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, ratios, offsets).unwrap();
    let output = output(&actuator, &input, 0.0);
    let options = Options { thresholds: Thresholds::Uniform(8), ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    check(&found, &actuator, ratios, 0.0);
}

#[test]
fn delays_whole_and_fractional() {
    let actuator = paper_actuator(Offsets::default());
    let input = decaying_triangle(4_000, 500.0, 10.0, 0.0);
    for delay in [0.0, 0.4, 1.0, 7.75, 30.5] {
        let output = output(&actuator, &input, delay);
        let options = Options {
            thresholds: given(),
            ratios: RatiosModel::Fixed(Ratios::PAPER),
            input_offset: Setting::Fixed(0.0),
            ..Options::default()
        };
        let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
        check(&found, &actuator, Ratios::PAPER, delay);
    }
}

#[test]
fn fixed_parameters_stay_bit_for_bit() {
    let input = decaying_triangle(2_000, 500.0, 10.0, 0.0);
    let output = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let ratios = Ratios { ra: 0.9, rb: 0.37, rc: 0.41 };
    let options = Options {
        thresholds: given(),
        ratios: RatiosModel::Fixed(ratios),
        input_offset: Setting::Fixed(3.0),
        dead_time: Setting::Fixed(0.7),
        smoothness: Setting::Fixed(0.0),
        ..Options::default()
    };
    let found = run(&record, &options).unwrap();
    assert_eq!((found.ratios, input_offset(&found), samples(&found)), (ratios, 3.0, 0.7));
    assert!(found.fit.rmse > 1e-4, "a wrong model cannot fit exactly");
    // Each one freed lowers the error.
    for freed in [
        Options { ratios: RatiosModel::Fit, ..options.clone() },
        Options { input_offset: Setting::Fit, ..options.clone() },
        Options { dead_time: Setting::Fit, ..options.clone() },
    ] {
        let better = run(&record, &freed).unwrap();
        assert!(better.fit.rmse < 0.999 * found.fit.rmse, "{freed:?}: {} {}", better.fit.rmse, found.fit.rmse);
    }
}

#[test]
fn several_records_each_with_its_output_offset() {
    let actuator = paper_actuator(Offsets { input: -20.0, output: 1.5 });
    let inputs = [decaying_triangle(5_000, 500.0, 9.0, 0.0), decaying_triangle(3_000, 300.0, 8.0, 50.0)];
    let mut outputs = inputs.clone().map(|input| output(&actuator, &input, 0.6));
    outputs[1].iter_mut().for_each(|y| *y += 100.0);
    let records = [0, 1].map(|i| Record::new(&inputs[i], &outputs[i], 0).unwrap());
    let found = run(&records, &Options { thresholds: given(), ..Options::default() }).unwrap();
    check(&found, &actuator, Ratios::PAPER, 0.6);
    assert!((found.output_offsets[1] - 101.5).abs() < 1e-6);
    assert_eq!(found.record_fits.len(), 2);
    assert_eq!((found.record_fits[1].samples, found.fit.samples), (3_000, 8_000));
    assert_eq!(found.fit.range, found.record_fits[0].range);
}

#[test]
fn skipped_samples_set_the_memory_and_nothing_else() {
    let actuator = paper_actuator(Offsets::default());
    // A stroke to 500 V that the fitted part, from 0 to 400 V, never repeats.
    let mut input: Vec<f64> = (0..200).map(|k| 500.0 * (f64::from(k) / 63.0).sin().abs()).collect();
    input.extend(decaying_triangle(4_000, 200.0, 12.0, 200.0));
    let output = output(&actuator, &input, 0.0);
    let options = Options { thresholds: given(), dead_time: Setting::Fixed(0.0), ..Options::default() };
    let with_garbage = |garbage: f64| {
        let mut measured = output.clone();
        measured[..200].fill(garbage);
        run(&[Record::new(&input, &measured, 200).unwrap()], &options).unwrap()
    };
    let found = with_garbage(1e6);
    assert_eq!(found, with_garbage(-7.0));
    assert_eq!(found.fit.samples, 4_000);
    assert!(found.fit.rmse < 1e-9, "{:?}", found.fit);
    // Without the skipped samples the memory is another, and with the true ratios the error stays.
    let known =
        Options { ratios: RatiosModel::Fixed(Ratios::PAPER), input_offset: Setting::Fixed(0.0), ..options.clone() };
    let cut = run(&[Record::new(&input[200..], &output[200..], 0).unwrap()], &known).unwrap();
    assert!(cut.fit.rmse > 1e-4, "{:?}", cut.fit);
}

#[test]
fn noise_is_all_that_is_left_and_runs_repeat_bit_for_bit() {
    let actuator = paper_actuator(Offsets { input: 30.0, output: 0.0 });
    let input = decaying_triangle(6_000, 500.0, 15.0, 0.0);
    let mut output = output(&actuator, &input, 1.5);
    output.iter_mut().zip(noise(6_000, 0.01, 1)).for_each(|(y, e)| *y += e);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let options = Options { thresholds: given(), ..Options::default() };
    let found = run(&record, &options).unwrap();
    assert!(found.fit.rmse < 0.0101 && found.fit.rmse > 0.0098, "{:?}", found.fit);
    assert!((samples(&found) - 1.5).abs() < 0.05 && (input_offset(&found) - 30.0).abs() < 3.0, "{found:?}");
    assert_eq!(found, run(&record, &options).unwrap());
}

#[test]
fn a_conventional_model() {
    let input = decaying_triangle(3_000, 5.0, 12.0, 2.0);
    let middle =
        0.5 * (input.iter().copied().fold(f64::INFINITY, f64::min) + input.iter().copied().fold(0.0, f64::max));
    let r = [0.0, 0.5, 1.0, 2.0];
    let offsets = Offsets { input: middle, output: -1.0 };
    let play = PrandtlIshlinskii::new(&[1.0, 0.4, 0.0, 0.3], &r, offsets).unwrap();
    let output = output(&ModifiedPrandtlIshlinskii::from(&play), &input, 1.25);
    let options =
        Options { model: ModelKind::Conventional, thresholds: Thresholds::Given(r.to_vec()), ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    assert!(matches!(found.model, Model::Conventional(_)));
    assert_eq!(found.ratios, Ratios::PLAY);
    assert!((input_offset(&found) - middle).abs() < 1e-12);
    assert!((samples(&found) - 1.25).abs() < 1e-6);
    for (got, want) in weights(&found).iter().zip(play.weights()) {
        assert!((got - want).abs() < 1e-6, "{:?}", weights(&found));
    }
    assert!(found.check_invertible().is_ok());
}

/// Half the peak-to-peak: a play of threshold r never moves both ways on strokes below 2 r.
#[test]
fn uniform_thresholds_of_the_conventional_model() {
    let input: Vec<f64> = (0..400).map(|k| 3.0 + (f64::from(k) / 20.0).sin().clamp(-0.5, 0.75)).collect();
    let output: Vec<f64> = input.iter().map(|u| 2.0 * u).collect();
    let options = Options { model: ModelKind::Conventional, thresholds: Thresholds::Uniform(5), ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    let Model::Conventional(model) = &found.model else { panic!("{found:?}") };
    for (i, play) in model.operators().iter().enumerate() {
        assert!((play.r() - 0.125 * f64::from(u32::try_from(i).unwrap())).abs() < 1e-12);
    }
    assert!((input_offset(&found) - 3.125).abs() < 1e-12);
}

#[test]
fn a_model_of_a_record_without_slope_after_reversals_has_an_inverse() {
    let input = decaying_triangle(2_000, 5.0, 12.0, 0.0);
    let r = [0.0, 0.5, 1.0];
    let dead = PrandtlIshlinskii::new(&[0.0, 1.0, 0.5], &r, Offsets::default()).unwrap();
    let mut output = output(&ModifiedPrandtlIshlinskii::from(&dead), &input, 0.0);
    // Slightly less than no slope, so that the weight is exactly zero.
    output.iter_mut().zip(&input).for_each(|(y, u)| *y -= 1e-3 * u);
    let options = Options {
        model: ModelKind::Conventional,
        thresholds: Thresholds::Given(r.to_vec()),
        dead_time: Setting::Fixed(0.0),
        ..Options::default()
    };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    found.check_invertible().unwrap();
    // The least that a weight of the identity may be, as a share of the others.
    let weights = weights(&found);
    assert!((weights[0] / (weights[1] + weights[2]) - 1e-3).abs() < 1e-12, "{weights:?}");
    assert!(found.standard_errors.weights[0].is_nan() && found.standard_errors.weights[1].is_finite());
    assert!(found.fit.rmse < 1e-3 * found.fit.range, "{:?}", found.fit);
}

/// A play that the fitted samples never move has a constant column: rounding must not give it a weight.
#[test]
fn operators_that_never_move_get_no_weight() {
    let input = decaying_triangle(3_000, 5.0, 12.0, 0.3);
    let later = decaying_triangle(3_000, 4.0, 7.0, -0.2);
    let measured = |input: &[f64], seed| input.iter().zip(noise(3_000, 0.01, seed)).map(|(u, e)| 2.0 * u + e).collect();
    let outputs: [Vec<f64>; 2] = [measured(&input, 1), measured(&later, 2)];
    let records = [Record::new(&input, &outputs[0], 300).unwrap(), Record::new(&later, &outputs[1], 0).unwrap()];
    for model in [ModelKind::Conventional, ModelKind::Modified] {
        let thresholds = Thresholds::Given(vec![0.0, 1.0, 4.0, 30.0, 100.0]);
        let ratios = RatiosModel::Fixed(Ratios::PLAY);
        // A quadratic law would tell weights of operators that the data do not.
        let options = Options { model, weights: WeightLaw::Free, thresholds, ratios, ..Options::default() };
        let found = run(&records, &options).unwrap();
        assert_eq!(weights(&found)[3..], [0.0, 0.0], "{model:?}");
        assert!(
            (weights(&found)[0] - 2.0).abs() < 0.01 && (found.output_offsets[1] - found.output_offsets[0]).abs() < 0.01,
            "{found:?}"
        );
    }
}

/// Millivolts and nanometres, or megavolts: the same model in other units.
#[test]
fn units_do_not_matter() {
    let actuator = paper_actuator(Offsets { input: 12.5, output: -3.0 });
    let input = decaying_triangle(3_000, 500.0, 10.0, 0.0);
    let output = output(&actuator, &input, 0.35);
    for (input_unit, output_unit) in [(1e3, 1e-9), (1e-12, 1e15)] {
        let input: Vec<f64> = input.iter().map(|u| u * input_unit).collect();
        let output: Vec<f64> = output.iter().map(|y| y * output_unit).collect();
        let thresholds = Thresholds::Given((0..20).map(|i| 25.0 * f64::from(i) * input_unit).collect());
        let found =
            run(&[Record::new(&input, &output, 0).unwrap()], &Options { thresholds, ..Options::default() }).unwrap();
        assert!((found.ratios.rb - 0.30).abs() < 1e-6 && (samples(&found) - 0.35).abs() < 1e-6, "{found:?}");
        assert!((input_offset(&found) / input_unit - 12.5).abs() < 1e-6);
        assert!((found.output_offsets[0] / output_unit + 3.0).abs() < 1e-6);
    }
}

/// Weights beyond what the core admits end in its error, not in a search without end.
#[test]
fn absurd_units_end_in_an_error() {
    let input: Vec<f64> = decaying_triangle(300, 1.0, 10.0, 0.0).iter().map(|u| u * 1e-99).collect();
    let output: Vec<f64> = decaying_triangle(300, 1.0, 10.0, 0.0).iter().map(|u| u * 1e99).collect();
    let error = run(&[Record::new(&input, &output, 0).unwrap()], &Options::default()).unwrap_err();
    assert!(matches!(error, Error::Core(_)), "{error}");
}
