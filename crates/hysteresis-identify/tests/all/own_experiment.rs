//! The package's own experiment: its rests, small reversals and small fast signal are no faults, whatever the range,
//! speed and noise.

use hysteresis_control::linear::{Creep, SecondOrder};
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
use hysteresis_identify::{Finding, FindingCode, Record, diagnose};
use hysteresis_simulate::excitation::{ExperimentOptions, Part, Shape};

use crate::actuators::noise;

/// Drives of a bench: limits, slew in V/s, rate in Hz, shape.
type Bench = (f64, f64, f64, f64, Shape);

const BENCHES: [Bench; 5] = [
    (0.0, 150.0, 3000.0, 1e3, Shape::Triangle),
    (-150.0, 150.0, 1e5, 1e3, Shape::Triangle),
    (-560.0, 560.0, 3e4, 1e3, Shape::Sine),
    (-20.0, 120.0, 700.0, 2e3, Shape::Triangle),
    (-500.0, 500.0, 2000.0, 500.0, Shape::Triangle),
];

/// Hysteresis of about 15 % over a range, 0.5 um/V.
fn hysteresis(low: f64, high: f64) -> ModifiedPrandtlIshlinskii {
    let thresholds: Vec<f64> = (0..10).map(|i| 0.05 * (high - low) * f64::from(i)).collect();
    let weights: Vec<f64> = (0..10).map(|i| if i == 0 { 0.35 } else { 0.04 / f64::from(i) }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(
        &weights,
        &thresholds,
        Ratios { ra: 0.9, rb: 0.4, rc: 0.5 },
        Offsets::default(),
    )
    .unwrap()
}

/// The parts of the experiment for a bench, and what a stage with creep, a mode and a dead time makes of them.
fn recorded(bench: Bench, share_of_noise: f64) -> (Vec<(Part, Vec<f64>)>, Model) {
    let (low, high, slew, rate, shape) = bench;
    let options = ExperimentOptions { shape, rest: 10.0, ..ExperimentOptions::new(low, high, slew, rate) };
    let hysteresis = hysteresis(low, high);
    let stage = Stage::new(StageParts {
        creep: Some(Creep::logarithmic(0.03, 1e-2, 1e3, 8).unwrap()),
        dynamics: SecondOrder::new(0.1 * rate, 0.05).unwrap().into(),
        dead_time: 2.0 / rate,
        ..StageParts::new(hysteresis.clone())
    })
    .unwrap();
    let measured = |(seed, part): (u64, Part)| {
        let mut forward = stage.forward(1.0 / rate).unwrap();
        forward.settle(part.drive[0]);
        let noise = noise(part.drive.len(), share_of_noise * 0.5 * (high - low), seed);
        let position = part.drive.iter().zip(noise).map(|(u, e)| forward.step(*u) + e).collect();
        (part, position)
    };
    ((1..).zip(options.experiment().unwrap().parts).map(measured).collect(), hysteresis.into())
}

fn found(recorded: &[(Part, Vec<f64>)], model: &Model, rate: f64) -> Vec<Finding> {
    let record = |(part, position)| {
        let (part, position): (&Part, &Vec<f64>) = (part, position);
        Record::new(&part.drive, position, 0).unwrap().sampled_every(1.0 / rate).unwrap()
    };
    let records: Vec<Record<'_>> = recorded.iter().map(|(part, position)| record((part, position))).collect();
    diagnose(&records, model, 2.0 / rate).unwrap()
}

#[test]
fn rests_and_small_reversals_are_no_faults() {
    for (bench, share_of_noise) in BENCHES.into_iter().zip([1e-4, 2e-3, 0.0, 1e-3, 1e-4]) {
        let (recorded, model) = recorded(bench, share_of_noise);
        let found = found(&recorded, &model, bench.3);
        let is_fault =
            |code| matches!(code, FindingCode::StuckInput | FindingCode::InputOutliers | FindingCode::ClippedInput);
        let faults: Vec<_> = found.iter().filter(|one| is_fault(one.code) || one.hint.contains("--mend")).collect();
        assert!(faults.is_empty(), "{bench:?}: {faults:?}");
    }
}

/// In the same record a recorder that froze and a glitch are told, and the hint mends them.
#[test]
fn what_froze_is_told_beside_rests() {
    let bench = BENCHES[0];
    let (mut recorded, model) = recorded(bench, 1e-4);
    let loops = &mut recorded[1].0;
    let ramp = loops.segments.iter().find(|segment| segment.name == "decaying").unwrap().start + 600;
    let held = loops.drive[ramp];
    loops.drive[ramp..ramp + 100].fill(held);
    assert!((loops.drive[ramp + 100] - held).abs() > 0.1 * (bench.1 - bench.0));
    loops.drive[2 * ramp] += 0.4 * (bench.1 - bench.0);
    let found = found(&recorded, &model, bench.3);
    let hint = |code| found.iter().find(|one| one.code == code).map_or("", |one| &one.hint);
    let froze = format!("--mend {ramp}:{}", ramp + 100);
    assert!(hint(FindingCode::StuckInput).ends_with(&froze), "{found:?}");
    let glitch = format!("--mend {}:{}", 2 * ramp, 2 * ramp + 1);
    assert!(hint(FindingCode::InputOutliers).ends_with(&glitch), "{found:?}");
}
