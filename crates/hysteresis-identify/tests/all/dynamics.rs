//! The linear part behind a known hysteresis.

use std::ops::ControlFlow;

use crate::actuators::{Behind, decaying_triangle, noise, stage_output};
use hysteresis_control::linear::{Creep, Dynamics, SecondOrder};
use hysteresis_core::{CompiledModel, ModifiedPrandtlIshlinskii};
use hysteresis_identify::{
    CreepModel, DynamicsIdentification, DynamicsOptions, Error, FindingCode, Record, RecordError, Setting,
    identify_dynamics,
};
use hysteresis_simulate::paper;

const DT: f64 = 1e-4;

fn chirp(samples: u32) -> Vec<f64> {
    let seconds = f64::from(samples) * DT;
    let sample = |k: u32| {
        let t = f64::from(k) * DT;
        150.0 * (std::f64::consts::TAU * (5.0 + 2000.0 * t / seconds) * t).sin()
    };
    (0..samples).map(sample).collect()
}

fn found(input: &[f64], output: &[f64], options: &DynamicsOptions) -> Result<DynamicsIdentification, Error> {
    let model = CompiledModel::new(&paper::table_1_recovered());
    let record = Record::new(input, output, 0).map_err(|error| error.in_record(0))?;
    identify_dynamics(&record, &model, options, &mut || ControlFlow::Continue(()))
}

fn behind(frequency: f64, damping: f64, dead_time: f64) -> Behind {
    let dynamics = Some(SecondOrder::new(frequency, damping).unwrap().into());
    Behind { creep: None, dynamics, dead_time }
}

fn second(found: &DynamicsIdentification) -> SecondOrder {
    let Some(Dynamics::SecondOrder(resonance)) = found.dynamics else { panic!("{:?}", found.dynamics) };
    resonance
}

#[test]
fn without_noise_dynamics_come_back() {
    for (frequency, damping, dead_time) in
        [(400.0, 0.02, 1.3), (400.0, 0.9, 0.0), (1000.0, 0.3, 3.0), (2000.0, 0.02, 2.0), (3000.0, 0.1, 0.4)]
    {
        let input = chirp(4000);
        let output = stage_output(&paper::table_1_recovered(), &behind(frequency, damping, dead_time), DT, &input);
        let found = found(&input, &output, &DynamicsOptions::new(DT)).unwrap();
        let case = format!("{frequency} {damping} {dead_time}: {:?} {}", found.dynamics, found.dead_time);
        assert!((second(&found).frequency() / frequency - 1.0).abs() < 1e-6, "{case}");
        assert!((second(&found).damping() / damping - 1.0).abs() < 1e-5, "{case}");
        assert!((found.dead_time - dead_time * DT).abs() < 1e-5 * DT, "{case}");
        assert!((found.gain - 1.0).abs() < 1e-7 && found.output_offset.abs() < 1e-6, "{case}");
        assert_eq!(found.warnings, [], "{case}");
        let predicted = found.predict(&input).unwrap();
        assert!(predicted.iter().zip(&output).all(|(p, y)| (p - y).abs() < 1e-6), "{case}");
    }
}

#[test]
fn a_model_in_other_units_and_its_creep() {
    let creep = Some(Creep::new(&[0.02], &[0.05]).unwrap());
    let stage = Behind { creep, ..behind(500.0, 0.1, 1.0) };
    let input = decaying_triangle(6000, 400.0, 20.0, 0.0);
    let clean = stage_output(&paper::table_1_recovered(), &stage, DT, &input);
    // nanometres, with an offset
    let output: Vec<f64> = clean.iter().zip(noise(6000, 0.01, 2)).map(|(y, e)| 1e3 * (y + e) + 70.0).collect();
    let options = DynamicsOptions {
        creep: CreepModel::TimeConstants(vec![0.05]),
        dead_time: Setting::Fixed(DT),
        ..DynamicsOptions::new(DT)
    };
    let found = found(&input, &output, &options).unwrap();
    assert!((found.gain / 1e3 - 1.0).abs() < 1e-3 && (found.output_offset - 70.0).abs() < 5.0, "{found:?}");
    assert!((found.creep_amplitudes[0] - 0.02).abs() < 4.0 * found.standard_errors.creep[0]);
    assert!((found.noise - 10.0).abs() < 1.0 && found.dead_time == DT);
    assert!(found.covariance.parameters.contains(&"gain".to_owned()));
    let gain = found.warnings.iter().find(|finding| finding.code == FindingCode::GainNotOne).unwrap();
    assert!((gain.value - 999.0).abs() < 1.0 && gain.limit == 0.05);
}

#[test]
fn slow_motion_does_not_tell_a_resonance() {
    let input = decaying_triangle(6000, 400.0, 2.0, 0.0);
    let clean = stage_output(&paper::table_1_recovered(), &behind(2000.0, 0.5, 0.0), DT, &input);
    let output: Vec<f64> = clean.iter().zip(noise(6000, 0.02, 2)).map(|(y, e)| y + e).collect();
    let found = found(&input, &output, &DynamicsOptions::new(DT)).unwrap();
    assert!(found.warnings.iter().any(|finding| finding.code == FindingCode::ResonanceNotExcited), "{found:?}");
}

#[test]
fn what_is_wrong_is_named() {
    let input = chirp(1000);
    let message = |output: &[f64], options: &DynamicsOptions| found(&input, output, options).unwrap_err().to_string();
    let options = DynamicsOptions::new(DT);
    let output = stage_output(&paper::table_1_recovered(), &behind(500.0, 0.1, 0.0), DT, &input);
    assert!(message(&output, &DynamicsOptions::new(-1.0)).starts_with("dt: expected a finite number of seconds"));
    let dead_time = Setting::Fixed(1.0);
    assert!(message(&output, &DynamicsOptions { dead_time, ..options.clone() }).starts_with("dead_time: expected"));
    let creep = CreepModel::Decades(9);
    assert!(message(&output, &DynamicsOptions { creep, ..options.clone() }).starts_with("creep: expected a number"));
    // A model that does not answer to this drive.
    let dead =
        ModifiedPrandtlIshlinskii::new(&[1.0], &[1e4], &[1e4], &[0.0], &[0.0], hysteresis_core::Offsets::default());
    let record = Record::new(&input, &output, 0).unwrap();
    let error =
        identify_dynamics(&record, &CompiledModel::new(&dead.unwrap()), &options, &mut || ControlFlow::Continue(()));
    let Error::Record { error: RecordError::Constant { argument, .. }, .. } = error.unwrap_err() else { panic!() };
    assert_eq!(argument, "output of the model");
    let model = CompiledModel::new(&paper::table_1_recovered());
    let stopped = identify_dynamics(&record, &model, &options, &mut || ControlFlow::Break(()));
    assert_eq!(stopped.unwrap_err(), Error::Interrupted);
}
