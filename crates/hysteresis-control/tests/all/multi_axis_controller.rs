//! The controller that a stage of several axes leads: it follows, rejects, holds, remembers, and allocates nothing.

use hysteresis_control::multi_axis::{
    Matrices, MultiAxisForward, MultiAxisStage, MultiAxisStageController, PrecompensationOptions, ScalarOperator,
    Tracking, TrackingOptions,
};
use hysteresis_control::oscillator::{Hold, HystereticOscillator, OscillatorForward};
use hysteresis_core::{
    AxesCommand, ControllerOptions, Duhem, Error, FeedForward, HybridController, Mode, MultiAxisController,
};
use nalgebra::DMatrix;

const DT: f64 = 1e-3;
const SAMPLES: usize = 900;

/// Two coupled axes, one mode each, with plays inside; `stiffer` makes another plant of it.
fn stage(stiffer: f64) -> MultiAxisStage {
    let (s, c) = (0.9 * 0.7_f64.sin(), 0.9 * 0.7_f64.cos());
    let matrices = Matrices {
        a: DMatrix::from_row_slice(4, 4, &[c, s, 0.0, 0.0, -s, c, 0.0, 0.0, 0.0, 0.0, 0.6, 0.2, 0.0, 0.0, -0.2, 0.6]),
        b: DMatrix::from_row_slice(4, 2, &[0.3, 0.05, 0.2, 0.0, 0.0, 0.3, 0.05, 0.1]) * stiffer,
        bw: DMatrix::from_row_slice(4, 2, &[0.05, 0.0, 0.04, 0.0, 0.0, 0.06, 0.0, 0.03]),
        c: DMatrix::from_row_slice(2, 4, &[1.0, 0.2, 0.1, 0.0, -0.1, 0.0, 1.0, 0.3]),
        d: DMatrix::zeros(2, 2),
        cq: DMatrix::from_row_slice(2, 4, &[0.2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0]),
        dq: DMatrix::from_row_slice(2, 2, &[1.0, 0.0, 0.0, 1.0]),
    };
    let plays = ScalarOperator::plays(&[0.2, 0.6], &[0.8, 0.5]).unwrap();
    MultiAxisStage::new(matrices, vec![plays.clone(), plays], vec![0.3, -0.2], DT).unwrap()
}

fn controller(limits: (f64, f64)) -> MultiAxisStageController {
    let options = ControllerOptions::new(1.0, 0.0, DT, limits);
    stage(1.0).controller(&[options; 2], &TrackingOptions::default()).unwrap()
}

fn wanted(k: usize) -> [f64; 2] {
    let t = f64::from(u32::try_from(k).unwrap()) * DT;
    let soft = 1.0 - (-(t / 0.1).powi(2)).exp();
    [0.3 + soft * (30.0 * t).sin(), -0.2 + 0.5 * soft * (50.0 * t).sin()]
}

/// The rms distance from the reference behind the first 300 samples, for each axis.
fn missed(controller: &mut MultiAxisStageController, plant: &MultiAxisStage) -> [f64; 2] {
    let (mut plant, mut drives, mut y) = (MultiAxisForward::new(plant), [0.0; 2], [0.3, -0.2]);
    let ahead = controller.tracking().unwrap().ahead();
    let mut squares = [0.0; 2];
    for k in 0..ahead + SAMPLES {
        controller.step((&wanted(k)).into(), &y, &mut drives).unwrap();
        plant.advance(&drives, &mut y).unwrap();
        if let Some(now) = (k + 1).checked_sub(ahead).filter(|k| *k >= 300) {
            squares.iter_mut().zip(y.iter().zip(wanted(now))).for_each(|(sum, (y, r))| *sum += (y - r).powi(2));
        }
    }
    squares.map(|sum: f64| (sum / 600.0).sqrt())
}

#[test]
fn the_model_itself_is_followed() {
    let missed = missed(&mut controller((-9.0, 9.0)), &stage(1.0));
    assert!(missed.iter().all(|missed| *missed < 2e-3), "{missed:?}");
}

#[test]
fn feedback_takes_away_what_the_model_does_not_know() {
    let (mut closed, mut open) = (controller((-9.0, 9.0)), controller((-9.0, 9.0)));
    open.controller_mut().set_mode(Mode::Feedforward).unwrap();
    let plant = stage(1.1);
    let (closed, open) = (missed(&mut closed, &plant), missed(&mut open, &plant));
    assert!(closed.iter().zip(open).all(|(closed, open)| *closed < 0.4 * open), "{closed:?} {open:?}");
}

#[test]
fn a_bad_reference_holds_all_drives_and_limits_hold() {
    let mut controller = controller((-1.5, 1.5));
    let mut drives = [0.0; 2];
    for k in 0..200 {
        controller.step((&[3.0 * wanted(k)[0], 0.0]).into(), &[0.0, f64::NAN], &mut drives).unwrap();
        assert!(drives.iter().all(|drive| drive.abs() <= 1.5));
    }
    let before = drives;
    controller.step((&[f64::NAN, 0.0]).into(), &[0.0; 2], &mut drives).unwrap();
    assert_eq!(drives, before);
    let counted =
        |one: &hysteresis_core::HybridController| (one.counters().rejected_count, one.counters().missing_count);
    assert!(controller.controller().controllers().iter().map(counted).all(|counts| counts == (1, 200)));
    let error = controller.step((&[0.0]).into(), &[0.0; 2], &mut drives).unwrap_err();
    assert_eq!(error, Error::Length { parameter: "references", expected: 2, got: 1 });
}

/// Axes that do not move each other: the decoupling has zeros.
fn apart() -> MultiAxisStageController {
    let of = |number: f64| DMatrix::identity(2, 2) * number;
    let matrices = Matrices { a: of(0.5), b: of(0.4), bw: of(0.1), c: of(1.0), d: of(0.0), cq: of(0.0), dq: of(1.0) };
    let plays = ScalarOperator::plays(&[0.2], &[1.0]).unwrap();
    let stage = MultiAxisStage::new(matrices, vec![plays.clone(), plays], vec![0.0; 2], DT).unwrap();
    stage.controller(&[ControllerOptions::new(1.0, 0.0, DT, (-9.0, 9.0)); 2], &TrackingOptions::default()).unwrap()
}

#[test]
fn what_is_not_admissible_stays_out_of_the_observer() {
    let plain = AxesCommand::from(&[0.1, 0.2]);
    let (one_bad, good) = ([f64::NAN, 0.0], Some(&[0.1, 0.2][..]));
    let bad = [
        AxesCommand { feedforward: Some(&[0.1, f64::NAN]), ..plain },
        AxesCommand { targets: Some(&one_bad), feedforward: good, ..plain },
        AxesCommand { corrections: Some(&one_bad), feedforward: good, ..plain },
        AxesCommand { feedforward: good, ..(&one_bad).into() },
    ];
    for command in bad {
        let (mut controller, mut drives) = (apart(), [0.0; 2]);
        (0..100).for_each(|_| controller.step(plain, &[0.1, 0.2], &mut drives).unwrap());
        let before = drives;
        controller.step(command, &[0.1, 0.2], &mut drives).unwrap();
        assert_eq!(drives, before, "{command:?}");
        assert!(controller.controller().controllers().iter().all(|one| one.counters().rejected_count == 1));
        controller.step(plain, &[0.1, 0.2], &mut drives).unwrap();
        let saved = controller.state();
        assert!(saved.tracking.as_ref().unwrap().beside.iter().all(|number| number.is_finite()), "{command:?}");
        apart().set_state(&saved).unwrap();
    }
}

#[test]
fn plans_and_saved_states_go_on_bit_for_bit() {
    let (mut one, mut other) = (controller((-9.0, 9.0)), controller((-9.0, 9.0)));
    let [mut drives, mut planned, mut looked] = [[0.0; 2]; 3];
    for k in 0_u16..150 {
        let y = [0.3 + 0.01 * f64::from(k).sin(), -0.2];
        let references = wanted(k.into());
        one.step((&references).into(), &y, &mut drives).unwrap();
        other.peek((&references).into(), &y, &mut looked).unwrap();
        other.plan((&references).into(), &y, &mut planned).unwrap();
        assert!(other.commit() && !other.commit());
        assert_eq!((drives, drives), (planned, looked));
    }
    let mut third = controller((-9.0, 9.0));
    third.set_state(&one.state()).unwrap();
    for k in 150..300 {
        one.step((&wanted(k)).into(), &[0.3, -0.2], &mut drives).unwrap();
        third.step((&wanted(k)).into(), &[0.3, -0.2], &mut planned).unwrap();
        assert_eq!(drives, planned);
    }
    let without = MultiAxisStageController::from(one.controller().clone());
    assert!(matches!(third.set_state(&without.state()), Err(Error::State { .. })));
}

#[test]
fn a_stop_ramps_the_drives_and_a_motion_begins_where_it_ended() {
    let mut controller = controller((-9.0, 9.0));
    let mut drives = [0.0; 2];
    (0..200).for_each(|k| controller.step((&wanted(k)).into(), &wanted(k), &mut drives).unwrap());
    controller.controller_mut().stop(1e5, &[1.0, 0.5]).unwrap();
    (0..50).for_each(|_| controller.step((&[f64::NAN; 2]).into(), &[0.0; 2], &mut drives).unwrap());
    assert_eq!(drives, [1.0, 0.5]);
    controller.controller_mut().release();
    let before = drives;
    controller.step((&wanted(200)).into(), &[0.0; 2], &mut drives).unwrap();
    assert_eq!(drives, before);
}

/// What the amplifiers have is known to the observer as it is to the controllers: what it expects is measured.
#[test]
fn the_observer_follows_drives_that_jump() {
    let steps =
        |count: usize, controller: &mut MultiAxisStageController, plant: &mut MultiAxisForward, y: &mut [f64; 2]| {
            let mut drives = [0.0; 2];
            for k in 0..count {
                controller.step((&wanted(k)).into(), y, &mut drives).unwrap();
                let found = controller.tracking().unwrap().disturbance();
                assert!(found.iter().all(|number| number.abs() < 1e-12), "{k} {found:?}");
                plant.advance(&drives, y).unwrap();
            }
        };
    let jumped = [1.5, -0.5];
    let (mut one, mut plant, mut y) = (controller((-9.0, 9.0)), MultiAxisForward::new(&stage(1.0)), [0.3, -0.2]);
    steps(200, &mut one, &mut plant, &mut y);
    assert!(one.start_at(&[0.0, 9.5]).is_err());
    one.start_at(&jumped).unwrap();
    plant.advance(&jumped, &mut y).unwrap();
    steps(1, &mut one, &mut plant, &mut y);
    one.reset(Some(&jumped)).unwrap();
    plant.reset();
    plant.advance(&jumped, &mut y).unwrap();
    steps(1, &mut one, &mut plant, &mut y);
    // Limits that do not hold 0.
    let mut above = controller((0.5, 9.0));
    let start: Vec<f64> = above.controller().controllers().iter().map(HybridController::drive).collect();
    assert_eq!(start, [0.5; 2]);
    plant.reset();
    plant.advance(&start, &mut y).unwrap();
    steps(1, &mut above, &mut plant, &mut y);
}

#[test]
fn what_does_not_fit_is_refused() {
    let options = ControllerOptions::new(1.0, 0.0, DT, (-9.0, 9.0));
    let refused = |options: &[ControllerOptions], tracking: TrackingOptions| {
        stage(1.0).controller(options, &tracking).unwrap_err().to_string()
    };
    let usual = TrackingOptions::default();
    assert_eq!(refused(&[options], usual), "options: expected 2 elements, got 1");
    for (gains, message) in [
        (ControllerOptions { ki: 5.0, ..options }, "ki[0]: expected 0 where a stage leads"),
        (ControllerOptions { kp: 1.5, ..options }, "kp[0]: expected 0 to 1 where a stage leads"),
    ] {
        let error = refused(&[gains; 2], usual);
        assert!(error.starts_with(message), "{error}");
    }
    let mut made = controller((-9.0, 9.0));
    assert!(made.set_gains(0, 0.5, 5.0).unwrap_err().to_string().starts_with("ki: expected 0"));
    assert!(made.set_gains(0, -0.5, 0.0).unwrap_err().to_string().starts_with("kp: expected 0 to 1"));
    let mut alone = MultiAxisStageController::from(made.controller().clone());
    assert_eq!((made.set_gains(1, 0.5, 0.0), alone.set_gains(0, 1.5, 5.0)), (Ok(()), Ok(())));
    let other = ControllerOptions { dt: 2e-3, ..options };
    assert!(refused(&[other; 2], usual).starts_with("controllers[0]: expected controllers with the sampling interval"));
    assert_eq!(
        refused(&[options; 2], TrackingOptions { ahead: Some(0), ..usual }),
        "ahead: expected 1 to 512 samples, got 0"
    );
    assert_eq!(
        refused(&[options; 2], TrackingOptions { peak_sensitivity: 1.0, ..usual }),
        "peak_sensitivity: expected 1.05 to 5, got 1.0"
    );
}

#[test]
fn controllers_that_the_stage_cannot_lead_are_named() {
    let refused = |feedforward: FeedForward, limits: (f64, f64)| {
        let tracking = Tracking::new(&stage(1.0), &[(-9.0, 9.0); 2], 5, &TrackingOptions::default()).unwrap();
        let options = ControllerOptions::new(1.0, 0.0, DT, limits);
        let single = HybridController::new(feedforward, None, &options).unwrap();
        let controller = MultiAxisController::new(vec![single; 2], None).unwrap();
        MultiAxisStageController::from(controller).with_tracking(tracking).unwrap_err()
    };
    let error = refused(FeedForward::None, (-9.0, 9.0));
    assert_eq!(error.to_string(), "controllers[0]: expected a feed-forward that is given, got one of its own or none");
    assert_eq!(error.parameter(), Some("controllers"));
    let error = refused(FeedForward::Given, (-9.0, 8.0)).to_string();
    assert!(error.starts_with("controllers[0]: expected ") && error.ends_with("got 8.0"), "{error}");
    let error = refused(FeedForward::Given, (-9.0, 9.0)).to_string();
    assert_eq!(error, "controllers[0]: expected previews that look as far ahead as the stage, got 0");
}

#[test]
fn stages_without_an_inverse_or_a_feedback_are_named() {
    let refused = |stage: &MultiAxisStage| {
        let options = vec![ControllerOptions::new(1.0, 0.0, DT, (-9.0, 9.0)); stage.drives()];
        stage.controller(&options, &TrackingOptions::default()).unwrap_err().to_string()
    };
    let zeros = || DMatrix::zeros(2, 2);
    let nearly = Matrices {
        a: DMatrix::identity(2, 2) * 0.5,
        b: DMatrix::identity(2, 2),
        bw: DMatrix::zeros(2, 0),
        c: DMatrix::from_row_slice(2, 2, &[1.0, 1.0, 1.0, 1.0 + 1e-12]),
        d: zeros(),
        cq: DMatrix::zeros(0, 2),
        dq: DMatrix::zeros(0, 2),
    };
    let error = refused(&MultiAxisStage::new(nearly, vec![], vec![0.0; 2], DT).unwrap());
    assert!(error.starts_with("stage: expected a static gain with an inverse"), "{error}");
    // The steepest slope turns the gain round.
    let one = |number: f64| DMatrix::from_element(1, 1, number);
    let turned =
        Matrices { a: one(0.5), b: one(0.4), bw: one(-0.6), c: one(1.0), d: one(0.0), cq: one(0.0), dq: one(1.0) };
    let plays = ScalarOperator::plays(&[0.2], &[1.0]).unwrap();
    let error = refused(&MultiAxisStage::new(turned, vec![plays], vec![0.0], DT).unwrap());
    assert!(error.starts_with("peak_sensitivity: expected a peak that some feedback keeps"), "{error}");
}

/// One axis without hysteresis, with a fast and another pole, and a part d that follows the drive at once.
fn linear(pole: f64, d: f64) -> MultiAxisStage {
    let matrices = Matrices {
        a: DMatrix::from_row_slice(2, 2, &[pole, 0.0, 0.0, 0.5]),
        b: DMatrix::from_row_slice(2, 1, &[1.0 - pole, 0.5]),
        bw: DMatrix::zeros(2, 0),
        c: DMatrix::from_row_slice(1, 2, &[0.8, 0.6]),
        d: DMatrix::from_element(1, 1, d),
        cq: DMatrix::zeros(0, 2),
        dq: DMatrix::zeros(0, 1),
    };
    MultiAxisStage::new(matrices, vec![], vec![0.0], DT).unwrap()
}

#[test]
fn what_follows_drives_at_once_is_no_disturbance() {
    let stage = linear(0.9, 0.7);
    let options = ControllerOptions::new(1.0, 0.0, DT, (-9.0, 9.0));
    for (mode, kp) in [(Mode::Feedforward, 1.0), (Mode::Run, 0.5)] {
        let mut controller = stage.controller(&[options], &TrackingOptions::default()).unwrap();
        controller.controller_mut().set_mode(mode).unwrap();
        controller.set_gains(0, kp, 0.0).unwrap();
        let (mut plant, mut drives, mut y) = (MultiAxisForward::new(&stage), [0.0], [0.0]);
        for k in 0..3000 {
            controller.step((&[wanted(k)[1]]).into(), &y, &mut drives).unwrap();
            plant.advance(&[drives[0] + 0.1], &mut y).unwrap();
        }
        let found = controller.tracking().unwrap().disturbance()[0];
        assert!((found - 0.1).abs() < 1e-6, "{mode:?} {found}");
    }
}

/// The discrete Fourier transform of the answer to a jolt of the position, slow poles and D among the stages.
#[test]
fn the_sensitivity_stays_below_its_peak() {
    for (pole, d, peak) in [(0.9, 0.0, 2.0), (0.9, 0.7, 1.3), (0.999, 0.0, 1.3), (0.999, 0.3, 2.0), (0.9997, 0.0, 1.1)]
    {
        let (stage, options) = (linear(pole, d), ControllerOptions::new(1.0, 0.0, DT, (-1e6, 1e6)));
        let asked = TrackingOptions { peak_sensitivity: peak, ..TrackingOptions::default() };
        let mut controller = stage.controller(&[options], &asked).unwrap();
        let (mut plant, mut drives, mut y, mut answer) = (MultiAxisForward::new(&stage), [0.0], [0.0], vec![]);
        for k in 0..40_000 {
            let seen = y[0] + f64::from(u8::from(k == 100));
            controller.step((&[0.0]).into(), &[seen], &mut drives).unwrap();
            plant.advance(&drives, &mut y).unwrap();
            answer.extend((k >= 100).then_some(seen));
        }
        assert!(answer.last().unwrap().abs() < 1e-6, "{pole} {d} {answer:?}");
        for i in 0..100_u8 {
            let angle = core::f64::consts::PI * 10.0_f64.powf(-0.04 * f64::from(i));
            let (mut re, mut im) = (0.0, 0.0);
            for (k, number) in (0_u32..).zip(&answer) {
                let (sin, cos) = (angle * f64::from(k)).sin_cos();
                (re, im) = (re + number * cos, im - number * sin);
            }
            assert!(re.hypot(im) < 1.01 * peak, "{pole} {d} {peak}: {} at {angle}", re.hypot(im));
        }
    }
}

#[test]
fn samples_allocate_nothing() {
    let mut controller = controller((-9.0, 9.0));
    let mut drives = [0.0; 2];
    let count = allocations::count(|| {
        for k in 0..100 {
            let references = wanted(k);
            let command = AxesCommand { corrections: Some(&[0.0, 0.1]), ..(&references).into() };
            assert!(controller.step(command, &[0.3, -0.2], &mut drives).is_ok());
            assert!(controller.peek(command, &[0.3, f64::NAN], &mut drives).is_ok());
            assert!(controller.plan(command, &[0.3, -0.2], &mut drives).is_ok() && controller.commit());
        }
        assert!(controller.run(&[0.0; 20], &[0.0; 20], &mut [0.0; 20]).is_ok());
    });
    assert_eq!(count, 0);
}

fn oscillator() -> HystereticOscillator {
    HystereticOscillator::new(0.5, 5.0, 2.5e4, Duhem::from_bouc_wen(2.5e4, 1e3, 0.8, -1.1).unwrap()).unwrap()
}

/// Errors of what is held go with the square of the interval.
#[test]
fn a_sampled_oscillator_moves_as_the_oscillator() {
    let missed = |dt: f64, sub_steps: usize, count: u32| {
        let u: Vec<f64> = (0..count).map(|k| 60.0 * (2.0 * (100.0 * dt * f64::from(k)).sin()).sin()).collect();
        let y = oscillator().response(&u, dt, Hold::Zero, Some(40)).unwrap();
        let mut sampled = vec![0.0; u.len()];
        let stage = MultiAxisStage::of_oscillator(&oscillator(), dt, sub_steps).unwrap();
        MultiAxisForward::new(&stage).run(&u, &mut sampled).unwrap();
        let rms = |numbers: &mut dyn Iterator<Item = f64>| numbers.map(|x| x * x).sum::<f64>().sqrt();
        rms(&mut y.iter().zip(&sampled).map(|(y, sampled)| y - sampled)) / rms(&mut y.iter().copied())
    };
    let (coarse, fine) = (missed(1e-3, 1, 1000), missed(2.5e-4, 1, 4000));
    assert!(coarse < 0.02 && fine < 0.1 * coarse, "{coarse} {fine}");
    let inside = missed(1e-3, 4, 1000);
    assert!(inside < 0.1 * coarse, "{coarse} {inside}");
    let error = MultiAxisStage::of_oscillator(&oscillator(), 0.05, 1).unwrap_err();
    assert!(error.to_string().starts_with("dt: expected sub-steps so short beside a period"), "{error}");
    assert!(MultiAxisStage::of_oscillator(&oscillator(), 0.01, 2).is_ok());
    let error = MultiAxisStage::of_oscillator(&oscillator(), DT, 0).unwrap_err();
    assert_eq!(error.to_string(), "sub_steps: expected 1 to 1000 steps in a sample, got 0");
}

/// The position tells what its hysteresis does, so a few passes find the drives.
#[test]
fn an_oscillator_is_led_along_a_whole_reference() {
    let wanted = |k: u32| {
        let t = f64::from(k) * DT;
        let swell = |from: f64| 0.5 * (1.0 + ((t - from) / 0.05).tanh());
        3e-4 * swell(0.3) * (1.0 - swell(1.0)) * (2.0 * std::f64::consts::PI * 25.0 * t).sin()
    };
    let wanted: Vec<_> = (0..1400).map(wanted).collect();
    let rms = |numbers: &mut dyn Iterator<Item = f64>| numbers.map(|x| x * x).sum::<f64>().sqrt();
    let missed = |sub_steps: usize| {
        let stage = MultiAxisStage::of_oscillator(&oscillator(), DT, sub_steps).unwrap();
        let found = stage.precompensate(&wanted, &PrecompensationOptions::default()).unwrap();
        assert!(found.converged && found.sweeps < 30, "{sub_steps}: {} passes", found.sweeps);
        let there = oscillator().response(&found.drives, DT, Hold::Zero, Some(40)).unwrap();
        rms(&mut there.iter().zip(&wanted).map(|(y, wanted)| y - wanted)) / rms(&mut wanted.iter().copied())
    };
    let (one, four) = (missed(1), missed(4));
    assert!(one < 0.01 && four < 0.01, "{one} {four}");
}

#[test]
fn an_oscillator_is_followed_in_a_closed_loop() {
    let options = ControllerOptions::new(1.0, 0.0, DT, (-200.0, 200.0));
    let stage = MultiAxisStage::of_oscillator(&oscillator(), DT, 1).unwrap();
    let mut controller = stage.controller(&[options], &TrackingOptions::default()).unwrap();
    let ahead = controller.tracking().unwrap().ahead();
    let wanted = |k: usize| 5e-4 * (wanted(k)[0] - 0.3);
    let (mut plant, mut drives, mut y) = (OscillatorForward::new(&oscillator(), DT, None).unwrap(), [0.0], [0.0]);
    for k in 0..ahead + SAMPLES {
        controller.step((&[wanted(k)]).into(), &y, &mut drives).unwrap();
        y = [plant.advance(drives[0])];
        let now = (k + 1).saturating_sub(ahead);
        assert!(now < 200 || (y[0] - wanted(now)).abs() < 5e-7, "{k}: {} {}", y[0], wanted(now));
    }
}
