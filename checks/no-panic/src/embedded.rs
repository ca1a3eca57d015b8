//! Streams of a fixed size, in both precisions, and a controller over them.

use std::hint::black_box;

use hysteresis_core::embedded::{Forward, Inverse, Model};
use hysteresis_core::{
    Command, ControllerOptions, Error, HybridController, Mode, ModifiedPrandtlIshlinskii, Process, Real,
};
use no_panic::no_panic;

type Single<'a> = &'a Model<f32, 20>;
type Double<'a> = &'a Model<f64, 20>;

#[no_panic]
#[inline(never)]
fn forward_single(stream: &mut Forward<f32, 20, Single<'_>>, sample: f32) -> (f32, f32) {
    (stream.peek(sample), stream.step(sample))
}

#[no_panic]
#[inline(never)]
fn forward_double(stream: &mut Forward<f64, 20, Double<'_>>, sample: f64) -> (f64, f64) {
    (stream.peek(sample), stream.step(sample))
}

#[no_panic]
#[inline(never)]
fn inverse_single(stream: &mut Inverse<f32, 20, Single<'_>>, sample: f32) -> (f32, f32, f32) {
    (stream.peek(sample), stream.step(sample), stream.follow_drive(sample))
}

#[no_panic]
#[inline(never)]
fn inverse_double(stream: &mut Inverse<f64, 20, Double<'_>>, sample: f64) -> (f64, f64, f64) {
    (stream.peek(sample), stream.step(sample), stream.follow_drive(sample))
}

#[no_panic]
#[inline(never)]
fn follow(stream: &mut Inverse<f32, 20, Single<'_>>, drives: &[f32]) -> Result<(), Error> {
    stream.follow(drives)
}

#[no_panic]
#[inline(never)]
fn run_and_reset<T: Real>(stream: &mut impl Process<T>, samples: &[T], output: &mut [T]) -> Result<(), Error> {
    stream.run(samples, output)?;
    stream.reset();
    Ok(())
}

type Controller<'a> = HybridController<Inverse<f32, 20, Single<'a>>>;

#[no_panic]
#[inline(never)]
fn controller_step(controller: &mut Controller<'_>, command: Command, measurement: f64) -> (f64, f64) {
    (controller.peek(command, measurement), controller.step(command, measurement))
}

#[no_panic]
#[inline(never)]
fn controller_plan(controller: &mut Controller<'_>, command: Command, measurement: f64) -> (f64, bool) {
    (controller.plan(command, measurement), controller.commit())
}

#[no_panic]
#[inline(never)]
fn controller_changes(controller: &mut Controller<'_>, mode: Mode, kp: f64) -> Result<(), Error> {
    controller.set_mode(mode)?;
    controller.set_gains(kp, 0.1)?;
    controller.stop(1e5, 10.0)?;
    controller.release();
    controller.follow(&[1.0, 2.0])?;
    controller.start_at(3.0)?;
    controller.reset();
    Ok(())
}

/// Takes every path once.
pub(crate) fn run(model: &ModifiedPrandtlIshlinskii) -> Result<(), Error> {
    let (single, double) = (Model::<f32, 20>::try_from(model)?, Model::<f64, 20>::try_from(model)?);
    let limits = (-500.0, 500.0);
    let (mut single_forward, mut double_forward) = (Forward::new(&single), Forward::new(&double));
    let mut single_inverse = Inverse::new(&single, Some((-500.0, 500.0)))?;
    let mut double_inverse = Inverse::new(&double, Some(limits))?;
    let options = ControllerOptions { slew: Some(1e5), ..ControllerOptions::new(5.0, 6e3, 1e-4, limits) };
    let mut controller = HybridController::with_source(single_inverse.clone(), None, &options)?;
    for x in black_box([0.0_f32, 3.0, -1.0, 2.0, f32::NAN, 99.0, f32::INFINITY, -300.0]) {
        let wide = f64::from(x);
        black_box((forward_single(&mut single_forward, x), forward_double(&mut double_forward, wide)));
        black_box((inverse_single(&mut single_inverse, x), inverse_double(&mut double_inverse, wide)));
        black_box(controller_step(&mut controller, wide.into(), 0.5));
        black_box(controller_plan(&mut controller, wide.into(), wide));
        controller_changes(&mut controller, black_box(Mode::Feedforward), 2.0)?;
    }
    follow(&mut single_inverse, &black_box([1.0, -2.0]))?;
    run_and_reset(&mut single_forward, &black_box([1.0, -2.0]), &mut [0.0; 2])?;
    run_and_reset(&mut double_forward, &black_box([1.0, -2.0]), &mut [0.0; 2])?;
    run_and_reset(&mut single_inverse, &black_box([1.0, -2.0]), &mut [0.0; 2])?;
    run_and_reset(&mut double_inverse, &black_box([1.0, -2.0]), &mut [0.0; 2])
}
