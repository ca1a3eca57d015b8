//! What runs sample by sample never allocates: linear streams, learning in the loop, the observer.

use crate::support::models::actuator;
use hysteresis_control::learning::{FeedbackLoop, RepetitiveControl, RepetitiveOptions};
use hysteresis_control::linear::{Block, Creep, Delay, FirstOrder, LinearDynamics, SecondOrder, Stream};
use hysteresis_control::stage::{FeedForwardKind, LoopShift, RelaxingPlays, SlowGain, Stage, StageParts};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{ControllerOptions, Process, Sections};

#[test]
fn linear_streams_never_allocate() {
    let creep = Creep::new(&[0.01, 0.02], &[0.1, 1.0]).unwrap().block(1e-4).unwrap();
    let amplifier = LinearDynamics::from(FirstOrder::new(279.0).unwrap());
    let stage = amplifier.then(SecondOrder::new(2000.0, 0.03).unwrap()).then(Delay::new(2.4e-4).unwrap());
    runs_without_allocation(creep);
    runs_without_allocation(Delay::new(2.4e-4).unwrap().block(1e-4).unwrap());
    runs_without_allocation(stage.block(1e-4).unwrap());
}

fn runs_without_allocation(mut block: impl Block + Clone) {
    let mut stream = Stream::new(block.clone(), 0.5);
    let input: Vec<f64> = (0..1000_u32).map(|k| if k % 97 == 0 { f64::NAN } else { f64::from(k % 13) }).collect();
    let mut output = vec![0.0; input.len()];
    let count = allocations::count(|| {
        for u in &input {
            std::hint::black_box((stream.peek(*u), stream.step(*u)));
        }
        stream.reset();
        stream.run(&input, &mut output).unwrap();
        std::hint::black_box((block.look_ahead(1.0), block.advance(1.0)));
    });
    assert_eq!(count, 0);
    assert_eq!(stream.rejected(), 11);
}

#[test]
fn learning_in_the_loop_and_observation_never_allocate() {
    let dynamics = LinearDynamics::from(SecondOrder::new(400.0, 0.95).unwrap());
    let late = dynamics.clone().with_dead_time(0.5e-4).unwrap();
    let feedback =
        FeedbackLoop { kp: 60.0, ki: 6000.0, filters: Sections::default(), slope: 5e-3, dynamics: late, dt: 1e-4 };
    let mut repetitive = RepetitiveControl::new(&feedback, 100, &RepetitiveOptions::new(300.0)).unwrap();
    let parts = StageParts {
        loop_shift: Some(LoopShift::new(0.0, 500.0, [-0.2, 0.1], 0.01, 0.5).unwrap()),
        relaxing_plays: Some(RelaxingPlays::new(&[0.0, 90.0], 0.0, &[0.01], &[vec![1e-4; 2]]).unwrap()),
        slow_gain: Some(SlowGain::new(500.0, -0.02, 0.0, 1.0).unwrap()),
        duhem: Some(Box::new(hysteresis_core::Duhem::from_bouc_wen(2e-3, 0.1, 0.9, 0.4).unwrap())),
        creep: Some(Creep::new(&[0.01], &[0.1]).unwrap()),
        dynamics,
        dead_time: 1.5e-4,
        ..StageParts::new(actuator())
    };
    let stage = Stage::new(parts).unwrap();
    let mut observer = Observer::new(&stage, 1e-4, &ObserverOptions { noise: 0.016, drift: 0.5 }).unwrap();
    let count = allocations::count(|| {
        for k in 0..1000 {
            let x = if k % 97 == 0 { f64::NAN } else { f64::from(k % 13) };
            std::hint::black_box((repetitive.step(1e-3 * x), observer.step(40.0 * x, 0.1 * x)));
        }
    });
    assert_eq!((count, repetitive.rejected(), observer.rejected()), (0, 11, 11));
    repetitive.reset();
    observer.reset();
    let options = ControllerOptions::new(60.0, 6000.0, 1e-4, (-500.0, 500.0));
    let controller = stage.controller(FeedForwardKind::Preview { ahead: 6, smoothing: 0.0 }, &options).unwrap();
    let joined = StageController::from(controller).with_observer(observer).unwrap();
    let mut joined = joined.with_repetitive(repetitive).unwrap();
    let count = allocations::count(|| {
        for k in 0..1000 {
            let x = if k % 97 == 0 { f64::NAN } else { f64::from(k % 13) };
            std::hint::black_box((joined.plan(x.into(), 0.1 * x), joined.peek(x.into(), x), joined.commit()));
            std::hint::black_box(joined.step(x.into(), 0.1 * x));
        }
    });
    assert_eq!(count, 0);
}
