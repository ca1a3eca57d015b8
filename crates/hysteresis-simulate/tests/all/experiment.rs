//! The records of an experiment: what they have, and what no experiment can have.

use hysteresis_simulate::excitation::{ExperimentOptions, Part, Shape};

fn options() -> ExperimentOptions {
    ExperimentOptions { fast_rate: 1e4, ..ExperimentOptions::new(0.0, 150.0, 2000.0, 1e3) }
}

fn names(part: &Part) -> Vec<&str> {
    part.segments.iter().map(|segment| segment.name).collect()
}

fn named(options: ExperimentOptions) -> String {
    options.experiment().unwrap_err().to_string()
}

#[test]
fn the_default_experiment_takes_less_than_two_minutes() {
    let made = options().experiment().unwrap();
    let [fast, loops] = &made.parts[..] else { panic!("two parts") };
    assert_eq!(names(fast), ["start", "approach", "chirp", "end"]);
    let expected = ["start", "settle", "major", "decaying", "growing", "inner", "rests"];
    assert_eq!(names(loops)[..7], expected);
    assert_eq!(names(loops)[7..], ["fast major", "fast decaying", "return", "end"]);
    assert!(loops.drive.len() + fast.drive.len() / 10 < 120_000);
}

#[test]
fn loops_have_the_frequencies_that_they_say() {
    let loops = &options().experiment().unwrap().parts[1];
    for (name, cycles, frequency) in [("major", 5.0, 1.0), ("fast major", 5.0, 2000.0 / 300.0)] {
        let segment = loops.segments.iter().find(|segment| segment.name == name).unwrap();
        assert_eq!(segment.range, (0.0, 150.0));
        assert!((segment.frequencies.0 - frequency).abs() < 1e-12);
        let seconds = f64::from(u32::try_from(segment.stop - segment.start).unwrap()) / 1e3;
        assert!((seconds - cycles / frequency).abs() < 0.011, "{name}: {seconds} s");
    }
}

#[test]
fn a_slow_amplifier_gets_slow_loops_at_two_rates() {
    let slow = ExperimentOptions { slew: 90.0, ..options() };
    let loops = &slow.experiment().unwrap().parts[1];
    let frequency = |name: &str| loops.segments.iter().find(|one| one.name == name).unwrap().frequencies.0;
    assert!((frequency("fast major") - 0.3).abs() < 1e-12);
    assert!((frequency("major") - 0.1).abs() < 1e-12);
}

#[test]
fn the_first_stroke_ends_where_the_history_is_known() {
    for (low, high) in [(0.0, 150.0), (-500.0, 500.0)] {
        let made = ExperimentOptions::new(low, high, 20.0 * (high - low), 1e3).experiment().unwrap();
        assert_eq!(made.parts[0].initialization_samples, 0);
        let loops = &made.parts[1];
        let (before, after) = loops.drive.split_at(loops.initialization_samples);
        assert_eq!(after[0], low);
        assert!(before.contains(&high));
    }
}

#[test]
fn joined_parts_keep_their_segments() {
    let options = ExperimentOptions::new(-500.0, 500.0, 2e4, 5e3);
    let parts = options.experiment().unwrap().parts;
    let joined = options.experiment().unwrap().joined().unwrap();
    let (fast, loops) = (&parts[0], &parts[1]);
    assert_eq!(joined.drive, [&fast.drive[..], &loops.drive[..]].concat());
    assert_eq!(joined.segments.len(), fast.segments.len() + loops.segments.len());
    assert!(joined.segments.windows(2).all(|pair| pair[0].stop == pair[1].start));
    assert_eq!(joined.initialization_samples, fast.drive.len() + loops.initialization_samples);
    let error = ExperimentOptions { fast_rate: 1e4, fast_frequency: 2e3, ..options }.experiment().unwrap().joined();
    let expected = "fast_rate: expected 5000.0 Hz, the rate of the loops, for a drive in one part, got 10000.0";
    assert_eq!(error.unwrap_err().to_string(), expected);
}

#[test]
fn what_no_experiment_can_have_is_named() {
    let frequencies = |frequencies| named(ExperimentOptions { frequencies, ..options() });
    let expected = "frequencies: expected two numbers above 0, the lower one first, got ";
    assert_eq!(frequencies((0.0, 10.0)), format!("{expected}0.0"));
    assert_eq!(frequencies((1.0, 1.0)), format!("{expected}1.0"));
    assert_eq!(frequencies((1.0, f64::NAN)), format!("{expected}NaN"));
    assert_eq!(frequencies((f64::INFINITY, f64::INFINITY)), format!("{expected}inf"));
    let fast = |fast_frequency| named(ExperimentOptions { fast_frequency, ..options() });
    let expected = "fast_frequency: expected a number from 4.0 to half of `fast_rate`, 10000.0 Hz, got ";
    assert_eq!(fast(5001.0), format!("{expected}5001.0"));
    assert_eq!(fast(3.9), format!("{expected}3.9"));
    let expected = "fast_amplitude: expected a number above 0, at most half of the range, 75.0, got ";
    for fast_amplitude in [0.0, 76.0] {
        assert_eq!(named(ExperimentOptions { fast_amplitude, ..options() }), format!("{expected}{fast_amplitude:?}"));
    }
    assert_eq!(
        named(ExperimentOptions { rest: -1.0, ..options() }),
        "rest: expected a finite number, 0 or more, got -1.0"
    );
    assert!(named(ExperimentOptions { rest: f64::INFINITY, ..options() }).starts_with("rest: "));
    assert!(named(ExperimentOptions { rest: 1e9, ..options() }).starts_with("rate: expected at most 134217728 "));
    assert!(named(ExperimentOptions { rate: 100.0, ..options() }).starts_with("rate: expected at least "));
    assert_eq!(
        named(ExperimentOptions { fast_rate: 0.0, ..options() }),
        "fast_rate: expected a finite number above 0, got 0.0"
    );
    assert!(
        named(ExperimentOptions { fast_rate: 1e9, fast_frequency: 1e3, ..options() })
            .starts_with("fast_rate: expected at most 134217728 samples")
    );
    assert_eq!(
        named(ExperimentOptions { slew: f64::NAN, ..options() }),
        "slew: expected a finite number above 0, got NaN"
    );
    assert!(named(ExperimentOptions { high: 0.0, ..options() }).starts_with("high: "));
    let sine = ExperimentOptions { shape: Shape::Sine, center: 151.0, ..options() };
    assert!(named(sine).starts_with("center: "));
}

#[test]
fn an_experiment_that_rests_at_its_center_has_no_way_back() {
    let loops = &ExperimentOptions::new(-500.0, 500.0, 2e4, 1e3).experiment().unwrap().parts[1];
    assert_eq!(names(loops)[7..], ["fast major", "fast decaying", "end"]);
}

/// 2000 V/s allow 0.75 V up to 424 Hz, and 0.16 V at 2 kHz: the slow part of the chirp does not pay for the fast one.
#[test]
fn a_chirp_has_the_amplitude_that_the_slew_rate_allows_at_its_frequency() {
    let made = ExperimentOptions { start: 75.0, fast_frequency: 2e3, ..options() }.experiment().unwrap();
    let chirp = made.parts[0].segments.iter().find(|segment| segment.name == "chirp").unwrap();
    let drive = &made.parts[0].drive[chirp.start..chirp.stop];
    let highest = |from: usize, to: usize| {
        let part = &drive[from * drive.len() / 100..to * drive.len() / 100];
        part.iter().map(|u| (u - 75.0).abs()).fold(0.0, f64::max)
    };
    assert!(highest(10, 20) > 0.74 && highest(0, 100) <= 0.75, "{}", highest(10, 20));
    let (middle, end) = (highest(48, 52), highest(90, 94));
    assert!((0.28..0.34).contains(&middle) && (0.15..0.18).contains(&end), "{middle} {end}");
    let speed = drive.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max) * 1e4;
    assert!((1900.0..=2000.0001).contains(&speed), "{speed}");
}
