//! A stage whose loops shift.

use hysteresis_control::stage::{Identified, LoopShift, PrecompensateOptions, Stage, StageParts, StageState};
use hysteresis_core::{PiecewiseLinearMap, Process};

use crate::support::past_drives::{
    DT, creeping, error_behind_inverse, error_in_open_loop, error_of_feedforward, error_of_sub_steps, largest,
    reference, with_a_mode,
};

fn loop_shift() -> LoopShift {
    LoopShift::new(75.0, 75.0, [-8.0, 3.0], 0.02, 0.5).unwrap()
}

/// What the shift adds is up to 3 um.
fn parts() -> StageParts {
    let input_map = Some(PiecewiseLinearMap::new(&[0.0, 50.0, 150.0], &[0.0, 55.0, 150.0]).unwrap());
    StageParts { loop_shift: Some(loop_shift()), input_map, ..creeping() }
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
fn open_loop_follows_a_reference_that_a_rigid_model_misses() {
    let reference = reference(4000);
    let stage = Stage::new(dynamic()).unwrap();
    let rigid = Stage::new(StageParts { loop_shift: None, ..dynamic() }).unwrap();
    let error = |model: &Stage| error_in_open_loop(&stage, model, &reference, 1000);
    let (with, without) = (error(&stage), error(&rigid));
    assert!(with < 1e-3 && without > 0.5, "{with} {without}");
}

#[test]
fn a_lead_in_begins_where_the_loop_is_still_shifted() {
    let stage = Stage::new(dynamic()).unwrap();
    let history: Vec<f64> = (0..700).map(|k| 75.0 - 75.0 * (0.02 * f64::from(k)).cos()).collect();
    let reference: Vec<f64> = reference(3000).iter().map(|r| r + 20.0).collect();
    let options =
        PrecompensateOptions { history: &history, lead_in: Some(0.05), start: Some(0.0), ..Default::default() };
    let found = stage.precompensate(&reference, DT, &options).unwrap();
    assert!(found.first_step.abs() < 0.05, "{} V", found.first_step);
    let mut bench = stage.forward(DT).unwrap();
    bench.settle(0.0);
    bench.follow(&history).unwrap();
    let rows: Vec<f64> = found.drive.iter().map(|u| bench.step(*u)).collect();
    let error = largest(rows[500..].iter().zip(&reference).map(|(y, r)| y - r));
    assert!(error < 5e-3, "{error} um");
}

#[test]
fn a_controller_feeds_the_shift_forward() {
    let error = error_of_feedforward(parts(), 3000);
    assert!(error < 1e-9, "{error} um");
}

#[test]
fn the_shift_behind_an_amplifier_is_that_of_its_voltage() {
    let error = error_of_sub_steps(dynamic());
    assert!(error < 2e-3, "{error} um");
}

#[test]
fn at_rest_nothing_moves() {
    let mut forward = Stage::new(dynamic()).unwrap().forward(DT).unwrap();
    let rest = forward.settle(60.0);
    assert!(largest((0..500).map(|_| forward.advance(60.0) - rest)) < 1e-12);
}

#[test]
fn a_stage_file_keeps_the_shift_and_others_stay_as_they_were() {
    let stage = Stage::new(dynamic()).unwrap();
    let text = stage.to_json();
    assert_eq!(Stage::from_json(&text).unwrap(), stage);
    let rigid = Stage::new(StageParts { loop_shift: None, ..dynamic() }).unwrap();
    assert!(!rigid.to_json().contains("loop_shift"));
    assert_eq!(Stage::from_json(&rigid.to_json()).unwrap(), rigid);
    assert_ne!(stage, rigid);
    for (from, to, message) in [
        ("\"half_range\": 75.0", "\"half_range\": -75.0", "half_range: expected a number above 0"),
        ("\"time_constant\": 0.02", "\"time_constant\": 0.0", "time_constant: expected a finite number above 0"),
        ("\"limit\": 0.5", "\"limit\": 0.5, \"rate\": 1.0", "unknown field `rate`"),
        ("\"half_range\": 75.0,", "", "missing field `half_range`"),
    ] {
        assert!(text.contains(from), "{from}");
        let error = Stage::from_json(&text.replace(from, to)).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    }
}

#[test]
fn states_continue_bit_for_bit_and_may_leave_the_shift_out() {
    let stage = Stage::new(dynamic()).unwrap();
    let (mut one, mut other) = (stage.forward(DT).unwrap(), stage.forward(DT).unwrap());
    let drives = reference(400);
    one.follow(&drives).unwrap();
    let text = serde_json::to_string(&one.state()).unwrap();
    other.set_state(&serde_json::from_str::<StageState>(&text).unwrap()).unwrap();
    for drive in &drives {
        assert_eq!(one.step(*drive).to_bits(), other.step(*drive).to_bits());
    }
    // A state may leave out the loop shift that its stage does not have.
    let rigid = Stage::new(StageParts { loop_shift: None, ..dynamic() }).unwrap();
    let mut saved = serde_json::to_value(rigid.forward(DT).unwrap().state()).unwrap();
    assert!(saved["quasi_static"].as_object_mut().unwrap().remove("loop_shift").is_some());
    let shorter: StageState = serde_json::from_value(saved).unwrap();
    rigid.forward(DT).unwrap().set_state(&shorter).unwrap();
    let error = one.set_state(&shorter).unwrap_err().to_string();
    assert!(error.starts_with("state.model: expected"), "{error}");
}

#[test]
fn another_shift_takes_the_errors_of_the_identification() {
    let identified = Identified {
        drive_range: (0.0, 150.0),
        position_range: (0.0, 80.0),
        dt: vec![DT],
        rmse: 0.01,
        max_error: 0.1,
        parameters: vec!["w[0]".into()],
        covariance: vec![vec![1e-6]],
        warnings: Vec::new(),
        records: Vec::new(),
    };
    let stage = Stage::new(StageParts { identified: Some(identified), ..dynamic() }).unwrap();
    let same = stage.with_parts(StageParts { slew: Some(1e5), ..stage.parts().clone() }).unwrap();
    assert_eq!(same.parts().identified, stage.parts().identified);
    let rigid = stage.with_parts(StageParts { loop_shift: None, ..stage.parts().clone() }).unwrap();
    let known = rigid.parts().identified.as_ref().unwrap();
    assert!(known.rmse.is_nan() && known.covariance.is_empty());
    assert_eq!(known.drive_range, (0.0, 150.0));
}

#[test]
fn bad_numbers_are_named() {
    let made = |center, half_range, amplitudes, tau, limit| {
        LoopShift::new(center, half_range, amplitudes, tau, limit).unwrap_err().to_string()
    };
    let good = [1.0, 2.0];
    assert!(made(f64::INFINITY, 1.0, good, 1.0, 1.0).starts_with("center: expected"));
    assert!(made(0.0, 0.0, good, 1.0, 1.0).starts_with("half_range: expected"));
    assert!(made(0.0, 1.0, [f64::NAN, 0.0], 1.0, 1.0).starts_with("amplitudes[0]: expected"));
    assert!(made(0.0, 1.0, good, -1.0, 1.0).starts_with("time_constant: expected"));
    assert!(made(0.0, 1.0, good, 1.0, f64::INFINITY).starts_with("limit: expected"));
    assert!(loop_shift().terms(0.0).unwrap_err().to_string().starts_with("dt: expected"));
}
