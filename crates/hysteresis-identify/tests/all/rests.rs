//! Creep that is left open, in records of which the beginning is not fitted.

use crate::actuators::{Behind, decaying_triangle, noise, run, stage_output};
use hysteresis_control::linear::Creep;
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    CreepModel, DynamicsModel, Identification, Options, RatiosModel, Record, Setting, Thresholds, WeightLaw,
};

const THRESHOLDS: [f64; 4] = [0.0, 10.0, 20.0, 30.0];
const DT: f64 = 0.01;
const NOISE: f64 = 0.002;
const SWEEP: u32 = 1000;
const SKIP: usize = 600;

fn actuator() -> ModifiedPrandtlIshlinskii {
    let offsets = Offsets { input: 0.0, output: 0.0 };
    ModifiedPrandtlIshlinskii::from_ratios(&[0.1, 0.02, 0.02, 0.02], &THRESHOLDS, Ratios::PAPER, offsets).unwrap()
}

/// Loops that decay, and what comes after them; the first of them are not fitted.
fn fitted(after: &[f64], creep: Option<f64>) -> Identification {
    let mut drive = decaying_triangle(SWEEP, 50.0, 6.0, 0.0);
    drive.extend(after);
    let creep = creep.map(|gamma| Creep::logarithmic(gamma, 0.1, 100.0, 6).unwrap());
    let mut output = stage_output(&actuator(), &Behind { creep, dynamics: None, dead_time: 0.0 }, DT, &drive);
    output.iter_mut().zip(noise(drive.len(), NOISE, 7)).for_each(|(y, e)| *y += e);
    let options = Options {
        thresholds: Thresholds::Given(THRESHOLDS.to_vec()),
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(0.0),
        weights: WeightLaw::Free,
        dt: Some(DT),
        dynamics: DynamicsModel::None,
        smoothness: Setting::Fixed(0.0),
        ..Options::default()
    };
    assert_eq!(options.creep, CreepModel::Auto);
    run(&[Record::new(&drive, &output, SKIP).unwrap()], &options).unwrap()
}

/// Ramps to these drives, and a rest at each.
fn rests(levels: &[f64], samples: usize) -> Vec<f64> {
    let mut drive = vec![0.0];
    for level in levels {
        let last = drive[drive.len() - 1];
        drive.extend((1..=50).map(|k| last + (level - last) * f64::from(k) / 50.0));
        drive.extend(std::iter::repeat_n(*level, samples));
    }
    drive
}

#[test]
fn rests_tell_creep_behind_loops_that_only_decay() {
    let found = fitted(&rests(&[50.0, 10.0, -20.0], 500), Some(0.03));
    assert!(!found.creep_amplitudes.is_empty(), "{:?}", found.creep_amplitudes);
    assert!(found.fit.rmse < 1.1 * NOISE, "{:?}", found.fit);
}

#[test]
fn without_creep_rests_find_none() {
    let found = fitted(&rests(&[50.0, 10.0, -20.0], 500), None);
    assert!(found.creep_amplitudes.is_empty() && found.fit.rmse < 1.1 * NOISE, "{:?}", found.fit);
}

#[test]
fn without_rests_decaying_loops_are_not_told_from_creep() {
    let found = fitted(&[], Some(0.03));
    assert!(found.creep_amplitudes.is_empty(), "{:?}", found.creep_amplitudes);
}
