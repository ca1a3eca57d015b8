//! Thresholds that grow by a constant factor: more operators for small loops.

use crate::actuators::{decaying_triangle, noise, output, run};
use hysteresis_core::{CoupledPlay, Model, ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{DuhemModel, Identification, Options, Record, Setting, Thresholds, WeightLaw};

fn options(thresholds: Thresholds) -> Options {
    Options {
        thresholds,
        weights: WeightLaw::Free,
        smoothness: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(0.0),
        ..Options::default()
    }
}

fn thresholds(found: &Identification) -> Vec<f64> {
    match &found.model {
        Model::Modified(model) => model.operators().iter().map(CoupledPlay::r).collect(),
        Model::Conventional(model) => model.operators().iter().map(hysteresis_core::Play::r).collect(),
    }
}

/// Many small loops and a few large ones, about `centre`.
fn drive(amplitude: f64, centre: f64) -> Vec<f64> {
    let mut drive = decaying_triangle(3000, amplitude, 10.5, centre);
    for share in [0.04, 0.12, 0.02, 0.3] {
        drive.extend(decaying_triangle(700, share * amplitude, 5.5, centre));
    }
    drive
}

#[test]
fn they_grow_by_one_factor_below_the_reach() {
    let (amplitude, centre) = (40.0, 25.0);
    let input = drive(amplitude, centre);
    let reach = input.iter().fold(0.0_f64, |reach, u| reach.max((u - centre).abs()));
    let actuator =
        ModifiedPrandtlIshlinskii::from_ratios(&[0.1, 0.05], &[0.0, 5.0], Ratios::PAPER, Offsets::default()).unwrap();
    let output = output(&actuator, &input, 0.0);
    for (operators, smallest) in [(1, None), (2, Some(0.5)), (4, Some(0.125)), (8, Some(0.01)), (20, Some(0.01))] {
        let options = Options { input_offset: Setting::Fixed(centre), ..options(Thresholds::Geometric(operators)) };
        let found = thresholds(&run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap());
        assert_eq!((found.len(), found[0]), (operators, 0.0));
        assert!(found.windows(2).all(|pair| pair[0] < pair[1]) && found[operators - 1] < reach, "{found:?}");
        if let Some(smallest) = smallest {
            assert!((found[1] / reach - smallest).abs() < 1e-3 * smallest, "{operators}: {found:?}");
        }
        for all in found[1..].windows(3) {
            assert!((all[2] / all[1] - all[1] / all[0]).abs() < 1e-12, "{found:?}");
        }
    }
}

/// A stage whose operators crowd at small thresholds: with as many operators small loops are predicted better.
#[test]
fn they_suit_a_stage_of_small_thresholds() {
    for (amplitude, gain, seed) in [(60.0, 0.1, 1), (0.9, 4e-6, 2), (5.0, 700.0, 3)] {
        let r: Vec<f64> = [0.0, 0.008, 0.015, 0.03, 0.06, 0.1, 0.2, 0.4, 0.7].iter().map(|r| r * amplitude).collect();
        let weights = [1.0, 0.12, 0.1, 0.09, 0.08, 0.06, 0.06, 0.05, 0.05].map(|w| gain * w);
        let ratios = Ratios { ra: 0.9, rb: 0.5, rc: 0.7 };
        let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, ratios, Offsets::default()).unwrap();
        let input = drive(amplitude, 0.0);
        let noise = noise(input.len(), 2e-4 * gain * amplitude, seed);
        let measured: Vec<f64> = output(&actuator, &input, 0.0).iter().zip(noise).map(|(y, e)| y + e).collect();
        let unseen: Vec<f64> = [0.8, 0.03, 0.015, 0.09]
            .iter()
            .flat_map(|share| decaying_triangle(500, share * amplitude, 3.5, 0.0))
            .collect();
        let truth = output(&actuator, &unseen, 0.0);
        let error = |thresholds| {
            // Of plays alone: a Duhem operator beside them makes up for thresholds that do not suit.
            let plays = Options { duhem: DuhemModel::None, ..options(thresholds) };
            let found = run(&[Record::new(&input, &measured, 0).unwrap()], &plays).unwrap();
            let predicted = found.predict(&unseen).unwrap();
            truth.iter().zip(predicted).map(|(y, p)| (y - p).powi(2)).sum::<f64>().sqrt()
        };
        let (geometric, uniform) = (error(Thresholds::Geometric(10)), error(Thresholds::Uniform(10)));
        assert!(geometric < 0.6 * uniform, "{amplitude}: {geometric:.2e}, uniform {uniform:.2e}");
    }
}

#[test]
fn cross_validation_counts_them() {
    let input = drive(50.0, 0.0);
    let r: Vec<f64> = (0..8).map(|i| if i == 0 { 0.0 } else { 0.5 * 1.93_f64.powi(i - 1) }).collect();
    let weights = [0.1, 0.02, 0.02, 0.015, 0.015, 0.01, 0.01, 0.01];
    let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
    let noise = noise(input.len(), 2e-3, 7);
    let measured: Vec<f64> = output(&actuator, &input, 0.0).iter().zip(noise).map(|(y, e)| y + e).collect();
    let records = [Record::new(&input, &measured, 0).unwrap()];
    let auto = run(&records, &options(Thresholds::AutoGeometric)).unwrap();
    assert!(!auto.cross_validation.is_empty());
    let given = run(&records, &options(Thresholds::Geometric(thresholds(&auto).len()))).unwrap();
    let (found, expected) = (auto.fit.rmse, given.fit.rmse);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} {expected}");
}
