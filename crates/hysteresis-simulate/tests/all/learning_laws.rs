//! Laws of learning in the loop; the same names as in `test_learning_laws.py`.

use core::f64::consts::TAU;

use hysteresis_control::StageController;
use hysteresis_control::learning::{
    FeedbackLoop, IterativeLearning, LearningOptions, RepetitiveControl, RepetitiveOptions,
};
use hysteresis_control::linear::{Creep, SecondOrder};
use hysteresis_control::stage::{Stage, StageForward, StageParts};
use hysteresis_core::{
    ControllerOptions, HybridController, ModifiedPrandtlIshlinskii, Offsets, Ratios, Sections, is_admissible,
};
use hysteresis_simulate::closed_loop::{Tracking, TrackingTask};
use hysteresis_simulate::driven::{Driven, Reading};
use proptest::collection::vec;
use proptest::prelude::*;

const DT: f64 = 1e-4;

/// A stage of some 6 um and 500 V: its mode (Hz, damping), samples of dead time, and whether it creeps.
fn stage() -> impl Strategy<Value = Stage> {
    let hysteresis = vec(0.0..1e-3, 3);
    let mode = prop_oneof![1 => Just(None), 3 => (100.0..2000.0, -2.0..0.0).prop_map(Some)];
    (hysteresis, mode, 0.0..6.0, any::<bool>()).prop_map(|(weights, mode, dead_time, creeps)| {
        let weights = [&[4e-3], &weights[..]].concat();
        let r = [0.0, 80.0, 180.0, 300.0];
        let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
        let set = StageParts { dead_time: dead_time * DT, ..StageParts::new(model) };
        let dynamics = mode.map(|(frequency, damping)| SecondOrder::new(frequency, 10_f64.powf(damping)).unwrap());
        let creep = creeps.then(|| Creep::new(&[0.03], &[0.1]).unwrap());
        let dynamics = dynamics.map_or(set.dynamics.clone(), Into::into);
        Stage::new(StageParts { dynamics, creep, ..set }).unwrap()
    })
}

/// Limits and slew that hold many drives back, and gains with which the true loop need not be stable.
fn options() -> impl Strategy<Value = ControllerOptions> {
    let limits = (-300.0..0.0, 20.0..300.0);
    let gains = (0.0..200.0, prop_oneof![Just(0.0), 10.0..1e6]);
    let slew = prop_oneof![1 => Just(None), 4 => (3.5..6.0).prop_map(|power| Some(10_f64.powf(power)))];
    (limits, gains, slew)
        .prop_map(|(limits, (kp, ki), slew)| ControllerOptions { slew, ..ControllerOptions::new(kp, ki, DT, limits) })
}

/// One period of a reference (um).
fn reference() -> impl Strategy<Value = Vec<f64>> {
    (20..120_u32, 0.0..4.0, -1.0..1.0, 1..4_u32, any::<bool>()).prop_map(|(samples, size, offset, turns, jumps)| {
        let phase = |k: u32| TAU * f64::from(turns * k) / f64::from(samples);
        let wave = |k: u32| if jumps { phase(k).sin().signum() } else { phase(k).sin() };
        (0..samples).map(|k| offset + size * wave(k)).collect()
    })
}

/// What the sensor adds at a sample: noise, jumps, numbers that are none.
fn faults() -> impl Strategy<Value = Vec<f64>> {
    let bad = prop_oneof![Just(f64::NAN), Just(f64::INFINITY), Just(-1e300), Just(9.9e37), Just(-1e99)];
    vec(prop_oneof![40 => -0.02..0.02, 2 => -5.0..5.0, 1 => bad], 1..60)
}

/// A bench that looks at every drive.
struct Bench<'a> {
    stage: StageForward,
    faults: core::iter::Cycle<core::slice::Iter<'a, f64>>,
    limits: (f64, f64),
    step: f64,
    last: f64,
}

impl<'a> Bench<'a> {
    fn new(stage: &Stage, faults: &'a [f64], options: &ControllerOptions, last: f64) -> Self {
        let step = options.slew.map_or(f64::INFINITY, |slew| slew * options.dt);
        let stage = stage.forward(DT).unwrap();
        Self { stage, faults: faults.iter().cycle(), limits: options.limits, step, last }
    }
}

impl Driven<String> for Bench<'_> {
    const WRITE_MAY_FAIL: bool = true;

    fn read(&mut self, _: Option<usize>) -> Result<Reading, String> {
        let position = self.stage.output();
        Ok(Reading { measured: position + self.faults.next().unwrap(), position })
    }

    fn write(&mut self, sample: Option<usize>, drive: f64) -> Result<(), String> {
        let ((low, high), last) = (self.limits, self.last);
        // Exactly: the difference of two drives, in doubles, is never above slew times dt.
        if !(low <= drive && drive <= high && (drive - last).abs() <= self.step) {
            return Err(format!("sample {sample:?}: from {last} to {drive}"));
        }
        self.stage.advance(drive);
        self.last = drive;
        Ok(())
    }

    fn put_out(&mut self, _: Option<usize>, drive: f64) -> Result<f64, String> {
        Ok(drive)
    }

    fn limits(&self) -> Option<(f64, f64)> {
        None
    }
}

fn controller(stage: &Stage, options: &ControllerOptions) -> StageController {
    let inverse = stage.inverse(DT, Some(options.limits)).unwrap();
    HybridController::new(inverse.into(), None, options).unwrap().into()
}

/// What learning believes in: the stage of the controller without feedback, which is always stable.
fn believed(stage: &Stage) -> FeedbackLoop {
    stage.feedback_loop(DT, (0.0, 0.0), Sections::default()).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn learning_never_moves_the_drive_beyond_limits_and_slew(
        (stage, truth) in (stage(), stage()),
        options in options(),
        reference in reference(),
        faults in faults(),
        (bandwidth, target_limits) in (prop_oneof![Just(None), Just(Some(300.0))], prop_oneof![Just(None), Just(Some((-1.5, 1.0)))]),
        (settle, on_demand) in (0..2_u32, any::<bool>()),
    ) {
        let mut controller = controller(&stage, &options);
        let set = LearningOptions { bandwidth, target_limits, settle, on_demand, ..LearningOptions::default() };
        let mut learning = IterativeLearning::new(&believed(&stage), &reference, &set).unwrap();
        let mut bench = Bench::new(&truth, &faults, &options, controller.controller().drive());
        let task = TrackingTask::new(&reference, None).unwrap();
        for _ in 0..8 {
            if on_demand {
                // Every period begins at rest, and at the drive that the amplifier has.
                controller.reset(None).unwrap();
            }
            let tracking = Tracking { targets: Some(learning.target()), ..Tracking::of(&mut controller) };
            let run = tracking.run(&task, &mut bench, |_| Ok(())).map_err(TestCaseError::fail)?;
            let errors = reference.iter().zip(&run.record().measured).map(|(r, y)| r - y);
            // A sample that was not measured, or shows the code of an overflow, teaches nothing.
            let error: Vec<f64> = errors.map(|e| if is_admissible(e) && e.abs() < 1e38 { e } else { 0.0 }).collect();
            learning.update(&error).unwrap();
            let (low, high) = target_limits.unwrap_or((-1e100, 1e100));
            prop_assert!(learning.target().iter().all(|target| low <= *target && *target <= high));
        }
    }

    #[test]
    fn repetitive_control_never_moves_the_drive_beyond_limits_and_slew(
        (stage, truth) in (stage(), stage()),
        options in options(),
        reference in reference(),
        faults in faults(),
        limit in prop_oneof![Just(None), (0.0..1.0).prop_map(Some)],
        cut in 1..8_usize,
    ) {
        let set = RepetitiveOptions { limit, ..RepetitiveOptions::new(300.0) };
        let made = || RepetitiveControl::new(&believed(&stage), reference.len(), &set).unwrap();
        let mut controller = controller(&stage, &options).with_repetitive(made()).unwrap();
        let mut bench = Bench::new(&truth, &faults, &options, controller.controller().drive());
        let task = TrackingTask::new(&reference, None).unwrap();
        for period in 0..8 {
            if period == cut {
                // Whatever it was shown, it takes its own state back.
                let state = controller.state();
                controller.take_repetitive();
                controller = controller.with_repetitive(made()).unwrap();
                controller.set_state(&state).map_err(|error| TestCaseError::fail(error.to_string()))?;
                prop_assert_eq!(controller.state(), state);
            }
            Tracking::of(&mut controller).run(&task, &mut bench, |_| Ok(())).map_err(TestCaseError::fail)?;
        }
    }
}

/// Limits and slew come into play, or the laws would say nothing.
#[test]
fn a_drive_that_learning_asks_for_is_held_back() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[4e-3], &[0.0], Ratios::PAPER, Offsets::default()).unwrap();
    let stage = Stage::new(StageParts::new(model)).unwrap();
    let options = ControllerOptions { slew: Some(1e5), ..ControllerOptions::new(1.0, 0.0, DT, (-100.0, 100.0)) };
    let mut controller = controller(&stage, &options);
    let reference: Vec<f64> = (0..100).map(|k| (TAU * 0.01 * f64::from(k)).sin()).collect();
    let mut bench = Bench::new(&stage, &[0.0], &options, controller.controller().drive());
    let task = TrackingTask::new(&reference, None).unwrap();
    Tracking::of(&mut controller).run(&task, &mut bench, |_| Ok(())).unwrap();
    let counters = controller.controller().counters();
    assert!(counters.saturated_count > 50 && counters.slewing_count > 5);
    bench.step *= 0.999;
    assert!(Tracking::of(&mut controller).run(&task, &mut bench, |_| Ok(())).is_err());
}

#[test]
fn an_error_that_is_none_is_refused() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[4e-3], &[0.0], Ratios::PAPER, Offsets::default()).unwrap();
    let stage = Stage::new(StageParts::new(model)).unwrap();
    let mut learning = IterativeLearning::new(&believed(&stage), &[0.0; 20], &LearningOptions::default()).unwrap();
    let before = learning.state();
    let mut message = |got: f64| {
        let mut error = [0.0; 20];
        error[3] = got;
        learning.update(&error).unwrap_err().to_string()
    };
    assert_eq!(message(-1e99), "error[3]: expected a number from -1e40 to 1e40, got -1e99");
    assert!(message(f64::NAN).starts_with("error[3]: expected a finite number"));
    assert!(message(f64::INFINITY).starts_with("error[3]: expected a finite number"));
    assert_eq!(learning.state(), before);
}

/// The largest errors that are none of the rejected ones, one after the other: corrections stay numbers that a state
/// may have.
#[test]
fn repetitive_control_takes_its_own_state_back() {
    let model = ModifiedPrandtlIshlinskii::from_ratios(&[4e-3], &[0.0], Ratios::PAPER, Offsets::default()).unwrap();
    let stage = Stage::new(StageParts::new(model)).unwrap();
    let set = RepetitiveOptions { settle: 0, gain: 1.0, ..RepetitiveOptions::new(300.0) };
    let mut repetitive = RepetitiveControl::new(&believed(&stage), 100, &set).unwrap();
    for k in 0..1000 {
        let correction = repetitive.step(if k % 50 < 20 { 1e100 } else { -1e100 });
        assert!(is_admissible(correction), "{k}: {correction}");
        let state = repetitive.state();
        repetitive.set_state(&state).unwrap();
        assert_eq!(repetitive.state(), state);
    }
    assert_eq!(repetitive.rejected(), 0);
}
