//! The verdict in Rust: defects of a record with their place, severity and hint, and none of a clean one.

use std::ops::ControlFlow;

use crate::actuators::noise;
use hysteresis_core::Process;
use hysteresis_identify::{
    Error, Finding, FindingCode, Identification, Options, Record, RecordError, Setting, Severity, Thresholds, Verdict,
    WeightLaw, diagnose, identify,
};
use hysteresis_simulate::paper;

const SAMPLES: usize = 4000;

fn number(k: usize) -> f64 {
    f64::from(u32::try_from(k).unwrap())
}

/// A sine of 16 cycles that decays.
fn drive() -> Vec<f64> {
    let sample = |k: usize| 500.0 * (1.0 - 0.9 * number(k) / number(SAMPLES)) * (number(k) / 40.0).sin();
    (0..SAMPLES).map(sample).collect()
}

/// The actuator of the paper with noise of a tenth of a per cent of the range: a fixed sequence, uniform.
fn position(input: &[f64]) -> Vec<f64> {
    let mut stream = paper::table_1_recovered().forward();
    let mut state = 7_u64;
    let mut noise = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        0.02 * (f64::from(u32::try_from(state >> 32).unwrap()) / f64::from(u32::MAX) - 0.5)
    };
    input.iter().map(|u| stream.step(*u) + noise()).collect()
}

fn fitted(record: Record<'_>) -> Identification {
    let options = Options {
        thresholds: Thresholds::Uniform(8),
        weights: WeightLaw::Free,
        dead_time: Setting::Fixed(0.0),
        ..Options::default()
    };
    identify(&[record], &options, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn find(found: &Identification, code: FindingCode) -> &Finding {
    found.warnings.iter().find(|finding| finding.code == code).unwrap_or_else(|| panic!("{:?}", found.warnings))
}

#[test]
fn a_clean_record_is_green_and_a_turned_one_is_red() {
    let input = drive();
    let output = position(&input);
    let clean = fitted(Record::new(&input, &output, 0).unwrap());
    assert_eq!((clean.verdict(), &clean.warnings[..]), (Verdict::Green, &[][..]));
    let turned: Vec<f64> = output.iter().map(|y| -y).collect();
    let found = fitted(Record::new(&input, &turned, 0).unwrap());
    let wrong = find(&found, FindingCode::WrongSign);
    assert_eq!((found.verdict(), wrong.severity), (Verdict::Red, Severity::Red));
    assert!(wrong.message.contains("with the sign of the position turned 0."), "{wrong}");
    // Of the fit only that it is poor is told.
    assert_eq!(found.warnings.len(), 2, "{:?}", found.warnings);
}

#[test]
fn what_leads_is_backwards() {
    let input = drive();
    let output = position(&input);
    let found = fitted(Record::new(&output, &input, 0).unwrap());
    let backwards = find(&found, FindingCode::LoopBackwards);
    assert!(backwards.value > backwards.limit && backwards.severity == Severity::Red);
}

#[test]
fn a_place_is_told() {
    let input = drive();
    let mut output = position(&input);
    for (k, y) in output.iter_mut().enumerate().take(60) {
        *y += 2.0 * (1.0 - number(k) / 60.0);
    }
    let found = fitted(Record::new(&input, &output, 0).unwrap());
    let start = find(&found, FindingCode::StartUpTransient);
    let end = start.sample.unwrap();
    assert!((40..300).contains(&end) && start.hint.ends_with(&format!("--skip {end}")), "{start:?}");
    let again = fitted(Record::new(&input, &output, end.max(60)).unwrap());
    assert_eq!(again.verdict(), Verdict::Green, "{:?}", again.warnings);
}

#[test]
fn times_are_looked_at_where_they_are_known() {
    let input = drive();
    let output = position(&input);
    let late = |k: usize| if k < 1000 { 1e-3 * number(k) } else { 1e-3 * number(k + 5) };
    let times: Vec<f64> = (0..SAMPLES).map(late).collect();
    let record = Record::new(&input, &output, 0).unwrap();
    let found = fitted(record.at_times(&times).unwrap());
    let gap = find(&found, FindingCode::TimeGap);
    assert!((gap.value - 6.0).abs() < 1e-6 && gap.sample == Some(1000), "{gap:?}");
    assert_eq!(found.verdict(), Verdict::Amber);
    let short = record.at_times(&times[1..]).unwrap_err();
    assert_eq!(short, RecordError::Length { argument: "times", expected: SAMPLES, got: SAMPLES - 1 });
    let odd = vec![f64::NAN; SAMPLES];
    assert!(matches!(record.at_times(&odd), Err(RecordError::NotFinite { argument: "times", index: 0, .. })));
    let mut twice = times.clone();
    twice[7] = twice[6];
    let error = record.at_times(&twice).unwrap_err();
    assert_eq!(error, RecordError::TimeOrder { index: 7, before: times[6], got: times[6] });
    assert_eq!(error.parameter(), "times");
    let hint = "where times are too coarse, leave them out and give dt";
    assert!(error.to_string().ends_with(hint), "{error}");
    twice[7] = twice[5];
    let back = record.at_times(&twice).unwrap_err().to_string();
    assert!(!back.contains(hint), "{back}");
}

#[test]
fn times_that_contradict_the_sampling_interval_are_refused() {
    let input = drive();
    let output = position(&input);
    let times: Vec<f64> = (0..SAMPLES).map(|k| 1e-3 * number(k)).collect();
    let record = Record::new(&input, &output, 0).unwrap().at_times(&times).unwrap();
    let all = [
        (1e-3, true),
        (1.005e-3, true),
        (1.02e-3, false),
        (1.4e-3, false),
        (0.75e-3, false),
        (1e-2, false),
        (1e-4, false),
    ];
    for (dt, is_near) in all {
        let timed = record.sampled_every(dt).unwrap();
        let found = diagnose(&[timed], &paper::table_1_recovered().into(), 0.0);
        match found {
            Err(Error::Record { record: 0, error: RecordError::TimeStep { expected, got } }) => {
                assert!(!is_near && (expected - dt).abs() < 1e-12 && (got - 1e-3).abs() < 1e-9, "{dt}: {got}");
            }
            other => assert!(is_near && other.is_ok(), "{dt}: {other:?}"),
        }
    }
    // Times that a clock of few steps, or one that is read late, has made of the same samples; and another interval
    // beside each.
    let late: Vec<f64> = times.iter().zip(noise(SAMPLES, 1e-4, 11)).map(|(t, e)| t + e).collect();
    let rounded: Vec<f64> = times.iter().map(|t| (t / 9.1e-4).floor() * 9.1e-4).collect();
    for uneven in [&late, &rounded] {
        let record = record.at_times(uneven).unwrap();
        let refused =
            |dt| diagnose(&[record.sampled_every(dt).unwrap()], &paper::table_1_recovered().into(), 0.0).is_err();
        assert!(!refused(1e-3) && refused(1.05e-3) && refused(0.95e-3));
    }
    let options = Options { dt: Some(1e-2), ..Options::default() };
    let refused = identify(&[record], &options, &mut |_| ControlFlow::Continue(())).unwrap_err();
    assert_eq!(refused.parameter(), Some("times"));
}

#[test]
fn a_drive_beyond_the_range_is_an_extrapolation() {
    let input = drive();
    let output = position(&input);
    let mut found = fitted(Record::new(&input, &output, 0).unwrap());
    assert_eq!(found.extrapolation(&input), None);
    let further: Vec<f64> = input.iter().map(|u| 1.1 * u).collect();
    let beyond = position(&further);
    let held_out = [(Record::new(&further, &beyond, 0).unwrap(), None)];
    assert_eq!(found.validate_all(&held_out).len(), 1);
    let finding = find(&found, FindingCode::Extrapolation);
    assert!((finding.value - 0.05).abs() < 0.005 && finding.severity == Severity::Amber, "{finding:?}");
    assert!(finding.message.starts_with("held-out record 0: the drive reaches"), "{finding}");
}

/// Operators that the drive does not reach leave columns of zeros before the slow ones.
#[test]
fn a_slow_change_is_told_beside_operators_that_never_move() {
    let input = drive();
    let drifts = |(k, y): (usize, f64)| y + 0.3 * number(k) / number(SAMPLES);
    let clean = position(&input);
    let drifting: Vec<f64> = clean.iter().copied().enumerate().map(drifts).collect();
    for beyond in [0, 1, 3] {
        let thresholds = (0..8 + beyond).map(|i| if i < 8 { 60.0 * number(i) } else { 1000.0 * number(i) }).collect();
        let options = Options {
            thresholds: Thresholds::Given(thresholds),
            weights: WeightLaw::Free,
            dead_time: Setting::Fixed(0.0),
            ..Options::default()
        };
        let found = |output| {
            let record = Record::new(&input, output, 0).unwrap();
            identify(&[record], &options, &mut |_| ControlFlow::Continue(())).unwrap()
        };
        let slow = found(&drifting);
        let drift = find(&slow, FindingCode::Drift);
        assert!(drift.message.starts_with("a slow change of"), "{beyond} {drift}");
        let unreached = slow.warnings.iter().find(|finding| finding.code == FindingCode::UnreachedThreshold);
        assert_eq!(unreached.map_or(0.0, |finding| finding.value), number(beyond));
        let codes: Vec<_> = found(&clean).warnings.iter().map(|finding| finding.code).collect();
        assert!(!codes.contains(&FindingCode::Drift), "{beyond} {codes:?}");
    }
}

#[test]
fn a_turned_record_is_told_whatever_the_number_of_operators() {
    let input = drive();
    let turned: Vec<f64> = position(&input).iter().map(|y| -y).collect();
    let kinds = [Thresholds::Refined, Thresholds::Auto, Thresholds::RefinedQuantiles, Thresholds::AutoGeometric];
    for thresholds in kinds {
        let options = Options { thresholds: thresholds.clone(), dead_time: Setting::Fixed(0.0), ..Options::default() };
        let record = [Record::new(&input, &turned, 0).unwrap()];
        let found = identify(&record, &options, &mut |_| ControlFlow::Continue(())).unwrap();
        let codes: Vec<FindingCode> = found.warnings.iter().map(|finding| finding.code).collect();
        assert_eq!(codes, [FindingCode::WrongSign, FindingCode::PoorFit], "{thresholds:?}");
    }
}

/// What reading took for granted comes first; the verdict counts it, and the stage keeps it.
#[test]
fn what_was_assumed_is_a_finding_that_the_stage_keeps() {
    let input = drive();
    let output = position(&input);
    let found = fitted(Record::new(&input, &output, 0).unwrap());
    assert_eq!(found.verdict(), Verdict::Green);
    let said = ["no unit in 'pos': um is assumed".to_owned(), "a row is left out".to_owned()];
    let doubtful = found.clone().assuming(said.clone());
    assert_eq!(doubtful.verdict(), Verdict::Amber);
    assert!(
        doubtful.warnings.iter().zip(&said).all(|(one, said)| one.code == FindingCode::Assumed && one.message == *said)
    );
    let stage = doubtful.stage().unwrap();
    let read = hysteresis_control::stage::Stage::from_json(&stage.to_json()).unwrap();
    let kept = &read.parts().identified.as_ref().unwrap().warnings;
    assert_eq!((kept[0].code.as_str(), &kept[1].message), ("assumed", &said[1]));
    assert_eq!(found.clone().assuming([]), found);
}

/// A weight of zero has no standard error: that is no number, and reads back as none.
#[cfg(feature = "serde")]
#[test]
fn a_result_reads_back_from_json_with_what_is_no_number() {
    let input = drive();
    let output = position(&input);
    let options = Options {
        thresholds: Thresholds::Given(vec![0.0, 100.0, 101.0, 102.0, 300.0]),
        weights: WeightLaw::Free,
        dead_time: Setting::Fixed(0.0),
        smoothness: Setting::Fixed(0.0),
        ..Options::default()
    };
    let records = [Record::new(&input, &output, 0).unwrap()];
    let found = identify(&records, &options, &mut |_| ControlFlow::Continue(())).unwrap();
    assert!(found.standard_errors.weights.iter().any(|error| error.is_nan()), "{:?}", found.standard_errors);
    let text = serde_json::to_string(&found).unwrap();
    let read: Identification = serde_json::from_str(&text).unwrap();
    assert_eq!(read, found);
    // As files of before have it.
    let with_null = text.replace("\"nan\"", "null");
    assert!(with_null.contains("null"));
    assert_eq!(serde_json::from_str::<Identification>(&with_null).unwrap(), found);
}
