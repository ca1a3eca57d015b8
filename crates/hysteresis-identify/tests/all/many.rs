//! Many actuators at once: as good as single fits, each for itself, whatever goes wrong with the others.

use std::ops::ControlFlow;

use crate::actuators::{decaying_triangle, noise, output, run};
use hysteresis_core::{Model, ModifiedPrandtlIshlinskii, Offsets, Ratios};
use hysteresis_identify::{
    CreepModel, DuhemModel, DynamicsModel, Error, FindingCode, LoopShiftModel, ManyIdentifications, ManyRecords,
    MapModel, Options, Order, RatiosModel, Record, RecordError, RelaxingPlaysModel, Setting, Thresholds, Verdict,
    WeightLaw, identify_many, settled_options,
};
use proptest::prelude::*;

const SAMPLES: u32 = 600;

fn drive(centre: f64) -> Vec<f64> {
    decaying_triangle(SAMPLES, 50.0, 6.0, centre)
}

fn options() -> Options {
    Options {
        thresholds: Thresholds::Uniform(5),
        weights: WeightLaw::Free,
        dt: Some(1e-3),
        dynamics: DynamicsModel::None,
        creep: CreepModel::None,
        loop_shift: LoopShiftModel::None,
        relaxing_plays: RelaxingPlaysModel::None,
        duhem: DuhemModel::None,
        input_map: MapModel::None,
        output_map: MapModel::None,
        smoothness: Setting::Fixed(0.0),
        ..Options::default()
    }
}

/// The position of an actuator: ratios, weights, offsets, gain, dead time and noise are its own.
fn position(input: &[f64], seed: u64) -> Vec<f64> {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * random.f64();
    let ra = between(0.7, 1.2);
    let ratios = Ratios { ra, rb: ra * between(0.2, 0.8), rc: between(0.2, 0.8) };
    let gain = between(0.005, 0.02);
    let weights: Vec<f64> = (0..5).map(|i| gain * if i == 0 { 1.0 } else { between(0.05, 0.3) }).collect();
    let r: Vec<f64> = (0..5).map(|i| 12.0 * f64::from(i)).collect();
    let offsets = Offsets { input: between(-10.0, 10.0), output: between(-1.0, 1.0) };
    let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, ratios, offsets).unwrap();
    let clean = output(&model, input, between(0.0, 4.0));
    let noise = noise(input.len(), 0.1 * gain, seed);
    clean.iter().zip(noise).map(|(y, e)| y + e).collect()
}

fn all(records: &ManyRecords<'_>, options: &Options, threads: usize) -> ManyIdentifications {
    identify_many(records, options, threads, &mut |_| ControlFlow::Continue(())).unwrap()
}

fn refused(records: &ManyRecords<'_>, options: &Options) -> Error {
    identify_many(records, options, 1, &mut |_| ControlFlow::Continue(())).unwrap_err()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(3))]

    /// Drives of their own: the very fits of `identify`. One drive: whatever the number of threads, and whoever the
    /// others are.
    #[test]
    fn many_equals_single(seed in 0..1_000_000_u64) {
        let (first, second) = (drive(0.0), drive(10.0));
        let positions = [position(&first, seed), position(&second, seed + 1)];
        let inputs = [first.clone(), second].concat();
        let flat = positions.concat();
        let own = all(&ManyRecords::each(&inputs, &flat, SAMPLES as usize, 20).unwrap(), &options(), 2);
        for (m, fit) in own.actuators.iter().enumerate() {
            let fit = fit.as_ref().unwrap();
            let of = m * SAMPLES as usize..(m + 1) * SAMPLES as usize;
            let single = run(&[Record::new(&inputs[of.clone()], &flat[of], 20).unwrap()], &options()).unwrap();
            prop_assert_eq!(&fit.model, &single.model);
            prop_assert_eq!(Some(fit.dead_time), single.dead_time);
            // Sums over the samples, in another order.
            prop_assert!((fit.rmse - single.fit.rmse).abs() < 1e-12 * single.fit.rmse);
            prop_assert!((fit.noise - single.noise).abs() < 1e-12 * single.noise);
            prop_assert_eq!(fit.verdict(), single.verdict());
            let codes: Vec<FindingCode> = fit.findings.iter().map(|found| found.code).collect();
            prop_assert_eq!(codes, single.warnings.iter().map(|found| found.code).collect::<Vec<_>>());
        }
        let positions: Vec<f64> = (0..3).flat_map(|m| position(&first, seed + m)).collect();
        let shared = all(&ManyRecords::shared(&first, &positions, 0).unwrap(), &options(), 1);
        prop_assert_eq!(&shared, &all(&ManyRecords::shared(&first, &positions, 0).unwrap(), &options(), 3));
        let last = &positions[2 * SAMPLES as usize..];
        let alone = all(&ManyRecords::shared(&first, last, 0).unwrap(), &options(), 1);
        prop_assert_eq!(&shared.actuators[2], &alone.actuators[0]);
    }
}

/// The error of every shared fit over that of the single fit, in growing order.
fn ratios_to_single(options: &Options, actuators: u64) -> Vec<f64> {
    let input = drive(0.0);
    let positions: Vec<f64> = (0..actuators).flat_map(|m| position(&input, 100 + m)).collect();
    let found = all(&ManyRecords::shared(&input, &positions, 0).unwrap(), options, 2);
    let ratio = |(fit, position): (&Result<_, _>, &[f64])| {
        let fit: &hysteresis_identify::ActuatorFit = fit.as_ref().unwrap();
        let single = run(&[Record::new(&input, position, 0).unwrap()], options).unwrap();
        fit.rmse / single.fit.rmse
    };
    let mut ratios: Vec<f64> = found.actuators.iter().zip(positions.chunks(input.len())).map(ratio).collect();
    ratios.sort_by(f64::total_cmp);
    ratios
}

#[test]
fn one_drive_is_as_good_as_single_fits() {
    for weights in [WeightLaw::Free, WeightLaw::Quadratic, WeightLaw::Split] {
        let ratios = ratios_to_single(&Options { weights, ..options() }, 8);
        assert!(ratios[4] < 1.0 + 1e-6, "{weights:?}: {ratios:?}");
        assert!(ratios[7] < 1.02, "{weights:?}: {ratios:?}");
    }
}

/// What leaves one minimum: the same one to the last digits that the data determine.
#[test]
fn known_ratios_and_offset_leave_nothing_to_chance() {
    let known = Options {
        ratios: RatiosModel::Fixed(Ratios { ra: 0.95, rb: 0.4, rc: 0.5 }),
        input_offset: Setting::Fixed(0.0),
        smoothness: Setting::Fixed(0.01),
        ..options()
    };
    let conventional = Options { model: hysteresis_identify::ModelKind::Conventional, ..options() };
    for options in [known, conventional] {
        for ratio in ratios_to_single(&options, 4) {
            // Where a single fit stops, a step is worth a hundredth of what the noise lets be known.
            assert!((ratio - 1.0).abs() < 1e-5, "{ratio}");
        }
    }
}

#[test]
fn clean_positions_come_back() {
    let input = drive(0.0);
    let r = [0.0, 10.0, 20.0, 30.0, 40.0];
    let model = ModifiedPrandtlIshlinskii::from_ratios(
        &[1.0, 0.2, 0.3, 0.1, 0.2],
        &r,
        Ratios { ra: 0.9, rb: 0.5, rc: 0.6 },
        Offsets { input: 2.0, output: 1.0 },
    )
    .unwrap();
    let position = output(&model, &input, 1.5);
    let options = Options { thresholds: Thresholds::Given(r.to_vec()), ..options() };
    let found = all(&ManyRecords::shared(&input, &position, 0).unwrap(), &options, 1);
    let fit = found.actuators[0].as_ref().unwrap();
    assert!(fit.nrmse() < 1e-9, "{}", fit.nrmse());
    assert!((fit.dead_time - 1.5e-3).abs() < 1e-9, "{}", fit.dead_time);
    let Model::Modified(fitted) = &fit.model else { panic!("not modified") };
    assert!(fitted.weights().iter().zip(model.weights()).all(|(w, true_w)| (w - true_w).abs() < 1e-6));
}

#[test]
fn an_actuator_that_cannot_be_fitted_takes_nothing_from_the_others() {
    let input = drive(0.0);
    let samples = input.len();
    let good = position(&input, 7);
    let mut gap = good.clone();
    gap[17] = f64::NAN;
    let turned: Vec<f64> = good.iter().map(|y| -y).collect();
    let still = vec![0.25; samples];
    let positions = [good.clone(), gap, still, turned, good.clone()].concat();
    let found = all(&ManyRecords::shared(&input, &positions, 0).unwrap(), &options(), 2);
    let alone = all(&ManyRecords::shared(&input, &good, 0).unwrap(), &options(), 1);
    assert_eq!(found.actuators[0], alone.actuators[0]);
    assert_eq!(found.actuators[4], alone.actuators[0]);
    let error = |m: usize| *found.actuators[m].as_ref().unwrap_err();
    assert!(matches!(
        error(1),
        Error::Record { record: 1, error: RecordError::NotFinite { argument: "output", index: 17, .. } }
    ));
    assert_eq!(error(2), Error::Record { record: 2, error: RecordError::Constant { argument: "output", value: 0.25 } });
    let turned = found.actuators[3].as_ref().unwrap();
    let single = run(&[Record::new(&input, &positions[3 * samples..4 * samples], 0).unwrap()], &options()).unwrap();
    let codes: Vec<FindingCode> = turned.findings.iter().map(|found| found.code).collect();
    assert_eq!(codes, single.warnings.iter().map(|found| found.code).collect::<Vec<_>>());
    assert!(codes.contains(&FindingCode::WrongSign) && turned.verdict() == Verdict::Red);
    let small = |signal: &[f64]| signal.iter().map(|number| 1e-300 * number).collect::<Vec<f64>>();
    let mixed = all(&ManyRecords::shared(&input, &[good.clone(), small(&good)].concat(), 0).unwrap(), &options(), 1);
    assert_eq!(mixed.actuators[0], alone.actuators[0]);
    assert!(matches!(
        mixed.actuators[1],
        Err(Error::Record { record: 1, error: RecordError::SmallRange { argument: "output", .. } })
    ));
    let refused = ManyRecords::shared(&small(&input), &good, 0).unwrap_err();
    assert!(matches!(refused, RecordError::SmallRange { argument: "input", .. }), "{refused}");
    // None left: no drive is needed to say so.
    let none = all(&ManyRecords::shared(&input, &vec![1.0; 2 * samples], 0).unwrap(), &Options::default(), 1);
    assert!(none.actuators.iter().all(Result::is_err));
}

#[test]
fn what_is_left_open_is_chosen_once() {
    let input = drive(0.0);
    let positions: Vec<f64> = (0..4).flat_map(|m| position(&input, 40 + m)).collect();
    let records = ManyRecords::shared(&input, &positions, 0).unwrap();
    let open = Options { weights: WeightLaw::Auto, smoothness: Setting::Fit, ratios: RatiosModel::Fit, ..options() };
    let settled = settled_options(&records, &open, 2, &mut |_| ControlFlow::Continue(())).unwrap();
    assert_ne!(settled.weights, WeightLaw::Auto);
    assert_ne!(settled.smoothness, Setting::Fit);
    let single = |m: usize| {
        let position = &positions[m * input.len()..(m + 1) * input.len()];
        run(&[Record::new(&input, position, 0).unwrap()], &open).unwrap()
    };
    let asked = [0, 1, 3].map(single);
    assert!(asked.iter().any(|single| single.weights == settled.weights));
    let mut smoothness = asked.map(|single| single.smoothness);
    smoothness.sort_by(f64::total_cmp);
    assert_eq!(settled.smoothness, Setting::Fixed(smoothness[1]));
    assert_eq!(all(&records, &open, 1), all(&records, &settled, 1));
}

#[test]
fn errors_name_what_is_wrong() {
    let (input, position) = (drive(0.0), position(&drive(0.0), 1));
    let length = |error: RecordError| assert!(matches!(error, RecordError::Length { argument: "output", .. }));
    length(ManyRecords::shared(&input, &position[1..], 0).unwrap_err());
    length(ManyRecords::shared(&input, &[], 0).unwrap_err());
    length(ManyRecords::each(&input, &position[1..], input.len(), 0).unwrap_err());
    let skip = ManyRecords::shared(&input, &position, input.len()).unwrap_err();
    assert_eq!(skip, RecordError::Skip { samples: input.len(), got: input.len() });
    let still = ManyRecords::shared(&[1.0, 1.0], &[1.0, 2.0], 0).unwrap_err();
    assert_eq!(still, RecordError::Constant { argument: "input", value: 1.0 });
    assert!(ManyRecords::shared(&[1.0, f64::NAN], &[1.0, 2.0], 0).is_err());
    let records = ManyRecords::shared(&input, &position, 0).unwrap();
    for linear in [
        Options { dynamics: DynamicsModel::Order(Order::Second), ..options() },
        Options { creep: CreepModel::Decades(2), ..options() },
    ] {
        let error = refused(&records, &linear);
        assert_eq!((error, error.parameter()), (Error::LinearPart, Some("dynamics")));
        assert!(error.to_string().starts_with("dynamics: expected"));
    }
    let beside = refused(&records, &Options { duhem: DuhemModel::Fit, ..options() });
    assert_eq!((beside, beside.parameter()), (Error::DuhemMany, Some("duhem")));
    let many = Options { thresholds: Thresholds::Uniform(500), ..options() };
    assert!(matches!(refused(&records, &many), Error::TooFewSamples { .. }));
    assert_eq!(refused(&records, &Options { thresholds: Thresholds::Uniform(0), ..options() }), Error::NoOperators);
}

/// Weights are positions over drives: those of such a drive are beyond 1e100, which no model takes.
#[test]
fn an_actuator_whose_drive_is_next_to_nothing_is_refused_alone() {
    let input = drive(0.0);
    let tiny: Vec<f64> = input.iter().map(|u| 1e-98 * u).collect();
    let positions: Vec<f64> = (0..2).flat_map(|m| position(&input, m)).map(|y| 1e5 * y).collect();
    let found = all(&ManyRecords::shared(&tiny, &positions, 0).unwrap(), &options(), 1);
    let error = run(&[Record::new(&tiny, &positions[..input.len()], 0).unwrap()], &options()).unwrap_err();
    assert_eq!(error.parameter(), Some("weights"));
    for fit in found.actuators {
        assert_eq!(fit.unwrap_err().parameter(), error.parameter());
    }
    let inputs = [tiny, input.clone()].concat();
    let found = all(&ManyRecords::each(&inputs, &positions, input.len(), 0).unwrap(), &options(), 1);
    assert_eq!(found.actuators[0].as_ref().unwrap_err(), &error);
    assert!(found.actuators[1].is_ok());
}

#[test]
fn progress_counts_actuators_and_stops() {
    let input = drive(0.0);
    let positions: Vec<f64> = (0..4).flat_map(|m| position(&input, m)).collect();
    let inputs = input.repeat(4);
    let shared = ManyRecords::shared(&input, &positions, 0).unwrap();
    for records in [shared, ManyRecords::each(&inputs, &positions, input.len(), 0).unwrap()] {
        let mut told = Vec::new();
        let found = identify_many(&records, &options(), 1, &mut |done| {
            told.push(done);
            ControlFlow::Continue(())
        });
        assert_eq!(found.unwrap().actuators.len(), 4);
        assert!(told.is_sorted());
        told.dedup();
        assert!(told.ends_with(&[1, 2, 3, 4]), "{told:?}");
        for at in [0, 2] {
            let stop = |done: usize| if done >= at { ControlFlow::Break(()) } else { ControlFlow::Continue(()) };
            let stopped = identify_many(&records, &options(), 2, &mut |done| stop(done));
            assert_eq!(stopped.unwrap_err(), Error::Interrupted);
        }
    }
}

#[test]
fn actuators_without_slope_after_reversals_have_inverses() {
    let input = drive(0.0);
    let r = [0.0, 10.0, 20.0];
    let dead = ModifiedPrandtlIshlinskii::from_ratios(&[0.0, 1.0, 0.5], &r, Ratios::PLAY, Offsets::default()).unwrap();
    // Slightly less than no slope.
    let one: Vec<f64> = output(&dead, &input, 0.0).iter().zip(&input).map(|(y, u)| y - 1e-3 * u).collect();
    let (inputs, positions) = ([input.clone(), input.clone()].concat(), [one.clone(), one].concat());
    let known = Options {
        thresholds: Thresholds::Given(r.to_vec()),
        ratios: RatiosModel::Fixed(Ratios::PLAY),
        input_offset: Setting::Fixed(0.0),
        dead_time: Setting::Fixed(0.0),
        ..options()
    };
    let shared = all(&ManyRecords::shared(&input, &positions, 0).unwrap(), &known, 1);
    let own = all(&ManyRecords::each(&inputs, &positions, SAMPLES as usize, 0).unwrap(), &known, 1);
    for fit in shared.actuators.iter().chain(&own.actuators) {
        let fit = fit.as_ref().unwrap();
        let Model::Modified(model) = &fit.model else { panic!("conventional") };
        let weights = model.weights();
        assert!((weights[0] / (weights[1] + weights[2]) - 1e-3).abs() < 1e-12, "{weights:?}");
        assert!(model.check_invertible().is_ok() && fit.nrmse() < 2e-3, "{fit:?}");
    }
}
