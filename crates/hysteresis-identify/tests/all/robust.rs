//! Glitches of the position are left out of a fit; everything else stays in it.

use std::f64::consts::PI;

use crate::actuators::{Behind, decaying_triangle, noise, run, stage_output};
use hysteresis_control::linear::{Creep, SecondOrder};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    CreepModel, DynamicsModel, FindingCode, Identification, LoopShiftModel, Loss, MapModel, ModelKind, Options, Order,
    Record, Setting, Thresholds, Verdict, WeightLaw,
};

/// A stage of its own units and rates.
struct Bench {
    actuator: ModifiedPrandtlIshlinskii,
    behind: Behind,
    dt: f64,
    amplitude: f64,
    noise: f64,
}

/// Weights that fall with the threshold, in um/V times `gain`.
fn actuator(gain: f64, amplitude: f64, ratios: Ratios, output: f64) -> ModifiedPrandtlIshlinskii {
    let weights: Vec<f64> = (0..8).map(|i| gain * if i == 0 { 1.0 } else { 0.25 / (1.0 + f64::from(i)) }).collect();
    let thresholds: Vec<f64> = (0..8).map(|i| amplitude * f64::from(i) / 8.0).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, ratios, Offsets { input: 0.0, output }).unwrap()
}

fn benches() -> [Bench; 3] {
    let ratios = |ra, rb, rc| Ratios { ra, rb, rc };
    let still = |creep, dynamics, dead_time| Behind { creep, dynamics, dead_time };
    let resonance = |frequency, damping| Some(SecondOrder::new(frequency, damping).unwrap().into());
    [
        Bench {
            actuator: actuator(0.2, 50.0, ratios(0.9, 0.4, 0.5), 3.0),
            behind: still(None, None, 0.0),
            dt: 1e-2,
            amplitude: 50.0,
            noise: 5e-4,
        },
        Bench {
            actuator: actuator(3e-6, 5.0, ratios(1.1, 0.6, 0.3), -2e-5),
            behind: still(None, resonance(90.0, 0.05), 1.5),
            dt: 1e-3,
            amplitude: 5.0,
            noise: 1e-3,
        },
        Bench {
            actuator: actuator(80.0, 0.8, ratios(0.8, 0.5, 0.6), 40.0),
            behind: still(Some(Creep::new(&[0.02, 0.03], &[0.2, 2.0]).unwrap()), resonance(200.0, 0.3), 0.0),
            dt: 5e-4,
            amplitude: 0.8,
            noise: 3e-4,
        },
    ]
}

impl Bench {
    /// Decaying loops and steps, four thousand samples.
    fn drive(&self) -> Vec<f64> {
        let mut drive = decaying_triangle(3000, self.amplitude, 12.5, 0.0);
        drive.extend([0.4, -0.3, 0.7, 0.1, -0.6].into_iter().flat_map(|level| [level * self.amplitude; 200]));
        drive
    }

    fn output(&self, drive: &[f64]) -> Vec<f64> {
        stage_output(&self.actuator, &self.behind, self.dt, drive)
    }

    fn measured(&self, drive: &[f64], seed: u64) -> Vec<f64> {
        let output = self.output(drive);
        let noise = noise(output.len(), self.noise * range(&output), seed);
        output.iter().zip(noise).map(|(y, e)| y + e).collect()
    }

    /// What the stage has, and nothing left to cross-validation.
    fn options(&self, loss: Loss) -> Options {
        let (has_creep, has_dynamics) = (self.behind.creep.is_some(), self.behind.dynamics.is_some());
        Options {
            thresholds: Thresholds::Uniform(8),
            weights: WeightLaw::Free,
            dt: Some(self.dt),
            dynamics: if has_dynamics { DynamicsModel::Order(Order::Second) } else { DynamicsModel::None },
            creep: if has_creep { CreepModel::TimeConstants(vec![0.2, 2.0]) } else { CreepModel::None },
            loop_shift: LoopShiftModel::None,
            input_map: MapModel::None,
            output_map: MapModel::None,
            smoothness: Setting::Fixed(0.0),
            loss,
            ..Options::default()
        }
    }

    fn fitted(&self, output: &[f64], loss: Loss) -> Identification {
        run(&[Record::new(&self.drive(), output, 0).unwrap()], &self.options(loss)).unwrap()
    }

    /// The rms error of what is predicted for another drive against the stage without noise, over the range.
    fn error(&self, found: &Identification) -> f64 {
        let drive: Vec<f64> = (0..3000)
            .map(|k| f64::from(k) / 3000.0)
            .map(|t| self.amplitude * (0.6 * (2.0 * PI * 7.3 * t).sin() + 0.35 * (2.0 * PI * 2.1 * t).sin()))
            .collect();
        let (truth, predicted) = (self.output(&drive), found.predict(&drive).unwrap());
        let squares: f64 = truth.iter().zip(&predicted).map(|(y, p)| (y - p).powi(2)).sum();
        (squares / 3000.0).sqrt() / range(&truth)
    }
}

fn range(values: &[f64]) -> f64 {
    let (low, high) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(*y), b.max(*y)));
    high - low
}

/// Numbers from 0 to 1.
fn random(count: usize, seed: u64) -> Vec<f64> {
    noise(count, 12.0_f64.sqrt().recip(), seed).into_iter().map(|x| x + 0.5).collect()
}

#[derive(Clone, Copy, Debug)]
enum Kind {
    /// Single samples off by anything up to the range.
    Spikes,
    /// Single samples at zero.
    Dropouts,
    /// Three to ten samples in a row, each of any value within the range.
    Runs,
    /// Single samples off by anything up to a thousand ranges.
    Gross,
}

/// The same output with glitches, and where they are.
fn glitched(output: &[f64], kind: Kind, share: f64, seed: u64) -> (Vec<f64>, Vec<usize>) {
    let (mut spoilt, mut places) = (output.to_vec(), Vec::new());
    let [starts, sizes] = [seed, seed + 1].map(|seed| random(output.len(), seed));
    let (span, low) = (range(output), output.iter().copied().fold(f64::INFINITY, f64::min));
    let per_run = if matches!(kind, Kind::Runs) { 6.5 } else { 1.0 };
    for k in 0..output.len() {
        if starts[k] * per_run > share || k < 20 {
            continue;
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "three to ten")]
        let length = if matches!(kind, Kind::Runs) { 3 + (8.0 * sizes[k]) as usize } else { 1 };
        for j in k..(k + length).min(output.len()) {
            spoilt[j] = match kind {
                Kind::Spikes => output[j] + (2.0 * sizes[j] - 1.0) * span,
                Kind::Dropouts => 0.0,
                Kind::Runs => low + sizes[(7 * j) % sizes.len()] * span,
                Kind::Gross => output[j] + (2.0 * sizes[j] - 1.0) * 1e3 * span,
            };
            places.push(j);
        }
    }
    places.dedup();
    (spoilt, places)
}

#[test]
fn glitches_cost_no_accuracy() {
    for (place, bench) in benches().iter().enumerate() {
        for (seed, kinds) in [(11, [Kind::Spikes, Kind::Runs]), (22, [Kind::Dropouts, Kind::Gross])] {
            let output = bench.measured(&bench.drive(), seed);
            let clean = bench.fitted(&output, Loss::Auto);
            assert!(clean.left_out_samples[0].is_empty());
            for kind in kinds {
                let (spoilt, places) = glitched(&output, kind, 0.03, seed + 100);
                let [auto, squares] = [Loss::Auto, Loss::Squares].map(|loss| bench.fitted(&spoilt, loss));
                let left_out = &auto.left_out_samples[0];
                let case = format!("bench {place}, {kind:?}");
                assert!(left_out.iter().all(|k| places.contains(k)), "{case}: good samples are left out");
                assert!(left_out.len() * 100 >= 95 * places.len(), "{case}: {} of {}", left_out.len(), places.len());
                let [clean_error, error, pulled] = [&clean, &auto, &squares].map(|found| bench.error(found));
                assert!(error < 1.2 * clean_error, "{case}: {error:.2e}, clean {clean_error:.2e}");
                assert!(pulled > 2.0 * clean_error, "{case}: squares {pulled:.2e}, clean {clean_error:.2e}");
                assert_near(&auto, &clean, &case);
            }
        }
    }
}

/// The parameters lie within a standard error of those of the clean record, and the figures are those of what is
/// fitted.
fn assert_near(found: &Identification, clean: &Identification, case: &str) {
    let errors = &clean.standard_errors;
    let pairs = [
        (found.ratios.ra, clean.ratios.ra, errors.ratios[0]),
        (found.ratios.rb, clean.ratios.rb, errors.ratios[1]),
        (found.ratios.rc, clean.ratios.rc, errors.ratios[2]),
        (found.lag, clean.lag, errors.lag),
    ];
    for (value, expected, error) in pairs {
        assert!(error.is_nan() || (value - expected).abs() <= error, "{case}: {value} {expected} {error}");
    }
    assert_eq!(found.fit.samples + found.left_out_samples[0].len(), clean.fit.samples);
    assert!((found.fit.rmse / clean.fit.rmse - 1.0).abs() < 0.05, "{case}: {:?} {:?}", found.fit, clean.fit);
    assert!((found.noise / clean.noise - 1.0).abs() < 0.05, "{case}: {} {}", found.noise, clean.noise);
}

/// Everything is left to cross-validation: what it chooses and what it says is that of the clean record.
#[test]
fn cross_validation_and_loops_leave_glitches_out() {
    let bench = &benches()[0];
    let output = bench.measured(&bench.drive(), 5);
    let (spoilt, _) = glitched(&output, Kind::Spikes, 0.02, 9);
    let options = Options { dt: Some(bench.dt), ..Options::default() };
    let drive = bench.drive();
    let records = [&output, &spoilt].map(|output| [Record::new(&drive, output, 0).unwrap()]);
    let [clean, found] = records.each_ref().map(|records| run(records, &options).unwrap());
    assert_eq!(found.weights, clean.weights);
    assert_eq!(found.verdict(), clean.verdict(), "{:?}", found.warnings);
    for (one, other) in found.weights_validation.iter().zip(&clean.weights_validation) {
        assert!((one.rmse / other.rmse - 1.0).abs() < 0.1, "{one:?} {other:?}");
    }
    let loops = |found: &Identification, records| found.leave_one_loop_out(records).unwrap();
    for (one, other) in loops(&found, &records[1]).iter().zip(&loops(&clean, &records[0])) {
        assert!((one.left_out.rmse / other.left_out.rmse - 1.0).abs() < 0.2, "{one:?} {other:?}");
    }
}

#[test]
fn clean_records_give_the_same_bits() {
    for bench in benches() {
        let output = bench.measured(&bench.drive(), 3);
        let [auto, squares] = [Loss::Auto, Loss::Squares].map(|loss| bench.fitted(&output, loss));
        assert_same(&auto, &squares);
    }
}

fn assert_same(auto: &Identification, squares: &Identification) {
    assert_eq!(auto.left_out_samples, squares.left_out_samples);
    assert_eq!((&auto.model, auto.dynamics, &auto.creep), (&squares.model, squares.dynamics, &squares.creep));
    assert_eq!((auto.fit, auto.dead_time), (squares.fit, squares.dead_time));
    // A number that is not known is no number, and equal to none.
    assert_eq!(format!("{:?}", auto.warnings), format!("{:?}", squares.warnings));
}

/// What a model lacks may be far off in few samples, but it is no glitch.
#[test]
fn errors_of_the_model_stay_in_the_fit() {
    let benches = benches();
    let assert_kept =
        |case: &str, bench: &Bench, drive: &[f64], output: &[f64], change: &dyn Fn(Options) -> Options| {
            let fit = |loss| run(&[Record::new(drive, output, 0).unwrap()], &change(bench.options(loss))).unwrap();
            let [auto, squares] = [Loss::Auto, Loss::Squares].map(fit);
            assert!(auto.left_out_samples[0].is_empty(), "{case}: {:?}", auto.left_out_samples);
            assert_same(&auto, &squares);
        };
    let alone = |options: Options| Options { dynamics: DynamicsModel::None, creep: CreepModel::None, ..options };
    for bench in &benches {
        let drive = bench.drive();
        let (output, exact) = (bench.measured(&drive, 4), bench.output(&drive));
        assert_kept("no dynamics", bench, &drive, &output, &alone);
        assert_kept("no noise", bench, &drive, &exact, &|options| options);
        assert_kept("no noise, no dynamics", bench, &drive, &exact, &alone);
        assert_kept("plays", bench, &drive, &output, &|options| Options {
            model: ModelKind::Conventional,
            ..alone(options)
        });
        assert_kept("two operators", bench, &drive, &output, &|options| Options {
            thresholds: Thresholds::Uniform(2),
            ..alone(options)
        });
        let span = range(&output);
        for decay in [5.0, 40.0, 300.0] {
            let start = |(k, y): (u32, &f64)| y + 0.3 * span * (-f64::from(k) / decay).exp();
            let starting: Vec<f64> = (0..).zip(&output).map(start).collect();
            assert_kept("a start-up transient", bench, &drive, &starting, &|options| options);
        }
        let step = span / 200.0;
        let coarse: Vec<f64> = output.iter().map(|y| (y / step).round() * step).collect();
        assert_kept("a coarse converter", bench, &drive, &coarse, &|options| options);
        let jump: Vec<f64> = (0..).zip(&output).map(|(k, y)| if k > 1800 { y + 0.1 * span } else { *y }).collect();
        assert_kept("another zero", bench, &drive, &jump, &|options| options);
        for period in [7, 60, 400] {
            let level = |k: usize| bench.amplitude * [0.8, -0.6, 0.3, -0.1, 0.5, -0.9][(k / period) % 6];
            let steps: Vec<f64> = (0..3000).map(level).collect();
            assert_kept("steps", bench, &steps, &bench.measured(&steps, 6), &alone);
        }
    }
}

#[test]
fn long_runs_are_no_glitches() {
    let bench = &benches()[0];
    let mut output = bench.measured(&bench.drive(), 8);
    output[700..740].iter_mut().for_each(|y| *y += 6.0);
    let found = bench.fitted(&output, Loss::Auto);
    assert!(found.left_out_samples[0].is_empty());
    assert!(found.warnings.iter().any(|finding| finding.code == FindingCode::BadStretch), "{:?}", found.warnings);
    // Of one that is known, nothing is left.
    let samples: Vec<usize> = (700..740).collect();
    let drive = bench.drive();
    let record = Record::new(&drive, &output, 0).unwrap().leaving_out(&samples).unwrap();
    let known = run(&[record], &bench.options(Loss::Squares)).unwrap();
    assert_eq!((known.left_out_samples[0].len(), known.verdict()), (40, Verdict::Green), "{:?}", known.warnings);
}

#[test]
fn runs_of_one_value_are_left_out_up_to_twenty_five() {
    let bench = &benches()[0];
    let output = bench.measured(&bench.drive(), 8);
    for (value, length) in [(-8.0, 20), (-20.0, 25), (12.0, 25), (30.0, 25)] {
        let mut spoilt = output.clone();
        spoilt[700..700 + length].fill(value);
        let found = bench.fitted(&spoilt, Loss::Auto);
        assert_eq!(found.left_out_samples[0], (700..700 + length).collect::<Vec<_>>(), "{value}");
        assert_eq!(found.verdict(), Verdict::Green, "{:?}", found.warnings);
    }
}

#[test]
fn a_robust_loss_sees_smaller_glitches() {
    let bench = &benches()[0];
    let mut output = bench.measured(&bench.drive(), 8);
    let deviation = bench.noise * range(&output);
    let places: Vec<usize> = (100..3000).step_by(200).collect();
    let truth = bench.output(&bench.drive());
    for k in &places {
        output[*k] = truth[*k] + 7.5 * deviation;
    }
    assert!(bench.fitted(&output, Loss::Auto).left_out_samples[0].is_empty());
    assert_eq!(bench.fitted(&output, Loss::Robust).left_out_samples[0], places);
}

#[test]
fn many_glitches_are_told() {
    let bench = &benches()[0];
    let output = bench.measured(&bench.drive(), 8);
    let told = |share| {
        let found = bench.fitted(&glitched(&output, Kind::Spikes, share, 77).0, Loss::Auto);
        found.warnings.into_iter().find(|finding| finding.code == FindingCode::Outliers)
    };
    assert_eq!(told(0.03), None);
    let finding = told(0.07).unwrap();
    assert!(finding.value > 0.06 && finding.limit == 0.05 && finding.message.contains("left out"), "{finding:?}");
}

#[test]
fn a_transient_at_the_start_is_no_glitch() {
    let bench = &benches()[0];
    let mut output = bench.measured(&bench.drive(), 8);
    let height = 0.3 * range(&output);
    output.iter_mut().zip(0..6).for_each(|(y, k)| *y += height * (-f64::from(k)).exp());
    assert!(bench.fitted(&output, Loss::Auto).left_out_samples[0].is_empty());
}

#[test]
fn wrong_rows_at_the_ends_are_left_out() {
    let bench = &benches()[0];
    let output = bench.measured(&bench.drive(), 8);
    let last = output.len() - 1;
    for (value, rows) in [(-9999.0, 0..1), (8.0, 0..1), (-9999.0, 0..5), (-9999.0, 1..2), (-9999.0, last..last + 1)] {
        let mut spoilt = output.clone();
        spoilt[rows.clone()].fill(value);
        let found = bench.fitted(&spoilt, Loss::Auto);
        assert_eq!(found.left_out_samples[0], rows.clone().collect::<Vec<_>>(), "{value}");
        assert_eq!(found.verdict(), Verdict::Green, "{value} in {rows:?}: {:?}", found.warnings);
        // Where all samples count, a reading that failed is no counter that wraps.
        let found = bench.fitted(&spoilt, Loss::Squares);
        assert!(found.warnings.iter().all(|finding| finding.code != FindingCode::OutputWraps), "{:?}", found.warnings);
    }
}

/// A wrong sample of the drive corrupts what follows: it is told, and the position is not what is wrong.
#[test]
fn glitches_of_the_drive_are_for_mending() {
    let bench = &benches()[0];
    let (mut drive, output) = (bench.drive(), bench.measured(&bench.drive(), 8));
    for k in [333, 1200, 2000] {
        drive[k] = 45.0;
    }
    let found = run(&[Record::new(&drive, &output, 0).unwrap()], &bench.options(Loss::Auto)).unwrap();
    let finding = found.warnings.iter().find(|finding| finding.code == FindingCode::InputOutliers).unwrap();
    assert!(finding.hint.contains("--mend 333:334"), "{finding:?}");
}
