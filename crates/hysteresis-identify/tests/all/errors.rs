//! Every error, and what it names; progress and interruption.

use std::ops::ControlFlow;

use crate::actuators::{decaying_triangle, output, paper_actuator, run};
use hysteresis_core::{Model, Offsets, PrandtlIshlinskii, Ratios};
use hysteresis_identify::{
    Error, KnownLength, Options, PlacePair, PlacesOptions, Progress, RatiosModel, Record, RecordError,
    RecursiveIdentifier, RecursiveOptions, SearchStage, Setting, Stop, Thresholds, WeightLaw, identify,
    identify_places,
};

fn data() -> (Vec<f64>, Vec<f64>) {
    let input = decaying_triangle(1_000, 500.0, 6.0, 0.0);
    let output = output(&paper_actuator(Offsets::default()), &input, 0.0);
    (input, output)
}

fn refused(options: &Options) -> Error {
    let (input, output) = data();
    run(&[Record::new(&input, &output, 0).unwrap()], options).unwrap_err()
}

#[test]
fn records() {
    let refused = |input: &[f64], output: &[f64], skip| Record::new(input, output, skip).unwrap_err();
    let error = refused(&[0.0, 1.0], &[0.0], 0);
    assert_eq!(error, RecordError::Length { argument: "output", expected: 2, got: 1 });
    assert_eq!(error.to_string(), "output: expected 2 samples, got 1");
    assert_eq!(refused(&[0.0, 1.0], &[0.0, 1.0], 2), RecordError::Skip { samples: 2, got: 2 });
    assert_eq!(refused(&[], &[], 0), RecordError::Empty { argument: "input" });
    for bad in [f64::NAN, f64::INFINITY, -1e101] {
        // Skipped samples move the operators, so they are checked like all others.
        let error = refused(&[bad, 0.0, 1.0], &[0.0, 0.0, 1.0], 1);
        assert!(matches!(error, RecordError::NotFinite { argument: "input", index: 0, .. }), "{error}");
        let error = refused(&[0.0, 0.0, 1.0], &[0.0, 0.0, bad], 1);
        assert!(matches!(error, RecordError::NotFinite { argument: "output", index: 2, .. }), "{error}");
    }
    let error = refused(&[0.0, 1.0, 1.0], &[0.0, 1.0, 2.0], 1);
    assert_eq!(error, RecordError::Constant { argument: "input", value: 1.0 });
    // Squares of these are no numbers, or zero.
    for small in [4e-101, 1e-300, 1e-320] {
        let error = refused(&[0.0, small, -small], &[0.0, 1.0, 2.0], 1);
        assert_eq!(error, RecordError::SmallRange { argument: "input", got: 2.0 * small });
        let error = refused(&[0.0, 1.0, 2.0], &[0.0, small, 0.0], 0);
        assert_eq!(error, RecordError::SmallRange { argument: "output", got: small });
        assert_eq!(error.parameter(), "output");
    }
    let small = Record::new(&[0.0, 1.0, 2.0], &[0.0, 1.0, 1e-300], 0).unwrap().leaving_out(&[1]).unwrap_err();
    let expected =
        "output: expected fitted samples that vary by 1e-100 at least, got a range of 1e-300: take a smaller unit";
    assert_eq!(small.to_string(), expected);
    let error = refused(&[0.0, 1.0, 2.0], &[0.0, 1.0, 1.0], 1);
    assert_eq!(error.in_record(3), Error::Record { record: 3, error });
    assert_eq!(
        error.in_record(3).to_string(),
        "record 3: output: expected fitted samples that vary, got 1.0 throughout"
    );
}

#[test]
fn nothing_to_fit() {
    assert_eq!(run(&[], &Options::default()).unwrap_err(), Error::NoRecords);
    for thresholds in [Thresholds::Uniform(0), Thresholds::Given(vec![])] {
        assert_eq!(refused(&Options { thresholds, ..Options::default() }), Error::NoOperators);
    }
}

/// 20 weights, one output offset, five searched parameters: 52 samples are enough, 51 are not.
#[test]
fn too_few_samples() {
    let (input, output) = data();
    let record = |samples: usize| Record::new(&input[..samples + 9], &output[..samples + 9], 9).unwrap();
    let options = Options { ratios: RatiosModel::Fit, ..Options::default() };
    assert_eq!(run(&[record(51)], &options).unwrap_err(), Error::TooFewSamples { expected: 52, got: 51 });
    assert!(run(&[record(52)], &options).is_ok());
}

/// A stage that is identified without a position sensor is told what was given too few of.
#[test]
fn too_few_places() {
    let (drive, _) = data();
    let refused = |pairs: &[PlacePair]| {
        let lengths = [KnownLength::new(0, 10.0, 60.0, 1.0), KnownLength::new(0, 70.0, 90.0, -1.0)];
        let options = PlacesOptions::new(1e-3);
        identify_places(&[&drive], pairs, &lengths, &options, &mut || ControlFlow::Continue(())).unwrap_err()
    };
    let (without, with) = (refused(&[]), refused(&[PlacePair::new(0, 30.0, 120.0)]));
    assert!(matches!(without, Error::TooFewLengths { got: 2, .. }), "{without}");
    let said = without.to_string();
    assert!(
        said.starts_with("lengths: expected at least ") && said.ends_with(" where there are no pairs, got 2"),
        "{said}"
    );
    assert_eq!(without.parameter(), Some("lengths"));
    assert!(matches!(with, Error::TooFewPairs { got: 2 | 3, .. }), "{with}");
    assert_eq!(with.parameter(), Some("pairs"));
}

#[test]
fn options() {
    for (thresholds, place) in [(vec![0.0, 2.0, 2.0], 2), (vec![-1.0, 2.0], 0), (vec![0.0, f64::NAN, 1.0], 1)] {
        let error = refused(&Options { thresholds: Thresholds::Given(thresholds), ..Options::default() });
        assert!(
            matches!(error, Error::Core(hysteresis_core::Error::Domain { parameter: "thresholds", index: Some(i), .. }) if i == place),
            "{error}"
        );
    }
    let ratios = RatiosModel::Fixed(Ratios { ra: 0.2, rb: 0.3, rc: 0.3 });
    let error = refused(&Options { ratios, ..Options::default() });
    assert!(matches!(error, Error::Core(hysteresis_core::Error::Domain { parameter: "rb", .. })), "{error}");
    let input_offset = Setting::Fixed(f64::NAN);
    let error = refused(&Options { input_offset, ..Options::default() });
    assert!(error.parameter() == Some("input_offset"), "{error}");
    for smoothness in [-0.1, f64::NAN, f64::INFINITY] {
        let error = refused(&Options { smoothness: Setting::Fixed(smoothness), ..Options::default() });
        assert!(error.parameter() == Some("smoothness"), "{error}");
    }
    for delay in [-0.1, f64::NAN, 1_000.0] {
        let error = refused(&Options { dead_time: Setting::Fixed(delay), ..Options::default() });
        assert!(error.parameter() == Some("dead_time"), "{error}");
    }
}

#[test]
fn predictions_refuse_what_records_refuse() {
    let (input, output) = data();
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &Options::default()).unwrap();
    let error = found.predict(&[1.0, f64::NAN]).unwrap_err();
    assert!(matches!(error, RecordError::NotFinite { argument: "input", index: 1, .. }), "{error}");
    assert!(found.predict(&[]).unwrap().is_empty());
}

#[test]
fn progress_goes_forward_and_can_stop_the_search() {
    let (input, output) = data();
    let record = [Record::new(&input, &output, 0).unwrap()];
    let options = Options { weights: WeightLaw::Free, thresholds: Thresholds::Uniform(20), ..Options::default() };
    let mut seen: Vec<Progress> = Vec::new();
    let found = identify(&record, &options, &mut |progress| {
        seen.push(*progress);
        ControlFlow::Continue(())
    });
    let found = found.unwrap();
    assert_eq!(found.evaluations, seen.len());
    for stage in [SearchStage::Scan, SearchStage::Refine, SearchStage::Finish] {
        assert!(seen.iter().any(|progress| progress.stage == stage), "{stage:?}");
    }
    for pair in seen.windows(2) {
        assert_eq!(pair[1].evaluations, pair[0].evaluations + 1);
        assert!(pair[1].fraction >= pair[0].fraction);
        assert!(pair[1].stage != pair[0].stage || pair[1].best_rmse <= pair[0].best_rmse);
    }
    let last = seen.last().unwrap();
    assert_eq!(last.fraction, 1.0);
    assert!((last.best_rmse - found.fit.rmse).abs() <= 1e-9 * found.fit.range);

    // Stopped anywhere, the search ends with that very call.
    for stop in [1, seen.len() / 2, seen.len()] {
        let mut calls = 0;
        let stopped = identify(&record, &options, &mut |_| {
            calls += 1;
            if calls == stop { ControlFlow::Break(Stop::Discard) } else { ControlFlow::Continue(()) }
        });
        assert_eq!((stopped.unwrap_err(), calls), (Error::Interrupted, stop));
    }
}

/// Where cross-validation chooses, one search follows the other, and all of them are one piece of work.
#[test]
fn progress_goes_forward_through_all_candidates() {
    let (input, output) = data();
    let record = [Record::new(&input, &output, 0).unwrap()];
    let mut seen: Vec<Progress> = Vec::new();
    let options = Options { smoothness: Setting::Fit, thresholds: Thresholds::Uniform(20), ..Options::default() };
    let found = identify(&record, &options, &mut |progress| {
        seen.push(*progress);
        ControlFlow::Continue(())
    });
    assert_eq!(found.unwrap().evaluations, seen.len());
    for pair in seen.windows(2) {
        assert_eq!(pair[1].evaluations, pair[0].evaluations + 1);
        assert!(pair[1].fraction >= pair[0].fraction);
    }
    assert_eq!(seen.last().unwrap().fraction, 1.0);
    // The coupled plays, which are better than the plays, scan anew, and so does what comes last.
    let scans =
        seen.windows(2).filter(|pair| pair[1].stage == SearchStage::Scan && pair[0].stage != SearchStage::Scan).count();
    assert_eq!(scans, 2);
}

#[test]
fn options_of_a_recursive_identifier() {
    let model = Model::from(paper_actuator(Offsets::default()));
    let refused = |options: RecursiveOptions| RecursiveIdentifier::new(&model, &options).unwrap_err().to_string();
    let default = RecursiveOptions::default();
    assert_eq!(
        refused(RecursiveOptions { forgetting: 0.4, ..default.clone() }),
        "forgetting: expected a number from 0.5 to 1, got 0.4"
    );
    assert_eq!(
        refused(RecursiveOptions { forgetting: f64::NAN, ..default.clone() }),
        "forgetting: expected a number from 0.5 to 1, got NaN"
    );
    let message = "covariance: expected a number from 1e-30 to 1e30, got 0.0";
    assert_eq!(refused(RecursiveOptions { covariance: 0.0, ..default.clone() }), message);
    let message = "covariance_limit: expected a number from 1e-30 to 1e30, got -1.0";
    assert_eq!(refused(RecursiveOptions { covariance_limit: -1.0, ..default.clone() }), message);
    let message = "output_offset: expected a finite number (at most 1e100 in magnitude), got inf";
    assert_eq!(refused(RecursiveOptions { output_offset: Setting::Fixed(f64::INFINITY), ..default.clone() }), message);
    let without_identity = PrandtlIshlinskii::new(&[1.0], &[2.0], Offsets::default()).unwrap();
    let error = RecursiveIdentifier::new(&without_identity.into(), &default).unwrap_err();
    assert!(matches!(error, Error::Core(hysteresis_core::Error::NotInvertible { .. })));
}
