//! What surrounds a model: warnings, loops left out, the best so far of a search that was stopped.

use std::ops::ControlFlow;

use crate::actuators::{decaying_triangle, noise, output, paper_actuator, run, samples, weights};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    Error, FindingCode, Identification, Loss, MapModel, Options, Quality, RatiosModel, Record, RecordError,
    SearchStage, Setting, Stop, Thresholds, WeightLaw, diagnose, identify,
};

const NOISE: f64 = 0.015;

fn noisy(samples: u32, periods: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    noisy_about(0.0, samples, periods, seed)
}

fn noisy_about(centre: f64, samples: u32, periods: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let input = decaying_triangle(samples, 500.0 - centre, periods, centre);
    let clean = output(&paper_actuator(Offsets::default()), &input, 0.0);
    let noise = noise(input.len(), NOISE, seed);
    (input, clean.iter().zip(noise).map(|(y, e)| y + e).collect())
}

fn known(weights: WeightLaw) -> Options {
    Options {
        weights,
        thresholds: Thresholds::Given((0..10).map(|i| 50.0 * f64::from(i)).collect()),
        ratios: RatiosModel::Fixed(Ratios::PAPER),
        input_offset: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(1.3),
        smoothness: Setting::Fixed(0.0),
        input_map: MapModel::None,
        output_map: MapModel::None,
        ..Options::default()
    }
}

#[test]
fn warnings_are_the_findings_about_the_fitted_records() {
    let input: Vec<f64> = (0..4000).map(|k| 500.0 * (f64::from(k) / 100.0).sin()).collect();
    let mut measured = output(&paper_actuator(Offsets::default()), &input, 0.0);
    measured.iter_mut().zip(noise(4000, NOISE, 3)).for_each(|(y, e)| *y += e);
    measured[2000] += 0.5;
    let record = [Record::new(&input, &measured, 100).unwrap()];
    let found = run(&record, &Options { loss: Loss::Squares, ..known(WeightLaw::Free) }).unwrap();
    // Of a fit alone: the record has no interval, so its dead time counts in samples.
    let (of_fit, of_record) = found.warnings.split_last().unwrap();
    assert_eq!(of_fit.code, FindingCode::NoInterval);
    assert_eq!(of_record, diagnose(&record, &found.model, samples(&found)).unwrap());
    let defects: Vec<_> = found.warnings.iter().map(|finding| finding.code).collect();
    assert!(defects.contains(&FindingCode::NoMinorLoops) && defects.contains(&FindingCode::Outliers), "{defects:?}");
}

fn quality(found: &Identification, record: &Record<'_>, offset: Option<f64>) -> Quality {
    found.validate(record, offset)
}

/// The last loop left out is a record that ends before it, the first one left out a record that skips it.
#[test]
fn leaving_a_loop_out_is_fitting_without_it() {
    let (input, output) = noisy(3_000, 6.0, 5);
    for law in [WeightLaw::Free, WeightLaw::Quadratic, WeightLaw::Split] {
        let record = [Record::new(&input, &output, 40).unwrap()];
        let found = run(&record, &known(law)).unwrap();
        let rows = found.leave_one_loop_out(&record).unwrap();
        // Maxima at quarter periods of 500 samples: six of them, so five loops, each sample in one.
        assert_eq!(rows.len(), 5);
        assert_eq!((rows[0].samples.start, rows[4].samples.end), (40, 3_000));
        for pair in rows.windows(2) {
            assert_eq!(pair[0].samples.end, pair[1].samples.start);
            assert!(pair[0].amplitude > pair[1].amplitude);
            assert!((625..=2125).contains(&pair[0].samples.end) && (pair[0].samples.end - 125) % 500 <= 1);
        }
        let all = Quality::pooled(&rows.iter().map(|row| row.fitted).collect::<Vec<_>>());
        assert!((all.rmse - found.fit.rmse).abs() < 1e-9 * found.fit.rmse && all.samples == found.fit.samples);
        assert!((all.max_error - found.fit.max_error).abs() < 1e-9 * found.fit.max_error);

        let last = rows[4].samples.start;
        let before = run(&[Record::new(&input[..last], &output[..last], 40).unwrap()], &known(law)).unwrap();
        let end = Record::new(&input, &output, last).unwrap();
        let expected = quality(&before, &end, Some(before.output_offsets[0]));
        let near = |got: f64, want: f64| assert!((got - want).abs() < 1e-8 * want, "{law:?}: {got} instead of {want}");
        near(rows[4].left_out.rmse, expected.rmse);
        near(rows[4].left_out.max_error, expected.max_error);

        let first = rows[0].samples.end;
        let after = run(&[Record::new(&input, &output, first).unwrap()], &known(law)).unwrap();
        let beginning = Record::new(&input[..first], &output[..first], 40).unwrap();
        near(rows[0].left_out.rmse, quality(&after, &beginning, Some(after.output_offsets[0])).rmse);
        // Every loop is predicted worse than it is fitted, if not by much.
        assert!(rows.iter().all(|row| row.left_out.rmse > row.fitted.rmse));
    }
}

/// A record of one loop has the offset that suits it while it is left out.
#[test]
fn a_record_of_one_loop_is_left_out_whole() {
    let (input, output) = noisy(3_000, 6.0, 5);
    let shifted: Vec<f64> = output[..700].iter().map(|y| y + 7.0).collect();
    let records = [Record::new(&input, &output, 40).unwrap(), Record::new(&input[..700], &shifted, 40).unwrap()];
    let found = run(&records, &known(WeightLaw::Free)).unwrap();
    let rows = found.leave_one_loop_out(&records).unwrap();
    assert_eq!((rows.len(), rows[5].record, rows[5].samples.clone()), (6, 1, 40..700));
    let alone = run(&records[..1], &known(WeightLaw::Free)).unwrap();
    let expected = quality(&alone, &records[1], None);
    assert!((rows[5].left_out.rmse - expected.rmse).abs() < 1e-8 * expected.rmse);
    assert!((found.output_offsets[1] - found.output_offsets[0] - 7.0).abs() < 0.01);

    let one = run(&records[1..], &known(WeightLaw::Free)).unwrap();
    let error = one.leave_one_loop_out(&records[1..]).unwrap_err();
    assert_eq!(error, Error::TooFewLoops { got: 1 });
    assert!(error.to_string().starts_with("records: expected at least two loops"), "{error}");
    assert_eq!(one.leave_one_loop_out(&[]).unwrap_err(), Error::NoRecords);
}

#[test]
fn many_loops_are_left_out_in_groups() {
    let (input, output) = noisy(9_000, 600.0, 5);
    let record = [Record::new(&input, &output, 0).unwrap()];
    let rows = run(&record, &known(WeightLaw::Quadratic)).unwrap().leave_one_loop_out(&record).unwrap();
    assert!((100..=200).contains(&rows.len()), "{}", rows.len());
    assert_eq!((rows[0].samples.start, rows[rows.len() - 1].samples.end), (0, 9_000));
    assert!(rows.windows(2).all(|pair| pair[0].samples.end == pair[1].samples.start));
}

/// Wherever it is stopped, the weights are the best for the thresholds reached, and the later the better.
#[test]
fn a_search_that_is_stopped_hands_over_its_best() {
    let (input, output) = noisy(1_500, 8.0, 9);
    let record = [Record::new(&input, &output, 0).unwrap()];
    // Where cross-validation chooses, later may also be simpler, and fit a little less.
    for (thresholds, slack) in [(Thresholds::Uniform(6), 1.001), (Thresholds::Auto, 1.02)] {
        let options = Options { thresholds, ..Options::default() };
        let stopped_at = |stop: usize| {
            let (mut calls, mut best) = (0, f64::INFINITY);
            let found = identify(&record, &options, &mut |now| {
                (calls, best) = (calls + 1, now.best_rmse);
                if calls == stop { ControlFlow::Break(Stop::KeepBest) } else { ControlFlow::Continue(()) }
            });
            (found.unwrap(), best, calls)
        };
        let (whole, _, calls) = stopped_at(usize::MAX);
        // The number of operators is often judged and stays: then a report says that all is done.
        assert!(!whole.partial && calls == whole.evaluations + usize::from(options.thresholds == Thresholds::Auto));
        let mut last = f64::INFINITY;
        for stop in [1, calls / 2, calls - 2] {
            let (found, best, called) = stopped_at(stop);
            assert!(found.partial && called == stop && found.evaluations == stop);
            assert!(found.kkt_residual < 1e-12 && weights(&found).iter().all(|w| *w >= 0.0));
            // Two of these are errors on a selection of the samples, noise and all.
            assert!(found.fit.rmse < 1.3 * best || options.thresholds == Thresholds::Auto, "{} {best}", found.fit.rmse);
            assert!(found.fit.rmse <= slack * last, "{} after {last}", found.fit.rmse);
            assert!(found.predict_std(&input).unwrap().iter().all(|std| std.is_finite()));
            last = found.fit.rmse;
        }
        assert!(last <= 1.01 * whole.fit.rmse);
    }
}

/// A search that is stopped where everything begins anew with coupled plays leaves the plays that were found.
#[test]
fn what_is_stopped_where_it_begins_anew_leaves_what_was_found() {
    // Far from all ratios that the search begins with.
    let (ratios, thresholds) = (Ratios { ra: 1.4, rb: 0.7, rc: 0.1 }, [0.0, 80.0, 160.0, 240.0]);
    let weights = [4e-3, 1e-3, 2e-3, 2e-3];
    let actuator = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, ratios, Offsets::default()).unwrap();
    let input = decaying_triangle(1_500, 500.0, 8.0, 0.0);
    let output: Vec<f64> =
        output(&actuator, &input, 0.0).iter().zip(noise(input.len(), NOISE, 9)).map(|(y, e)| y + e).collect();
    let record = [Record::new(&input, &output, 0).unwrap()];
    let options = Options { thresholds: Thresholds::Uniform(6), ..Options::default() };
    let mut stages = Vec::new();
    let whole = identify(&record, &options, &mut |now| {
        stages.push(now.stage);
        ControlFlow::Continue(())
    });
    assert_ne!(whole.unwrap().ratios, Ratios::PLAY);
    let begins = |pair: &[SearchStage]| pair[1] == SearchStage::Scan && pair[0] != SearchStage::Scan;
    let anew = stages.windows(2).position(begins).unwrap() + 1;
    let mut calls = 0;
    let stopped = identify(&record, &options, &mut |_| {
        calls += 1;
        if calls > anew { ControlFlow::Break(Stop::KeepBest) } else { ControlFlow::Continue(()) }
    });
    let plays = Options { ratios: RatiosModel::Fixed(Ratios::PLAY), ..options };
    let (stopped, plays) = (stopped.unwrap(), run(&record, &plays).unwrap());
    assert!(stopped.partial && calls == anew + 1);
    assert_eq!(stopped.ratios, Ratios::PLAY);
    assert!(stopped.fit.rmse < 1.05 * plays.fit.rmse, "{} {}", stopped.fit.rmse, plays.fit.rmse);
}

/// Many noisy records: how far their predictions lie apart is what each says of itself.
#[test]
fn the_deviation_of_a_prediction_is_its_spread() {
    const RUNS: u32 = 120;
    let runs = f64::from(RUNS);
    let unseen = decaying_triangle(400, 250.0, 3.0, 210.0);
    for law in [WeightLaw::Free, WeightLaw::Quadratic, WeightLaw::Split] {
        let (mut sums, mut squares, mut told) = (vec![0.0; 400], vec![0.0; 400], 0.0);
        for seed in 0..RUNS {
            // Far from zero the output offset and the weights make up for each other.
            let (input, output) = noisy_about(200.0, 1_200, 6.0, u64::from(100 + seed));
            let options = Options { ratios: RatiosModel::Fit, dead_time: Setting::Fixed(0.0), ..known(law) };
            let found = run(&[Record::new(&input, &output, 0).unwrap()], &options).unwrap();
            let deviation = found.predict_std(&unseen).unwrap();
            for (k, y) in found.predict(&unseen).unwrap().iter().enumerate() {
                sums[k] += y / runs;
                squares[k] += y * y / (runs - 1.0);
                told += deviation[k] * deviation[k] / runs;
            }
        }
        let spread: f64 =
            squares.iter().zip(&sums).map(|(square, mean)| square - mean * mean * runs / (runs - 1.0)).sum();
        let ratio = (told / spread).sqrt();
        // 120 runs tell a deviation to 6 % (1 sigma). Weights at zero count as known, so it is told a little too small.
        assert!((0.75..1.3).contains(&ratio), "{law:?}: {ratio}");
    }
}

#[test]
fn the_deviation_of_a_prediction_wants_finite_samples() {
    let (input, output) = noisy(1_500, 8.0, 9);
    let found = run(&[Record::new(&input, &output, 0).unwrap()], &known(WeightLaw::Free)).unwrap();
    let error = found.predict_std(&[0.0, f64::NAN]).unwrap_err();
    assert!(matches!(error, RecordError::NotFinite { argument: "input", index: 1, .. }), "{error}");
    assert_eq!(found.predict_std(&[]), Ok(Vec::new()));
}
