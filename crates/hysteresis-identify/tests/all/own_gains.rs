//! Dynamics come back from a stage whose hysteresis is not of the model's kind.

use std::f64::consts::TAU;

use crate::actuators::bouc_wen::BoucWen;
use crate::actuators::{noise, run};
use hysteresis_control::linear::{Block, Dynamics, FirstOrder, SecondOrder};
use hysteresis_identify::{Options, Record, Thresholds};

/// Of the simulation.
const STEP: f64 = 5e-5;

/// Of the noise, in um.
const DEVIATION: f64 = 0.02;

/// Sampling intervals of the two records, in steps of the simulation.
const OF_LOOPS: u32 = 200;
const OF_SWEEP: u32 = 20;

/// The rows of a stage with an amplifier of 40 Hz and a mode of 60 Hz, damping 0.02, everything in small steps.
fn rows(drive: &[f64], steps: u32, seed: u64) -> Vec<f64> {
    let mut amplifier = FirstOrder::new(40.0).unwrap().block(STEP).unwrap();
    let mut mode = SecondOrder::new(60.0, 0.02).unwrap().block(STEP).unwrap();
    let mut hysteresis = BoucWen::default();
    amplifier.settle(0.0);
    let mut position = mode.settle(0.0);
    let noise = noise(drive.len(), DEVIATION, seed);
    let row = |(u, e): (&f64, f64)| {
        let row = position + e;
        for _ in 0..steps {
            position = mode.advance(hysteresis.step(amplifier.advance(*u)));
        }
        row
    };
    drive.iter().zip(noise).map(row).collect()
}

/// With one gain for loops and sweep the damping is off by a twelfth.
#[test]
fn damping_is_that_of_the_stage_where_small_movements_have_another_gain() {
    let share = |k: u32| f64::from(k) / 8000.0;
    let loops: Vec<f64> =
        (0..=8000_u32).map(share).map(|s| 75.0 - 75.0 * (1.5 - 1.5 * s).min(1.0) * (TAU * 12.0 * s).cos()).collect();
    let sweep: Vec<f64> = (0..6000_u32)
        .map(|k| f64::from(k) * f64::from(OF_SWEEP) * STEP)
        .map(|t| 0.5 - 0.5 * (TAU * (10.0 * t + 8.0 * t * t)).cos())
        .collect();
    let (from_loops, from_sweep) = (rows(&loops, OF_LOOPS, 1), rows(&sweep, OF_SWEEP, 2));
    let records = [
        Record::new(&loops, &from_loops, 0).unwrap().sampled_every(f64::from(OF_LOOPS) * STEP).unwrap(),
        Record::new(&sweep, &from_sweep, 0).unwrap().sampled_every(f64::from(OF_SWEEP) * STEP).unwrap(),
    ];
    let options = Options { thresholds: Thresholds::Uniform(12), ..Options::default() };
    let found = run(&records, &options).unwrap();
    let Some(Dynamics::SecondOrder(mode)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    let case = format!("{mode:?} {:?}", found.fit);
    assert!((mode.frequency() / 60.0 - 1.0).abs() < 0.002, "{case}");
    assert!((mode.damping() / 0.02 - 1.0).abs() < 0.05, "{case}");
}
