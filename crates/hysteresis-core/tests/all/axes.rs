//! Laws of several axes, whatever their controllers are and whatever comes.

use crate::support::control::{DT, Setup, command, setup};
use hysteresis_core::{AxesCommand, Command, ControllerOptions, Error, HybridController, MultiAxisController};
use proptest::collection::vec;
use proptest::prelude::*;

const AXES: usize = 3;

/// A sample of all axes: what is asked of each, and what each sensor shows.
type Sample = [(Command, f64); AXES];

fn sample() -> impl Strategy<Value = Sample> {
    let wild =
        prop_oneof![8 => -4.0..4.0, 1 => Just(f64::NAN), 1 => Just(f64::INFINITY), 1 => Just(-1e300), 1 => -1e3..1e3];
    prop::array::uniform3((command(), wild))
}

/// Controllers of one sampling interval, with windows of one length.
fn setups() -> impl Strategy<Value = [Setup; AXES]> {
    prop::array::uniform3(setup()).prop_map(|setups| {
        let (window, dt) = (setups[0].window.clone(), setups[0].options.dt);
        setups.map(|setup| {
            let options = ControllerOptions { dt, ..setup.options };
            Setup { window: window.clone(), options, ..setup }
        })
    })
}

/// Ones on the diagonal and less than 0.45 beside them, some of it nothing: such a matrix has an inverse.
fn decoupling() -> impl Strategy<Value = [f64; AXES * AXES]> {
    let beside = prop_oneof![2 => Just(0.0), 3 => -0.45..0.45];
    prop::array::uniform9(beside).prop_map(|mut entries| {
        (0..AXES).for_each(|i| entries[i * AXES + i] = 1.0);
        entries
    })
}

fn made(setups: &[Setup; AXES], decoupling: Option<&[f64]>) -> MultiAxisController {
    MultiAxisController::new(setups.iter().map(Setup::make).collect(), decoupling).unwrap()
}

fn shown(axes: &MultiAxisController) -> String {
    format!("{:?}", axes.state())
}

/// Without targets and volts of their own, which axes have for all or for none.
fn split(sample: &Sample) -> ([f64; AXES], [f64; AXES]) {
    (sample.map(|(command, _)| command.reference), sample.map(|(_, y)| y))
}

fn step(axes: &mut MultiAxisController, sample: &Sample) -> [u64; AXES] {
    let ((references, measurements), mut drives) = (split(sample), [0.0; AXES]);
    axes.step((&references).into(), &measurements, &mut drives).unwrap();
    drives.map(f64::to_bits)
}

proptest! {
    #[test]
    fn with_the_identity_every_axis_is_a_single_controller(setups in setups(), samples in vec(sample(), 1..40), all in any::<bool>()) {
        let mut single = setups.each_ref().map(Setup::make);
        let mut axes = made(&setups, None);
        for sample in samples {
            let (references, measurements) = split(&sample);
            let targets = sample.map(|(command, _)| command.target.unwrap_or(1.0));
            let corrections = sample.map(|(command, _)| command.correction);
            let volts = sample.map(|(command, _)| command.feedforward.unwrap_or(-1.0));
            let asked = AxesCommand {
                references: &references,
                targets: all.then_some(&targets),
                corrections: all.then_some(&corrections),
                estimates: None,
                feedforward: all.then_some(&volts),
            };
            let mut drives = [0.0; AXES];
            axes.step(asked, &measurements, &mut drives).unwrap();
            for (i, controller) in single.iter_mut().enumerate() {
                let command = Command {
                    reference: references[i],
                    target: all.then_some(targets[i]),
                    correction: if all { corrections[i] } else { 0.0 },
                    estimate: None,
                    feedforward: all.then_some(volts[i]),
                };
                let drive = controller.step(command, measurements[i]);
                prop_assert_eq!(drive.to_bits(), drives[i].to_bits());
                prop_assert_eq!(format!("{:?}", controller.state()), format!("{:?}", axes.state().controllers[i]));
            }
        }
    }

    #[test]
    fn no_drive_ever_leaves_its_limits_nor_its_slew(setups in setups(), d in decoupling(), samples in vec(sample(), 1..60)) {
        let mut axes = made(&setups, Some(&d));
        let mut last: Vec<f64> = axes.controllers().iter().map(HybridController::drive).collect();
        for sample in samples {
            let drives = step(&mut axes, &sample).map(f64::from_bits);
            for ((drive, last), setup) in drives.iter().zip(&mut last).zip(&setups) {
                let ControllerOptions { limits: (low, high), slew, dt, .. } = setup.options;
                prop_assert!(low <= *drive && *drive <= high, "{}", drive);
                prop_assert!((*drive - *last).abs() <= slew.map_or(f64::INFINITY, |slew| slew * dt));
                *last = *drive;
            }
        }
    }

    #[test]
    fn restored_axes_go_on_bit_for_bit(setups in setups(), d in decoupling(), before in vec(sample(), 0..20), after in vec(sample(), 1..20)) {
        let mut axes = made(&setups, Some(&d));
        for sample in &before {
            step(&mut axes, sample);
        }
        let saved = axes.state();
        let first: Vec<_> = after.iter().map(|sample| step(&mut axes, sample)).collect();
        let end = shown(&axes);
        axes.set_state(&saved).unwrap();
        let again: Vec<_> = after.iter().map(|sample| step(&mut axes, sample)).collect();
        prop_assert_eq!(&again, &first);
        let mut other = made(&setups, Some(&d));
        other.set_state(&saved).unwrap();
        let elsewhere: Vec<_> = after.iter().map(|sample| step(&mut other, sample)).collect();
        prop_assert_eq!((&elsewhere, shown(&other)), (&first, end));
    }

    #[test]
    fn a_step_is_a_plan_that_is_committed_and_a_row_of_a_run(setups in setups(), d in decoupling(), samples in vec(sample(), 1..20), skip in 0..4_usize) {
        let (mut stepped, mut planned, mut run) = (made(&setups, Some(&d)), made(&setups, Some(&d)), made(&setups, Some(&d)));
        let (mut x, mut y, mut z) = (Vec::new(), Vec::new(), Vec::new());
        for (k, sample) in samples.iter().enumerate() {
            let (references, measurements) = split(sample);
            let (mut peeked, mut drives) = ([0.0; AXES], [0.0; AXES]);
            let before = shown(&planned);
            planned.peek((&references).into(), &measurements, &mut peeked).unwrap();
            planned.plan((&references).into(), &measurements, &mut drives).unwrap();
            prop_assert_eq!(shown(&planned), before);
            if k % 4 == skip {
                // A change of one controller drops the plan of all.
                planned.controllers_mut()[0].release();
                prop_assert!(!planned.commit());
                planned.controllers_mut().iter_mut().for_each(|controller| assert!(!controller.commit()));
                planned.plan((&references).into(), &measurements, &mut drives).unwrap();
                stepped.controllers_mut()[0].release();
                run.controllers_mut()[0].release();
            }
            prop_assert!(planned.commit() && !planned.commit());
            let taken = step(&mut stepped, sample);
            prop_assert_eq!(taken, drives.map(f64::to_bits));
            prop_assert_eq!(taken, peeked.map(f64::to_bits));
            prop_assert_eq!(shown(&planned), shown(&stepped));
            x.extend(references);
            y.extend(measurements);
            z.extend(drives.map(f64::to_bits));
        }
        let mut drives = vec![0.0; x.len()];
        run.run(&x, &y, &mut drives).unwrap();
        prop_assert_eq!(drives.into_iter().map(f64::to_bits).collect::<Vec<_>>(), z);
        prop_assert_eq!(shown(&run), shown(&stepped));
    }

    #[test]
    fn a_missing_measurement_is_missing_where_the_decoupling_needs_it(setups in setups(), d in decoupling(), bad in 0..AXES, y in prop_oneof![Just(f64::NAN), Just(2e100), Just(f64::NEG_INFINITY)]) {
        let mut axes = made(&setups, Some(&d));
        let mut measurements = [0.5; AXES];
        measurements[bad] = y;
        let mut drives = [0.0; AXES];
        axes.step(AxesCommand { feedforward: Some(&[40.0; AXES]), ..(&[0.5; AXES]).into() }, &measurements, &mut drives).unwrap();
        for (i, controller) in axes.controllers().iter().enumerate() {
            let missing = controller.counters().missing_count;
            prop_assert_eq!(missing, u64::from(d[i * AXES + bad] != 0.0));
        }
    }
}

fn feedback(dt: f64) -> HybridController {
    let options = ControllerOptions::new(2.0, 500.0, dt, (-10.0, 10.0));
    HybridController::new(hysteresis_core::FeedForward::None, None, &options).unwrap()
}

#[test]
fn what_does_not_fit_is_named() {
    let message = |controllers: Vec<HybridController>, d: Option<&[f64]>| {
        MultiAxisController::new(controllers, d).unwrap_err().to_string()
    };
    let two = || vec![feedback(DT); 2];
    assert_eq!(message(Vec::new(), None), "controllers: expected at least one element, got none");
    let other = vec![feedback(DT), feedback(1e-3)];
    let expected = "controllers[1]: expected 0.0001, the sampling interval of the first one in seconds, got 0.001";
    assert_eq!(message(other, None), expected);
    let window = hysteresis_core::Preview::new(&[0.5, 0.5], 1).unwrap();
    let options = ControllerOptions::new(2.0, 500.0, DT, (-10.0, 10.0));
    let ahead = HybridController::new(hysteresis_core::FeedForward::None, Some(window), &options).unwrap();
    let expected = "controllers[1]: expected 0, the length of the preview of the first one, got 2";
    assert_eq!(message(vec![feedback(DT), ahead], None), expected);
    assert_eq!(message(two(), Some(&[1.0, 0.0])), "decoupling: expected 4 elements, got 2");
    assert!(message(two(), Some(&[1.0, f64::NAN, 0.0, 1.0])).starts_with("decoupling[1]: expected a finite number"));
    for singular in [[0.0; 4], [1.0, 2.0, 2.0, 4.0], [1.0, 1.0, 1.0, 1.0 + 1e-12]] {
        let expected = "decoupling: expected an invertible matrix with a condition number of at most 1e10, got ";
        assert!(message(two(), Some(&singular)).starts_with(expected));
    }
    let mut axes = MultiAxisController::new(two(), Some(&[0.0, 1.0, 1.0, 0.0])).unwrap();
    let before = shown(&axes);
    let wrong = [
        axes.step((&[0.0]).into(), &[0.0; 2], &mut [0.0; 2]),
        axes.step((&[0.0; 2]).into(), &[0.0; 3], &mut [0.0; 2]),
        axes.plan((&[0.0; 2]).into(), &[0.0; 2], &mut [0.0; 1]),
        axes.run(&[0.0; 3], &[0.0; 3], &mut [0.0; 3]),
        axes.stop(100.0, &[0.0, 11.0]),
        axes.stop(-1.0, &[0.0; 2]),
        axes.start_at(&[0.0, f64::NAN]),
    ];
    let names = wrong.map(|result| result.unwrap_err().parameter());
    let expected = ["references", "measurements", "drives", "references", "rest_drives", "rate", "drives"];
    assert_eq!(names, expected.map(Some));
    let other = MultiAxisController::new(two(), None).unwrap().state();
    assert!(matches!(axes.set_state(&other), Err(Error::State { .. })));
    assert_eq!(shown(&axes), before);
}

#[test]
fn a_stop_brings_every_axis_to_its_rest_drive() {
    let mut axes = MultiAxisController::new(vec![feedback(1e-3); 2], Some(&[1.0, 0.1, -0.1, 1.0])).unwrap();
    axes.start_at(&[1.0, -1.0]).unwrap();
    axes.stop(500.0, &[2.0, 0.0]).unwrap();
    let mut drives = [0.0; 2];
    for _ in 0..2 {
        axes.step((&[f64::NAN; 2]).into(), &[f64::NAN; 2], &mut drives).unwrap();
    }
    assert_eq!(drives, [2.0, 0.0]);
    axes.release();
    axes.hold();
    axes.step((&[1.0; 2]).into(), &[0.0; 2], &mut drives).unwrap();
    assert_eq!(drives, [2.0, 0.0]);
}

#[test]
fn a_drive_that_is_refused_is_named_with_its_actuator() {
    let mut axes = MultiAxisController::new(vec![feedback(1e-3); 2], None).unwrap();
    axes.start_at(&[1.0, -1.0]).unwrap();
    let before = shown(&axes);
    let refused = [
        (axes.stop(100.0, &[0.0, 11.0]), "rest_drives[1]: expected a number from -10.0 to 10.0, got 11.0"),
        (axes.stop(100.0, &[f64::NAN, 0.0]), "rest_drives[0]: expected a number from -10.0 to 10.0, got NaN"),
        (axes.stop(100.0, &[0.0]), "rest_drives: expected 2 elements, got 1"),
        (axes.start_at(&[0.0, -11.0]), "drives[1]: expected a number from -10.0 to 10.0, got -11.0"),
        (axes.reset_at(&[0.0, -11.0]), "drives[1]: expected a number from -10.0 to 10.0, got -11.0"),
        (axes.follow(&[0.0, 1.0, 0.0, 12.0]), "drives[1]: expected a number from -10.0 to 10.0, got 12.0"),
        (axes.follow(&[0.0; 3]), "drives: expected whole rows of 2 elements, got 3 elements"),
    ];
    for (result, message) in refused {
        assert_eq!(result.unwrap_err().to_string(), message);
    }
    assert_eq!(shown(&axes), before);
}

#[test]
fn what_was_driven_before_is_taken_over_by_all_axes_or_by_none() {
    let limits = (-10.0, 10.0);
    let model = hysteresis_core::PrandtlIshlinskii::new(&[1.0, 0.5], &[0.0, 2.0], hysteresis_core::Offsets::default());
    let single = |source| HybridController::new(source, None, &ControllerOptions::new(2.0, 500.0, DT, limits)).unwrap();
    let inverse = single(model.as_ref().unwrap().inverse(Some(limits)).unwrap().into());
    let mut singles = [inverse.clone(), inverse.clone()];
    let mut axes = MultiAxisController::new(singles.to_vec(), None).unwrap();
    axes.follow(&[8.0, -3.0, 4.0, 2.0]).unwrap();
    singles[0].follow(&[8.0, 4.0]).unwrap();
    singles[1].follow(&[-3.0, 2.0]).unwrap();
    assert_eq!(axes.state().controllers, singles.map(|one| one.state()));
    axes.reset_at(&[5.0, 6.0]).unwrap();
    assert_eq!(
        axes.state().controllers,
        [5.0, 6.0].map(|drive| {
            let mut one = inverse.clone();
            one.reset_at(drive).unwrap();
            one.state()
        })
    );
    let targets_alone = single(model.unwrap().forward().into());
    let mut axes = MultiAxisController::new(vec![inverse, targets_alone], None).unwrap();
    let before = shown(&axes);
    assert_eq!(axes.follow(&[8.0, 1.0]), Err(Error::CannotFollow));
    assert_eq!(shown(&axes), before);
}

#[test]
fn a_matrix_tells_its_size_and_entries() {
    let identity = hysteresis_core::AxisMatrix::identity(3);
    assert_eq!((identity.axes(), identity.entries()), (3, &[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0][..]));
}
