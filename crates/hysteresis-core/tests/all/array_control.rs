//! The controller of an array: anti-windup, neighbours, missing measurements, other models, refusals.

use crate::support::array::{Actuator, DT, M, S, Setup, model, positions, shown, stage};
use hysteresis_core::{
    ArrayController, ArrayInverse, ArrayOptions, ArraySample, Error, Mode, Process, QuasiStaticForward,
    QuasiStaticInverse, StreamArray,
};

fn setup(options: ArrayOptions) -> Setup {
    Setup { options: ArrayOptions { bumpless_time: 0.0, ..options }, limits: vec![(-500.0, 500.0); M] }
}

fn plain(options: ArrayOptions) -> ArrayController {
    setup(options).make()
}

fn of_stages(options: ArrayOptions) -> ArrayController<QuasiStaticInverse> {
    setup(options).make()
}

fn settle<P: ArrayInverse>(controller: &mut ArrayController<P>, reference: [f64; M], samples: usize) -> Vec<f64> {
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
    let mut all: ArrayController =
        plain(ArrayOptions { ki: 1.0, reconstruction: Some(vec![1.0; M * S]), ..ArrayOptions::new(DT) });
    settle(&mut all, [0.0; M], 1);
    let sample = ArraySample { measurement: Some(&[0.1, f64::NAN, 0.1]), ..ArraySample::of(&[0.5; M]) };
    all.step(&sample, &mut [0.0; M]).unwrap();
    assert_eq!(all.integral(), [0.0; M]);
    assert!(positions(&all).iter().all(|p| (p - 0.5).abs() < 1e-12), "feed-forward goes on");
}

#[test]
fn another_model_is_no_jump() {
    let mut controller: ArrayController =
        Setup { options: ArrayOptions::new(DT), limits: vec![(-500.0, 500.0); M] }.make();
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
    assert_eq!(named(pairs(&[(0, 2)], &[1.0])), "neighbours[0]: expected a whole number from 0 to 1, got 2");
    assert_eq!(named(pairs(&[(0, 1), (1, 1)], &[1.0])), "neighbours[1]: expected two different actuators, got 1");
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

#[test]
fn a_state_belongs_to_the_options_it_was_made_with() {
    let state = plain(ArrayOptions::new(DT)).state();
    let mut other = plain(ArrayOptions { slew: vec![1e4], ..ArrayOptions::new(DT) });
    assert!(other.set_state(&state).is_err());
    plain(ArrayOptions::new(DT)).set_state(&state).unwrap();
}

#[test]
fn a_stop_goes_so_many_volts_a_second() {
    let mut controller = plain(ArrayOptions::new(DT));
    settle(&mut controller, [1.0; M], 20);
    let before = controller.drives().to_vec();
    controller.stop(1e3, &[0.0; M]).unwrap();
    let mut drives = [0.0; M];
    for k in 1..=5_u32 {
        controller.step(&ArraySample::of(&[1.0; M]), &mut drives).unwrap();
        for (drive, before) in drives.iter().zip(&before) {
            assert!((before - drive - f64::from(k) * 1e3 * DT).abs() < 1e-9, "{drive} after {before}");
        }
    }
}

#[test]
fn a_reset_forgets_all_but_the_drives() {
    let mut controller = plain(ArrayOptions { ki: 500.0, ..ArrayOptions::new(DT) });
    let sample = ArraySample { measurement: Some(&[0.9; M]), ..ArraySample::of(&[1.0; M]) };
    for _ in 0..10 {
        controller.step(&sample, &mut [0.0; M]).unwrap();
    }
    controller.step(&ArraySample::of(&[100.0; M]), &mut [0.0; M]).unwrap();
    controller.stop(1e3, &[0.0; M]).unwrap();
    assert!(controller.integral()[0] > 0.0 && controller.counters().saturated_count > 0);
    controller.reset();
    assert_eq!((controller.integral(), controller.mode()), (&[0.0; M][..], Mode::Run));
    assert_eq!(controller.counters().saturated_count, 0);
}

/// Stages that have moved from rest to 0 V, as a controller begins.
fn forwards() -> Vec<QuasiStaticForward> {
    let mut stages: Vec<_> = (0..M).map(|i| stage(i, 1.0).forward()).collect();
    driven(&mut stages, &[0.0; M]);
    stages
}

/// The positions of stages at these drives.
fn driven(stages: &mut [QuasiStaticForward], drives: &[f64]) -> Vec<f64> {
    stages.iter_mut().zip(drives).map(|(stage, drive)| stage.step(*drive)).collect()
}

#[test]
fn stages_go_where_they_are_asked_to() {
    let mut controller = of_stages(ArrayOptions::new(DT));
    let (mut stages, mut drives) = (forwards(), [0.0; M]);
    for k in 0..400 {
        let reference = [0.1, 0.3, 0.5, 0.2].map(|at| 0.5 * (at * f64::from(k)).sin());
        controller.step(&ArraySample::of(&reference), &mut drives).unwrap();
        let at = driven(&mut stages, &drives);
        let aims = if k == 0 { positions(&controller) } else { reference.to_vec() };
        assert!(at.iter().zip(&aims).all(|(p, aim)| (p - aim).abs() < 1e-12), "{k}: {at:?} and {aims:?}");
        assert!(positions(&controller).iter().zip(&aims).all(|(p, aim)| (p - aim).abs() < 1e-12));
    }
    assert_eq!(controller.counters().saturated_count, 0);
}

/// Creep goes on while the drives are held: by a hold, by rejected references, by a stop that has ended, and where a
/// motion starts.
#[test]
fn creep_goes_on_while_the_drives_stay() {
    let after = |end: fn(&mut ArrayController<QuasiStaticInverse>), reference: [f64; M], samples: usize| {
        let (mut controller, mut stages, mut drives) = (of_stages(ArrayOptions::new(DT)), forwards(), [0.0; M]);
        let mut play = |controller: &mut ArrayController<_>, reference: [f64; M], samples| {
            let mut at = vec![];
            for _ in 0..samples {
                controller.step(&ArraySample::of(&reference), &mut drives).unwrap();
                at = driven(&mut stages, &drives);
                assert!(at.iter().zip(positions(controller)).all(|(p, q)| (p - q).abs() < 1e-12));
            }
            at
        };
        play(&mut controller, [0.6; M], 20);
        end(&mut controller);
        play(&mut controller, reference, samples);
        controller.release();
        play(&mut controller, [0.4; M], 1); // a motion starts
        play(&mut controller, [0.4; M], 1)
    };
    let stay = |controller: &mut ArrayController<_>| controller.hold();
    let stop = |controller: &mut ArrayController<_>| controller.stop(1e9, &[30.0; M]).unwrap();
    for at in [after(stay, [0.6; M], 50), after(|_| {}, [f64::NAN; M], 50), after(stop, [0.6; M], 50)] {
        assert!(at.iter().all(|p| (p - 0.4).abs() < 1e-12), "{at:?}");
    }
}

/// A pair at its limit would creep apart if its drives stayed.
#[test]
fn neighbours_do_not_creep_apart() {
    let chain =
        ArrayOptions { neighbours: vec![(0, 1), (1, 2), (2, 3)], max_difference: vec![0.25], ..ArrayOptions::new(DT) };
    let mut controller = of_stages(chain);
    let (mut stages, mut drives) = (forwards(), [0.0; M]);
    for k in 0..600 {
        // So steep that all pairs are at their limits.
        let reference = if k < 50 { [0.0; M] } else { [-3.0, -1.5, 1.5, 3.0] };
        controller.step(&ArraySample::of(&reference), &mut drives).unwrap();
        let at = driven(&mut stages, &drives);
        if k > 50 {
            assert!(at.windows(2).all(|pair| (pair[0] - pair[1]).abs() <= 0.25), "{k}: {at:?}");
        }
    }
    assert!(controller.counters().pair_limited_count > 500);
    assert!(driven(&mut stages, &drives).windows(2).any(|pair| (pair[0] - pair[1]).abs() > 0.25), "creep goes on");
}

#[test]
fn an_inverse_behind_an_amplifier_is_refused() {
    let limits = (-500.0, 500.0);
    let lagging = QuasiStaticInverse::made(1, 1.0, limits).behind_amplifier(0.5).unwrap();
    let inverse: StreamArray<_> = [QuasiStaticInverse::made(0, 1.0, limits), lagging].into_iter().collect();
    let error = ArrayController::new(inverse, &ArrayOptions::new(DT)).unwrap_err();
    let expected = "inverses of which none is behind an amplifier, unlike that of actuator";
    assert_eq!(error, Error::whole("inverse", None, expected, 1));
}

#[test]
fn the_state_of_stages_has_their_positions() {
    let mut controller = of_stages(ArrayOptions::new(DT));
    settle(&mut controller, [0.5; M], 3);
    let saved = controller.state();
    assert_eq!(saved.positions, positions(&controller));
    for (positions, message) in [
        (vec![], "state.positions: expected 4 elements, got 0"),
        (
            vec![0.0, f64::NAN, 0.0, 0.0],
            "state.positions[1]: expected a finite number (at most 1e100 in magnitude), got NaN",
        ),
    ] {
        let wrong = hysteresis_core::ArrayControllerState { positions, ..saved.clone() };
        assert_eq!(controller.set_state(&wrong).unwrap_err().to_string(), message);
        assert_eq!(controller.state(), saved);
    }
    let of_models = plain(ArrayOptions::new(DT));
    assert!(of_models.state().positions.is_empty());
}
