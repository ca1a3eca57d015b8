//! Links only if the hot path cannot panic: see Cargo.toml. Run, it calls each function once.

mod control;
mod duhem;
mod embedded;
mod several;

use std::hint::black_box;

use hysteresis_core::{
    AntiWindup, Biquad, Bracket, Command, CompiledModel, ControllerOptions, CreepTerms, Duhem, Error, FeedForward,
    Filter, Forward, HybridController, Inverse, Law, LoopShiftTerms, Mode, ModifiedPrandtlIshlinskii, Offsets,
    PiecewiseLinearMap, Preview, Process, QuasiStatic, QuasiStaticForward, QuasiStaticInverse, Ratios,
    RelaxingPlayTerms, Sections, SlowGainTerms, StreamArray,
};
use no_panic::no_panic;

#[no_panic]
#[inline(never)]
fn forward_step(stream: &mut Forward, sample: f64) -> f64 {
    stream.step(sample)
}

#[no_panic]
#[inline(never)]
fn forward_peek(stream: &Forward, sample: f64) -> f64 {
    stream.peek(sample)
}

#[no_panic]
#[inline(never)]
fn reset(stream: &mut impl Process) {
    stream.reset();
}

#[no_panic]
#[inline(never)]
fn run(stream: &mut impl Process, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    stream.run(samples, output)
}

#[no_panic]
#[inline(never)]
fn inverse_step(stream: &mut Inverse, sample: f64) -> f64 {
    stream.step(sample)
}

#[no_panic]
#[inline(never)]
fn inverse_peek(stream: &Inverse, sample: f64) -> f64 {
    stream.peek(sample)
}

#[no_panic]
#[inline(never)]
fn array_step(array: &mut StreamArray<Inverse>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    array.step(samples, output)
}

#[no_panic]
#[inline(never)]
fn array_run(array: &mut StreamArray<Inverse>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    array.run(samples, output)
}

#[no_panic]
#[inline(never)]
fn array_peek(array: &StreamArray<Inverse>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    array.peek(samples, output)
}

#[no_panic]
#[inline(never)]
fn forward_array_step(array: &mut StreamArray<Forward>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    array.step(samples, output)
}

#[no_panic]
#[inline(never)]
fn forward_array_run(array: &mut StreamArray<Forward>, samples: &[f64], output: &mut [f64]) -> Result<(), Error> {
    array.run(samples, output)
}

#[no_panic]
#[inline(never)]
fn controller_step(controller: &mut HybridController, command: Command, measurement: f64) -> f64 {
    controller.step(command, measurement)
}

#[no_panic]
#[inline(never)]
fn controller_peek(controller: &HybridController, command: Command, measurement: f64) -> f64 {
    controller.peek(command, measurement)
}

#[no_panic]
#[inline(never)]
fn controller_plan(controller: &mut HybridController, command: Command, measurement: f64) -> f64 {
    controller.plan(command, measurement)
}

#[no_panic]
#[inline(never)]
fn controller_commit(controller: &mut HybridController) -> bool {
    controller.commit()
}

#[no_panic]
#[inline(never)]
fn controller_changes(controller: &mut HybridController, mode: Mode, kp: f64, filters: &Sections) -> Result<(), Error> {
    controller.hold();
    controller.set_mode(mode)?;
    controller.release();
    controller.set_filters(filters)?;
    controller.set_gains(kp, 0.1)
}

#[no_panic]
#[inline(never)]
fn controller_restarts(controller: &mut HybridController, drive: f64) -> Result<(), Error> {
    controller.start_at(drive)?;
    controller.reset();
    controller.reset_at(drive)
}

#[no_panic]
#[inline(never)]
fn controller_run(controller: &mut HybridController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), Error> {
    controller.run(x, y, drives)
}

#[no_panic]
#[inline(never)]
fn filter(filter: &mut Filter, sample: f64) -> (f64, f64) {
    (filter.peek(sample), filter.step(sample))
}

#[no_panic]
#[inline(never)]
fn controller_stop(controller: &mut HybridController, rate: f64, rest_drive: f64) -> Result<(), Error> {
    controller.stop(rate, rest_drive)
}

#[no_panic]
#[inline(never)]
fn controller_follow(controller: &mut HybridController, drives: &[f64]) -> Result<(), Error> {
    controller.follow(drives)
}

#[no_panic]
#[inline(never)]
fn quasi_static_forward(stream: &mut QuasiStaticForward, sample: f64) -> (f64, f64) {
    (stream.peek(sample), stream.step(sample))
}

#[no_panic]
#[inline(never)]
fn quasi_static_settle(stream: &mut QuasiStaticForward, sample: f64) -> f64 {
    stream.settle(sample)
}

#[no_panic]
#[inline(never)]
fn quasi_static_inverse(stream: &mut QuasiStaticInverse, sample: f64) -> (f64, f64, f64) {
    (stream.peek(sample), stream.step(sample), stream.follow_drive(sample))
}

#[no_panic]
#[inline(never)]
fn inverse_follow(stream: &mut Inverse, drives: &[f64]) -> Result<(), Error> {
    stream.follow(drives)
}

#[no_panic]
#[inline(never)]
fn bracket_step(bracket: &mut Bracket, sample: f64) -> (f64, f64) {
    bracket.step(sample)
}

fn quasi_static(compiled: &CompiledModel, samples: &[f64]) -> Result<(), Error> {
    let map = || PiecewiseLinearMap::new(&[-1.0, 0.0, 2.0], &[-2.0, 0.0, 1.0]);
    let creep = CreepTerms::new(&[0.1, 0.01], &[0.9, 0.99])?;
    let shift = LoopShiftTerms::new(0.0, 500.0, [-0.2, 0.1], 0.5, 0.9)?;
    let stage = QuasiStatic::new(compiled).with_input_map(map()?).with_output_map(map()?).with_creep(creep);
    let gain = SlowGainTerms::new(500.0, -0.1, 0.0, 0.9)?;
    let plays = RelaxingPlayTerms::new(&[0.0, 90.0], 0.0, &[0.9, 0.99], &[vec![1e-4; 2], vec![2e-4; 2]])?;
    let stage = stage
        .with_loop_shift(shift)
        .with_relaxing_plays(plays)
        .with_slow_gain(gain)
        .with_duhem(Duhem::from_bouc_wen(0.1, 0.02, 0.9, 0.4)?);
    let (mut forward, mut inverse) = (stage.forward(), stage.inverse(Some((-500.0, 500.0)))?);
    let mut bracket = Bracket::new(compiled, (-500.0, 500.0))?;
    for sample in samples {
        black_box(quasi_static_forward(&mut forward, *sample));
        black_box(quasi_static_settle(&mut forward, *sample));
        black_box(quasi_static_inverse(&mut inverse, *sample));
        black_box(bracket_step(&mut bracket, *sample));
    }
    let mut output = vec![0.0; samples.len()];
    run(&mut forward, samples, &mut output)?;
    run(&mut inverse, samples, &mut output)?;
    black_box(output);
    reset(&mut forward);
    reset(&mut inverse);
    Ok(())
}

fn controllers(compiled: &CompiledModel, filters: &Sections) -> Result<(), Error> {
    let limits = (-500.0, 500.0);
    let set = ControllerOptions { slew: Some(1e5), ..ControllerOptions::new(5.0, 6e3, 1e-4, limits) };
    let conditional =
        ControllerOptions { measurement_range: Some((-5.0, 5.0)), max_measurement_step: Some(1.0), ..set };
    let tracking = AntiWindup::BackCalculation { tracking_time: None };
    let back_calculation = ControllerOptions { anti_windup: tracking, max_missing: 1, ..conditional };
    let creep = CreepTerms::new(&[0.1], &[0.9])?;
    let preview = Preview::new(&[-1.0, 2.0, 0.5], 1)?.smoothed(&[0.25, 0.5, 0.25])?;
    let cases = [
        (FeedForward::from(Inverse::new(compiled, Some(limits))?), Some(preview), conditional),
        (Forward::new(compiled).into(), None, back_calculation),
        (FeedForward::Given, None, ControllerOptions { law: Law::Incremental, ..conditional }),
        (FeedForward::None, None, ControllerOptions { filters: *filters, ..set }),
        (QuasiStatic::new(compiled).with_creep(creep).inverse(Some(limits))?.into(), None, set),
    ];
    for (source, preview, options) in black_box(cases) {
        let mut controller = HybridController::new(source, preview, &options)?;
        several::axes(&controller)?;
        for x in black_box([0.0, f64::NAN, 3.0, -1.0, 1e90, f64::INFINITY, 2.0]) {
            for measurement in black_box([x, 0.0, f64::NAN, f64::NAN, f64::NAN]) {
                let command = Command { target: Some(x), feedforward: Some(2.0), ..x.into() };
                black_box(controller_peek(&controller, x.into(), measurement));
                black_box(controller_step(&mut controller, x.into(), measurement));
                black_box(controller_plan(&mut controller, command, measurement));
                black_box(controller_commit(&mut controller));
            }
            controller_changes(&mut controller, Mode::Feedforward, 2.0, &Sections::default())?;
            black_box(controller_step(&mut controller, x.into(), 1.0));
            controller_stop(&mut controller, 1e5, 10.0)?;
            for _ in 0..3 {
                black_box(controller_peek(&controller, x.into(), x));
                black_box(controller_step(&mut controller, x.into(), x));
                black_box(controller_plan(&mut controller, x.into(), x));
                black_box(controller_commit(&mut controller));
            }
            _ = black_box(controller_follow(&mut controller, &[x, 1.0]));
            controller_changes(&mut controller, Mode::Run, 2.0, filters)?;
            controller_run(&mut controller, &[x, 1.0], &[0.5, x], &mut [0.0; 2])?;
            controller_restarts(&mut controller, 10.0)?;
        }
    }
    Ok(())
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let weights: Vec<f64> = (0..20).map(|i| if i == 0 { 4.3e-3 } else { 2e-4 }).collect();
    let thresholds: Vec<f64> = (0..20).map(|i| 25.0 * f64::from(i)).collect();
    let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default())?;
    let compiled = CompiledModel::new(&model);
    let zeros = vec![0.0; compiled.operators()];
    let samples = black_box([0.0, 3.0, -1.0, 2.0, f64::NAN, 99.0]);
    let mut output = [0.0; 6];
    for mut stream in [Forward::new(&compiled), Forward::with_initial(&compiled, &zeros)?] {
        for sample in samples {
            black_box((forward_peek(&stream, sample), forward_step(&mut stream, sample)));
        }
        run(&mut stream, &samples, &mut output)?;
        reset(&mut stream);
    }
    for mut stream in [Inverse::new(&compiled, None)?, Inverse::with_initial(&compiled, Some((-500.0, 500.0)), &zeros)?]
    {
        for sample in samples {
            black_box((inverse_peek(&stream, sample), inverse_step(&mut stream, sample)));
        }
        run(&mut stream, &samples, &mut output)?;
        inverse_follow(&mut stream, &samples[..4])?;
        reset(&mut stream);
    }
    quasi_static(&compiled, &samples)?;
    let sections = [Biquad::new([0.98, -1.7, 0.95], [-1.7, 0.93])?, Biquad::new([0.1, 0.0, 0.0], [-0.9, 0.0])?];
    let mut filtered = Filter::new(&sections)?;
    for sample in samples {
        black_box(filter(&mut filtered, sample));
    }
    run(&mut filtered, &samples, &mut output)?;
    reset(&mut filtered);
    controllers(&compiled, &Sections::new(&sections)?)?;
    several::actuators(&compiled)?;
    several::led()?;
    let models = [compiled.clone(), compiled.clone(), compiled];
    let mut actuators = StreamArray::forward(&models);
    forward_array_step(&mut actuators, &samples[..3], &mut output[..3])?;
    forward_array_run(&mut actuators, &samples, &mut output)?;
    let mut array = StreamArray::inverse(&models, None)?;
    array_peek(&array, &samples[..3], &mut output[..3])?;
    array_step(&mut array, &samples[..3], &mut output[..3])?;
    array_run(&mut array, &samples, &mut output)?;
    embedded::run(&model)?;
    duhem::run()?;
    control::run(&model)
}
