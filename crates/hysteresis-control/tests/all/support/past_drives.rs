//! A stage whose past drives count, and what holds whether its loops shift or change their size.

use core::f64::consts::TAU;

use hysteresis_control::linear::{Creep, FirstOrder, SecondOrder};
use hysteresis_control::stage::{FeedForwardKind, PrecompensateOptions, Stage, StageParts};
use hysteresis_core::{ControllerOptions, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Process, Ratios};

pub(crate) const DT: f64 = 1e-4;

/// 0 to 150 V, 80 um, without a loop shift and a slow gain.
pub(crate) fn creeping() -> StageParts {
    let r: Vec<f64> = (0..20).map(|i| 7.5 * f64::from(i)).collect();
    let w: Vec<f64> = (0..20).map(|i| if i == 0 { 0.4 } else { 0.01 }).collect();
    let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, Offsets::default()).unwrap();
    StageParts {
        creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap()),
        output_map: Some(PiecewiseLinearMap::new(&[0.0, 40.0, 100.0], &[0.0, 42.0, 100.0]).unwrap()),
        limits: Some((-30.0, 150.0)),
        ..StageParts::new(hysteresis)
    }
}

/// The same with a mode and a dead time.
pub(crate) fn with_a_mode(parts: StageParts) -> StageParts {
    StageParts { dynamics: SecondOrder::new(800.0, 0.1).unwrap().into(), dead_time: 1.5e-4, ..parts }
}

/// From 0 with no velocity: 20 Hz.
pub(crate) fn reference(samples: u32) -> Vec<f64> {
    (0..samples).map(|k| 25.0 - 25.0 * (TAU * 20.0 * DT * f64::from(k)).cos()).collect()
}

pub(crate) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

/// By how much the position behind the inverse misses the target.
pub(crate) fn error_behind_inverse(parts: StageParts) -> f64 {
    let stage = Stage::new(parts).unwrap();
    let (mut forward, mut inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    largest(reference(5000).iter().map(|target| forward.step(inverse.step(*target)) - target))
}

/// By how much a stage misses a reference under the drive that a model gives, behind the first samples.
pub(crate) fn error_in_open_loop(stage: &Stage, model: &Stage, reference: &[f64], skip: usize) -> f64 {
    let drive = model.precompensate(reference, DT, &PrecompensateOptions::default()).unwrap().drive;
    let mut bench = stage.forward(DT).unwrap();
    let rows: Vec<f64> = drive.iter().zip(reference).map(|(u, r)| bench.step(*u) - r).collect();
    largest(rows[skip..].iter().copied())
}

/// By how much a stage misses so many samples under the feed-forward of its controller alone.
pub(crate) fn error_of_feedforward(parts: StageParts, samples: u32) -> f64 {
    let stage = Stage::new(parts).unwrap();
    let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, DT, (-30.0, 150.0)) };
    let mut controller = stage.controller(FeedForwardKind::Inverse, &options).unwrap();
    let mut bench = stage.forward(DT).unwrap();
    let mut position = bench.output();
    let mut error = 0.0_f64;
    for target in reference(samples) {
        let drive = controller.step(target.into(), position);
        position = bench.advance(drive);
        error = error.max((position - target).abs());
    }
    error
}

/// By how much the position behind an amplifier changes where samples are ten times as close. Its sub-steps have terms
/// of their own: the interval of the samples must not matter.
pub(crate) fn error_of_sub_steps(parts: StageParts) -> f64 {
    let amplifier = Some(FirstOrder::new(279.0).unwrap());
    let stage = Stage::new(StageParts { amplifier, ..parts }).unwrap();
    let (mut coarse, mut fine) = (stage.forward(DT).unwrap(), stage.forward(DT / 10.0).unwrap());
    assert!(coarse.sub_steps() >= 8);
    largest((0..3000_u32).map(|k| {
        let drive = 75.0 - 75.0 * (0.0126 * f64::from(k)).cos();
        let position = (0..10).map(|_| fine.advance(drive)).last().unwrap();
        coarse.advance(drive) - position
    }))
}
