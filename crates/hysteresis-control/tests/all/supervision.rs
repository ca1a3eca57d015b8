//! Learning that diverges stops: what the supervisor of repetitive control sees, and what it must not see.

use core::f64::consts::TAU;
use std::sync::LazyLock;

use crate::support::models::actuator;
use crate::support::{DT, Noise};
use hysteresis_control::binary::Binary;
use hysteresis_control::learning::{LearningPhase, RepetitiveControl, RepetitiveOptions, RepetitiveState};
use hysteresis_control::linear::SecondOrder;
use hysteresis_control::stage::{FeedForwardKind, Stage, StageParts};
use hysteresis_control::{StageController, StageControllerState};

const PERIOD: usize = 400;
const FREQUENCY: f64 = 350.0;

fn stage(frequency: f64) -> Stage {
    let dynamics = SecondOrder::new(frequency, 0.03).unwrap().into();
    let parts =
        StageParts { dynamics, dead_time: 2.0 * DT, limits: Some((-500.0, 500.0)), ..StageParts::new(actuator()) };
    Stage::new(parts).unwrap()
}

/// A controller that learns, whose design takes its time, and the same without learning.
fn made(learns: bool) -> StageController {
    static MADE: LazyLock<StageController> = LazyLock::new(|| {
        let stage = stage(FREQUENCY);
        let options = stage.controller_options(DT, None).unwrap();
        let around = stage.feedback_loop(DT, (options.kp, options.ki), options.filters).unwrap();
        let learning = RepetitiveOptions { uncertainty: stage.loop_uncertainty(), ..RepetitiveOptions::default() };
        let learning = RepetitiveControl::new(&around, PERIOD, &learning).unwrap();
        let controller = stage.controller(FeedForwardKind::Inverse, &options).unwrap();
        StageController::from(controller).with_repetitive(learning).unwrap()
    });
    let mut controller = MADE.clone();
    if !learns {
        controller.take_repetitive();
    }
    controller
}

/// The stage on the bench, with a sensor.
struct Bench {
    plant: hysteresis_control::stage::StageForward,
    position: f64,
    noise: Noise,
    rms: f64,
}

impl Bench {
    fn new(frequency: f64, rms: f64, seed: u64) -> Self {
        let mut plant = stage(frequency).forward(DT).unwrap();
        let position = plant.settle(0.0);
        Self { plant, position, noise: Noise::new(seed), rms }
    }

    /// A period, and the root mean square of its error.
    fn period(&mut self, controller: &mut StageController, reference: impl Fn(usize) -> f64) -> f64 {
        let mut squares = 0.0;
        for k in 0..PERIOD {
            squares += (reference(k) - self.position).powi(2);
            let measured = self.position + self.rms * self.noise.next();
            self.position = self.plant.advance(controller.step(reference(k).into(), measured));
        }
        #[expect(clippy::cast_precision_loss, reason = "a period is short")]
        let samples = PERIOD as f64;
        (squares / samples).sqrt()
    }
}

#[expect(clippy::cast_precision_loss, reason = "a period is short")]
fn sine(k: usize) -> f64 {
    1.5 * (TAU * k as f64 / PERIOD as f64).sin()
}

fn phase(controller: &StageController) -> LearningPhase {
    controller.repetitive().unwrap().phase()
}

fn divergences(controller: &StageController) -> u64 {
    controller.repetitive().unwrap().divergence_count()
}

/// With a resonance 20 % and more from the model: counted once, and then as good as without learning.
#[test]
fn learning_that_diverges_stops_and_leaves_the_feedback() {
    for off in [0.7, 0.8, 1.3] {
        let [mut learning, mut alone] = [made(true), made(false)];
        let [mut one, mut other] = [0, 1].map(|_| Bench::new(off * FREQUENCY, 2e-3, 1));
        let errors: Vec<f64> = (0..80).map(|_| one.period(&mut learning, sine)).collect();
        let without = (0..80).map(|_| other.period(&mut alone, sine)).last().unwrap();
        assert_eq!((divergences(&learning), phase(&learning)), (1, LearningPhase::Stopped), "{off}: {errors:?}");
        assert!(errors[79] < 1.05 * without, "{off}: {without} {errors:?}");
        let worst = errors.iter().copied().fold(0.0, f64::max);
        assert!(worst < 1.5, "{off}: {errors:?}");
        assert_eq!(learning.controller().counters().saturated_count, 0);
        assert_eq!(learning.repetitive().unwrap().peek().to_bits(), 0, "exactly zero");
    }
}

/// Noise, a resonance that is a little off, and references that change are no divergence.
#[test]
fn learning_that_converges_goes_on() {
    for seed in 0..8 {
        let mut controller = made(true);
        let off = [0.95, 1.0, 1.05][usize::try_from(seed).unwrap() % 3];
        let mut bench = Bench::new(off * FREQUENCY, [1e-4, 3e-3, 3e-2][usize::try_from(seed / 2).unwrap() % 3], seed);
        let mut random = fastrand::Rng::with_seed(seed);
        let mut size = 0.0;
        for period in 0..120 {
            size = match seed % 4 {
                0 => 1.0,
                1 => 0.05 + f64::from(period) / 120.0,
                2 => random.f64(),
                _ if period % 20 == 0 => random.f64().powi(3),
                _ => size,
            };
            bench.period(&mut controller, |k| size * sine(k));
            assert_eq!((divergences(&controller), phase(&controller)), (0, LearningPhase::Learning), "{seed} {period}");
        }
    }
}

/// Without references: a motion of other size is learned, not taken for divergence, if learning only sees its error.
#[test]
fn an_error_that_jumps_and_shrinks_is_no_divergence() {
    let mut repetitive = made(true).take_repetitive().unwrap();
    let error = |k: usize, size: f64| size * sine(k);
    for period in 0..40_i32 {
        // Half a period of a larger error, and then it is learned away.
        let size = if period < 10 { 1e-3 } else { 0.7_f64.powi(period - 11).min(1.0) };
        for k in 0..PERIOD {
            let begun = period != 10 || k > PERIOD / 2;
            repetitive.step(error(k, if begun { size } else { 1e-3 }));
        }
        assert_eq!(repetitive.divergence_count(), 0, "{period}");
    }
    for period in 0..3_i32 {
        assert_eq!(repetitive.divergence_count(), 0, "{period}");
        (0..PERIOD).for_each(|k| _ = repetitive.step(error(k, 1e-3 * 2_f64.powi(period))));
    }
    assert_eq!((repetitive.divergence_count(), repetitive.phase()), (1, LearningPhase::Fading));
}

/// An error that doubles with its reference is no divergence, one that doubles without is.
#[test]
fn an_error_that_a_reference_explains_is_no_divergence() {
    for (explained, expected) in [(true, 0), (false, 1)] {
        let mut repetitive = made(true).take_repetitive().unwrap();
        for period in 0..14_i32 {
            let size = 1e-3 * 2_f64.powi((period - 6).max(0));
            for k in 0..PERIOD {
                let reference = sine(k) * if explained { size } else { 1e-3 };
                repetitive.step_with(reference, 0.5 * size * sine(k));
            }
        }
        assert_eq!(repetitive.divergence_count(), expected);
    }
}

/// An error of half the swing that comes at once needs no second look.
#[test]
fn a_stage_that_is_thrown_about_is_seen_at_once() {
    let mut repetitive = made(true).take_repetitive().unwrap();
    for period in 0..7 {
        assert_eq!(repetitive.divergence_count(), 0);
        let size = if period < 6 { 0.01 } else { 0.6 };
        (0..PERIOD).for_each(|k| _ = repetitive.step_with(sine(k), size * sine(k)));
    }
    assert_eq!(repetitive.divergence_count(), 1);
}

/// A reference of ever other size explains errors up to its swing, not more.
#[test]
fn a_reference_that_always_changes_hides_no_divergence_beyond_its_swing() {
    let mut repetitive = made(true).take_repetitive().unwrap();
    let mut seen = 0.0;
    for period in 0..40_i32 {
        let (size, error) = (if period % 2 == 0 { 1.0 } else { 0.2 }, 0.01 * 1.2_f64.powi(period));
        (0..PERIOD).for_each(|k| _ = repetitive.step_with(size * sine(k), error * sine(k)));
        if repetitive.divergence_count() > 0 {
            seen = error;
            break;
        }
    }
    assert!((1.0..9.0).contains(&seen), "{seen}");
}

/// Learning that has diverged, `beyond` samples after that.
fn diverged(beyond: usize) -> (StageController, Bench) {
    let (mut controller, mut bench) = (made(true), Bench::new(0.7 * FREQUENCY, 0.0, 1));
    for _ in 0..80 {
        bench.period(&mut controller, sine);
        if divergences(&controller) > 0 {
            break;
        }
    }
    for k in 0..beyond {
        bench.position = bench.plant.advance(controller.step(sine(k).into(), bench.position));
    }
    (controller, bench)
}

/// The correction goes to zero, and learning begins anew when it is told to.
#[test]
fn what_was_learned_fades_out_and_is_learned_anew() {
    let (mut controller, mut bench) = diverged(0);
    for k in 0..2 * PERIOD {
        assert_eq!(phase(&controller), LearningPhase::Fading);
        bench.position = bench.plant.advance(controller.step(sine(k).into(), bench.position));
        let now = controller.repetitive().unwrap().peek();
        assert!(k < PERIOD - 1 || now == 0.0, "{k}: {now}");
    }
    for _ in 0..2 {
        bench.period(&mut controller, sine);
    }
    assert_eq!(phase(&controller), LearningPhase::Stopped);
    assert!(controller.restart_learning());
    assert_eq!((phase(&controller), divergences(&controller)), (LearningPhase::Learning, 1));
    // Another stage on the bench, which is that of the model.
    let mut bench = Bench::new(FREQUENCY, 0.0, 1);
    let errors: Vec<f64> = (0..40).map(|_| bench.period(&mut controller, sine)).collect();
    assert!(errors[39] < 0.3 * errors[1], "{errors:?}");
    assert_eq!((phase(&controller), divergences(&controller)), (LearningPhase::Learning, 1));
    // In the middle of learning it fades out first.
    controller.restart_learning();
    assert_eq!(phase(&controller), LearningPhase::Fading);
    let after: Vec<f64> = (0..40).map(|_| bench.period(&mut controller, sine)).collect();
    assert_eq!((phase(&controller), divergences(&controller)), (LearningPhase::Learning, 1));
    assert!(after[3] > 0.8 * errors[1] && after[39] < 0.3 * errors[1], "{after:?}");
    controller.reset(None).unwrap();
    assert_eq!(divergences(&controller), 0);
    assert!(!made(false).restart_learning());
}

/// Neither where learning has diverged nor where it is told to begin anew.
#[test]
fn what_was_learned_fades_out_without_a_jump() {
    let correction = |controller: &StageController| controller.repetitive().unwrap().peek();
    for (share, restarted) in [(0.7, false), (0.8, false), (1.3, false), (1.0, true)] {
        let (mut controller, mut bench) = (made(true), Bench::new(share * FREQUENCY, 0.0, 1));
        let (mut steps, mut last, mut beginning) = (Vec::new(), 0.0, None);
        for k in 0..80 * PERIOD {
            if restarted && k == 10 * PERIOD + PERIOD / 3 {
                controller.restart_learning();
            }
            let now = correction(&controller);
            steps.push(f64::abs(now - last));
            last = now;
            if beginning.is_none() && phase(&controller) == LearningPhase::Fading {
                beginning = Some(k);
            }
            if beginning.is_some_and(|beginning| k == beginning + 2 * PERIOD - 1) {
                break;
            }
            bench.position = bench.plant.advance(controller.step(sine(k % PERIOD).into(), bench.position));
        }
        let (before, after) = steps.split_at(beginning.unwrap());
        let largest = |steps: &[f64]| steps.iter().fold(0.0, |most: f64, step| most.max(*step));
        let usual = largest(&before[before.len() - PERIOD..]);
        // What diverges grows on for the period in which it fades.
        assert!(
            largest(&after[..3]) < 1.5 * usual && largest(after) < 3.0 * usual,
            "{share}: {:?}, {usual}",
            &after[..3]
        );
    }
}

/// What swings by less than the errors says nothing of how far the stage is thrown.
#[test]
fn a_reference_that_swings_by_rounding_ends_nothing() {
    let mut repetitive = made(true).take_repetitive().unwrap();
    for k in 0..70 * PERIOD {
        // A knock in one period.
        let size = if k / PERIOD == 60 { 4e-3 } else { 1e-3 };
        let reference = if k % 2 == 0 { 10.0 } else { 10.0 + 2e-15 };
        repetitive.step_with(reference, size * sine(k * 7 % PERIOD));
    }
    assert_eq!((repetitive.divergence_count(), repetitive.phase()), (0, LearningPhase::Learning));
}

/// In every phase, as text and as bytes.
#[test]
fn a_state_of_any_phase_goes_on_bit_for_bit() {
    let phases =
        [(0, LearningPhase::Fading), (PERIOD / 2, LearningPhase::Fading), (4 * PERIOD, LearningPhase::Stopped)];
    for (beyond, expected) in phases {
        for restarted in [false, true] {
            let (mut controller, mut bench) = diverged(beyond);
            assert_eq!(phase(&controller), expected);
            if restarted {
                controller.restart_learning();
            }
            let state = controller.state();
            let text = serde_json::to_string(&state).unwrap();
            let mut twins = [made(true), made(true)];
            twins[0].set_state(&serde_json::from_str(&text).unwrap()).unwrap();
            twins[1].set_state(&StageControllerState::from_bytes(&state.to_bytes()).unwrap()).unwrap();
            for k in 0..5 * PERIOD {
                let drive = controller.peek(sine(k).into(), bench.position);
                for twin in &mut twins {
                    assert_eq!(twin.step(sine(k).into(), bench.position).to_bits(), drive.to_bits(), "{k}");
                }
                assert_eq!(controller.step(sine(k).into(), bench.position).to_bits(), drive.to_bits());
                bench.position = bench.plant.advance(drive);
            }
            assert_eq!(twins[0].state(), controller.state());
            assert_eq!(twins[1].state(), controller.state());
        }
    }
}

#[test]
fn a_state_that_cannot_be_is_refused_by_name() {
    let mut repetitive = made(true).take_repetitive().unwrap();
    (0..1000).for_each(|k| _ = repetitive.step_with(sine(k), 0.1 * sine(k)));
    let saved = repetitive.state();
    let mut refused = |change: fn(&mut RepetitiveState)| {
        let mut torn = saved.clone();
        change(&mut torn);
        let message = repetitive.set_state(&torn).unwrap_err().to_string();
        assert_eq!(repetitive.state(), saved);
        message
    };
    let message = refused(|torn| torn.supervision.fading = 1 << 30);
    assert!(message.starts_with("state.supervision.fading: expected at most as many samples"), "{message}");
    let message = refused(|torn| torn.supervision.stopped = true);
    assert!(message.starts_with("state.corrections[") && message.contains("expected 0, as learning"), "{message}");
    let message = refused(|torn| torn.supervision.references[3] = f64::NAN);
    assert!(message.starts_with("state.supervision.references[3]: expected a finite number"), "{message}");
    let message = refused(|torn| torn.supervision.references.truncate(3));
    assert!(message.starts_with("state.supervision.references: expected as many numbers"), "{message}");
    let message = refused(|torn| torn.supervision.supervisor.samples = [PERIOD; 2]);
    assert!(message.starts_with("state.supervision.supervisor.samples: expected fewer samples"), "{message}");
    let message = refused(|torn| torn.supervision.supervisor.best = Some(-1.0));
    assert!(message.starts_with("state.supervision.supervisor[5]: expected a number >= 0"), "{message}");
    let message = refused(|torn| torn.supervision.supervisor.deviations[0] = f64::NAN);
    assert!(message.starts_with("state.supervision.supervisor[1]: expected a finite number"), "{message}");
}
