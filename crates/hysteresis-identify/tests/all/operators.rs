//! How many operators there are, where that is left to the records.

use crate::actuators::{Behind, decaying_triangle, noise, output, paper_actuator, run, stage_output, weights};
use hysteresis_control::linear::{Creep, SecondOrder};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    AmplifierModel, CreepModel, DynamicsModel, Error, Identification, LoopShiftModel, MapModel, Options, Order,
    RatiosModel, Record, Setting, Thresholds, WeightLaw,
};

const DT: f64 = 1e-3;

/// Forty plays, of which every other one has the weight: twenty lie where there is none.
fn forty() -> ModifiedPrandtlIshlinskii {
    let r: Vec<f64> = (0..40).map(|i| 12.5 * f64::from(i)).collect();
    let weights: Vec<f64> = (0..40).map(|i| if i == 0 { 4e-3 } else { 4e-4 * f64::from(i % 2) }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap()
}

/// The rows of that stage behind a mode and creep.
fn measured(input: &[f64], seed: u64) -> Vec<f64> {
    let creep = Creep::new(&[0.01, 0.01], &[0.03, 0.3]).unwrap();
    let dynamics = SecondOrder::new(60.0, 0.05).unwrap().into();
    let behind = Behind { creep: Some(creep), dynamics: Some(dynamics), dead_time: 0.0 };
    let true_rows = stage_output(&forty(), &behind, DT, input);
    true_rows.iter().zip(noise(input.len(), 1e-3, seed)).map(|(y, e)| y + e).collect()
}

/// A decaying triangle with many periods, and a growing one: 500 V at most.
fn drive(samples: u32, periods: f64) -> Vec<f64> {
    let mut drive = decaying_triangle(samples, 500.0, periods, 0.0);
    let back: Vec<f64> = drive.iter().rev().copied().collect();
    drive.extend(back);
    drive
}

fn options(thresholds: Thresholds) -> Options {
    Options {
        thresholds,
        weights: WeightLaw::Free,
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(0.0),
        dt: Some(DT),
        dynamics: DynamicsModel::Order(Order::Second),
        amplifier: AmplifierModel::None,
        creep: CreepModel::TimeConstants(vec![0.03, 0.3]),
        loop_shift: LoopShiftModel::None,
        input_map: MapModel::None,
        output_map: MapModel::None,
        ..Options::default()
    }
}

fn tried(found: &Identification) -> Vec<usize> {
    found.cross_validation.iter().map(|one| one.operators).collect()
}

/// The root mean square error on a record that was not fitted.
fn unseen(found: &Identification) -> f64 {
    let input = drive(1_500, 23.0);
    let measured = measured(&input, 8);
    found.validate(&Record::new(&input, &measured, 0).unwrap(), None).rmse
}

#[test]
fn a_stage_of_forty_plays_behind_a_mode_and_creep_has_as_many() {
    let input = drive(2_000, 37.0);
    let measured = measured(&input, 7);
    let record = [Record::new(&input, &measured, 0).unwrap()];
    let twenty = run(&record, &options(Thresholds::Uniform(20))).unwrap();
    for thresholds in [Thresholds::Auto, Thresholds::Refined] {
        let found = run(&record, &options(thresholds)).unwrap();
        assert!(weights(&found).len() >= 32, "{:?}", found.cross_validation);
        // The noise is 1e-3: what twenty plays lack is as much again.
        assert!(unseen(&found) < 0.75 * unseen(&twenty), "{} {}", unseen(&found), unseen(&twenty));
    }
}

/// Thresholds of twenty are among those of forty: at the same point, the weights of the former are among those that are
/// tried.
#[test]
fn twice_as_many_never_fit_worse() {
    let input = drive(1_000, 19.0);
    let measured = measured(&input, 3);
    let record = [Record::new(&input, &measured, 0).unwrap()];
    let without = |thresholds| Options { smoothness: Setting::Fixed(0.0), ..options(thresholds) };
    let twenty = run(&record, &without(Thresholds::Uniform(20))).unwrap();
    let found = run(&record, &without(Thresholds::Refined)).unwrap();
    assert!(tried(&found).starts_with(&[20, 40]) && weights(&found).len() >= 40);
    assert!(found.fit.rmse <= twenty.fit.rmse * (1.0 + 1e-12), "{} {}", found.fit.rmse, twenty.fit.rmse);
}

#[test]
fn an_actuator_of_twenty_keeps_them_with_the_same_bits() {
    let input = decaying_triangle(3_000, 500.0, 30.0, 0.0);
    let truth = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let measured: Vec<f64> = truth.iter().zip(noise(input.len(), 0.01, 5)).map(|(y, e)| y + e).collect();
    let record = [Record::new(&input, &measured, 0).unwrap()];
    for kind in [Thresholds::Refined, Thresholds::RefinedQuantiles, Thresholds::RefinedGeometric] {
        let given = match kind {
            Thresholds::RefinedQuantiles => Thresholds::Quantiles(20),
            Thresholds::RefinedGeometric => Thresholds::Geometric(20),
            _ => Thresholds::Uniform(20),
        };
        let given = run(&record, &Options { thresholds: given, ..Options::default() }).unwrap();
        let found = run(&record, &Options { thresholds: kind, ..Options::default() }).unwrap();
        assert_eq!(tried(&found), [20, 40]);
        assert!(given.cross_validation.is_empty());
        assert_eq!((found.model, found.output_offsets, found.fit), (given.model, given.output_offsets, given.fit));
    }
}

/// Samples that do not bear twenty are too few for the default, and bear fewer where any number may be taken.
#[test]
fn few_samples_bear_few_operators() {
    let input = decaying_triangle(44, 500.0, 4.0, 0.0);
    let measured = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let record = [Record::new(&input, &measured, 0).unwrap()];
    let options = |thresholds| Options { thresholds, weights: WeightLaw::Free, ..Options::default() };
    let refused = run(&record, &options(Thresholds::Refined)).unwrap_err();
    assert_eq!(refused, run(&record, &options(Thresholds::Uniform(20))).unwrap_err());
    assert!(matches!(refused, Error::TooFewSamples { .. }));
    let found = run(&record, &options(Thresholds::Auto)).unwrap();
    assert!(weights(&found).len() <= 16 && tried(&found) == [4, 6, 8, 12, 16], "{:?}", tried(&found));
}
