//! A stage with a Duhem operator beside its plays.

use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_core::{Duhem, Offsets, PiecewiseLinearMap, PrandtlIshlinskii, Process};

use crate::support::past_drives::{
    creeping, error_behind_inverse, error_in_open_loop, error_of_feedforward, error_of_sub_steps, reference,
    with_a_mode,
};

/// A third of the stroke.
fn parts() -> StageParts {
    let duhem = Duhem::from_bouc_wen(0.5, 0.03, 0.7, 0.3).unwrap();
    StageParts { duhem: Some(Box::new(duhem)), ..creeping() }
}

fn dynamic() -> StageParts {
    with_a_mode(parts())
}

/// One that falls, as in the piezo form of Bouc-Wen's model.
fn falling() -> StageParts {
    let duhem = Duhem::from_bouc_wen(-0.2, 0.03, 0.7, -0.3).unwrap();
    StageParts { duhem: Some(Box::new(duhem)), ..creeping() }
}

#[test]
fn forward_of_inverse_is_the_target() {
    for parts in [parts(), falling()] {
        let error = error_behind_inverse(parts);
        assert!(error < 1e-11 * 100.0, "{error} um");
    }
}

#[test]
fn open_loop_follows_a_reference_that_plays_miss() {
    let reference = reference(10_000);
    let stage = Stage::new(dynamic()).unwrap();
    let plays = Stage::new(StageParts { duhem: None, ..dynamic() }).unwrap();
    let error = |model: &Stage| error_in_open_loop(&stage, model, &reference, 5000);
    let (with, without) = (error(&stage), error(&plays));
    assert!(with < 0.02 && without > 10.0 * with, "{with} {without} um");
}

#[test]
fn a_controller_feeds_it_forward() {
    for parts in [parts(), falling()] {
        let error = error_of_feedforward(parts, 5000);
        assert!(error < 1e-9, "{error} um");
    }
}

#[test]
fn behind_an_amplifier_it_has_its_voltage() {
    for parts in [dynamic(), with_a_mode(falling())] {
        let error = error_of_sub_steps(parts);
        assert!(error < 2e-3, "{error} um");
    }
}

#[test]
fn what_the_stage_reaches_holds_for_loops_that_drift() {
    let stage = Stage::new(StageParts { creep: None, ..parts() }).unwrap();
    let without = Stage::new(StageParts { duhem: None, ..stage.parts().clone() }).unwrap();
    let (low, high) = stage.position_range().unwrap();
    let mut forward = stage.forward(1e-4).unwrap();
    forward.step(150.0);
    for _ in 0..100 {
        let ends = [-30.0, 150.0].map(|drive| forward.step(drive));
        assert!(ends[0] <= low + 1e-9 && ends[1] >= high - 1e-9, "{ends:?} {low} {high}");
    }
    let ((flat, steep), (plays, most)) = (stage.slope_range(), without.slope_range());
    assert!(flat >= plays && steep > most + 0.4, "{flat} {steep}, plays alone {plays} {most}");
    // Behind maps the steepest slope of one that falls is the least.
    let map = |top| PiecewiseLinearMap::new(&[-60.0, 0.0, 60.0], &[-60.0, 0.0, top]).unwrap();
    let steep = Duhem::new(&[-1.0, 1.0], &[-0.5; 2], &[-0.5; 2]).unwrap();
    let line = PrandtlIshlinskii::new(&[0.1], &[0.0], Offsets::default()).unwrap();
    let parts = StageParts { duhem: Some(Box::new(steep)), ..StageParts::new((&line).into()) };
    let parts = StageParts { input_map: Some(map(120.0)), ..parts };
    let turned = Stage::new(parts).unwrap();
    assert_eq!(turned.slope_range(), (-0.8, -0.4));
    let refused = turned.tune(1e-3, 1.3).unwrap_err().to_string();
    assert!(refused.starts_with("duhem: expected a Duhem operator that falls less"), "{refused}");
    let (flatter, less) = Stage::new(StageParts { creep: None, ..falling() }).unwrap().slope_range();
    assert!(0.0 < flatter && flatter < plays - 0.2 && less < most, "{flatter} {less}");
}

#[test]
fn another_operator_is_another_stage() {
    for parts in [parts(), falling()] {
        let stage = Stage::new(parts).unwrap();
        assert_eq!(Stage::from_json(&stage.to_json()).unwrap(), stage);
    }
    let stage = Stage::new(parts()).unwrap();
    let plays = stage.with_parts(StageParts { duhem: None, ..parts() }).unwrap();
    assert_ne!(plays, stage);
    let state = stage.forward(1e-4).unwrap().state();
    assert!(plays.forward(1e-4).unwrap().set_state(&state).is_err());
    let mut text = stage.to_json();
    text = text.replacen("\"rising\"", "\"raising\"", 1);
    assert!(Stage::from_json(&text).unwrap_err().to_string().contains("raising"));
}
