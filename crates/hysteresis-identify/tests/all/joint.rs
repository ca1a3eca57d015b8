//! Hysteresis, dynamics, dead time and creep come back together from their own output.

use std::ops::ControlFlow;

use crate::actuators::{Behind, decaying_triangle, noise, run, stage_output, weights};
use hysteresis_control::linear::{Creep, Dynamics, FirstOrder, SecondOrder};
use hysteresis_control::stage::Stage;
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
use hysteresis_identify::{
    CreepModel, DynamicsModel, Error, FindingCode, Identification, LoopShiftModel, Options, Order, Record, SearchStage,
    Setting, Stop, Thresholds, WeightLaw, identify,
};

const DT: f64 = 1e-3;
const RATIOS: Ratios = Ratios { ra: 0.8, rb: 0.5, rc: 0.6 };

/// Five operators, 0 to 50 V, about 20 um.
fn actuator() -> ModifiedPrandtlIshlinskii {
    let offsets = Offsets { input: 0.0, output: 3.0 };
    let (weights, thresholds) = ([0.2, 0.05, 0.04, 0.03, 0.02], [0.0, 10.0, 20.0, 30.0, 40.0]);
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, RATIOS, offsets).unwrap()
}

fn resonance(frequency: f64, damping: f64) -> Dynamics {
    SecondOrder::new(frequency, damping).unwrap().into()
}

/// A decaying triangle, and then a few steps.
fn drive() -> Vec<f64> {
    let mut drive = decaying_triangle(1600, 50.0, 9.5, 0.0);
    drive.extend([20.0, -10.0, 35.0, 0.0].into_iter().flat_map(|level| [level; 100]));
    drive
}

fn options() -> Options {
    Options {
        thresholds: Thresholds::Given(vec![0.0, 10.0, 20.0, 30.0, 40.0]),
        weights: WeightLaw::Free,
        input_offset: Setting::Fixed(0.0),
        dt: Some(DT),
        dynamics: DynamicsModel::Order(Order::Second),
        ..Options::default()
    }
}

fn fitted(behind: &Behind, options: &Options) -> (Vec<f64>, Identification) {
    let output = stage_output(&actuator(), behind, DT, &drive());
    let found = run(&[Record::new(&drive(), &output, 0).unwrap()], options).unwrap();
    (output, found)
}

fn second(found: &Identification) -> SecondOrder {
    let Some(Dynamics::SecondOrder(resonance)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    resonance
}

fn codes(found: &Identification) -> Vec<FindingCode> {
    found.warnings.iter().map(|finding| finding.code).collect()
}

fn largest_difference(one: &[f64], other: &[f64]) -> f64 {
    one.iter().zip(other).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
}

#[test]
fn without_noise_everything_comes_back() {
    let taus = vec![0.02, 0.3];
    for (frequency, damping, dead_time) in [(60.0, 0.05, 1.35), (150.0, 0.7, 0.4), (90.0, 1.4, 2.0)] {
        let creep = Some(Creep::new(&[0.01, 0.03], &taus).unwrap());
        let behind = Behind { creep, dynamics: Some(resonance(frequency, damping)), dead_time };
        let options = Options { creep: CreepModel::TimeConstants(taus.clone()), ..options() };
        let (output, found) = fitted(&behind, &options);
        let case = format!("{frequency} Hz, {damping}: {:?} {:?}", found.dynamics, found.creep);
        assert!((second(&found).frequency() / frequency - 1.0).abs() < 1e-6, "{case}");
        assert!((second(&found).damping() / damping - 1.0).abs() < 1e-6, "{case}");
        assert!((found.dead_time.unwrap() - dead_time * DT).abs() < 1e-6 * DT, "{case} {:?}", found.dead_time);
        assert!((found.dead_time_samples.unwrap() - dead_time).abs() < 1e-6);
        assert!((found.creep_amplitudes[0] - 0.01).abs() < 1e-7, "{case}");
        assert!((found.creep.as_ref().unwrap().amplitudes()[1] - 0.03).abs() < 1e-7, "{case}");
        assert!((found.ratios.rb - RATIOS.rb).abs() < 1e-6, "{case}");
        for (got, want) in weights(&found).iter().zip(actuator().weights()) {
            assert!((got - want).abs() < 1e-7, "{case}: {:?}", weights(&found));
        }
        let lag = 2.0 * damping / (std::f64::consts::TAU * frequency) + dead_time * DT;
        assert!((found.lag - lag).abs() < 1e-6 * lag, "{case}: {}", found.lag);
        assert!(largest_difference(&found.predict(&drive()).unwrap(), &output) < 1e-8, "{case}");
        // The offset of the record has crept: the model has what it was before.
        assert!((found.output_offsets[0] - 3.0 * 1.04).abs() < 1e-6, "{case}");
        assert_eq!(codes(&found), [], "{case}: {:?}", found.warnings);
    }
}

#[test]
fn a_lag_and_log_type_creep_come_back() {
    let creep = Creep::logarithmic(0.015, 0.01, 20.0, 7).unwrap();
    let dynamics = Some(FirstOrder::new(40.0).unwrap().into());
    let behind = Behind { creep: Some(creep), dynamics, dead_time: 0.0 };
    // The span of two seconds at most is ten times the record.
    let terms = Some(7);
    let options =
        Options { dynamics: DynamicsModel::Order(Order::First), creep: CreepModel::Logarithmic { terms }, ..options() };
    let (output, found) = fitted(&behind, &options);
    let Some(Dynamics::FirstOrder(lag)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    assert!((lag.frequency() - 40.0).abs() < 1e-5, "{lag:?}");
    assert!((found.creep_amplitudes[0] - 0.015).abs() < 1e-8 && found.creep_amplitudes.len() == 1);
    assert_eq!(found.dead_time, Some(0.0));
    assert!(largest_difference(&found.predict(&drive()).unwrap(), &output) < 1e-8);
    assert!(found.standard_errors.creep[0] < 1e-8 && found.standard_errors.frequency < 1e-3);
}

/// The forward model of the stage, settled at the first drive, is the prediction.
#[test]
fn the_stage_predicts_what_the_identification_predicts() {
    let creep = Some(Creep::logarithmic(0.02, 0.01, 20.0, 7).unwrap());
    let behind = Behind { creep, dynamics: Some(resonance(70.0, 0.1)), dead_time: 1.35 };
    let mut output = stage_output(&actuator(), &behind, DT, &drive());
    output.iter_mut().zip(noise(2000, 0.01, 4)).for_each(|(y, e)| *y += e);
    let options = Options { creep: CreepModel::Logarithmic { terms: None }, ..options() };
    let found = run(&[Record::new(&drive(), &output, 0).unwrap()], &options).unwrap();
    let parts = found.stage_parts();
    let known = parts.identified.clone().unwrap();
    assert_eq!(
        (known.drive_range, known.dt, known.parameters),
        (found.drive_range, vec![DT], found.covariance.parameters.clone())
    );
    assert!((parts.noise.unwrap() - 0.01).abs() < 0.001);
    let stage = Stage::new(parts).unwrap();
    let other: Vec<f64> = (0..500).map(|k| 12.0 + 30.0 * (f64::from(k) / 17.0).sin()).collect();
    let mut forward = stage.forward(DT).unwrap();
    forward.settle(other[0]);
    let rows: Vec<f64> = other.iter().map(|u| forward.step(*u)).collect();
    assert!(largest_difference(&rows, &found.predict(&other).unwrap()) < 1e-9);
    // The truth is within a few standard deviations of the prediction.
    let truth = stage_output(&actuator(), &behind, DT, &other);
    let (predicted, std) = (found.predict(&other).unwrap(), found.predict_std(&other).unwrap());
    let worst = (0..500).map(|k| (predicted[k] - truth[k]).abs() / std[k]).fold(0.0, f64::max);
    assert!(worst < 5.0 && largest_difference(&predicted, &truth) < 0.05, "{worst}");
    // Another rate: the same stage.
    assert_eq!(found.predict_at(&other, DT).unwrap(), predicted);
    let slow: Vec<f64> = other.iter().flat_map(|u| [*u, *u]).collect();
    let fast = found.predict_at(&slow, 0.5 * DT).unwrap();
    let same: Vec<f64> = fast.into_iter().step_by(2).collect();
    assert!(largest_difference(&same, &predicted) < 0.02);
}

/// Seconds of a record at 10 kHz of the benchmark plant A1: 400 Hz, damping 0.95, 16 nm.
#[test]
fn a_slow_record_tells_the_lag_of_an_overdamped_stage() {
    let dt = 1e-4;
    let behind = Behind { creep: None, dynamics: Some(resonance(400.0, 0.95)), dead_time: 0.0 };
    let plant = hysteresis_simulate::paper::table_1_recovered();
    let input = decaying_triangle(12_000, 500.0, 12.0, 0.0);
    let mut output = stage_output(&plant, &behind, dt, &input);
    output.iter_mut().zip(noise(12_000, 0.016, 3)).for_each(|(y, e)| *y += e);
    let dynamics = DynamicsModel::Order(Order::Second);
    let options = Options { weights: WeightLaw::Quadratic, dt: Some(dt), dynamics, ..Options::default() };
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
    let truth = 2.0 * 0.95 / (std::f64::consts::TAU * 400.0);
    let error = (found.lag - truth).abs();
    assert!(error < 15e-6 && error < 3.0 * found.standard_errors.lag, "{} s instead of {truth}", found.lag);
    assert!((second(&found).frequency() - 400.0).abs() < 3.0 * found.standard_errors.frequency, "{:?}", found.dynamics);
    assert_eq!(found.dead_time, Some(0.0));
    let confounded = found.warnings.iter().find(|finding| finding.code == FindingCode::DeadTimeConfounded).unwrap();
    assert!(confounded.value > confounded.limit && confounded.message.contains("lag of the dynamics"));
    // 20 Hz and 3 um: what the stage does and what its model says.
    let sine: Vec<f64> = (0..1500).map(|k| 440.0 * (std::f64::consts::TAU * 20.0 * dt * f64::from(k)).sin()).collect();
    let stage = stage_output(&plant, &behind, dt, &sine);
    let model = found.predict(&sine).unwrap();
    let offset = found.output_offsets[0];
    let worst = (500..1500).map(|k| (stage[k] - model[k] + offset).abs()).fold(0.0, f64::max);
    assert!(worst < 0.015, "{worst} um");
}

#[test]
fn a_resonance_and_creep_from_a_triangle_and_a_step() {
    let dt = 1e-4;
    let creep = Some(Creep::logarithmic(0.012, 0.01, 100.0, 8).unwrap());
    let behind = Behind { creep, dynamics: Some(resonance(800.0, 0.02)), dead_time: 1.0 };
    let plant = hysteresis_simulate::paper::table_1_recovered();
    let triangle = decaying_triangle(10_000, 500.0, 12.0, 0.0);
    let step: Vec<f64> = (0..6000).map(|k| if k < 100 { 0.0 } else { 200.0 }).collect();
    let noisy = |input: &[f64], seed| {
        let mut output = stage_output(&plant, &behind, dt, input);
        output.iter_mut().zip(noise(input.len(), 0.01, seed)).for_each(|(y, e)| *y += e);
        output
    };
    let outputs = [noisy(&triangle, 3), noisy(&step, 5)];
    let records = [Record::new(&triangle, &outputs[0], 0).unwrap(), Record::new(&step, &outputs[1], 0).unwrap()];
    let options = Options {
        weights: WeightLaw::Quadratic,
        dt: Some(dt),
        dynamics: DynamicsModel::Order(Order::Second),
        creep: CreepModel::Logarithmic { terms: None },
        ..Options::default()
    };
    let found = run(&records, &options).unwrap();
    let case = format!("{:?} {:?} {:?}", found.dynamics, found.creep_amplitudes, found.dead_time_samples);
    assert!((second(&found).frequency() / 800.0 - 1.0).abs() < 0.005, "{case}");
    assert!((second(&found).damping() / 0.02 - 1.0).abs() < 0.2, "{case}");
    assert!((found.creep_amplitudes[0] / 0.012 - 1.0).abs() < 0.1, "{case}");
    assert!((found.dead_time_samples.unwrap() - 1.0).abs() < 0.05, "{case}");
    assert_eq!(codes(&found), [], "{:?}", found.warnings);
}

#[test]
fn rows_that_are_one_sample_off_are_named() {
    let behind = Behind { creep: None, dynamics: Some(resonance(70.0, 0.1)), dead_time: -1.0 };
    let mut output = stage_output(&actuator(), &behind, DT, &drive());
    output.iter_mut().zip(noise(2000, 0.01, 4)).for_each(|(y, e)| *y += e);
    let found = run(&[Record::new(&drive(), &output, 0).unwrap()], &options()).unwrap();
    // What leads cannot run: the result has no dead time, and says by how much it would lead.
    assert_eq!(found.dead_time, Some(0.0));
    let finding = found.warnings.iter().find(|finding| finding.code == FindingCode::NegativeDeadTime).unwrap();
    assert!((finding.value + 1.0).abs() < 0.05, "{finding}");
    assert!(finding.hint.contains("shift the position column down by one row"), "{finding}");
    // Shifted as the hint says, there is none.
    let shifted = run(&[Record::new(&drive()[1..], &output[..1999], 0).unwrap()], &options()).unwrap();
    assert_eq!(shifted.dead_time, Some(0.0));
    assert!((second(&shifted).frequency() - 70.0).abs() < 0.1, "{:?}", shifted.dynamics);
    assert!(!codes(&shifted).contains(&FindingCode::NegativeDeadTime));
}

/// A search that is stopped on its way keeps nothing that leads, either.
#[test]
fn what_a_stopped_search_keeps_does_not_lead() {
    let behind = Behind { creep: None, dynamics: Some(resonance(70.0, 0.1)), dead_time: -1.0 };
    let mut output = stage_output(&actuator(), &behind, DT, &drive());
    output.iter_mut().zip(noise(2000, 0.01, 4)).for_each(|(y, e)| *y += e);
    let input = drive();
    let record = Record::new(&input, &output, 0).unwrap();
    let mut told = 0;
    for stop in (10..400).step_by(30) {
        let mut calls = 0;
        let mut progress = |_: &_| {
            calls += 1;
            if calls == stop { ControlFlow::Break(Stop::KeepBest) } else { ControlFlow::Continue(()) }
        };
        let Ok(found) = identify(&[record], &options(), &mut progress) else { continue };
        assert!(found.dead_time.unwrap() >= 0.0, "{stop}: {:?}", found.dead_time);
        told += usize::from(found.partial && codes(&found).contains(&FindingCode::NegativeDeadTime));
    }
    assert!(told > 0);
}

/// Infinitely fast dynamics a sample early are none.
#[test]
fn a_stage_without_dynamics_gets_none() {
    let creep = Some(Creep::new(&[0.04], &[0.3]).unwrap());
    for (creep, model) in [(None, CreepModel::None), (creep, CreepModel::TimeConstants(vec![0.3]))] {
        let behind = Behind { creep, dynamics: None, dead_time: 0.0 };
        let mut output = stage_output(&actuator(), &behind, DT, &drive());
        output.iter_mut().zip(noise(2000, 0.01, 4)).for_each(|(y, e)| *y += e);
        let options = Options { creep: model.clone(), ..options() };
        let found = run(&[Record::new(&drive(), &output, 0).unwrap()], &options).unwrap();
        assert_eq!(found.dynamics, None, "{model:?}");
        assert!(found.dead_time_samples.unwrap().abs() < 0.05);
        assert!(found.fit.rmse < 0.0105, "{:?}", found.fit);
        let finding = found.warnings.iter().find(|finding| finding.code == FindingCode::ResonanceNotExcited).unwrap();
        assert!(finding.message.contains("a dead time alone with the same lag"), "{finding}");
        assert!(found.creep_amplitudes.iter().all(|c| (c - 0.04).abs() < 0.002), "{:?}", found.creep_amplitudes);
    }
}

/// Slow loops and a fast step, each at its own rate, tell one stage.
#[test]
fn records_of_different_rates_belong_in_one_fit() {
    let behind = |dead_time| Behind { creep: None, dynamics: Some(resonance(60.0, 0.1)), dead_time };
    let (slow, fast) = (4e-3, 5e-4);
    let triangle = decaying_triangle(1500, 50.0, 9.5, 0.0);
    let step: Vec<f64> = (0..400).map(|k| if k < 40 { 0.0 } else { 30.0 }).collect();
    // 2 ms of dead time
    let outputs = [
        stage_output(&actuator(), &behind(0.5), slow, &triangle),
        stage_output(&actuator(), &behind(4.0), fast, &step),
    ];
    let records = [
        Record::new(&triangle, &outputs[0], 0).unwrap().sampled_every(slow).unwrap(),
        Record::new(&step, &outputs[1], 0).unwrap(),
    ];
    let found = run(&records, &Options { dt: Some(fast), ..options() }).unwrap();
    assert!((second(&found).frequency() - 60.0).abs() < 1e-4 && (second(&found).damping() - 0.1).abs() < 1e-6);
    assert!((found.dead_time.unwrap() - 2e-3).abs() < 1e-8, "{:?}", found.dead_time);
    assert_eq!((found.dt.as_slice(), found.dead_time_samples), (&[slow, fast][..], None));
    assert!(largest_difference(&found.predict(&triangle).unwrap(), &outputs[0]) < 1e-7);
    assert!(found.validate(&records[1], None).rmse < 1e-7);
}

#[test]
fn seconds_are_asked_for_where_they_are_needed() {
    let behind = Behind { creep: None, dynamics: None, dead_time: 0.0 };
    let output = stage_output(&actuator(), &behind, DT, &drive());
    let drive = drive();
    let record = Record::new(&drive, &output, 0).unwrap();
    let without = Options { dt: None, dynamics: DynamicsModel::None, ..options() };
    for needs in [
        Options { dynamics: DynamicsModel::Order(Order::First), ..without.clone() },
        Options { creep: CreepModel::Logarithmic { terms: None }, ..without.clone() },
    ] {
        let error = run(&[record], &needs).unwrap_err();
        assert_eq!(error, Error::NoInterval { record: 0 });
        assert!(error.to_string().starts_with("dt: expected the sampling interval of record 0 in seconds"));
    }
    let timed = record.sampled_every(DT).unwrap();
    assert_eq!(run(&[timed, record], &without).unwrap_err(), Error::NoInterval { record: 1 });
    let error = run(&[record], &Options { dt: Some(0.0), ..without.clone() }).unwrap_err();
    assert!(error.parameter() == Some("dt"), "{error}");
    assert!(record.sampled_every(f64::NAN).unwrap_err().parameter() == Some("dt"));
    let found = run(&[record], &without).unwrap();
    assert_eq!((found.dead_time, found.dt.as_slice()), (None, &[][..]));
    assert!(found.dead_time_samples.is_some());
}

/// What is known beforehand stays as it is.
#[test]
fn a_dead_time_that_is_given_stays() {
    let behind = Behind { creep: None, dynamics: Some(resonance(60.0, 0.2)), dead_time: 1.0 };
    let known = Options { dead_time: Setting::Fixed(DT), ..options() };
    let (_, found) = fitted(&behind, &known);
    assert_eq!((found.dead_time, found.standard_errors.dead_time), (Some(DT), 0.0));
    assert!((second(&found).frequency() - 60.0).abs() < 1e-4, "{:?}", found.dynamics);
    assert!(!found.covariance.parameters.contains(&"dead_time".to_owned()));
    assert!(found.covariance.parameters.contains(&"frequency".to_owned()));
}

/// A record of which the fit reads no sample, as those that are not left out act behind a negative dead time, has no
/// offset to estimate.
#[test]
fn an_offset_that_no_sample_tells_counts_for_no_sample() {
    let behind = Behind { creep: None, dynamics: Some(resonance(80.0, 0.1)), dead_time: 2.0 };
    let mut output = stage_output(&actuator(), &behind, DT, &drive());
    output.iter_mut().zip(noise(drive().len(), 0.05, 5)).for_each(|(y, e)| *y += e);
    let (input, left_out) = (drive(), (0..drive().len() - 2).collect::<Vec<_>>());
    let options = Options {
        creep: CreepModel::None,
        loop_shift: LoopShiftModel::None,
        smoothness: Setting::Fixed(0.0),
        ..options()
    };
    let record = Record::new(&input, &output, 0).unwrap();
    let unread = record.leaving_out(&left_out).unwrap();
    let alone = run(&[record], &options).unwrap();
    let both = run(&[record, unread], &options).unwrap();
    assert!((both.noise / alone.noise - 1.0).abs() < 1e-5, "{} {}", both.noise, alone.noise);
}

/// The covariance has the squares of the standard errors on its diagonal.
#[test]
fn covariance_and_standard_errors_agree() {
    let creep = Some(Creep::new(&[0.03], &[0.3]).unwrap());
    let behind = Behind { creep, dynamics: Some(resonance(60.0, 0.2)), dead_time: 1.0 };
    let mut output = stage_output(&actuator(), &behind, DT, &drive());
    output.iter_mut().zip(noise(2000, 0.01, 9)).for_each(|(y, e)| *y += e);
    let options = Options { creep: CreepModel::TimeConstants(vec![0.3]), ..options() };
    let found = run(&[Record::new(&drive(), &output, 0).unwrap()], &options).unwrap();
    let errors = &found.standard_errors;
    let variance = |name: &str| {
        let place = found.covariance.parameters.iter().position(|parameter| parameter == name).unwrap();
        found.covariance.matrix[place][place].sqrt()
    };
    for (name, error) in [
        ("weights[2]", errors.weights[2]),
        ("rb", errors.ratios[1]),
        ("dead_time", errors.dead_time),
        ("frequency", errors.frequency),
        ("damping", errors.damping),
        ("creep[0]", errors.creep[0]),
    ] {
        assert!((variance(name) / error - 1.0).abs() < 1e-9 && error > 0.0, "{name}: {} {error}", variance(name));
    }
    for (got, want, error) in [
        (second(&found).frequency(), 60.0, errors.frequency),
        (second(&found).damping(), 0.2, errors.damping),
        (found.dead_time.unwrap(), DT, errors.dead_time),
        (found.creep_amplitudes[0], 0.03, errors.creep[0]),
    ] {
        assert!((got - want).abs() < 4.0 * error && error < 0.1 * want, "{got} +- {error} instead of {want}");
    }
}

/// Loops that are left out are predicted through dynamics and creep too.
#[test]
fn leaving_loops_out_takes_the_linear_part_along() {
    let behind = Behind { creep: None, dynamics: Some(resonance(30.0, 0.8)), dead_time: 0.0 };
    let (output, found) = fitted(&behind, &options());
    let loops = found.leave_one_loop_out(&[Record::new(&drive(), &output, 0).unwrap()]).unwrap();
    assert!(loops.len() > 5 && loops.iter().all(|one| one.fitted.rmse < 1e-7 && one.left_out.rmse < 1e-6), "{loops:?}");
}

#[test]
fn a_search_that_is_stopped_keeps_the_best_or_nothing() {
    let behind = Behind { creep: None, dynamics: Some(resonance(60.0, 0.2)), dead_time: 1.0 };
    let output = stage_output(&actuator(), &behind, DT, &drive());
    let drive = drive();
    let record = [Record::new(&drive, &output, 0).unwrap()];
    let (mut stages, mut fractions) = (Vec::new(), Vec::new());
    let mut watch = |progress: &hysteresis_identify::Progress| {
        stages.push(progress.stage);
        fractions.push(progress.fraction);
        ControlFlow::Continue(())
    };
    let whole = identify(&record, &options(), &mut watch).unwrap();
    assert!(fractions.is_sorted() && fractions[0] < 0.1 && fractions[fractions.len() - 1] == 1.0, "{fractions:?}");
    let dynamics = stages.iter().position(|stage| *stage == SearchStage::Dynamics).unwrap();
    for (after, rmse) in [(3, 5.0), (dynamics + 1, 5.0), (dynamics + 60, 0.5), (stages.len() - 1, 1e-6)] {
        let after = after.min(stages.len() - 1);
        let stopped = |stop| {
            let mut evaluations = 0;
            identify(&record, &options(), &mut |_| {
                evaluations += 1;
                if evaluations >= after { ControlFlow::Break(stop) } else { ControlFlow::Continue(()) }
            })
        };
        assert_eq!(stopped(Stop::Discard).unwrap_err(), Error::Interrupted);
        let kept = stopped(Stop::KeepBest).unwrap();
        assert!(kept.partial && kept.fit.rmse < rmse && kept.dynamics.is_some(), "{after}: {:?}", kept.fit);
    }
    assert!(!whole.partial);
}
