//! What runs in a unit is what the stage makes, and its description has its variables.

use std::sync::LazyLock;

use hysteresis_control::linear::{Creep, SecondOrder};
use hysteresis_control::stage::{FeedForwardKind, Stage, StageParts, Units};
use hysteresis_core::{Duhem, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
use hysteresis_export::{Kind, MockUp, Settings, Simulation, Source};
use proptest::prelude::*;

const DT: f64 = 1e-4;

fn parts() -> StageParts {
    let weights = [0.112, 0.02, 0.03];
    let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &[0.0, 7.0, 20.0], Ratios::PAPER, Offsets::default());
    StageParts {
        creep: Some(Creep::logarithmic(0.012, 0.01, 100.0, 4).unwrap()),
        dynamics: SecondOrder::new(800.0, 0.3).unwrap().into(),
        dead_time: DT,
        limits: Some((-30.0, 150.0)),
        slew: Some(2e5),
        ..StageParts::new(model.unwrap())
    }
}

fn stage() -> Stage {
    Stage::new(parts()).unwrap()
}

/// The same without a Duhem operator, with one that adds, and with one that is subtracted.
fn stages() -> [Stage; 3] {
    [0.0, 1.0, -1.0].map(|sign: f64| {
        let duhem = (sign != 0.0).then(|| Duhem::from_bouc_wen(sign * 0.03, 0.01, 0.7, sign * 0.3).unwrap());
        Stage::new(StageParts { duhem: duhem.map(Box::new), ..parts() }).unwrap()
    })
}

fn made_of(stage: &Stage, kind: Kind) -> Simulation {
    Simulation::new(stage, &Settings::new(kind, DT)).unwrap()
}

fn made(kind: Kind) -> Simulation {
    made_of(&stage(), kind)
}

/// The same, made once: tuning takes a second.
fn fresh(kind: Kind) -> Simulation {
    static MADE: LazyLock<[Simulation; 3]> =
        LazyLock::new(|| [Kind::Forward, Kind::Inverse, Kind::Controller].map(made));
    MADE[kind as usize].clone()
}

fn signal() -> impl Iterator<Item = f64> {
    let bad = [f64::NAN, f64::INFINITY, -1e200];
    (0_u32..400).map(move |k| if k % 50 == 7 { bad[(k / 50 % 3) as usize] } else { f64::from(k * k % 97) - 20.0 })
}

#[test]
fn a_forward_unit_is_the_plant_in_a_loop() {
    for stage in stages() {
        let (mut unit, mut plant) = (made_of(&stage, Kind::Forward), stage.forward(DT).unwrap());
        assert_eq!(unit.real(1), Ok(plant.output()));
        for drive in signal().map(|x| 3.0 * x) {
            unit.set_real(0, drive).unwrap();
            unit.step(DT).unwrap();
            assert_eq!(unit.real(1).unwrap().to_bits(), plant.advance(drive).to_bits());
        }
        assert_eq!((unit.integer(2), unit.integer(3)), (Ok(8), Ok(plant.clamped().try_into().unwrap())));
        assert!(plant.clamped() > 0);
    }
}

#[test]
fn an_inverse_unit_is_the_inverse() {
    for stage in stages() {
        let (mut unit, mut inverse) = (made_of(&stage, Kind::Inverse), stage.inverse(DT, None).unwrap());
        for target in signal().map(|x| 0.4 * x) {
            unit.set_real(0, target).unwrap();
            unit.step(DT).unwrap();
            assert_eq!(unit.real(1).unwrap().to_bits(), inverse.step(target).to_bits());
            assert_eq!((unit.real(2), unit.boolean(3)), (Ok(inverse.position()), Ok(inverse.saturated())));
        }
        assert_eq!(unit.integer(4), Ok(8));
    }
}

#[test]
fn controller_units_are_the_controllers() {
    stages().iter().for_each(a_controller_unit_is_the_controller);
}

fn a_controller_unit_is_the_controller(stage: &Stage) {
    let options = stage.controller_options(DT, None).unwrap();
    let given = stage.controller_options_with_gains(DT, None, (0.5, 40.0)).unwrap();
    let preview = FeedForwardKind::Preview { ahead: stage.preview_ahead(DT).unwrap(), smoothing: 0.0 };
    let plain = Settings::new(Kind::Controller, DT);
    let cases = [
        (plain.clone(), FeedForwardKind::Inverse, options),
        (Settings { feedforward: Source::Preview, ..plain.clone() }, preview, options),
        (Settings { gains: Some((0.5, 40.0)), ..plain }, FeedForwardKind::Inverse, given),
    ];
    for (settings, kind, options) in cases {
        let mut unit = Simulation::new(stage, &settings).unwrap();
        let mut controller = stage.controller(kind, &options).unwrap();
        assert_eq!((unit.real(10), unit.real(11)), (Ok(options.kp), Ok(options.ki)));
        for (k, reference) in signal().map(|x| 0.4 * x).enumerate() {
            let measurement = if k % 60 == 3 { f64::NAN } else { 0.9 * reference };
            unit.set_real(0, reference).unwrap();
            unit.set_real(1, measurement).unwrap();
            unit.step(DT).unwrap();
            assert_eq!(unit.real(2).unwrap().to_bits(), controller.step(reference.into(), measurement).to_bits());
        }
        let counters = controller.counters();
        let expected = [
            counters.rejected_count,
            counters.missing_count,
            counters.implausible_count,
            counters.saturated_count,
            counters.slewing_count,
        ];
        assert_eq!([5, 6, 7, 8, 9].map(|which| u64::from(unit.integer(which).unwrap().cast_unsigned())), expected);
        assert!(expected[0] == 8 && expected[1] > 0);
    }
}

#[test]
fn a_step_of_several_samples_holds_the_inputs() {
    let (mut one, mut other) = (made(Kind::Forward), made(Kind::Forward));
    one.set_real(0, 40.0).unwrap();
    other.set_real(0, 40.0).unwrap();
    one.step(7.0 * DT).unwrap();
    (0..7).for_each(|_| other.step(DT).unwrap());
    assert_eq!(one.state(), other.state());
    // As a tool computes it, far from time 0.
    one.step((5000.0 + DT) - 5000.0).unwrap();
    for seconds in [0.0, -DT, 0.5 * DT, 1.01 * DT, 1.5 * DT, f64::NAN, f64::INFINITY, 1e300, 1e9] {
        let before = one.state();
        let error = one.step(seconds).unwrap_err().to_string();
        let expected = "communicationStepSize: expected a whole multiple of the sampling interval, 0.0001 s, got ";
        assert!(error.starts_with(expected), "{error}");
        assert_eq!(one.state(), before);
    }
}

#[test]
fn references_are_checked() {
    let mut unit = made(Kind::Inverse);
    assert_eq!(
        unit.real(9).unwrap_err().to_string(),
        "value reference: expected that of a Real of this inverse, got 9"
    );
    assert!(unit.real(3).is_err() && unit.integer(0).is_err() && unit.boolean(0).is_err());
    let error = unit.set_real(1, 0.0).unwrap_err().to_string();
    assert_eq!(error, "value reference: expected that of an input, got \"drive\"");
}

#[test]
fn settings_are_checked() {
    let stage = stage();
    for (settings, expected) in [
        (Settings::new(Kind::Forward, 0.0), "dt: expected a finite number above 0"),
        (Settings { feedforward: Source::Preview, ..Settings::new(Kind::Inverse, DT) }, "feedforward: expected none"),
        (Settings { gains: Some((1.0, 1.0)), ..Settings::new(Kind::Forward, DT) }, "gains: expected none without"),
        (Settings { gains: Some((-1.0, 1.0)), ..Settings::new(Kind::Controller, DT) }, "kp: expected a finite number"),
    ] {
        let error = MockUp::new(&stage, &settings, "x").unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    for (text, expected) in [("{}", "settings.json: expected settings of schema"), ("{", "settings.json: expected")] {
        assert!(Settings::from_json(text).unwrap_err().to_string().starts_with(expected));
    }
    let other = Settings::new(Kind::Forward, DT).to_json().replace("fmu/1", "fmu/2");
    assert!(Settings::from_json(&other).is_err());
    assert!(Kind::of("plant").unwrap_err().to_string().contains("\"forward\", \"inverse\" or \"controller\""));
    assert!(Source::of("none").is_err());
}

#[test]
fn the_same_contents_have_the_same_guid() {
    let settings = Settings::new(Kind::Controller, DT);
    let unit = MockUp::new(&stage(), &settings, "x").unwrap();
    assert_eq!(MockUp::new(&stage(), &settings, "x").unwrap(), unit);
    let read = Settings::from_json(&unit.settings).unwrap();
    assert_eq!(read, Settings { guid: read.guid.clone(), ..settings.clone() });
    assert!(unit.description.contains(&format!("guid=\"{}\"", read.guid)));
    assert_eq!(MockUp::new(&stage(), &read, "x").unwrap(), unit);
    let others = [
        MockUp::new(&stage(), &settings, "y").unwrap(),
        MockUp::new(&stage(), &Settings::new(Kind::Forward, DT), "x").unwrap(),
        MockUp::new(&Stage::new(StageParts { dead_time: 0.0, ..parts() }).unwrap(), &settings, "x").unwrap(),
    ];
    for other in others {
        assert!(!other.description.contains(&read.guid));
    }
}

#[test]
fn names_and_units_are_escaped() {
    let units = Units { drive: "<&\"\u{1}".into(), position: "\u{b5}m".into() };
    let stage = Stage::new(StageParts { units, ..parts() }).unwrap();
    let unit = MockUp::new(&stage, &Settings::new(Kind::Forward, DT), "a<b").unwrap();
    for expected in ["modelName=\"a&lt;b\"", "modelIdentifier=\"a_b\"", "unit=\"&lt;&amp;&quot; \"", "name=\"\u{b5}m\""]
    {
        assert!(unit.description.contains(expected), "{}", unit.description);
    }
}

proptest! {
    #[test]
    fn a_state_goes_on_bit_for_bit(
        kind in prop::sample::select(vec![Kind::Forward, Kind::Inverse, Kind::Controller]),
        inputs in prop::collection::vec(-50.0..100.0, 2..40),
    ) {
        let mut unit = fresh(kind);
        let mut other = unit.clone();
        let run = |unit: &mut Simulation| -> Vec<Vec<u8>> {
            let mut step = |input: &f64| {
                unit.set_real(0, *input).unwrap();
                unit.step(DT).unwrap();
                unit.state()
            };
            inputs.iter().map(&mut step).collect()
        };
        run(&mut unit);
        other.set_state(&unit.state()).unwrap();
        prop_assert_eq!(other.state(), unit.state());
        prop_assert_eq!(run(&mut other), run(&mut unit));
    }

    #[test]
    fn any_bytes_are_a_state_or_an_error(
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..4),
        cut in any::<prop::sample::Index>(),
    ) {
        let mut unit = fresh(Kind::Forward);
        let mut bytes = unit.state();
        let whole = bytes.clone();
        for (place, byte) in changes {
            let place = place.index(bytes.len());
            bytes[place] = byte;
        }
        prop_assert_eq!(unit.set_state(&bytes).is_ok(), bytes == whole);
        prop_assert!(unit.set_state(&whole[..cut.index(whole.len())]).is_err());
        prop_assert_eq!(unit.state(), whole);
    }
}
