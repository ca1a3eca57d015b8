//! A stage whose loops change their size while the drive cycles.

use hysteresis_control::linear::{Creep, FirstOrder, SecondOrder};
use hysteresis_control::stage::{FeedForwardKind, PrecompensateOptions, SlowGain, Stage, StageParts};
use hysteresis_core::{ControllerOptions, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Process, Ratios};

const DT: f64 = 1e-4;

fn slow_gain() -> SlowGain {
    SlowGain::new(75.0, -0.1, 20.0, 0.3).unwrap()
}

/// 0 to 150 V, 80 um; the gain falls by some per cent.
fn parts() -> StageParts {
    let r: Vec<f64> = (0..20).map(|i| 7.5 * f64::from(i)).collect();
    let w: Vec<f64> = (0..20).map(|i| if i == 0 { 0.4 } else { 0.01 }).collect();
    let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&w, &r, Ratios::PAPER, Offsets::default()).unwrap();
    StageParts {
        slow_gain: Some(slow_gain()),
        creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap()),
        output_map: Some(PiecewiseLinearMap::new(&[0.0, 40.0, 100.0], &[0.0, 42.0, 100.0]).unwrap()),
        limits: Some((-30.0, 150.0)),
        ..StageParts::new(hysteresis)
    }
}

fn dynamic() -> StageParts {
    StageParts { dynamics: SecondOrder::new(800.0, 0.1).unwrap().into(), dead_time: 1.5e-4, ..parts() }
}

/// From 0 with no velocity: 20 Hz.
fn reference(samples: u32) -> Vec<f64> {
    (0..samples).map(|k| 25.0 - 25.0 * (core::f64::consts::TAU * 20.0 * DT * f64::from(k)).cos()).collect()
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    values.map(f64::abs).fold(0.0, f64::max)
}

#[test]
fn forward_of_inverse_is_the_target() {
    let stage = Stage::new(parts()).unwrap();
    let (mut forward, mut inverse) = (stage.forward(DT).unwrap(), stage.inverse(DT, None).unwrap());
    let error = largest(reference(5000).iter().map(|target| forward.step(inverse.step(*target)) - target));
    assert!(error < 1e-11 * 100.0, "{error} um");
}

#[test]
fn open_loop_follows_a_reference_that_a_constant_gain_misses() {
    let reference = reference(10_000);
    let stage = Stage::new(dynamic()).unwrap();
    let constant = Stage::new(StageParts { slow_gain: None, ..dynamic() }).unwrap();
    let error = |model: &Stage| {
        let drive = model.precompensate(&reference, DT, &PrecompensateOptions::default()).unwrap().drive;
        let mut bench = stage.forward(DT).unwrap();
        let rows: Vec<f64> = drive.iter().zip(&reference).map(|(u, r)| bench.step(*u) - r).collect();
        largest(rows[5000..].iter().copied())
    };
    let (with, without) = (error(&stage), error(&constant));
    assert!(with < 0.02 && without > 10.0 * with, "{with} {without} um");
}

#[test]
fn a_controller_feeds_the_gain_forward() {
    let stage = Stage::new(parts()).unwrap();
    let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, DT, (-30.0, 150.0)) };
    let mut controller = stage.controller(FeedForwardKind::Inverse, &options).unwrap();
    let mut bench = stage.forward(DT).unwrap();
    let mut position = bench.output();
    let mut error = 0.0_f64;
    for target in reference(5000) {
        let drive = controller.step(target.into(), position);
        position = bench.advance(drive);
        error = error.max((position - target).abs());
    }
    assert!(error < 1e-9, "{error} um");
}

/// Sub-steps of an amplifier have terms of their own: the interval of the samples must not matter.
#[test]
fn the_gain_behind_an_amplifier_is_that_of_its_voltage() {
    let amplifier = Some(FirstOrder::new(279.0).unwrap());
    let stage = Stage::new(StageParts { amplifier, ..dynamic() }).unwrap();
    let (mut coarse, mut fine) = (stage.forward(DT).unwrap(), stage.forward(DT / 10.0).unwrap());
    let mut error = 0.0_f64;
    for k in 0..3000_u32 {
        let drive = 75.0 - 75.0 * (0.0126 * f64::from(k)).cos();
        let position = (0..10).map(|_| fine.advance(drive)).last().unwrap();
        error = error.max((coarse.advance(drive) - position).abs());
    }
    assert!(coarse.sub_steps() >= 8 && error < 2e-3, "{error} um");
}

#[test]
fn what_the_stage_reaches_counts_the_gain_where_it_is_worst() {
    let stage = Stage::new(StageParts { creep: None, ..parts() }).unwrap();
    let constant = Stage::new(StageParts { slow_gain: None, creep: None, ..parts() }).unwrap();
    let ((low, high), (lowest, highest)) = (stage.position_range().unwrap(), constant.position_range().unwrap());
    let behind = |position: f64| 20.0 + 0.9 * (position - 20.0);
    assert!((low - behind(lowest)).abs() < 1e-12 && (high - behind(highest)).abs() < 1e-12, "{low} {high}");
    let ((flat, steep), (flattest, steepest)) = (stage.slope_range(), constant.slope_range());
    assert!((flat - 0.9 * flattest).abs() < 1e-15 && steep.to_bits() == steepest.to_bits());
}

#[test]
fn a_stage_file_keeps_the_gain_and_others_stay_as_they_were() {
    let stage = Stage::new(dynamic()).unwrap();
    let text = stage.to_json();
    assert_eq!(Stage::from_json(&text).unwrap(), stage);
    let constant = Stage::new(StageParts { slow_gain: None, ..dynamic() }).unwrap();
    assert!(!constant.to_json().contains("slow_gain"));
    assert_eq!(Stage::from_json(&constant.to_json()).unwrap(), constant);
    assert_ne!(stage, constant);
    for (from, to, message) in [
        ("\"half_range\": 75.0", "\"half_range\": -75.0", "half_range: expected a number above 0"),
        ("\"time_constant\": 0.3", "\"time_constant\": 0.0", "time_constant: expected a finite number above 0"),
        ("\"amplitude\": -0.1", "\"amplitude\": -0.1, \"rate\": 1.0", "unknown field `rate`"),
        ("\"half_range\": 75.0,", "", "missing field `half_range`"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Stage::from_json(&text.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn bad_numbers_are_named() {
    let made =
        |half_range, amplitude, zero, tau| SlowGain::new(half_range, amplitude, zero, tau).unwrap_err().to_string();
    assert!(made(0.0, 0.1, 0.0, 1.0).starts_with("half_range: expected"));
    assert!(made(1.0, 0.6, 0.0, 1.0).starts_with("amplitude: expected"));
    assert!(made(1.0, 0.1, f64::NAN, 1.0).starts_with("zero: expected"));
    assert!(made(1.0, 0.1, 0.0, -1.0).starts_with("time_constant: expected"));
    assert!(slow_gain().terms(0.0).unwrap_err().to_string().starts_with("dt: expected"));
}
