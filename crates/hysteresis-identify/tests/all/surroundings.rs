//! What surrounds the hysteresis in a joint fit: an amplifier in front of it, and a map on either side.

use std::ops::ControlFlow;

use crate::actuators::{decaying_triangle, noise, run};
use hysteresis_control::linear::{Dynamics, FirstOrder, SecondOrder};
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, PiecewiseLinearMap, Process, Ratios};
use hysteresis_identify::{
    AmplifierModel, DuhemModel, DynamicsModel, Error, FindingCode, Identification, MapModel, Options, Order, Quality,
    Record, Setting, Stop, Thresholds, identify,
};

const DT: f64 = 1e-4;

fn hysteresis() -> ModifiedPrandtlIshlinskii {
    let ratios = Ratios { ra: 0.8, rb: 0.5, rc: 0.6 };
    let (weights, thresholds) = ([0.2, 0.05, 0.04, 0.03], [0.0, 10.0, 20.0, 30.0]);
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, ratios, Offsets::default()).unwrap()
}

fn options() -> Options {
    Options {
        thresholds: Thresholds::Given(vec![0.0, 10.0, 20.0, 30.0]),
        input_offset: Setting::Fixed(0.0),
        dt: Some(DT),
        ..Options::default()
    }
}

/// Swings of -50 to 50 V and smaller ones, then steps that make the modes ring.
fn drive() -> Vec<f64> {
    let mut drive = decaying_triangle(4000, 50.0, 9.5, 0.0);
    for level in [20.0, -10.0, 35.0, 0.0] {
        let last = drive[drive.len() - 1];
        drive.extend((1..=20_u32).map(|k| last + (level - last) * f64::from(k) / 20.0));
        drive.extend([level; 150]);
    }
    drive
}

fn found(stage: &Stage, deviation: f64, options: &Options) -> (Vec<f64>, Identification) {
    found_from(&drive(), stage, deviation, options)
}

fn found_from(drive: &[f64], stage: &Stage, deviation: f64, options: &Options) -> (Vec<f64>, Identification) {
    let mut forward = stage.forward(DT).unwrap();
    forward.settle(drive[0]);
    let noise = noise(drive.len(), deviation, 7);
    let position: Vec<f64> = drive.iter().zip(noise).map(|(u, e)| forward.step(*u) + e).collect();
    let found = run(&[Record::new(drive, &position, 0).unwrap()], options).unwrap();
    (position, found)
}

fn amplified(bandwidth: f64) -> Stage {
    Stage::new(StageParts {
        amplifier: Some(FirstOrder::new(bandwidth).unwrap()),
        dynamics: SecondOrder::new(800.0, 0.1).unwrap().into(),
        dead_time: 1.4 * DT,
        ..StageParts::new(hysteresis())
    })
    .unwrap()
}

#[test]
fn an_amplifier_is_told_from_dead_time_and_dynamics() {
    let (position, found) = found(&amplified(300.0), 1e-3, &options());
    let Some(Dynamics::SecondOrder(resonance)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    let bandwidth = found.amplifier().unwrap().frequency();
    let case = format!("{bandwidth} {resonance:?} {:?}", found.dead_time);
    assert!((bandwidth / 300.0 - 1.0).abs() < 0.02, "{case}");
    assert!((resonance.frequency() / 800.0 - 1.0).abs() < 0.005, "{case}");
    assert!((resonance.damping() / 0.1 - 1.0).abs() < 0.05, "{case}");
    assert!((found.dead_time.unwrap() / DT - 1.4).abs() < 0.1, "{case}");
    let lag = 1.4 * DT + 1.0 / (std::f64::consts::TAU * 300.0) + 0.2 / (std::f64::consts::TAU * 800.0);
    assert!((found.lag / lag - 1.0).abs() < 0.01, "{case} {}", found.lag);
    assert!(found.warnings.iter().all(|one| one.code != FindingCode::DeadTimeConfounded), "{:?}", found.warnings);
    // The stage has the same amplifier: it repeats the record.
    let mut forward = found.stage().unwrap().forward(DT).unwrap();
    forward.settle(0.0);
    let worst = drive().iter().zip(&position).map(|(u, y)| (forward.step(*u) - y).abs()).fold(0.0, f64::max);
    assert!(worst < 2e-2, "{worst}");
}

/// A lag of first order is a resonance damped without bound: the search for one of second order ends at its edge, or
/// inside with a dead time below zero.
#[test]
fn a_lag_is_not_taken_for_a_resonance() {
    use FindingCode::{ClippedInput, NegativeDeadTime, PoorFit, ResonanceNotExcited};
    let loops = decaying_triangle(13000, 50.0, 4.5, 0.0);
    for (drive, frequency) in [(&drive(), 20.0), (&drive(), 700.0), (&loops, 8.0), (&loops, 16.0)] {
        let lag = FirstOrder::new(frequency).unwrap();
        let stage = Stage::new(StageParts { dynamics: lag.into(), ..StageParts::new(hysteresis()) }).unwrap();
        let (_, found) = found_from(drive, &stage, 1e-3, &options());
        let Some(Dynamics::FirstOrder(lag)) = found.dynamics else { panic!("{frequency}: {:?}", found.dynamics) };
        assert!((lag.frequency() / frequency - 1.0).abs() < 0.02, "{lag:?}");
        assert!(found.fit.rmse < 1.1e-3, "{frequency}: {:?}", found.fit);
        let is_wrong = |code| matches!(code, ClippedInput | NegativeDeadTime | PoorFit | ResonanceNotExcited);
        assert!(!found.warnings.iter().any(|one| is_wrong(one.code)), "{frequency}: {:?}", found.warnings);
    }
}

/// The square of the drive, from 0 to 100 V.
fn squared() -> PiecewiseLinearMap {
    let x: Vec<f64> = (0..=100).map(f64::from).collect();
    let y: Vec<f64> = x.iter().map(|x| x * x / 100.0).collect();
    PiecewiseLinearMap::new(&x, &y).unwrap()
}

/// Where the square is not in the model yet, hysteresis, creep and a dead time explain as much as a lag.
#[test]
fn a_lag_behind_a_square_is_found_and_a_dead_time_there_stays_one() {
    let plain = StageParts { input_map: Some(squared()), ..StageParts::new(hysteresis()) };
    let drive = decaying_triangle(8000, 49.0, 5.5, 50.0);
    let lag = FirstOrder::new(12.0).unwrap();
    let stage = Stage::new(StageParts { dynamics: lag.into(), ..plain.clone() }).unwrap();
    let (_, found) = found_from(&drive, &stage, 1e-2, &options());
    let Some(Dynamics::FirstOrder(lag)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    assert!((lag.frequency() / 12.0 - 1.0).abs() < 0.02, "{lag:?}");
    assert!(found.input_map().is_some() || found.output_map().is_some());
    assert!(found.fit.rmse < 1.2e-2, "{:?}", found.fit);

    let stage = Stage::new(StageParts { dead_time: 30.0 * DT, ..plain }).unwrap();
    let (_, found) = found_from(&drive, &stage, 1e-2, &options());
    assert!(found.dynamics.is_none() && (found.dead_time.unwrap() / DT - 30.0).abs() < 0.5, "{:?}", found.dead_time);
}

/// The weights of all loops are those of the fit, whatever is in front of the hysteresis and behind it; and those of
/// the other loops predict a loop about as well as it is fitted.
#[test]
fn leaving_a_loop_out_knows_the_maps() {
    let (before, behind) = (Some(bent(1.0, 0.25)), Some(saturated()));
    for (input_map, output_map) in [(before.clone(), None), (None, behind.clone()), (before, behind)] {
        let model = |map: &Option<_>| if map.is_some() { MapModel::Smooth } else { MapModel::None };
        let options = Options { input_map: model(&input_map), output_map: model(&output_map), ..options() };
        let stage = Stage::new(StageParts { input_map, output_map, ..StageParts::new(hysteresis()) }).unwrap();
        let drive = drive();
        let (position, found) = found_from(&drive, &stage, 1e-3, &options);
        assert_eq!(found.output_map().is_some(), stage.parts().output_map.is_some());
        let record = [Record::new(&drive, &position, 0).unwrap()];
        let rows = found.leave_one_loop_out(&record).unwrap();
        let all = Quality::pooled(&rows.iter().map(|row| row.fitted).collect::<Vec<_>>());
        let near = (all.rmse / found.fit.rmse - 1.0).abs() < 1e-3 && all.samples == found.fit.samples;
        assert!(near, "{} instead of {}", all.rmse, found.fit.rmse);
        let left_out = Quality::pooled(&rows.iter().map(|row| row.left_out).collect::<Vec<_>>());
        assert!((1.0..2.0).contains(&(left_out.rmse / all.rmse)), "{} {}", left_out.rmse, all.rmse);
    }
}

/// Most of this search looks for maps.
#[test]
fn a_search_that_is_stopped_among_maps_hands_over_its_best() {
    let parts = StageParts { input_map: Some(squared()), ..StageParts::new(hysteresis()) };
    let stage = Stage::new(StageParts { dynamics: FirstOrder::new(12.0).unwrap().into(), ..parts }).unwrap();
    let drive = decaying_triangle(1000, 49.0, 5.5, 50.0);
    let mut forward = stage.forward(8.0 * DT).unwrap();
    let position: Vec<f64> = drive.iter().map(|u| forward.step(*u)).collect();
    let record = [Record::new(&drive, &position, 0).unwrap()];
    let options = Options { dt: Some(8.0 * DT), ..options() };
    let stopped_at = |stop: usize| {
        let (mut calls, mut fraction) = (0, 0.0);
        let found = identify(&record, &options, &mut |now| {
            assert!(now.fraction >= fraction, "{} after {fraction}", now.fraction);
            (calls, fraction) = (calls + 1, now.fraction);
            if calls == stop { ControlFlow::Break(Stop::KeepBest) } else { ControlFlow::Continue(()) }
        });
        (found.unwrap(), calls)
    };
    let (whole, calls) = stopped_at(usize::MAX);
    assert!(!whole.partial && matches!(whole.dynamics, Some(Dynamics::FirstOrder(_))), "{:?}", whole.dynamics);
    for share in 2..10 {
        assert!(stopped_at(calls * share / 10).0.partial, "{share}");
    }
}

#[test]
fn a_fast_amplifier_is_confounded_with_a_dead_time() {
    let (_, found) = found(&amplified(4000.0), 1e-3, &options());
    assert!(found.warnings.iter().any(|one| one.code == FindingCode::DeadTimeConfounded), "{:?}", found.warnings);
}

#[test]
fn a_given_amplifier_is_kept_and_none_is_none() {
    let second = DynamicsModel::Order(Order::Second);
    let given = Options { dynamics: second, amplifier: AmplifierModel::Bandwidth(300.0), ..options() };
    let (_, found) = found(&amplified(300.0), 1e-3, &given);
    assert!((found.amplifier().unwrap().frequency() - 300.0).abs() < 1e-9);
    assert!((found.dead_time.unwrap() / DT - 1.4).abs() < 0.02, "{:?}", found.dead_time);
    let none = Options { dynamics: second, amplifier: AmplifierModel::None, ..options() };
    assert!(self::found(&amplified(300.0), 1e-3, &none).1.amplifier().is_none());
}

/// Through -60, 0, 60 and bent in between.
fn bent(scale: f64, bend: f64) -> PiecewiseLinearMap {
    let x: Vec<f64> = (-60..=60).map(|k| scale * f64::from(k)).collect();
    let y: Vec<f64> = x.iter().map(|x| x - bend * scale * (x / scale / 60.0).powi(2) * 60.0).collect();
    PiecewiseLinearMap::new(&x, &y).unwrap()
}

#[test]
fn a_map_is_found_where_there_is_one() {
    let plain = StageParts::new(hysteresis());
    let behind = Stage::new(StageParts { output_map: Some(bent(0.35, 0.25)), ..plain.clone() }).unwrap();
    let before = Stage::new(StageParts { input_map: Some(bent(1.0, 0.25)), ..plain.clone() }).unwrap();
    for stage in [behind, before] {
        let (_, found) = found(&stage, 1e-3, &options());
        assert!(found.input_map().is_some() != found.output_map().is_some());
        let none = Options { input_map: MapModel::None, output_map: MapModel::None, ..options() };
        let (position, without) = self::found(&stage, 1e-3, &none);
        assert!(found.fit.rmse < 0.5 * without.fit.rmse, "{} {}", found.fit.rmse, without.fit.rmse);
        let mut forward = found.stage().unwrap().forward(DT).unwrap();
        forward.settle(0.0);
        let squares: f64 = drive().iter().zip(&position).map(|(u, y)| (forward.step(*u) - y).powi(2)).sum();
        let rms = (squares / f64::from(u32::try_from(position.len()).unwrap())).sqrt();
        assert!((rms / found.fit.rmse - 1.0).abs() < 0.02, "{rms} {}", found.fit.rmse);
    }
    let (_, found) = found(&Stage::new(plain).unwrap(), 1e-3, &options());
    assert!(found.input_map().is_none() && found.output_map().is_none());
}

#[test]
fn maps_on_both_sides_are_found_where_one_does_not_do() {
    let bent_twice = Stage::new(StageParts {
        input_map: Some(bent(1.0, 0.25)),
        output_map: Some(saturated()),
        ..StageParts::new(hysteresis())
    })
    .unwrap();
    let (_, found) = found(&bent_twice, 1e-3, &options());
    assert!(found.input_map().is_some() && found.output_map().is_some());
    let plays = Options { duhem: DuhemModel::None, ..options() };
    for one in [Options { input_map: MapModel::None, ..plays.clone() }, Options { output_map: MapModel::None, ..plays }]
    {
        let (_, with_one) = self::found(&bent_twice, 1e-3, &one);
        assert!(found.fit.rmse < 0.7 * with_one.fit.rmse, "{} {}", found.fit.rmse, with_one.fit.rmse);
    }
}

/// The position of the stage, which is within -24 and 24, as a tanh.
fn saturated() -> PiecewiseLinearMap {
    let x: Vec<f64> = (-60..=60).map(|k| 0.5 * f64::from(k)).collect();
    let y: Vec<f64> = x.iter().map(|x| 12.0 * (x / 12.0).tanh()).collect();
    PiecewiseLinearMap::new(&x, &y).unwrap()
}

#[test]
fn what_is_no_amplifier_is_refused() {
    let refused = |amplifier, dynamics| {
        let options = Options { amplifier, dynamics, ..options() };
        let Error::Core(error) = run(&[Record::new(&drive(), &drive(), 0).unwrap()], &options).unwrap_err() else {
            panic!("another error")
        };
        error.to_string()
    };
    let second = DynamicsModel::Order(Order::Second);
    assert!(refused(AmplifierModel::Bandwidth(0.0), second).starts_with("amplifier: expected a bandwidth"));
    let first = DynamicsModel::Order(Order::First);
    assert!(
        refused(AmplifierModel::Bandwidth(5.0), first)
            .contains("second-order dynamics (dynamics 2) or without dynamics")
    );
}
