//! What runs beside the controller of the core: model of the stage, observer, repetitive control and linear blocks.

use std::error::Error;
use std::hint::black_box;

use hysteresis_control::learning::{FeedbackLoop, RepetitiveControl, RepetitiveOptions};
use hysteresis_control::linear::{
    Block, Creep, CreepBlock, Delay, DelayBlock, FirstOrder, LinearBlock, LinearDynamics, SecondOrder, Stream,
};
use hysteresis_control::stage::{FeedForwardKind, Stage, StageForward, StageParts};
use hysteresis_control::{Observer, ObserverOptions, StageController};
use hysteresis_core::{Command, ControllerOptions, Error as CoreError, ModifiedPrandtlIshlinskii, Process, Sections};
use no_panic::no_panic;

#[no_panic]
#[inline(never)]
fn linear_block(block: &mut LinearBlock, input: f64) -> [f64; 4] {
    [block.output(input), block.look_ahead(input), block.step(input), block.advance(input)]
}

#[no_panic]
#[inline(never)]
fn linear_settle(block: &mut LinearBlock, level: f64) -> f64 {
    block.settle(level)
}

#[no_panic]
#[inline(never)]
fn delay_block(block: &mut DelayBlock, input: f64) -> [f64; 4] {
    [block.output(input), block.look_ahead(input), block.step(input), block.advance(input)]
}

#[no_panic]
#[inline(never)]
fn creep_block(block: &mut CreepBlock, input: f64) -> [f64; 4] {
    [block.output(input), block.look_ahead(input), block.step(input), block.advance(input)]
}

#[no_panic]
#[inline(never)]
fn linear_stream(stream: &mut Stream<LinearBlock>, input: f64) -> (f64, f64) {
    (stream.peek(input), stream.step(input))
}

#[no_panic]
#[inline(never)]
fn stage_step(stage: &mut StageForward, drive: f64) -> (f64, f64) {
    (stage.peek(drive), stage.step(drive))
}

#[no_panic]
#[inline(never)]
fn stage_advance(stage: &mut StageForward, drive: f64) -> f64 {
    stage.advance(drive)
}

#[no_panic]
#[inline(never)]
fn stage_settle(stage: &mut StageForward, drive: f64) -> f64 {
    stage.settle(drive)
}

#[no_panic]
#[inline(never)]
fn observer_step(observer: &mut Observer, drive: f64, measurement: f64) -> f64 {
    observer.step(drive, measurement)
}

#[no_panic]
#[inline(never)]
fn observer_run(observer: &mut Observer, drives: &[f64], y: &[f64], positions: &mut [f64]) -> Result<(), CoreError> {
    observer.run(drives, y, positions)
}

#[no_panic]
#[inline(never)]
fn observer_reset(observer: &mut Observer) {
    observer.reset();
}

#[no_panic]
#[inline(never)]
fn repetitive_step(repetitive: &mut RepetitiveControl, error: f64) -> f64 {
    repetitive.step_with(2.0 * error, error)
}

#[no_panic]
#[inline(never)]
fn repetitive_restart(repetitive: &mut RepetitiveControl) {
    repetitive.restart();
}

#[no_panic]
#[inline(never)]
fn repetitive_reset(repetitive: &mut RepetitiveControl) {
    repetitive.reset();
}

#[no_panic]
#[inline(never)]
fn whole_step(controller: &mut StageController, command: Command, measurement: f64) -> [f64; 3] {
    let (peeked, planned) = (controller.peek(command, measurement), controller.plan(command, measurement));
    controller.commit();
    [peeked, planned, controller.step(command, measurement)]
}

#[no_panic]
#[inline(never)]
fn whole_run(controller: &mut StageController, r: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), CoreError> {
    controller.run(r, y, drives)
}

/// Takes every path of the above once.
pub(crate) fn run(model: &ModifiedPrandtlIshlinskii) -> Result<(), Box<dyn Error>> {
    let samples = black_box([0.0, 3.0, -1.0, f64::NAN, 90.0, 1e90, f64::INFINITY, 2.0]);
    let dynamics = LinearDynamics::from(SecondOrder::new(800.0, 0.02)?).with_dead_time(2.5e-4)?;
    let mut stream = Stream::new(dynamics.block(1e-4)?, 0.0);
    let mut delay = Delay::new(1.25e-4)?.block(1e-4)?;
    let mut creep = Creep::new(&[0.01, 0.02], &[0.1, 1.0])?.block(1e-4)?;
    for sample in samples {
        black_box((delay_block(&mut delay, sample), creep_block(&mut creep, sample)));
        black_box(linear_stream(&mut stream, sample));
    }
    crate::run(&mut stream, &samples, &mut [0.0; 8])?;
    crate::reset(&mut stream);
    for mut block in [dynamics.block(1e-4)?, LinearDynamics::none().block(1e-4)?] {
        for sample in samples {
            black_box((linear_block(&mut block, sample), linear_settle(&mut block, sample)));
        }
    }
    stages(model, &dynamics, &samples)?;
    let open = FeedbackLoop { kp: 0.0, ki: 0.0, filters: Sections::default(), slope: 1.0, dynamics, dt: 1e-4 };
    for limit in black_box([None, Some(0.5)]) {
        let options = RepetitiveOptions { limit, ..RepetitiveOptions::new(100.0) };
        let mut repetitive = RepetitiveControl::new(&open, 100, &options)?;
        for sample in samples.iter().cycle().take(1000) {
            black_box(repetitive_step(&mut repetitive, *sample));
        }
        whole(model, &repetitive, &samples)?;
        repetitive_restart(&mut repetitive);
        for sample in samples.iter().cycle().take(1000) {
            black_box(repetitive_step(&mut repetitive, *sample));
        }
        repetitive_reset(&mut repetitive);
    }
    Ok(())
}

fn whole(
    model: &ModifiedPrandtlIshlinskii,
    repetitive: &RepetitiveControl,
    samples: &[f64; 8],
) -> Result<(), Box<dyn Error>> {
    let stage = Stage::new(StageParts { limits: Some((-50.0, 50.0)), ..StageParts::new(model.clone()) })?;
    let observer = Observer::new(&stage, 1e-4, &ObserverOptions { noise: 0.016, drift: 0.5 })?;
    let plain = stage.controller(FeedForwardKind::Inverse, &ControllerOptions::new(1.0, 10.0, 1e-4, (-50.0, 50.0)))?;
    let observed = StageController::from(plain.clone()).with_observer(observer)?;
    let both = observed.clone().with_repetitive(repetitive.clone())?;
    for mut controller in black_box([plain.into(), observed, both]) {
        for reference in samples {
            for measurement in samples {
                let command = Command { correction: 0.5, ..(*reference).into() };
                black_box(whole_step(&mut controller, command, *measurement));
            }
        }
        let mut drives = [0.0; 8];
        whole_run(&mut controller, samples, samples, &mut drives)?;
        black_box(drives);
    }
    Ok(())
}

fn stages(
    model: &ModifiedPrandtlIshlinskii,
    dynamics: &LinearDynamics,
    samples: &[f64; 8],
) -> Result<(), Box<dyn Error>> {
    let modes = dynamics.clone().with_dead_time(0.0)?;
    let parts = StageParts { dynamics: modes, dead_time: 2.5e-4, ..StageParts::new(model.clone()) };
    let plain = StageParts { limits: Some((-50.0, 50.0)), ..parts };
    let amplified = StageParts { amplifier: Some(FirstOrder::new(279.0)?), ..plain.clone() };
    let crept = StageParts { creep: Some(Creep::new(&[0.01], &[0.1])?), ..plain.clone() };
    for parts in black_box([plain, amplified, crept]) {
        let stage = Stage::new(parts)?;
        let mut forward = stage.forward(1e-4)?;
        let mut observer = Observer::new(&stage, 1e-4, &ObserverOptions { noise: 0.016, drift: 0.5 })?;
        for sample in samples {
            black_box((stage_step(&mut forward, *sample), stage_advance(&mut forward, *sample)));
            black_box(stage_settle(&mut forward, *sample));
            for measurement in samples {
                black_box(observer_step(&mut observer, *sample, *measurement));
            }
        }
        let mut positions = [0.0; 8];
        crate::run(&mut forward, samples, &mut positions)?;
        crate::reset(&mut forward);
        observer_run(&mut observer, samples, samples, &mut positions)?;
        observer_reset(&mut observer);
        black_box(positions);
    }
    Ok(())
}
