//! What a stage says of its limits, its ranges and its slope, and what a controller of it gets.

use hysteresis_control::linear::{Creep, StateSpace};
use hysteresis_control::stage::{Error, Identified, Stage, StageParts};
use hysteresis_core::{MAX_MAGNITUDE, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Process, Ratios};
use proptest::collection::vec;
use proptest::prelude::*;

type Range = Option<(f64, f64)>;

/// Slope 2, without hysteresis, so that numbers are exact.
fn parts(limits: Range) -> StageParts {
    let hysteresis = ModifiedPrandtlIshlinskii::from_ratios(&[2.0], &[0.0], Ratios::PAPER, Offsets::default()).unwrap();
    StageParts { limits, ..StageParts::new(hysteresis) }
}

/// Identified between these drives, with positions that are no others' range.
fn identified(drive_range: (f64, f64)) -> Identified {
    Identified {
        drive_range,
        position_range: (-7.0, 8.0),
        dt: Vec::new(),
        rmse: 0.0,
        max_error: 0.0,
        parameters: Vec::new(),
        covariance: Vec::new(),
        warnings: Vec::new(),
        records: Vec::new(),
    }
}

fn stage(limits: Range, drive_range: Range) -> Stage {
    Stage::new(StageParts { identified: drive_range.map(identified), ..parts(limits) }).unwrap()
}

#[test]
fn drives_stay_within_limits_and_what_was_identified() {
    let (wide, narrow) = (Some((-10.0, 150.0)), Some((20.0, 80.0)));
    for (limits, drive_range, expected) in [
        (None, None, None),
        (wide, None, wide),
        (None, wide, wide),
        (wide, narrow, narrow),
        (narrow, wide, narrow),
        (Some((-10.0, 50.0)), narrow, Some((20.0, 50.0))),
        // What was identified elsewhere says nothing; a range of one drive is none.
        (Some((-10.0, 10.0)), narrow, Some((-10.0, 10.0))),
        (Some((-10.0, 20.0)), narrow, Some((-10.0, 20.0))),
        (Some((80.0, 90.0)), narrow, Some((80.0, 90.0))),
    ] {
        let stage = stage(limits, drive_range);
        assert_eq!(stage.drive_range(), expected, "{limits:?} {drive_range:?}");
        assert_eq!(stage.limits(None).unwrap(), expected, "{limits:?} {drive_range:?}");
    }
}

#[test]
fn limits_extrapolate_that_reach_farther_than_a_thousandth_of_the_range() {
    let range = (50.0, 150.0);
    for (limits, extrapolates) in [
        ((50.0, 150.0), false),
        ((60.0, 140.0), false),
        ((49.95, 150.05), false),
        ((49.89, 150.0), true),
        ((50.0, 150.11), true),
        ((49.0, 140.0), true),
        ((60.0, 151.0), true),
    ] {
        assert_eq!(stage(None, Some(range)).extrapolates(limits), extrapolates.then_some(range), "{limits:?}");
        assert_eq!(stage(Some(limits), Some(range)).is_narrowed(), extrapolates, "{limits:?}");
    }
    assert_eq!(stage(None, None).extrapolates((-1e9, 1e9)), None);
    assert!(stage(None, Some(range)).is_narrowed() && !stage(None, None).is_narrowed());
}

#[test]
fn given_limits_lie_within_those_of_the_stage() {
    let bounded = stage(Some((-10.0, 150.0)), None);
    for given in [(-10.0, 150.0), (-10.0, 0.0), (5.0, 150.0), (5.0, 6.0)] {
        assert_eq!(bounded.limits(Some(given)).unwrap(), Some(given));
        assert_eq!(stage(None, None).limits(Some(given)).unwrap(), Some(given));
    }
    for (given, message) in [
        ((-11.0, 0.0), "limits[0]: expected a number from -10.0 to 150.0, got -11.0"),
        ((0.0, 151.0), "limits[1]: expected a number from -10.0 to 150.0, got 151.0"),
        ((160.0, 170.0), "limits[0]: expected a number from -10.0 to 150.0, got 160.0"),
        ((5.0, 5.0), "limits[1]: expected a number above the low limit = 5.0, got 5.0"),
    ] {
        assert_eq!(bounded.limits(Some(given)).unwrap_err().to_string(), message);
    }
}

#[test]
fn a_stage_rests_at_0_or_the_limit_nearest_to_it() {
    for (limits, rest) in
        [(None, 0.0), (Some((-10.0, 150.0)), 0.0), (Some((20.0, 150.0)), 20.0), (Some((-9.0, -4.0)), -4.0)]
    {
        assert_eq!(stage(limits, None).rest_drive(), rest);
    }
}

#[test]
fn positions_lie_where_the_drives_lead() {
    assert_eq!(stage(None, None).position_range(), None);
    assert_eq!(stage(Some((-10.0, 150.0)), None).position_range(), Some((-20.0, 300.0)));
    // The positions of the records may hold ringing.
    assert_eq!(stage(Some((-10.0, 150.0)), Some((0.0, 1.0))).position_range(), Some((0.0, 2.0)));
    assert_eq!(stage(Some((-10.0, 0.5)), Some((0.0, 1.0))).position_range(), Some((0.0, 1.0)));
    let falling = PiecewiseLinearMap::new(&[0.0, 1.0], &[5.0, 4.0]).unwrap();
    let falling = Stage::new(StageParts { output_map: Some(falling), ..parts(Some((-10.0, 150.0))) }).unwrap();
    assert_eq!(falling.position_range(), Some((-295.0, 25.0)));
    for (gain, expected) in [(0.5, (-10.0, 150.0)), (-1.0, (-300.0, 20.0))] {
        let dynamics = StateSpace::from_gain(gain).unwrap().into();
        let stage = Stage::new(StageParts { dynamics, ..parts(Some((-10.0, 150.0))) }).unwrap();
        assert_eq!(stage.position_range(), Some(expected));
    }
}

/// Creep has come to rest at the other end, but takes no more than half of the range.
#[test]
fn creep_narrows_the_range_of_positions() {
    for (amplitudes, expected) in [
        ([0.0, 0.0], (0.0, 300.0)),
        ([0.0, 0.1], (30.0, 300.0)),
        ([0.1, 0.1], (60.0, 300.0)),
        ([0.0, -0.1], (0.0, 270.0)),
        ([0.1, -0.1], (30.0, 270.0)),
        ([2.0, 1.0], (450.0 + 75.0, 450.0 + 225.0)),
    ] {
        let creep = Some(Creep::new(&amplitudes, &[1.0, 10.0]).unwrap());
        let found = Stage::new(StageParts { creep, ..parts(Some((0.0, 150.0))) }).unwrap().position_range().unwrap();
        let misses = (found.0 - expected.0).abs().max((found.1 - expected.1).abs());
        assert!(misses < 1e-12, "{amplitudes:?}: {found:?}");
    }
}

proptest! {
    /// Whatever the history, both ends of the range of positions are reached, and the remanence is not within it.
    #[test]
    fn every_history_leads_to_the_whole_range_of_positions(
        weights in vec(0.01..1.0, 4),
        low in -150.0..0.0,
        size in 20.0..200.0,
        amplitude in -0.2..0.2,
        history in vec(0.0..1.0, 0..30),
    ) {
        let hysteresis =
            ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 10.0, 40.0, 90.0], Ratios::PAPER, Offsets::default())
                .unwrap();
        let creep = Some(Creep::new(&[amplitude], &[0.02]).unwrap());
        let stage =
            Stage::new(StageParts { creep, limits: Some((low, low + size)), ..StageParts::new(hysteresis) }).unwrap();
        let (lowest, highest) = stage.position_range().unwrap();
        let rigid = Stage::new(StageParts { creep: None, ..stage.parts().clone() }).unwrap();
        let ends = rigid.position_range().unwrap();
        // Creep that may take more than the half promises less.
        prop_assume!(highest - lowest > 0.51 * (ends.1 - ends.0));
        let (mut inverse, mut bench) = (stage.inverse(1e-3, None).unwrap(), stage.forward(1e-3).unwrap());
        // Each drive for long, so that creep ends.
        for share in history {
            let held = vec![low + share * size; 300];
            inverse.follow(&held).unwrap();
            bench.follow(&held).unwrap();
        }
        for target in [lowest, highest, lowest] {
            let missed = (bench.step(inverse.step(target)) - target).abs();
            prop_assert!(missed < 1e-9 * (highest - lowest), "{target}: {missed}");
        }
        let mut remanence = rigid.forward(1e-3).unwrap();
        remanence.follow(&[low + size, low]).unwrap();
        prop_assert_eq!(remanence.output(), ends.0);
    }
}

#[test]
fn a_history_without_limits_lies_between_the_largest_numbers() {
    assert_eq!(stage(None, None).bracket(None).unwrap().limits(), (-MAX_MAGNITUDE, MAX_MAGNITUDE));
    assert_eq!(stage(Some((-10.0, 150.0)), None).bracket(None).unwrap().limits(), (-10.0, 150.0));
    assert_eq!(stage(Some((-10.0, 150.0)), None).bracket(Some((0.0, 1.0))).unwrap().limits(), (0.0, 1.0));
}

/// Slopes multiply; creep adds to the highest slope, or takes from the lowest.
#[test]
fn slopes_are_those_of_maps_hysteresis_creep_and_gain() {
    let input = PiecewiseLinearMap::new(&[0.0, 1.0, 2.0], &[0.0, 3.0, 8.0]).unwrap();
    let output = PiecewiseLinearMap::new(&[0.0, 1.0, 2.0], &[0.0, 0.5, 0.75]).unwrap();
    let gain = || StateSpace::from_gain(-4.0).unwrap().into();
    let creep = |amplitude| Some(Creep::new(&[amplitude], &[1.0]).unwrap());
    let plain = || StageParts { dynamics: gain(), ..parts(None) };
    for (parts, expected) in [
        (parts(None), (2.0, 2.0)),
        (plain(), (8.0, 8.0)),
        (StageParts { input_map: Some(input.clone()), ..plain() }, (24.0, 40.0)),
        (StageParts { output_map: Some(output.clone()), ..plain() }, (2.0, 4.0)),
        (StageParts { input_map: Some(input.clone()), output_map: Some(output), ..plain() }, (6.0, 20.0)),
        (StageParts { creep: creep(0.25), ..plain() }, (8.0, 10.0)),
        (StageParts { creep: creep(-0.25), ..plain() }, (6.0, 8.0)),
        (StageParts { input_map: Some(input), creep: creep(0.25), ..plain() }, (24.0, 50.0)),
    ] {
        assert_eq!(Stage::new(parts).unwrap().slope_range(), expected);
    }
}

#[test]
fn stages_of_other_parts_are_not_equal() {
    assert_eq!(stage(None, None), stage(None, None));
    assert_ne!(stage(None, None), stage(Some((-10.0, 150.0)), None));
}

/// Each part that falls turns the sign, and two of them turn it back.
#[test]
fn feedback_needs_a_position_that_rises() {
    let map = |falls: bool| {
        let y = if falls { [1.0, 0.0] } else { [0.0, 1.0] };
        Some(PiecewiseLinearMap::new(&[0.0, 1.0], &y).unwrap())
    };
    for (input, output, gain) in [false, true]
        .into_iter()
        .flat_map(|input| [false, true].map(|output| (input, output)))
        .flat_map(|(input, output)| [false, true].map(|gain| (input, output, gain)))
    {
        let dynamics = StateSpace::from_gain(if gain { -1.0 } else { 1.0 }).unwrap().into();
        let parts =
            StageParts { input_map: map(input), output_map: map(output), dynamics, ..parts(Some((-10.0, 150.0))) };
        let made = Stage::new(parts).unwrap().controller_options_with_gains(1e-4, None, (0.1, 10.0));
        let falls = input ^ output ^ gain;
        assert_eq!(made.err(), falls.then_some(Error::Falling), "{input} {output} {gain}");
    }
}

#[test]
fn a_controller_gets_the_limits_and_a_gate_a_stroke_wider_than_the_positions() {
    let limits = (20.0, 150.0);
    let stage = Stage::new(StageParts { slew: Some(2e3), ..parts(Some(limits)) }).unwrap();
    let options = stage.controller_options_with_gains(1e-4, None, (0.1, 10.0)).unwrap();
    assert_eq!((options.kp, options.ki, options.dt), (0.1, 10.0, 1e-4));
    assert_eq!((options.limits, options.slew, options.start_drive), (limits, Some(2e3), Some(20.0)));
    // Positions from 40 to 300.
    assert_eq!(options.measurement_range, Some((-220.0, 560.0)));
    let options = stage.controller_options_with_gains(1e-4, Some((30.0, 40.0)), (0.1, 10.0)).unwrap();
    assert_eq!((options.limits, options.start_drive), ((30.0, 40.0), Some(30.0)));
    let boundless = Stage::new(parts(None)).unwrap();
    assert_eq!(boundless.controller_options_with_gains(1e-4, None, (0.1, 10.0)).unwrap_err(), Error::NoLimits);
}
