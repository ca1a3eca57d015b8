//! Laws of plants and their converters, and the loops of the paper on its benchmark plants.

use hysteresis_control::linear::{Block, Creep, FirstOrder, LinearDynamics, SecondOrder};
use hysteresis_control::stage::{Stage, StageParts};
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, PrandtlIshlinskii, Process};
use hysteresis_simulate::closed_loop::{TrackingTask, WATCH_INTERVAL, simulate};
use hysteresis_simulate::metrics::{LoopRecord, Run};
use hysteresis_simulate::paper;
use hysteresis_simulate::paper::Benchmark;
use hysteresis_simulate::plant::{Events, Plant, PlantOptions, Quantiser};
use hysteresis_simulate::signals::{Wave, sine, triangle};
use proptest::prelude::*;

/// The model whose output is its input.
fn identity(limits: Option<(f64, f64)>) -> Stage {
    let model = PrandtlIshlinskii::new(&[1.0], &[0.0], Offsets::default()).unwrap();
    Stage::new(StageParts { limits, ..StageParts::new(ModifiedPrandtlIshlinskii::from(&model)) }).unwrap()
}

const PLAIN: PlantOptions = PlantOptions { dt: DT, seed: 0, dac_bits: None, adc: None };

const DT: f64 = 1e-4;

/// A converter over any range that is not too narrow for it, with one number and another.
fn converters() -> impl Strategy<Value = (Quantiser, f64, f64)> {
    (1_u32..=24, -1000.0..1000.0, 1e-3..2000.0).prop_flat_map(|(bits, low, width)| {
        let converter = Quantiser::new(bits, (low, low + width)).unwrap();
        let number = move || prop_oneof![low - width..low + 2.0 * width, Just(low), Just(low + width)];
        (Just(converter), number(), number())
    })
}

/// What a rounding of the numbers of a converter can be, times a few.
fn rounding(converter: &Quantiser) -> f64 {
    8.0 * f64::EPSILON * converter.range().0.abs().max(converter.range().1.abs())
}

proptest! {
    #[test]
    fn an_output_is_on_the_grid((converter, x, _) in converters()) {
        let level = converter.level(x);
        let code = (level - converter.range().0) / converter.resolution();
        prop_assert!((code - code.round()).abs() * converter.resolution() <= rounding(&converter));
        prop_assert_eq!(converter.level(level), level);
    }

    #[test]
    fn an_output_is_within_half_a_step((converter, x, _) in converters()) {
        let (low, high) = converter.range();
        let missing = (converter.level(x) - x.clamp(low, high)).abs();
        prop_assert!(missing <= 0.5 * converter.resolution() + rounding(&converter));
    }

    #[test]
    fn a_converter_is_monotone((converter, x, other) in converters()) {
        prop_assert!(converter.level(x.min(other)) <= converter.level(x.max(other)));
    }

    #[test]
    fn a_converter_clamps((converter, x, _) in converters()) {
        let (low, high) = converter.range();
        prop_assert!((low..=high).contains(&converter.level(x)));
        prop_assert_eq!((converter.level(low), converter.level(high)), (low, high));
        prop_assert_eq!((converter.level(-1e100), converter.level(1e100)), (low, high));
    }

    #[test]
    fn nan_is_held_and_counted(drive in -20.0..20.0, bad in prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300)]) {
        let options = PlantOptions { dac_bits: Some(8), ..PLAIN };
        let mut plant = Plant::new(&identity(Some((-10.0, 10.0))), &options).unwrap();
        let converter = Quantiser::new(8, (-10.0, 10.0)).unwrap();
        let put_out = plant.step(drive);
        prop_assert_eq!(put_out, converter.level(drive));
        prop_assert_eq!((plant.step(bad), plant.drive()), (put_out, put_out));
        let events = Events { rejected: 1, clamped: u64::from(drive.abs() > 10.0), overrange: 0 };
        prop_assert_eq!(plant.events(), events);
    }
}

/// Numbers in -amplitude..amplitude that follow no pattern.
fn walk(samples: u32, amplitude: f64) -> Vec<f64> {
    let unit = |k: u32| 2.0 * (f64::from(k) * f64::from(k + 7) * 0.618_033_988_749_895).fract() - 1.0;
    (0..samples).map(|k| amplitude * unit(k)).collect()
}

/// A plant with everything that there is.
fn everything(seed: u64) -> Plant {
    let stage = Stage::new(StageParts {
        amplifier: Some(FirstOrder::new(279.0).unwrap()),
        dynamics: SecondOrder::new(900.0, 0.1).unwrap().into(),
        creep: Some(Creep::logarithmic(0.02, 1e-3, 1.0, 6).unwrap()),
        dead_time: 2.5e-4,
        noise: Some(0.016),
        limits: Some((-500.0, 500.0)),
        ..StageParts::new(paper::table_1_recovered())
    });
    let options = PlantOptions { seed, dac_bits: Some(16), adc: Some((24, (-4.0, 4.0))), ..PLAIN };
    Plant::new(&stage.unwrap(), &options).unwrap()
}

fn steps(plant: &mut Plant, drives: &[f64]) -> Vec<(f64, f64)> {
    drives.iter().map(|u| (plant.step(*u), plant.position())).collect()
}

#[test]
fn a_reset_plant_and_one_of_the_same_seed_give_the_same_numbers() {
    let drives = walk(500, 600.0);
    let mut plant = everything(3);
    let start = plant.measured();
    let first = steps(&mut plant, &drives);
    assert!(plant.events().clamped > 0);
    let mut clone = plant.clone();
    assert_eq!(steps(&mut clone, &drives), steps(&mut plant, &drives));
    plant.reset();
    assert_eq!((plant.measured(), plant.events()), (start, Events::default()));
    assert_eq!(steps(&mut plant, &drives), first);
    assert_eq!(steps(&mut everything(3), &drives), first);
    let other = steps(&mut everything(4), &drives);
    assert!(first.iter().zip(&other).all(|(one, other)| one.1 == other.1));
    assert!(first.iter().zip(&other).any(|(one, other)| one.0 != other.0));
}

#[test]
fn run_writes_rows_and_leaves_the_plant_where_steps_do() {
    let mut drives = walk(300, 600.0);
    (drives[7], drives[8], drives[9]) = (f64::NAN, f64::INFINITY, -1e300);
    let mut stepped = everything(1);
    let mut before = vec![(stepped.measured(), stepped.position())];
    before.extend(steps(&mut stepped, &drives));
    let (mut measured, mut position) = (vec![0.0; 300], vec![0.0; 300]);
    let mut plant = everything(1);
    plant.run(&drives, &mut measured, &mut position).unwrap();
    // Rounding: a row and the reading before it are computed apart. The converter turns that into one level at most.
    for (k, (y, p)) in before[..300].iter().enumerate() {
        assert!((y - measured[k]).abs() < 1e-6 && (p - position[k]).abs() < 1e-12, "{k}");
    }
    assert_eq!((plant.measured(), plant.position()), before[300]);
    assert_eq!(plant.events().rejected, 3);
    let error = plant.run(&drives, &mut measured, &mut position[1..]).unwrap_err();
    assert_eq!(error.to_string(), "position: expected 300 elements, got 299");
}

#[test]
fn without_modes_a_row_shows_its_drive_at_once() {
    let mut plant = Plant::new(&identity(None), &PLAIN).unwrap();
    let (mut measured, mut position) = ([0.0; 3], [0.0; 3]);
    plant.run(&[1.0, -2.0, 3.0], &mut measured, &mut position).unwrap();
    assert_eq!((measured, position), ([1.0, -2.0, 3.0], [1.0, -2.0, 3.0]));
}

#[test]
fn without_an_amplifier_a_plant_is_the_parts_one_after_the_other() {
    let model = paper::table_1_recovered();
    let creep = Creep::new(&[0.1], &[0.01]).unwrap();
    let modes = LinearDynamics::from(SecondOrder::new(900.0, 0.1).unwrap());
    let parts = StageParts {
        dynamics: modes.clone(),
        creep: Some(creep.clone()),
        dead_time: 1.25e-4,
        ..StageParts::new(model.clone())
    };
    let mut plant = Plant::new(&Stage::new(parts).unwrap(), &PLAIN).unwrap();
    let mut creep = creep.block(DT).unwrap();
    let mut modes = modes.with_dead_time(1.25e-4).unwrap().block(DT).unwrap();
    let mut forward = model.forward();
    for u in walk(500, 500.0) {
        let expected = modes.advance(creep.step(forward.step(u)));
        assert!((plant.step(u) - expected).abs() < 1e-13);
    }
}

#[test]
fn a_plant_rests_where_the_drive_is_nearest_to_zero() {
    let plant = |limits| Plant::new(&identity(limits), &PLAIN).unwrap();
    assert_eq!(
        [None, Some((-2.0, 3.0)), Some((2.0, 3.0)), Some((-3.0, -2.0))].map(|l| plant(l).position()),
        [0.0, 0.0, 2.0, -2.0]
    );
    let mut rests = everything(0);
    let (drive, position) = (rests.drive(), rests.position());
    assert!((0..1000).all(|_| (rests.step(0.0), rests.position(), rests.drive()).1 == position));
    assert_eq!(rests.drive(), drive);
}

#[test]
fn measurements_beyond_the_converter_are_clamped_and_counted() {
    let options = PlantOptions { adc: Some((12, (-1.0, 1.0))), ..PLAIN };
    let mut plant = Plant::new(&identity(None), &options).unwrap();
    assert_eq!([2.0, -5.0, 1.0].map(|u| plant.step(u)), [1.0, -1.0, 1.0]);
    assert_eq!((plant.position(), plant.events().overrange), (1.0, 2));
}

#[test]
fn what_no_plant_can_have_is_named() {
    let limited = Some((0.0, 1.0));
    let message = |options: PlantOptions, limits| Plant::new(&identity(limits), &options).unwrap_err().to_string();
    assert_eq!(
        message(PlantOptions { dac_bits: Some(16), ..PLAIN }, None),
        "limits: expected (low, high) for the 16 bits of the D/A converter to span, got none"
    );
    assert_eq!(
        message(PlantOptions { dac_bits: Some(33), ..PLAIN }, limited),
        "dac_bits: expected a whole number from 1 to 32, got 33"
    );
    let adc = |bits, range| message(PlantOptions { adc: Some((bits, range)), ..PLAIN }, None);
    assert_eq!(adc(0, (0.0, 1.0)), "adc_bits: expected a whole number from 1 to 32, got 0");
    // Levels that doubles cannot tell apart: next to 1e9 they are 1e-7 apart.
    assert_eq!(adc(32, (1e9, 1e9 + 1.0)), "adc_bits: expected a whole number from 1 to 20, got 32");
    assert!(adc(1, (1e16, 1e16 + 4.0)).starts_with("adc_range[1]: expected"));
    for dt in [0.0, f64::NAN] {
        assert!(message(PlantOptions { dt, ..PLAIN }, None).starts_with("dt: expected a finite number > 0"));
    }
}

/// The paper's law: positional, with a feed-forward from a bank.
fn track(benchmark: Benchmark, seed: u64, reference: &[f64], inverse: &ModifiedPrandtlIshlinskii) -> Run {
    let gains = benchmark.gains();
    let (mut feed_forward, mut sum) = (inverse.forward(), 0.0);
    simulate(&mut benchmark.plant(seed), reference, |k, measured| {
        let error = reference[k] - measured;
        sum += 1e-4 * error;
        feed_forward.step(reference[k]) + gains.kp * error + gains.ki * sum
    })
    .unwrap()
}

/// The median over ten seeds of the largest measured error.
fn median(benchmark: Benchmark, reference: &[f64], inverse: &ModifiedPrandtlIshlinskii) -> f64 {
    let mut maxima =
        [0, 1, 2, 3, 4, 5, 6, 7, 8, 9].map(|seed| track(benchmark, seed, reference, inverse).metrics().max_error);
    maxima.sort_by(f64::total_cmp);
    0.5 * (maxima[4] + maxima[5])
}

/// Three periods of 3.3 um.
fn wave(frequency: f64) -> Wave {
    Wave { amplitude: 3.3, frequency, rate: 1e4, offset: 0.0 }
}

#[test]
fn the_published_maxima_of_sines_come_out() {
    for benchmark in Benchmark::ALL {
        for (frequency, published) in [(5.0, 0.098), (10.0, 0.159), (15.0, 0.224), (20.0, 0.293)] {
            let reference = sine(wave(frequency), 3.0 / frequency).unwrap();
            let got = median(benchmark, &reference, &paper::table_2());
            assert!((got / published - 1.0).abs() < 0.1, "{benchmark:?} {frequency} Hz: {got} um, {published} um");
        }
    }
}

#[test]
fn the_published_maxima_of_the_triangle_come_out() {
    let model = paper::table_1_recovered();
    let r: Vec<f64> = model.operators().iter().map(hysteresis_core::CoupledPlay::r).collect();
    let conventional = PrandtlIshlinskii::new(model.weights(), &r, Offsets::default()).unwrap();
    let closed_form = ModifiedPrandtlIshlinskii::from(&conventional.closed_form_inverse().unwrap());
    let reference = triangle(wave(1.0), 3.0).unwrap();
    for benchmark in Benchmark::ALL {
        let modified = median(benchmark, &reference, &paper::table_2());
        assert!((0.06..0.08).contains(&modified), "{benchmark:?}: {modified} um");
        let conventional = median(benchmark, &reference, &closed_form);
        assert!((0.085..0.12).contains(&conventional), "{benchmark:?}: {conventional} um");
    }
}

#[test]
fn a_run_has_the_numbers_of_its_samples() {
    let reference = sine(wave(20.0), 0.15).unwrap();
    let run = track(Benchmark::A1, 0, &reference, &paper::table_2());
    let LoopRecord { measured, position, drive, .. } = run.record();
    // The same drives give the same plant again: sample k was read before drive k.
    let mut plant = Benchmark::A1.plant(0);
    for ((u, y), p) in drive.iter().zip(measured).zip(position) {
        assert_eq!((plant.measured(), plant.position()), (*y, *p));
        plant.step(*u);
    }
    let metrics = run.metrics();
    assert_eq!((metrics.samples, metrics.saturated_count), (1500, 0));
    assert_eq!((metrics.range, metrics.hysteresis_percent), (6.6, Some(100.0 * metrics.max_error / 6.6)));
    assert_eq!(run.settled(), None);
}

#[test]
fn saturated_samples_are_those_at_a_limit() {
    let reference = vec![0.0; 10];
    let mut plant = Benchmark::A1.plant(0);
    let drives = [0.0, 560.0, 561.0, -1e9, f64::NAN, 559.0, 0.0, 0.0, 0.0, 0.0];
    let run = simulate(&mut plant, &reference, |k, _| drives[k]).unwrap();
    assert_eq!(run.record().drive[..6], [0.0, 560.0, 560.0, -560.0, -560.0, 559.0]);
    let metrics = run.metrics();
    assert_eq!((metrics.saturated_count, metrics.drive_low, metrics.drive_high), (4, -560.0, 560.0));
    assert_eq!(metrics.hysteresis_percent, None);
    assert_eq!(plant.events(), Events { rejected: 1, clamped: 2, overrange: 0 });
}

#[test]
fn a_run_can_be_watched_and_stopped() {
    let reference = vec![0.0; 3 * WATCH_INTERVAL];
    let task = TrackingTask::new(&reference, Some(100.5)).unwrap();
    let mut seen = Vec::new();
    let mut plant = Benchmark::A1.plant(0);
    let run = task
        .run(
            &mut plant,
            |_, _| Ok::<_, &str>(0.0),
            |k| {
                seen.push(k);
                Ok(())
            },
        )
        .unwrap();
    assert_eq!(seen, [0, WATCH_INTERVAL, 2 * WATCH_INTERVAL]);
    assert_eq!(run.settled().unwrap().samples, reference.len() - 101);
    let mut taken = 0;
    let stop = |k| if k > 0 { Err("enough") } else { Ok(()) };
    let count = |_, _| {
        taken += 1;
        Ok(0.0)
    };
    assert_eq!(task.run(&mut plant, count, stop).unwrap_err(), "enough");
    assert_eq!(taken, WATCH_INTERVAL);
    let fail = |k, _| if k == 2 { Err("broken") } else { Ok(0.0) };
    assert_eq!(task.run(&mut plant, fail, |_| Ok(())).unwrap_err(), "broken");
}

#[test]
fn what_no_run_can_have_is_named_before_anything_moves() {
    let mut plant = Benchmark::A1.plant(0);
    let before = plant.measured();
    let message = |plant: &mut Plant, reference: &[f64]| {
        simulate(plant, reference, |_, _| panic!("must not run")).unwrap_err().to_string()
    };
    assert_eq!(message(&mut plant, &[]), "reference: expected at least one element, got none");
    assert_eq!(
        message(&mut plant, &[0.0, f64::NAN]),
        "reference[1]: expected a finite number (at most 1e100 in magnitude), got NaN"
    );
    assert_eq!(plant.measured(), before);
    for period in [0.0, -1.0, 2.0, f64::NAN] {
        let error = TrackingTask::new(&[0.0, 1.0], Some(period)).unwrap_err();
        assert_eq!(error.to_string(), format!("period: expected a number from 0.0 to 1.0, got {period:?}"));
    }
    let record = |measured: &[f64]| LoopRecord {
        reference: vec![0.0; 2],
        measured: measured.to_vec(),
        position: vec![0.0; 2],
        drive: vec![0.0; 2],
    };
    let wrong = |measured: &[f64]| Run::new(record(measured), None, None).unwrap_err().to_string();
    assert_eq!(wrong(&[0.0]), "measured: expected 2 elements, got 1");
    assert!(wrong(&[0.0, f64::INFINITY]).starts_with("measured[1]: expected a finite number"));
}
