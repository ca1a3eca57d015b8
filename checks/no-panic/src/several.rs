//! What runs many actuators at once: controllers of several axes and of an array.

use std::hint::black_box;

use hysteresis_control::multi_axis::{
    Matrices, MultiAxisStage, MultiAxisStageController, ScalarOperator, TrackingOptions,
};
use hysteresis_core::{
    ArrayController, ArrayOptions, ArraySample, BracketArray, CompiledModel, ControllerOptions, Duhem, Error,
    HybridController, Mode, MultiAxisController, StreamArray,
};
use nalgebra::DMatrix;
use no_panic::no_panic;

#[no_panic]
#[inline(never)]
fn axes_step(axes: &mut MultiAxisController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), Error> {
    axes.peek(x.into(), y, drives)?;
    axes.step(x.into(), y, drives)
}

#[no_panic]
#[inline(never)]
fn axes_plan(axes: &mut MultiAxisController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<bool, Error> {
    axes.plan(x.into(), y, drives)?;
    Ok(axes.commit())
}

#[no_panic]
#[inline(never)]
fn axes_run(axes: &mut MultiAxisController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), Error> {
    axes.run(x, y, drives)
}

#[no_panic]
#[inline(never)]
fn axes_changes(axes: &mut MultiAxisController, mode: Mode, rest: &[f64]) -> Result<(), Error> {
    axes.hold();
    axes.set_mode(mode)?;
    axes.stop(1e4, rest)?;
    axes.release();
    axes.start_at(rest)
}

#[no_panic]
#[inline(never)]
fn axes_reset(axes: &mut MultiAxisController) {
    axes.reset();
}

/// Takes every path of the controller of several axes once.
pub(crate) fn axes(controller: &HybridController) -> Result<(), Error> {
    let mut axes = MultiAxisController::new(vec![controller.clone(); 2], Some(&[1.0, 0.5, 0.0, 1.0]))?;
    for x in black_box([[0.0, f64::NAN], [3.0, -1.0], [1e90, f64::INFINITY]]) {
        let mut drives = [0.0; 2];
        axes_step(&mut axes, &x, &[x[1], 0.5], &mut drives)?;
        black_box(axes_plan(&mut axes, &x, &[0.5, x[0]], &mut drives)?);
        axes_run(&mut axes, &x, &x, &mut drives)?;
        axes_changes(&mut axes, black_box(Mode::Feedforward), &[10.0, -20.0])?;
    }
    axes_reset(&mut axes);
    Ok(())
}

#[no_panic]
#[inline(never)]
fn led_step(axes: &mut MultiAxisStageController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), Error> {
    axes.peek(x.into(), y, drives)?;
    axes.step(x.into(), y, drives)
}

#[no_panic]
#[inline(never)]
fn led_plan(axes: &mut MultiAxisStageController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<bool, Error> {
    axes.plan(x.into(), y, drives)?;
    Ok(axes.commit())
}

#[no_panic]
#[inline(never)]
fn led_run(axes: &mut MultiAxisStageController, x: &[f64], y: &[f64], drives: &mut [f64]) -> Result<(), Error> {
    axes.run(x, y, drives)
}

/// Takes every path of a controller that a stage of several axes leads once.
pub(crate) fn led() -> Result<(), Error> {
    let diagonal = |x: f64| DMatrix::from_diagonal_element(2, 2, x);
    let matrices = Matrices {
        a: diagonal(0.5),
        b: diagonal(0.4),
        bw: diagonal(0.1),
        c: diagonal(1.0),
        d: diagonal(0.0),
        cq: diagonal(0.1),
        dq: diagonal(1.0),
    };
    let duhem = ScalarOperator::duhem(Duhem::from_bouc_wen(1.0, 1.0, 0.5, 0.1)?);
    let operators = vec![ScalarOperator::plays(&[0.2], &[1.0])?, duhem];
    let stage = MultiAxisStage::new(matrices, operators, vec![0.0; 2], 1e-3)?;
    let options = ControllerOptions::new(1.0, 0.0, 1e-3, (-5.0, 5.0));
    let mut axes = stage.controller(&[options; 2], &TrackingOptions::default())?;
    for x in black_box([[0.0, f64::NAN], [3.0, -1.0], [1e90, f64::INFINITY]]) {
        let mut drives = [0.0; 2];
        led_step(&mut axes, &x, &[x[1], 0.5], &mut drives)?;
        black_box(led_plan(&mut axes, &x, &[0.5, x[0]], &mut drives)?);
        led_run(&mut axes, &x, &x, &mut drives)?;
    }
    Ok(())
}

#[no_panic]
#[inline(never)]
fn array_controller_step(
    controller: &mut ArrayController,
    sample: &ArraySample<'_>,
    drives: &mut [f64],
) -> Result<(), Error> {
    controller.step(sample, drives)
}

#[no_panic]
#[inline(never)]
fn array_controller_peek(
    controller: &mut ArrayController,
    sample: &ArraySample<'_>,
    drives: &mut [f64],
) -> Result<(), Error> {
    controller.peek(sample, drives)
}

#[no_panic]
#[inline(never)]
fn array_controller_run(
    controller: &mut ArrayController,
    block: &ArraySample<'_>,
    drives: &mut [f64],
) -> Result<(), Error> {
    controller.run(block, drives)
}

#[no_panic]
#[inline(never)]
fn array_controller_changes(controller: &mut ArrayController, rest: &[f64]) -> Result<(), Error> {
    controller.hold();
    controller.release();
    controller.set_gains(50.0, 1.0)?;
    controller.follow(rest)?;
    controller.stop(1e4, rest)
}

#[no_panic]
#[inline(never)]
fn array_controller_restarts(controller: &mut ArrayController, rest: &[f64]) -> Result<(), Error> {
    controller.reset();
    controller.reset_at(rest)
}

#[no_panic]
#[inline(never)]
fn brackets(brackets: &mut BracketArray, inputs: &[f64], low: &mut [f64], high: &mut [f64]) -> Result<(), Error> {
    brackets.follow(inputs)?;
    brackets.reset();
    brackets.step(inputs, low, high)?;
    brackets.run(inputs, low, high)
}

/// Takes every path of the controller of an array once.
pub(crate) fn actuators(compiled: &CompiledModel) -> Result<(), Error> {
    let models = [compiled.clone(), compiled.clone(), compiled.clone()];
    let set = ArrayOptions { ki: 100.0, leak: 1.0, slew: vec![1e5], ..ArrayOptions::new(1e-3) };
    let paired = ArrayOptions { neighbours: vec![(0, 1), (1, 2)], max_difference: vec![0.5], ..set.clone() };
    for options in black_box([set, ArrayOptions { reconstruction: Some(vec![0.1; 9]), ..paired }]) {
        let inverse = StreamArray::inverse(&models, Some((-500.0, 500.0))).map_err(|wrong| wrong.error)?;
        let mut controller = ArrayController::new(inverse, &options)?;
        let mut drives = [0.0; 9];
        for x in black_box([0.0, 0.0, 3.0, -1.0, f64::NAN, 1e90, 2.0, -2.0]) {
            let reference = [x, -x, 0.5 * x];
            let block = [0.1, 0.2, 0.3, x, -x, 0.5 * x, -3.0, 3.0, -3.0];
            let sample = ArraySample { measurement: Some(&reference), ..ArraySample::of(&reference) };
            let whole = ArraySample { measurement: Some(&block), ..ArraySample::of(&block) };
            array_controller_peek(&mut controller, &sample, &mut drives[..3])?;
            array_controller_step(&mut controller, &sample, &mut drives[..3])?;
            array_controller_run(&mut controller, &whole, &mut drives)?;
            array_controller_changes(&mut controller, &[10.0, -20.0, 0.0])?;
            array_controller_run(&mut controller, &ArraySample::of(&block), &mut drives)?;
            controller.release();
            array_controller_restarts(&mut controller, &[1.0, 2.0, -3.0])?;
        }
        black_box(drives);
    }
    let mut array = BracketArray::new(&models, |_| (-500.0, 500.0)).map_err(|wrong| wrong.error)?;
    let (mut low, mut high) = ([0.0; 3], [0.0; 3]);
    brackets(&mut array, &black_box([1.0, -2.0, 70.0]), &mut low, &mut high)?;
    black_box((low, high));
    Ok(())
}
