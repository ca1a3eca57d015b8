//! What the report says of learning: what happened in this run, and nothing else.

use core::f64::consts::TAU;

use crate::setup::{DT, Scripted, controller, run_with, said, settings};
use hysteresis_control::StageController;
use hysteresis_control::learning::{LearningPhase, RepetitiveControl, RepetitiveOptions};
use hysteresis_realtime::clock::SimulatedClock;
use hysteresis_realtime::{Report, Settings};
use hysteresis_simulate::paper::Benchmark;

const PERIOD: u32 = 200;

/// A controller whose learning has seen so many periods of the sine, with errors (um) that double from the fifth one
/// on.
fn learning(periods: i32) -> StageController {
    let controller = controller();
    let stage = Benchmark::A1.stage();
    let options = controller.controller().options();
    let around = stage.feedback_loop(DT, (options.kp, options.ki), options.filters).unwrap();
    let mut repetitive = RepetitiveControl::new(&around, PERIOD as usize, &RepetitiveOptions::default()).unwrap();
    for period in 0..periods {
        let error = 1e-3 * 2_f64.powi((period - 4).max(0));
        for k in 0..PERIOD {
            let wave = (TAU * f64::from(k) / f64::from(PERIOD)).sin();
            repetitive.step_with(2.0 * wave, error * wave);
        }
    }
    controller.with_repetitive(repetitive).unwrap()
}

/// Until learning has diverged: it is fading out then.
fn diverged() -> StageController {
    let found = learning(9);
    assert_eq!(found.repetitive().map(|now| (now.divergence_count(), now.phase())), Some((1, LearningPhase::Fading)));
    found
}

/// So many samples.
fn report(controller: StageController, samples: f64) -> (Report, Vec<String>) {
    let settings = Settings { seconds: Some(samples * DT), ..settings() };
    let report = run_with(SimulatedClock::new(), controller, Scripted::new(), settings).report;
    let said = said(&report, "learning: ").into_iter().map(str::to_owned).collect();
    (report, said)
}

#[test]
fn a_divergence_in_the_run_is_told() {
    let (report, said) = report(learning(8), 3000.0);
    let found = report.learning.unwrap();
    assert_eq!((found.divergence_count, found.phase), (1, LearningPhase::Stopped));
    assert_eq!(said.len(), 1);
    assert!(said[0].contains("it diverged and was stopped: the error grew"), "{said:?}");
}

#[test]
fn a_divergence_before_the_run_is_told_as_one_of_before() {
    for (samples, phase) in [(100.0, LearningPhase::Fading), (3000.0, LearningPhase::Stopped)] {
        let (report, said) = report(diverged(), samples);
        assert_eq!(report.learning.map(|found| found.phase), Some(phase));
        assert_eq!(
            said,
            ["learning: it had diverged before this run, and stays stopped until it is told to begin anew"]
        );
    }
}

/// Told to begin anew in the middle of learning or while it fades out, after an earlier divergence: it fades, and has
/// not diverged.
#[test]
fn learning_that_fades_to_begin_anew_has_not_diverged() {
    let [mut again, mut at_once] = [diverged(), diverged()];
    // Until nothing is left of what was learned.
    for _ in 0..3 * PERIOD {
        let _ = again.step(0.0.into(), 0.0);
    }
    assert!(again.restart_learning());
    assert_eq!(again.repetitive().map(RepetitiveControl::phase), Some(LearningPhase::Learning));
    for made in [&mut again, &mut at_once] {
        assert!(made.restart_learning());
    }
    for made in [again, at_once] {
        let (report, said) = report(made, 100.0);
        let found = report.learning.unwrap();
        assert_eq!((found.divergence_count, found.phase), (1, LearningPhase::Fading));
        assert!(said.is_empty(), "{said:?}");
    }
}
