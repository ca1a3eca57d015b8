//! What a stage says of its errors before it is driven.

use hysteresis_control::stage::{CELLS, Error, ErrorBand, PrecompensateOptions, Stage, StageParts};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};

const DT: f64 = 1e-3;

fn parts() -> StageParts {
    let hysteresis =
        ModifiedPrandtlIshlinskii::from_ratios(&[0.5, 0.1], &[0.0, 20.0], Ratios::PLAY, Offsets::default());
    StageParts { limits: Some((0.0, 100.0)), ..StageParts::new(hysteresis.unwrap()) }
}

/// A stage that is wrong by 0.1 um rms where the drive goes up from rest, and by 0.4 um elsewhere.
fn stage() -> Stage {
    let mut errors = vec![vec![0.4; CELLS]; CELLS];
    errors[0] = vec![0.1; CELLS];
    let band = ErrorBand::new(0.0, (0.0, 100.0), 5.0, errors, vec![(1e6, 1.0)], vec![(10.0, 1.0)]);
    Stage::new(StageParts { error_band: Some(band.unwrap()), ..parts() }).unwrap()
}

/// Up to the top of the reference and half way down again.
fn reference(top: f64) -> Vec<f64> {
    (0..=300).map(|k| f64::from(if k <= 200 { k } else { 400 - k }) * top / 200.0).collect()
}

#[test]
fn bounds_are_those_of_the_place_of_every_drive() {
    let (stage, options, reference) = (stage(), PrecompensateOptions::default(), reference(20.0));
    let found = stage.precompensate(&reference, DT, &options).unwrap();
    let bounds = stage.error_bounds(&found, &reference, DT, &options, 0.95).unwrap();
    for (k, expected) in [(100, 0.1), (199, 0.1), (300, 0.4)] {
        assert!((bounds.high[k] - 1.96 * expected).abs() < 1e-3, "{k}: {}", bounds.high[k]);
        assert!((bounds.high[k] + bounds.low[k]).abs() < 1e-9, "{k}");
    }
    // One number for the whole is that of its widest branch, and a little more for the other one. A normal error in 32
    // is beyond 3.16 deviations with 5 %.
    assert!(bounds.within > 3.1 * 0.4 && bounds.within < 3.3 * 0.4, "{}", bounds.within);
    let narrow = stage.error_bounds(&found, &reference, DT, &options, 0.5).unwrap();
    assert!(narrow.within < bounds.within && narrow.high[100] < bounds.high[100]);
}

/// A drive that was driven before goes on from its last reversal.
#[test]
fn a_history_says_where_the_drive_turned_round() {
    let stage = stage();
    let mut bench = stage.forward(DT).unwrap();
    let here = [0.0, 100.0, 0.0].map(|drive| bench.step(drive))[2];
    let reference: Vec<f64> = (0..100).map(|k| here + 0.05 * f64::from(k)).collect();
    let options = PrecompensateOptions { history: &[0.0, 100.0, 20.0, 0.0], ..PrecompensateOptions::default() };
    let found = stage.precompensate(&reference, DT, &options).unwrap();
    let bounds = stage.error_bounds(&found, &reference, DT, &options, 0.95).unwrap();
    assert!((bounds.high[0] - 1.96 * 0.4).abs() < 0.01, "{}", bounds.high[0]);
    assert!((bounds.high[99] - 1.96 * 0.1).abs() < 0.01, "{}", bounds.high[99]);
}

/// What the limits hold back is a miss that is known.
#[test]
fn what_is_out_of_reach_is_in_the_bounds() {
    let (stage, options, reference) = (stage(), PrecompensateOptions::default(), reference(70.0));
    let found = stage.precompensate(&reference, DT, &options).unwrap();
    assert!(found.saturated_count > 0);
    let bounds = stage.error_bounds(&found, &reference, DT, &options, 0.95).unwrap();
    assert!(bounds.high[200] < -5.0 && bounds.within > 5.0, "{} {}", bounds.high[200], bounds.within);
}

#[test]
fn a_stage_of_parts_alone_and_an_old_file_know_no_band() {
    let text = stage().to_json();
    assert_eq!(Stage::from_json(&text).unwrap(), stage());
    let mut old: serde_json::Value = serde_json::from_str(&text).unwrap();
    old.as_object_mut().unwrap().remove("error_band").unwrap();
    let old = Stage::from_json(&old.to_string()).unwrap();
    assert_eq!(old, Stage::new(parts()).unwrap());
    let (options, reference) = (PrecompensateOptions::default(), reference(20.0));
    let found = old.precompensate(&reference, DT, &options).unwrap();
    let error = old.error_bounds(&found, &reference, DT, &options, 0.95).unwrap_err();
    assert_eq!((&error, error.parameter()), (&Error::NoBand, Some("error_band")));
    assert!(error.to_string().contains("identify it from records"));
}

#[test]
fn a_band_that_no_stage_can_have_is_refused_from_a_file() {
    let text = stage().to_json().replace("\"loop_width\": 5.0", "\"loop_width\": -5.0");
    let error = Stage::from_json(&text).unwrap_err().to_string();
    assert!(error.contains("loop_width") && error.contains("-5.0"), "{error}");
}

/// Other parts have other errors; other limits do not.
#[test]
fn a_band_goes_with_the_parts_that_it_was_found_for() {
    let stage = stage();
    let with = |parts| stage.with_parts(parts).unwrap().error_band().is_ok();
    assert!(with(StageParts { limits: Some((0.0, 50.0)), error_band: None, ..parts() }));
    assert!(!with(StageParts { dead_time: 1e-3, ..parts() }));
    let other = ModifiedPrandtlIshlinskii::from_ratios(&[0.6], &[0.0], Ratios::PLAY, Offsets::default()).unwrap();
    assert!(!with(StageParts { hysteresis: other, ..stage.parts().clone() }));
}
