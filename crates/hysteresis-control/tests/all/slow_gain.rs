//! A stage whose loops change their size while the drive cycles.

use hysteresis_control::stage::{SlowGain, Stage, StageParts};

use crate::support::past_drives::{
    creeping, error_behind_inverse, error_in_open_loop, error_of_feedforward, error_of_sub_steps, reference,
    with_a_mode,
};

fn slow_gain() -> SlowGain {
    SlowGain::new(75.0, -0.1, 20.0, 0.3).unwrap()
}

/// The gain falls by some per cent.
fn parts() -> StageParts {
    StageParts { slow_gain: Some(slow_gain()), ..creeping() }
}

fn dynamic() -> StageParts {
    with_a_mode(parts())
}

#[test]
fn forward_of_inverse_is_the_target() {
    let error = error_behind_inverse(parts());
    assert!(error < 1e-11 * 100.0, "{error} um");
}

#[test]
fn open_loop_follows_a_reference_that_a_constant_gain_misses() {
    let reference = reference(10_000);
    let stage = Stage::new(dynamic()).unwrap();
    let constant = Stage::new(StageParts { slow_gain: None, ..dynamic() }).unwrap();
    let error = |model: &Stage| error_in_open_loop(&stage, model, &reference, 5000);
    let (with, without) = (error(&stage), error(&constant));
    assert!(with < 0.02 && without > 10.0 * with, "{with} {without} um");
}

#[test]
fn a_controller_feeds_the_gain_forward() {
    let error = error_of_feedforward(parts(), 5000);
    assert!(error < 1e-9, "{error} um");
}

#[test]
fn the_gain_behind_an_amplifier_is_that_of_its_voltage() {
    let error = error_of_sub_steps(dynamic());
    assert!(error < 2e-3, "{error} um");
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
