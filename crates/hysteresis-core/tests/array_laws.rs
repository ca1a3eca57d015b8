//! Laws of the controller of an array, whatever happens to it.

mod support;

use hysteresis_core::{
    ArrayController, ArrayOptions, ArraySample, CompiledModel, Error, Inverse, Mode, ModifiedPrandtlIshlinskii,
    Offsets, Ratios, StreamArray,
};
use proptest::collection::vec;
use proptest::prelude::*;

const M: usize = 4;
const S: usize = 3;
const DT: f64 = 1e-3;

/// Actuators that differ, and also in the share of their hysteresis.
fn model(i: usize, soft: f64) -> CompiledModel {
    let gain = [4e-3, 6e-3, 5e-3, 8e-3][i % M];
    let weights = [gain, 0.2 * soft * gain, 0.1 * gain, 0.3 * soft * gain];
    let offsets = Offsets { input: 10.0 * [0.0, 1.0, -2.0, 0.5][i % M], output: 0.1 };
    let r = [0.0, 40.0, 120.0, 200.0];
    CompiledModel::new(&ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, offsets).unwrap())
}

#[derive(Clone, Debug)]
struct Setup {
    options: ArrayOptions,
    limits: Vec<(f64, f64)>,
}

impl Setup {
    fn make(&self) -> ArrayController {
        let stream = |(i, limits): (usize, &(f64, f64))| Inverse::new(&model(i, 1.0), Some(*limits)).unwrap();
        let inverse: StreamArray<Inverse> = self.limits.iter().enumerate().map(stream).collect();
        ArrayController::new(inverse, &self.options).unwrap()
    }
}

#[derive(Clone, Debug)]
enum Event {
    Sample([f64; M], Option<Vec<f64>>, Option<Vec<f64>>),
    Hold,
    Release,
    Stop(f64, f64),
    Model(usize, f64),
    Gains(f64),
    Follow([f64; M]),
    Reset,
    Save,
    Load,
}

fn wild() -> impl Strategy<Value = f64> {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(-1e99)];
    prop_oneof![30 => -3.0..3.0, 4 => -1e3..1e3, 1 => bad, 1 => Just(0.0)]
}

fn references() -> impl Strategy<Value = [f64; M]> {
    prop_oneof![4 => [-3.0..3.0, -3.0..3.0, -3.0..3.0, -3.0..3.0], 1 => [wild(), wild(), wild(), wild()]]
}

fn sensors(count: usize) -> impl Strategy<Value = Option<Vec<f64>>> {
    prop_oneof![1 => Just(None), 3 => vec(wild(), count).prop_map(Some)]
}

fn sample(sensors_of: usize) -> impl Strategy<Value = Event> {
    let sensor_reference = prop_oneof![3 => Just(None), 1 => vec(-2.0..2.0, sensors_of).prop_map(Some)];
    (references(), sensors(sensors_of), sensor_reference).prop_map(|(r, y, s)| Event::Sample(r, y, s))
}

fn event(sensors_of: usize) -> impl Strategy<Value = Event> {
    prop_oneof![
        30 => sample(sensors_of),
        1 => Just(Event::Hold),
        3 => Just(Event::Release),
        1 => (1e2..1e6, 0.0..1.0).prop_map(|(rate, at)| Event::Stop(rate, at)),
        2 => (0..M, 0.2..3.0).prop_map(|(i, soft)| Event::Model(i, soft)),
        1 => (0.0..500.0).prop_map(Event::Gains),
        1 => [0.0..1.0, 0.0..1.0, 0.0..1.0, 0.0..1.0].prop_map(Event::Follow),
        1 => Just(Event::Reset),
        1 => Just(Event::Save),
        1 => Just(Event::Load),
    ]
}

fn pairs() -> impl Strategy<Value = (Vec<(usize, usize)>, Vec<f64>)> {
    prop_oneof![
        1 => Just((vec![], vec![])),
        2 => (0.05..2.0).prop_map(|most| (vec![(0, 1), (1, 2), (2, 3)], vec![most])),
        1 => vec(0.05..2.0, 4).prop_map(|each| (vec![(0, 1), (2, 1), (2, 3), (0, 3)], each)),
    ]
}

fn setup() -> impl Strategy<Value = Setup> {
    let limits = prop_oneof![Just((-500.0, 500.0)), Just((-20.0, 150.0)), Just((30.0, 100.0))];
    let slew = prop_oneof![1 => Just(vec![]), 1 => vec(1e2..1e6, 1), 1 => vec(1e2..1e6, M)];
    let matrix = prop_oneof![Just(None), vec(-1.0..1.0, M * S).prop_map(Some)];
    let gains = (prop_oneof![Just(0.0), 0.0..1500.0], prop_oneof![Just(0.0), 0.0..1000.0]);
    let bumpless_time = prop_oneof![Just(0.0), 1e-3..2e-2];
    (vec(limits, M), slew, matrix, gains, pairs(), bumpless_time).prop_map(
        |(limits, slew, reconstruction, (ki, leak), (neighbours, max_difference), bumpless_time)| {
            let set = ArrayOptions::new(DT);
            let options =
                ArrayOptions { ki, leak, reconstruction, slew, neighbours, max_difference, bumpless_time, ..set };
            Setup { options, limits }
        },
    )
}

fn case() -> impl Strategy<Value = (Setup, Vec<Event>)> {
    setup().prop_flat_map(|setup| {
        let sensors = if setup.options.reconstruction.is_some() { S } else { M };
        (Just(setup), vec(event(sensors), 1..60))
    })
}

fn within(at: f64, (low, high): (f64, f64)) -> f64 {
    low + at * (high - low)
}

fn asked(event: &Event) -> Option<ArraySample<'_>> {
    let Event::Sample(reference, measurement, sensor_reference) = event else { return None };
    let (measurement, sensor_reference) = (measurement.as_deref(), sensor_reference.as_deref());
    Some(ArraySample { reference, measurement, sensor_reference })
}

/// Lets something happen; whether the controller was told of other drives.
fn happen(controller: &mut ArrayController, event: &Event, saved: &mut Option<ArrayController>) -> bool {
    let limits = controller.limits().to_vec();
    match event {
        Event::Sample(..) => controller.step(&asked(event).unwrap(), &mut [0.0; M]).unwrap(),
        Event::Hold => controller.hold(),
        Event::Release => controller.release(),
        Event::Stop(rate, at) => {
            let rest: Vec<f64> = limits.iter().map(|limits| within(*at, *limits)).collect();
            controller.stop(*rate, &rest).unwrap();
        }
        Event::Model(i, soft) => controller.set_model(*i, &model(*i, *soft)).unwrap(),
        Event::Gains(ki) => controller.set_gains(*ki, 0.5 * ki).unwrap(),
        Event::Follow(at) => {
            let drives: Vec<f64> = at.iter().zip(&limits).map(|(at, limits)| within(*at, *limits)).collect();
            controller.follow(&drives).unwrap();
            return true;
        }
        Event::Reset => controller.reset(),
        Event::Save => *saved = Some(controller.clone()),
        Event::Load => {
            if let Some(saved) = saved {
                // Gains and models are no part of a state.
                let mut other = saved.clone();
                other.set_state(&saved.state()).unwrap();
                *controller = other;
                return true;
            }
        }
    }
    false
}

fn positions(controller: &ArrayController) -> Vec<f64> {
    controller.positions().collect()
}

/// All that can be seen, with every bit.
fn shown(controller: &ArrayController) -> String {
    format!("{:?}", controller.state())
}

proptest! {
    #[test]
    fn no_drive_ever_leaves_limits_nor_slew((setup, events) in case()) {
        let mut controller = setup.make();
        let (mut last, mut saved) = (controller.drives().to_vec(), None);
        for event in &events {
            let told = happen(&mut controller, event, &mut saved);
            for (i, (drive, before)) in controller.drives().iter().zip(&last).enumerate() {
                let (low, high) = setup.limits[i];
                prop_assert!(drive.is_finite() && low <= *drive && *drive <= high, "{drive}");
                let slew = setup.options.slew.get(i).or(setup.options.slew.first());
                let step = slew.map_or(f64::INFINITY, |slew| slew * DT);
                prop_assert!(told || (drive - before).abs() <= step, "{before} to {drive}, at most {step}");
                prop_assert!(told || asked(event).is_some() || drive == before, "{event:?} moves a drive");
            }
            last = controller.drives().to_vec();
        }
    }

    #[test]
    fn no_pair_is_ever_too_far_apart_but_where_it_was_already((setup, events) in case()) {
        let mut controller = setup.make();
        let ArrayOptions { neighbours, max_difference, .. } = &setup.options;
        let mut saved = None;
        for event in &events {
            let before = positions(&controller);
            happen(&mut controller, event, &mut saved);
            if asked(event).is_none() {
                continue;
            }
            let after = positions(&controller);
            for (pair, (i, j)) in neighbours.iter().enumerate() {
                let most = max_difference[if max_difference.len() == 1 { 0 } else { pair }];
                let (was, is) = ((before[*i] - before[*j]).abs(), (after[*i] - after[*j]).abs());
                // Inside the limit without any tolerance; outside it to the roundings of positions of some um.
                prop_assert!(is <= most || is <= was + 1e-13, "{was} to {is}, at most {most}");
            }
        }
    }

    #[test]
    fn the_memory_is_that_of_the_drives_that_went_out((setup, events) in case()) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in events.iter().filter(|event| !matches!(event, Event::Model(..) | Event::Reset | Event::Load)) {
            let mut mirror: Vec<Inverse> = controller.state().streams.iter().enumerate().map(|(i, state)| {
                let mut stream = Inverse::new(&model(i, 1.0), Some(setup.limits[i])).unwrap();
                stream.set_state(state).unwrap();
                stream
            }).collect();
            happen(&mut controller, event, &mut saved);
            for ((stream, drive), position) in mirror.iter_mut().zip(controller.drives()).zip(positions(&controller)) {
                stream.follow_drive(*drive);
                prop_assert!((stream.reached() - position).abs() < 1e-12);
                prop_assert!((stream.output() - drive).abs() < 1e-10);
            }
        }
    }

    #[test]
    fn a_peek_changes_nothing_and_a_step_follows_it((setup, events) in case()) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in &events {
            if let Some(sample) = asked(event) {
                let (before, mut ahead) = (shown(&controller), [0.0; M]);
                controller.peek(&sample, &mut ahead).unwrap();
                prop_assert_eq!(&before, &shown(&controller));
                happen(&mut controller, event, &mut saved);
                prop_assert_eq!(ahead.map(f64::to_bits).to_vec(), bits(controller.drives()));
            } else {
                happen(&mut controller, event, &mut saved);
            }
        }
    }

    #[test]
    fn a_restored_controller_goes_on_bit_for_bit((setup, events) in case(), cut in 0..60_usize) {
        let (before, after) = events.split_at(cut.min(events.len()));
        let models = |event: &&Event| !matches!(event, Event::Model(..) | Event::Gains(_) | Event::Load);
        let (mut one, mut other) = (setup.make(), setup.make());
        for event in before.iter().filter(models) {
            happen(&mut one, event, &mut None);
        }
        other.set_state(&one.state()).unwrap();
        for event in after.iter().filter(models) {
            happen(&mut one, event, &mut None);
            happen(&mut other, event, &mut None);
            prop_assert_eq!(shown(&one), shown(&other));
        }
    }

    #[test]
    fn a_block_is_its_samples(setup in setup(), rows in vec((references(), vec(wild(), M)), 0..40), fed in any::<bool>()) {
        let (mut stepped, mut ran) = (setup.make(), setup.make());
        let sensors = stepped.sensors();
        let reference: Vec<f64> = rows.iter().flat_map(|(r, _)| *r).collect();
        let measurement: Vec<f64> = rows.iter().flat_map(|(_, y)| y[..sensors].to_vec()).collect();
        let mut expected = vec![];
        for (r, y) in &rows {
            let mut drives = [0.0; M];
            let measured = fed.then_some(&y[..sensors]);
            stepped.step(&ArraySample { measurement: measured, ..ArraySample::of(r) }, &mut drives).unwrap();
            expected.extend(drives);
        }
        let mut drives = vec![0.0; reference.len()];
        let block = ArraySample { measurement: fed.then_some(&measurement[..]), ..ArraySample::of(&reference) };
        ran.run(&block, &mut drives).unwrap();
        prop_assert_eq!(bits(&drives), bits(&expected));
        prop_assert_eq!(shown(&ran), shown(&stepped));
    }

    #[test]
    fn a_motion_starts_from_the_drives_that_are_there((setup, events) in case(), r in references()) {
        let mut controller = setup.make();
        let mut saved = None;
        for event in &events {
            happen(&mut controller, event, &mut saved);
        }
        controller.hold();
        let before = controller.drives().to_vec();
        let mut drives = [9.0; M];
        controller.step(&ArraySample::of(&r), &mut drives).unwrap();
        prop_assert_eq!(bits(&drives), bits(&before));
        controller.release();
        prop_assert_eq!(controller.mode(), Mode::Run);
        controller.step(&ArraySample::of(&r), &mut drives).unwrap();
        prop_assert_eq!(bits(&drives), bits(&before));
    }

    #[test]
    fn the_integral_follows_its_equation(rows in vec((vec(-0.3..0.3, M), vec(-0.2..0.2, S)), 1..40), matrix in vec(-1.0..1.0, M * S), ki in 0.0..200.0, leak in 0.0..200.0) {
        let set = ArrayOptions { ki, leak, reconstruction: Some(matrix.clone()), bumpless_time: 0.0, ..ArrayOptions::new(DT) };
        let mut controller = Setup { options: set, limits: vec![(-500.0, 500.0); M] }.make();
        let (mut integral, mut drives) = ([0.0; M], [0.0; M]);
        for (k, (r, y)) in rows.iter().enumerate() {
            controller.step(&ArraySample { measurement: Some(y), ..ArraySample::of(r) }, &mut drives).unwrap();
            // The first sample starts the motion.
            for (a, row) in integral.iter_mut().zip(matrix.chunks(S)).filter(|_| k > 0) {
                let error = row.iter().zip(y).fold(0.0, |sum, (gain, y)| sum + gain * -y);
                *a += (ki * DT) * error - (leak * DT) * *a;
            }
            prop_assert_eq!(bits(controller.integral()), bits(&integral));
            let aims = r.iter().zip(&integral).map(|(r, a)| r + a);
            if k > 0 {
                prop_assert!(aims.zip(positions(&controller)).all(|(aim, p)| (aim - p).abs() < 1e-13));
            }
        }
    }
}

fn bits(numbers: &[f64]) -> Vec<u64> {
    numbers.iter().copied().map(f64::to_bits).collect()
}

fn plain(options: ArrayOptions) -> ArrayController {
    Setup { options: ArrayOptions { bumpless_time: 0.0, ..options }, limits: vec![(-500.0, 500.0); M] }.make()
}

fn settle(controller: &mut ArrayController, reference: [f64; M], samples: usize) -> Vec<f64> {
    for _ in 0..samples {
        controller.step(&ArraySample::of(&reference), &mut [0.0; M]).unwrap();
    }
    positions(controller)
}

#[test]
fn limits_leave_no_integral_behind() {
    let mut controller = plain(ArrayOptions { ki: 500.0, ..ArrayOptions::new(DT) });
    let (mut drives, measured) = ([0.0; M], [0.0; M]);
    // The sensors never move: the integral would grow by half of the reference at every sample.
    for _ in 0..1000 {
        let sample = ArraySample { measurement: Some(&measured), ..ArraySample::of(&[1.0; M]) };
        controller.step(&sample, &mut drives).unwrap();
    }
    assert_eq!(drives, [500.0; M]);
    for (integral, position) in controller.integral().iter().zip(controller.positions()) {
        assert!((1.0 + integral - position).abs() < 1e-12, "reference and integral are what is reached");
    }
    // One error of the other sign moves every drive away from its limit at once.
    let sample = ArraySample { measurement: Some(&[1.1; M]), ..ArraySample::of(&[1.0; M]) };
    controller.step(&sample, &mut drives).unwrap();
    assert!(drives.iter().all(|drive| *drive < 500.0));
    // A reference that is out of reach by itself takes nothing from the integral.
    let before = controller.integral().to_vec();
    controller.step(&ArraySample::of(&[100.0; M]), &mut drives).unwrap();
    assert_eq!(controller.integral(), before.as_slice());
    // And a change that brings the target back counts, though the target is still out of reach.
    let sample = ArraySample { measurement: Some(&[102.0; M]), ..ArraySample::of(&[100.0; M]) };
    controller.step(&sample, &mut drives).unwrap();
    for (integral, before) in controller.integral().iter().zip(&before) {
        assert!((integral - (before - 500.0 * DT * 2.0)).abs() < 1e-12);
    }
    assert!(controller.counters().saturated_count > 3900);
}

#[test]
fn neighbours_move_together_and_are_not_stuck() {
    let chain =
        ArrayOptions { neighbours: vec![(0, 1), (1, 2), (2, 3)], max_difference: vec![0.25], ..ArrayOptions::new(DT) };
    let mut controller = plain(chain);
    settle(&mut controller, [0.0; M], 20);
    // A common move is free: no pair differs.
    let moved = settle(&mut controller, [1.0; M], 1);
    assert!(moved.iter().all(|p| (p - 1.0).abs() < 1e-12), "{moved:?}");
    assert_eq!(controller.counters().pair_limited_count, 0);
    // A tilt that is too steep becomes the steepest one, in the middle of what was asked for.
    let tilted = settle(&mut controller, [-2.0, -1.0, 1.0, 2.0], 50);
    for (p, expected) in tilted.iter().zip([-0.375, -0.125, 0.125, 0.375]) {
        assert!((p - expected).abs() < 0.02, "{tilted:?}");
    }
    assert!(controller.counters().pair_limited_count > 40);
    // From there it moves on as a whole, though all pairs are at their limits.
    let risen = settle(&mut controller, [0.0, 1.0, 3.0, 4.0], 1);
    assert!(risen.iter().zip(&tilted).all(|(p, q)| (p - q - 2.0).abs() < 0.02), "{risen:?}");
    // And back to a shape that is allowed, in one sample.
    let flat = settle(&mut controller, [0.0, 0.2, 0.2, 0.1], 1);
    assert!(flat.iter().zip([0.0, 0.2, 0.2, 0.1]).all(|(p, r)| (p - r).abs() < 1e-12), "{flat:?}");
}

#[test]
fn a_missing_measurement_rests_what_it_belongs_to() {
    let mut direct = plain(ArrayOptions { ki: 100.0, ..ArrayOptions::new(DT) });
    settle(&mut direct, [0.0; M], 1);
    let measured = [0.1, f64::NAN, 0.1, 0.1];
    let sample = ArraySample { measurement: Some(&measured), ..ArraySample::of(&[0.5; M]) };
    direct.step(&sample, &mut [0.0; M]).unwrap();
    let change = 100.0 * DT * (0.5 - 0.1);
    assert_eq!(direct.integral(), [change, 0.0, change, change]);
    assert_eq!(direct.counters().missing_count, 1);
    let given = [1.0; M];
    let sample = ArraySample { sensor_reference: Some(&given), ..sample };
    direct.step(&sample, &mut [0.0; M]).unwrap();
    assert_eq!(direct.integral()[0], change + 100.0 * DT * (1.0 - 0.1));
    let mut all = plain(ArrayOptions { ki: 1.0, reconstruction: Some(vec![1.0; M * S]), ..ArrayOptions::new(DT) });
    settle(&mut all, [0.0; M], 1);
    let sample = ArraySample { measurement: Some(&[0.1, f64::NAN, 0.1]), ..ArraySample::of(&[0.5; M]) };
    all.step(&sample, &mut [0.0; M]).unwrap();
    assert_eq!(all.integral(), [0.0; M]);
    assert!(positions(&all).iter().all(|p| (p - 0.5).abs() < 1e-12), "feed-forward goes on");
}

#[test]
fn another_model_is_no_jump() {
    let mut controller = Setup { options: ArrayOptions::new(DT), limits: vec![(-500.0, 500.0); M] }.make();
    settle(&mut controller, [1.0; M], 20);
    let before = controller.drives().to_vec();
    controller.set_model(2, &model(2, 2.0)).unwrap();
    let mut last = before[2];
    for k in 0..5 {
        let after = settle(&mut controller, [1.0; M], 1);
        let (drive, jump) = (controller.drives()[2], (controller.drives()[2] - last).abs());
        assert!(jump < 15.0 && drive < last, "{last} to {drive}");
        assert_eq!(controller.drives()[0], before[0]);
        assert!((after[2] - 1.0).abs() < 1e-12 || k < 4);
        last = drive;
    }
    assert!(before[2] - last > 10.0, "the softer model needs less");
}

#[test]
fn what_cannot_be_is_named() {
    let named = |options: ArrayOptions| {
        let inverse = StreamArray::inverse(&[model(0, 1.0), model(1, 1.0)], Some((-500.0, 500.0))).unwrap();
        ArrayController::new(inverse, &options).unwrap_err().to_string()
    };
    let set = || ArrayOptions::new(DT);
    assert_eq!(named(ArrayOptions { dt: -1.0, ..set() }), "dt: expected a finite number > 0, got -1.0");
    assert_eq!(named(ArrayOptions { ki: -1.0, ..set() }), "ki: expected a finite number >= 0, got -1.0");
    assert_eq!(named(ArrayOptions { leak: 2e3, ..set() }), "leak: expected a number from 0.0 to 1000.0, got 2000.0");
    assert_eq!(named(ArrayOptions { slew: vec![1.0; 3], ..set() }), "slew: expected 2 elements, got 3");
    assert_eq!(named(ArrayOptions { slew: vec![0.0], ..set() }), "slew: expected a finite number > 0, got 0.0");
    assert_eq!(
        named(ArrayOptions { slew: vec![1.0, f64::NAN], ..set() }),
        "slew[1]: expected a finite number > 0, got NaN"
    );
    let pairs = |neighbours: &[(usize, usize)], max_difference: &[f64]| ArrayOptions {
        neighbours: neighbours.to_vec(),
        max_difference: max_difference.to_vec(),
        ..set()
    };
    assert_eq!(named(pairs(&[(0, 2)], &[1.0])), "neighbours[0]: expected a whole number from 0 to 1, got 2.0");
    assert_eq!(named(pairs(&[(0, 1), (1, 1)], &[1.0])), "neighbours[1]: expected two different actuators, got 1.0");
    assert_eq!(named(pairs(&[(0, 1)], &[])), "max_difference: expected 1 elements, got 0");
    assert_eq!(named(pairs(&[(0, 1)], &[0.0])), "max_difference: expected a finite number > 0, got 0.0");
    let matrix = |reconstruction| ArrayOptions { reconstruction: Some(reconstruction), ..set() };
    assert_eq!(named(matrix(vec![])), "reconstruction: expected at least one element, got none");
    assert!(named(matrix(vec![1.0, f64::NAN])).starts_with("reconstruction[1]: expected a finite number"));
    assert_eq!(named(matrix(vec![1.0; 3])), "reconstruction: expected whole rows of 2 elements, got 3 elements");
    let start = ArrayOptions { start_drive: Some(vec![0.0, 501.0]), ..set() };
    assert_eq!(named(start), "start_drive[1]: expected a number from -500.0 to 500.0, got 501.0");
    let free = StreamArray::inverse(&[model(0, 1.0)], None).unwrap();
    let error = ArrayController::new(free, &set()).unwrap_err();
    assert_eq!(error.to_string(), "limits[0]: expected finite limits of every drive, got inf");
    let none = ArrayController::new(StreamArray::inverse(&[], None).unwrap(), &set()).unwrap_err();
    assert_eq!(none, Error::Empty { parameter: "inverse" });
}

#[test]
fn a_refused_change_changes_nothing() {
    let mut controller = plain(ArrayOptions { ki: 100.0, ..ArrayOptions::new(DT) });
    settle(&mut controller, [1.0; M], 3);
    let before = shown(&controller);
    let mut drives = [0.0; M];
    assert!(controller.step(&ArraySample::of(&[0.0; 3]), &mut drives).is_err());
    assert!(controller.step(&ArraySample::of(&[0.0; M]), &mut drives[..3]).is_err());
    let short = ArraySample { measurement: Some(&[0.0; 3]), ..ArraySample::of(&[0.0; M]) };
    assert!(controller.step(&short, &mut drives).is_err() && controller.run(&short, &mut drives).is_err());
    assert!(controller.run(&ArraySample::of(&[0.0; 5]), &mut [0.0; 5]).is_err());
    assert!(controller.stop(0.0, &[0.0; M]).is_err() && controller.stop(1.0, &[0.0, 501.0, 0.0, 0.0]).is_err());
    assert!(controller.set_gains(f64::NAN, 0.0).is_err() && controller.set_gains(1.0, 2e3).is_err());
    assert!(controller.set_model(M, &model(0, 1.0)).is_err());
    assert!(controller.follow(&[0.0; 5]).is_err() && controller.follow(&[0.0, 0.0, 0.0, -501.0]).is_err());
    assert!(controller.reset_at(&[0.0; 3]).is_err());
    let state = controller.state();
    let mut moved = state.clone();
    moved.drives[1] += 1.0;
    assert!(controller.set_state(&moved).is_err());
    let mut other = state.clone();
    other.integral[0] = f64::NAN;
    assert!(controller.set_state(&other).is_err());
    let mut stopped = state.clone();
    stopped.mode = Mode::Stop;
    assert!(controller.set_state(&stopped).is_err());
    controller.set_state(&state).unwrap();
    assert_eq!(before, shown(&controller));
    controller.set_gains(50.0, 0.0).unwrap();
    let error = controller.set_state(&state).unwrap_err();
    assert_eq!(error.to_string(), "state.ki: expected 50.0, as in this controller, got 100.0");
}
