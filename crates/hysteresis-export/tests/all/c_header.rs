//! The header has the numbers of the stage, and names that C takes.

use hysteresis_control::binary::Binary;
use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{PEAK_SENSITIVITY, RelaxingPlays, Stage, StageParts, Units};
use hysteresis_core::{Biquad, CoupledPlay, Duhem, ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Ratios};
use hysteresis_export::{HeaderOptions, c_header};

fn parts() -> StageParts {
    let offsets = Offsets { input: 0.1, output: -1.0 / 3.0 };
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[0.1, 1e-7], &[0.0, 7.0], Ratios::PAPER, offsets).unwrap();
    StageParts {
        limits: Some((-30.0, 150.0)),
        dynamics: SecondOrder::new(800.0, 0.02).unwrap().into(),
        output_map: Some(PiecewiseLinearMap::new(&[0.0, 1.0, 2.0], &[0.0, 1.1, 2.0]).unwrap()),
        ..StageParts::new(model)
    }
}

fn header(stage: &Stage, dt: Option<f64>) -> String {
    c_header(stage, &HeaderOptions { name: "axis", dt, sha256: None }).unwrap()
}

/// The numbers between the braces behind a name.
fn array(header: &str, name: &str) -> Vec<f64> {
    let (_, rest) = header.split_once(&format!(" axis_{name}[")).unwrap();
    let (_, rest) = rest.split_once("= {").unwrap();
    let (inside, _) = rest.split_once("};").unwrap();
    inside
        .split(',')
        .map(|x| x.trim_matches([' ', '\n', '{', '}']))
        .filter(|x| !x.is_empty())
        .map(|x| x.parse().unwrap())
        .collect()
}

fn number(header: &str, name: &str) -> f64 {
    let (_, rest) = header.split_once(&format!("#define AXIS_{name} ((AXIS_REAL)")).unwrap();
    rest.split_once(')').unwrap().0.parse().unwrap()
}

#[test]
fn numbers_come_back_bit_for_bit() {
    let stage = Stage::new(parts()).unwrap();
    let header = header(&stage, Some(1e-4));
    let model = &stage.parts().hysteresis;
    assert_eq!(array(&header, "w"), model.weights());
    assert_eq!(array(&header, "v"), model.weights());
    assert_eq!(array(&header, "ra"), model.operators().iter().map(CoupledPlay::ra).collect::<Vec<_>>());
    assert_eq!(array(&header, "output_map_y"), [0.0, 1.1, 2.0]);
    assert_eq!([number(&header, "INPUT_OFFSET"), number(&header, "OUTPUT_OFFSET")], [0.1, -1.0 / 3.0]);
    assert_eq!([number(&header, "SLOPE_LOW"), number(&header, "SLOPE_HIGH")], <[f64; 2]>::from(stage.slope_range()));
    let tuning = stage.tune(1e-4, PEAK_SENSITIVITY).unwrap();
    assert_eq!([number(&header, "KP"), number(&header, "KI")], [tuning.kp, tuning.ki]);
    let filters = hysteresis_control::filters::sections(&tuning.filters, 1e-4).unwrap();
    let expected: Vec<f64> = filters.as_slice().iter().flat_map(Biquad::numerator).collect();
    assert!(!expected.is_empty(), "a lightly damped mode has filters");
    assert_eq!(array(&header, "filter_b"), expected);
}

#[test]
fn an_operator_beside_the_others_has_its_tables() {
    for sign in [1.0, -1.0] {
        let duhem = Duhem::from_bouc_wen(sign * 0.05, 0.03, 0.7, sign * 0.3).unwrap();
        let stage = Stage::new(StageParts { duhem: Some(Box::new(duhem)), ..parts() }).unwrap();
        let header = header(&stage, None);
        assert!(header.contains("#define AXIS_DUHEM_KNOTS 3\n"), "{header}");
        assert_eq!(array(&header, "duhem_knots"), duhem.knots().collect::<Vec<_>>());
        assert_eq!(array(&header, "duhem_rising"), duhem.rising().collect::<Vec<_>>());
        assert_eq!(array(&header, "duhem_falling"), duhem.falling().collect::<Vec<_>>());
    }
}

#[test]
fn plays_that_relax_have_their_tables() {
    let (thresholds, times) = ([0.0, 9.0, 30.0], [0.01, 0.3]);
    let plays = RelaxingPlays::new(&thresholds, 4.0, &times, &[vec![0.01, 0.02, 0.0], vec![0.0, 0.03, 0.04]]).unwrap();
    let stage = Stage::new(StageParts { relaxing_plays: Some(plays), ..parts() }).unwrap();
    let header = header(&stage, None);
    for count in ["RELAXING_PLAYS 3", "RELAXING_LAGS 2"] {
        assert!(header.contains(&format!("#define AXIS_{count}\n")), "{header}");
    }
    assert_eq!(array(&header, "relaxing_thresholds"), thresholds);
    assert_eq!(array(&header, "relaxing_origin"), [4.0]);
    assert_eq!(array(&header, "relaxing_time_constants"), times);
    assert_eq!(array(&header, "relaxing_weights"), [0.01, 0.02, 0.0, 0.0, 0.03, 0.04]);
}

#[test]
fn what_the_stage_lacks_is_not_there() {
    let bare = StageParts { limits: None, output_map: None, ..parts() };
    let header = header(&Stage::new(bare).unwrap(), None);
    for there in
        ["HAS_LIMITS", "HAS_SLEW", "OUTPUT_MAP_POINTS", "DUHEM_KNOTS", "RELAXING_PLAYS", "HAS_SLOW_GAIN", "CREEP_TERMS"]
    {
        assert!(header.contains(&format!("AXIS_{there} 0\n")), "{there}");
    }
    for missing in [
        "LIMIT_LOW",
        "AXIS_SLEW",
        "output_map_x",
        "duhem_",
        "relaxing_",
        "slow_gain",
        "creep_amplitudes",
        "AXIS_DT",
        "AXIS_KP",
    ] {
        assert!(!header.contains(missing), "{missing}");
    }
}

#[test]
fn the_stage_is_in_it_as_bytes() {
    let stage = Stage::new(parts()).unwrap();
    let header = header(&stage, None);
    let (_, rest) = header.split_once("axis_stage[").unwrap();
    let (_, rest) = rest.split_once("= {").unwrap();
    let digits = |x: &str| x.trim().strip_prefix("0x").map(|x| u8::from_str_radix(x, 16).unwrap());
    let bytes: Vec<u8> = rest.split_once("};").unwrap().0.split(',').filter_map(digits).collect();
    assert_eq!(Stage::from_bytes(&bytes), Ok(stage));
}

#[test]
fn names_are_checked_and_units_end_no_comment() {
    let units = Units { drive: "*/ #error\n".into(), position: "\u{b5}m\\".into() };
    let stage = Stage::new(StageParts { units, ..parts() }).unwrap();
    let header = header(&stage, None);
    assert!(!header.contains("#error\n") && !header.contains('\\'), "{header}");
    for name in ["", "2nd", "a b", "a-b", "\u{e4}"] {
        let error = c_header(&stage, &HeaderOptions { name, dt: None, sha256: None }).unwrap_err().to_string();
        assert!(error.starts_with("name: expected a name of C"), "{error}");
    }
    let error = c_header(&stage, &HeaderOptions { name: "a", dt: Some(f64::NAN), sha256: None }).unwrap_err();
    assert_eq!(error.parameter(), Some("dt"));
}
