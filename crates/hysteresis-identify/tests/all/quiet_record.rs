//! Dynamics that a small fast record tells, where a hysteresis that is not of the model's kind leaves much more of the
//! loops.

use std::f64::consts::TAU;

use crate::actuators::bouc_wen::BoucWen;
use crate::actuators::{noise, run};
use hysteresis_control::linear::{Block, Dynamics, FirstOrder, SecondOrder};
use hysteresis_identify::{FindingCode, Identification, Options, Record};

/// Of the simulation.
const STEP: f64 = 1e-4;

/// Sampling intervals of the two records, in steps of the simulation.
const OF_LOOPS: u32 = 100;
const OF_SWEEP: u32 = 10;

/// Of the noise, in um.
const DEVIATION: f64 = 0.02;

/// The dead time, in steps.
const LATE: usize = 10;

/// The rows of a stage with an amplifier of 40 Hz, a mode of 90 Hz, damping 0.05, and a dead time of 1 ms, everything
/// in small steps.
fn rows(drive: &[f64], steps: u32, seed: u64) -> Vec<f64> {
    let mut amplifier = FirstOrder::new(40.0).unwrap().block(STEP).unwrap();
    let mut mode = SecondOrder::new(90.0, 0.05).unwrap().block(STEP).unwrap();
    let mut hysteresis = BoucWen::default();
    amplifier.settle(0.0);
    let mut fine = vec![mode.settle(0.0); LATE + 1];
    for u in drive {
        for _ in 0..steps {
            fine.push(mode.advance(hysteresis.step(amplifier.advance(*u))));
        }
    }
    let positions = fine.iter().step_by(usize::try_from(steps).unwrap());
    positions.zip(noise(drive.len(), DEVIATION, seed)).map(|(position, e)| position + e).collect()
}

/// Loops up to 4 Hz and a sweep of 1 V.
fn found() -> Identification {
    let loops: Vec<f64> = (0..=6000_u32)
        .map(|k| (f64::from(k) * f64::from(OF_LOOPS) * STEP, f64::from(k) / 6000.0))
        .map(|(t, s)| 75.0 - 75.0 * (1.5 - 1.5 * s).min(1.0) * (TAU * (0.1 + 0.0325 * t) * t).cos())
        .collect();
    let sweep: Vec<f64> = (0..4000_u32)
        .map(|k| f64::from(k) * f64::from(OF_SWEEP) * STEP)
        .map(|t| 0.5 - 0.5 * (TAU * (10.0 + 17.5 * t) * t).cos())
        .collect();
    let (from_loops, from_sweep) = (rows(&loops, OF_LOOPS, 1), rows(&sweep, OF_SWEEP, 2));
    let records = [
        Record::new(&loops, &from_loops, 0).unwrap().sampled_every(f64::from(OF_LOOPS) * STEP).unwrap(),
        Record::new(&sweep, &from_sweep, 0).unwrap().sampled_every(f64::from(OF_SWEEP) * STEP).unwrap(),
    ];
    run(&records, &Options::default()).unwrap()
}

/// Least squares of both records find a dead time of several milliseconds in place of the dynamics.
#[test]
fn a_quiet_record_tells_the_dynamics_that_loops_drown() {
    let found = found();
    let Some(Dynamics::SecondOrder(mode)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    let bandwidth = found.amplifier().map(|amplifier| amplifier.frequency());
    let case = format!("{mode:?} {bandwidth:?} {:?} {:?}", found.dead_time, found.fit);
    assert!((mode.frequency() / 90.0 - 1.0).abs() < 0.005, "{case}");
    assert!((mode.damping() / 0.05 - 1.0).abs() < 0.05, "{case}");
    assert!((bandwidth.unwrap() / 40.0 - 1.0).abs() < 0.25, "{case}");
    assert!((found.dead_time.unwrap() - 1e-3).abs() < 3e-4, "{case}");
    let doubts = [FindingCode::ResonanceNotExcited, FindingCode::DampingUndetermined];
    assert!(found.warnings.iter().all(|one| !doubts.contains(&one.code)), "{:?}", found.warnings);
    assert!(found.standard_errors.damping < 0.05 * mode.damping(), "{:?}", found.standard_errors);
}
