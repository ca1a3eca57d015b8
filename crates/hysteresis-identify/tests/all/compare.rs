//! Models side by side: each predicts what it can, and a comparison that is stopped leaves nothing.

use std::ops::ControlFlow;

use crate::actuators::{decaying_triangle, noise};
use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};
use hysteresis_identify::{
    Comparison, Error, Extension, Omission, Options, Record, Setting, Stop, Thresholds, WeightLaw, compare,
};

fn options() -> Options {
    Options {
        thresholds: Thresholds::Uniform(5),
        weights: WeightLaw::Free,
        smoothness: Setting::Fixed(0.0),
        ..Options::default()
    }
}

/// Plays with a square and a cube of the drive beside them, and noise of 1e-3.
fn signals() -> (Vec<f64>, Vec<f64>) {
    // A stroke whose middle is the rest of the plays.
    let mut drive: Vec<f64> = (0..50).chain((-49..=50).rev()).chain(-50..0).map(f64::from).collect();
    drive.extend(decaying_triangle(2000, 50.0, 11.0, 0.0));
    drive.extend(decaying_triangle(1000, 40.0, 5.0, 0.0));
    let offsets = Offsets { input: 0.0, output: 3.0 };
    let model =
        PrandtlIshlinskii::new(&[0.2, 0.05, 0.04, 0.03, 0.02], &[0.0, 10.0, 20.0, 30.0, 40.0], offsets).unwrap();
    let mut plays = model.forward();
    let position = drive.iter().zip(noise(drive.len(), 1e-3, 5)).map(|(u, more)| {
        let x = u / 50.0;
        plays.step(*u) + 0.8 * x * x - 0.6 * x * x * x + more
    });
    let position = position.collect();
    (drive, position)
}

fn compared(options: &Options) -> Result<Comparison, Error> {
    let (drive, position) = signals();
    compare(&[Record::new(&drive, &position, 0).unwrap()], options, &mut |_| ControlFlow::Continue(()))
}

#[test]
fn a_polynomial_beside_plays_predicts_what_it_made() {
    let found = compared(&options()).unwrap();
    let names: Vec<_> = found.models.iter().map(|model| model.name.as_str()).collect();
    // Time is not needed for what does not depend on it.
    assert_eq!(names, ["conventional", "polynomial + plays", "modified", "modified + duhem"]);
    let [conventional, polynomial, ..] = &found.models[..] else { unreachable!() };
    assert!((polynomial.held_out / 1e-3 - 1.0).abs() < 0.1, "{}", polynomial.held_out);
    assert!(conventional.held_out > 50.0 * polynomial.held_out, "{}", conventional.held_out);
    assert_eq!(found.simplest().name, "polynomial + plays");
    assert_eq!(polynomial.unknowns, conventional.unknowns + 2);
    let reasons: Vec<_> = found.omitted.iter().map(|(_, reason)| *reason).collect();
    assert_eq!(reasons, [Omission::NoSamplingInterval; 6]);
}

#[test]
fn extensions_are_tried_where_the_records_tell_them() {
    let found = compared(&Options { dt: Some(1e-3), ..options() }).unwrap();
    let names: Vec<_> = found.models[3..].iter().map(|model| model.name.as_str()).collect();
    // One record that only decays, twice: amplitudes come back.
    assert_eq!(names.last(), Some(&"modified + all"));
    assert!(names.contains(&"modified + creep") && names.contains(&"modified + dynamics"));
    // A slow gain takes longer than they last.
    assert_eq!(found.omitted, [(Extension::SlowGain, Omission::NotTold)]);
}

#[test]
fn half_a_comparison_is_none() {
    let (drive, position) = signals();
    let records = [Record::new(&drive, &position, 0).unwrap()];
    for stop in [Stop::Discard, Stop::KeepBest] {
        let mut fraction = 0.0;
        let ended = compare(&records, &options(), &mut |now| {
            assert!(now.fraction >= fraction);
            fraction = now.fraction;
            if fraction > 0.5 { ControlFlow::Break(stop) } else { ControlFlow::Continue(()) }
        });
        assert!(matches!(ended, Err(Error::Interrupted)));
    }
    assert!(matches!(compare(&[], &options(), &mut |_| ControlFlow::Continue(())), Err(Error::NoRecords)));
}
