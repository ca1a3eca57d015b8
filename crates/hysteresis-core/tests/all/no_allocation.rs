//! `step`, `peek`, `reset` and `run` into a given slice never allocate.

use crate::support::models::{actuator, parametric_inverse};
use hysteresis_core::{
    ArrayController, ArrayInverse, ArrayOptions, ArraySample, Biquad, Command, CompiledModel, ControllerOptions,
    CreepTerms, Duhem, FeedForward, Forward, HybridController, Inverse, LoopShiftTerms, Mode, MultiAxisController,
    PiecewiseLinearMap, Preview, Process, QuasiStatic, RelaxingPlayTerms, Sections, SlowGainTerms, StreamArray,
};

/// Jumps, reversals, plateaus, samples out of reach and samples that are rejected.
fn signal() -> Vec<f64> {
    let mut samples = vec![f64::NAN, f64::INFINITY, -1e300];
    samples.extend((0..5000_u32).map(|k| 600.0 * (f64::from(k) * f64::from(k) * 1e-4).sin()));
    samples.extend((0..5000_u32).map(|k| 3.2 * (f64::from(k) * f64::from(k) * 1e-4).sin()));
    samples
}

fn slow_gain() -> SlowGainTerms {
    SlowGainTerms::new(500.0, -0.1, 0.0, 0.9).unwrap()
}

fn loop_shift() -> LoopShiftTerms {
    LoopShiftTerms::new(0.0, 500.0, [-0.2, 0.1], 0.5, 0.9).unwrap()
}

#[test]
fn the_hot_path_never_allocates() {
    let compiled = CompiledModel::new(&actuator());
    let zeros = vec![0.0; compiled.operators()];
    let limits = Some((-500.0, 500.0));
    let map = || PiecewiseLinearMap::new(&[-1.0, 0.0, 2.0], &[-2.0, 0.0, 1.0]).unwrap();
    let creep = CreepTerms::new(&[0.1, 0.01], &[0.9, 0.99]).unwrap();
    let stage = QuasiStatic::new(&compiled).with_input_map(map()).with_output_map(map()).with_creep(creep);
    let duhem = Duhem::from_bouc_wen(2e-3, 0.1, 0.9, 0.4).unwrap();
    let plays = RelaxingPlayTerms::new(&[0.0, 90.0], 0.0, &[0.9, 0.99], &[vec![1e-4; 2], vec![2e-4; 2]]).unwrap();
    let shifting = stage.clone().with_loop_shift(loop_shift()).with_slow_gain(slow_gain()).with_duhem(duhem);
    let shifting = shifting.with_relaxing_plays(plays);
    let streams: [Box<dyn Process>; 8] = [
        Box::new(shifting.forward()),
        Box::new(shifting.inverse(limits).unwrap()),
        Box::new(stage.forward()),
        Box::new(stage.inverse(limits).unwrap()),
        Box::new(Forward::new(&compiled)),
        Box::new(Inverse::new(&compiled, limits).unwrap()),
        Box::new(Forward::with_initial(&compiled, &zeros).unwrap()),
        Box::new(Inverse::with_initial(&compiled, limits, &zeros).unwrap()),
    ];
    let signal = signal();
    let mut output = vec![0.0; signal.len()];
    for mut stream in streams {
        let count = allocations::count(|| {
            for x in &signal {
                std::hint::black_box(stream.peek(*x));
                std::hint::black_box(stream.step(*x));
            }
            stream.reset();
            stream.run(&signal, &mut output).unwrap();
        });
        assert_eq!(count, 0);
    }
}

#[test]
fn an_array_never_allocates_while_it_runs() {
    let compiled = vec![CompiledModel::new(&actuator()); 10];
    let (mut forward, mut inverse) =
        (StreamArray::forward(&compiled), StreamArray::inverse(&compiled, Some((-500.0, 500.0))).unwrap());
    let signal = &signal()[..10_000];
    let mut output = vec![0.0; signal.len()];
    let mut row = vec![0.0; 10];
    let count = allocations::count(|| {
        for x in signal.chunks_exact(10) {
            forward.peek(x, &mut row).unwrap();
            forward.step(x, &mut row).unwrap();
            inverse.peek(x, &mut row).unwrap();
            inverse.step(x, &mut row).unwrap();
        }
        forward.reset();
        inverse.reset();
        forward.run(signal, &mut output).unwrap();
        inverse.run(signal, &mut output).unwrap();
        assert!(forward.step(&row, &mut output).is_err());
    });
    assert_eq!(count, 0);
}

#[test]
fn the_controller_of_an_array_never_allocates_while_it_runs() {
    let (model, limits) = (CompiledModel::new(&actuator()), Some((-500.0, 500.0)));
    let creep = CreepTerms::new(&[0.1, 0.01], &[0.9, 0.99]).unwrap();
    let duhem = Duhem::from_bouc_wen(2e-3, 0.1, 0.9, 0.4).unwrap();
    let stage = QuasiStatic::new(&model).with_creep(creep).with_loop_shift(loop_shift()).with_duhem(duhem);
    assert_never_allocates(vec![Inverse::new(&model, limits).unwrap(); 10].into_iter().collect(), &model);
    assert_never_allocates(vec![stage.inverse(limits).unwrap(); 10].into_iter().collect(), &model);
}

fn assert_never_allocates<P: ArrayInverse>(inverse: StreamArray<P>, model: &CompiledModel) {
    let set = ArrayOptions { ki: 100.0, leak: 1.0, slew: vec![1e5], ..ArrayOptions::new(1e-3) };
    let neighbours = (1..10).map(|i| (i - 1, i)).collect();
    let paired = ArrayOptions { neighbours, max_difference: vec![0.5], reconstruction: Some(vec![0.1; 50]), ..set };
    let mut controller = ArrayController::new(inverse, &paired).unwrap();
    let signal: Vec<f64> = signal()[..10_000].iter().map(|x| 0.005 * x).collect();
    let measured = vec![0.1; 5000];
    let mut output = vec![0.0; signal.len()];
    let mut row = vec![0.0; 10];
    let count = allocations::count(|| {
        for (k, x) in signal.chunks_exact(10).enumerate() {
            let sample = ArraySample { measurement: (k % 3 > 0).then_some(&measured[..5]), ..ArraySample::of(x) };
            controller.peek(&sample, &mut row).unwrap();
            controller.step(&sample, &mut row).unwrap();
            match k % 100 {
                40 => controller.hold(),
                70 => controller.stop(1e4, &[10.0; 10]).unwrap(),
                50 | 80 => controller.release(),
                90 => controller.set_model(k % 10, model).unwrap(),
                _ => {}
            }
        }
        controller.run(&ArraySample { measurement: Some(&measured), ..ArraySample::of(&signal) }, &mut output).unwrap();
        controller.set_gains(50.0, 0.0).unwrap();
        controller.follow(&row).unwrap();
        controller.reset();
    });
    assert_eq!(count, 0);
    assert!(output.iter().any(|drive| *drive != 0.0));
}

#[test]
fn a_controller_never_allocates_while_it_runs() {
    let compiled = CompiledModel::new(&actuator());
    let limits = (-500.0, 500.0);
    let creeping = QuasiStatic::new(&compiled).with_creep(CreepTerms::new(&[0.1], &[0.9]).unwrap());
    let creeping = creeping.with_loop_shift(loop_shift());
    let sources: [FeedForward; 3] = [
        Inverse::new(&compiled, Some(limits)).unwrap().into(),
        creeping.inverse(Some(limits)).unwrap().into(),
        parametric_inverse().forward().into(),
    ];
    let set = ControllerOptions::new(5.0, 6e3, 1e-4, limits);
    let gate = (Some((-5.0, 5.0)), Some(0.1));
    let sections = [Biquad::new([0.98, -1.7, 0.95], [-1.7, 0.93]), Biquad::new([0.1, 0.0, 0.0], [-0.9, 0.0])];
    let filters = Sections::new(&sections.map(Result::unwrap)).unwrap();
    let options = ControllerOptions { slew: Some(1e6), measurement_range: gate.0, max_measurement_step: gate.1, ..set };
    let options = ControllerOptions { filters, ..options };
    let signal = signal();
    for source in sources {
        let preview = Preview::new(&[-1.0, 3.0, -1.0], 1).unwrap();
        let mut controller = HybridController::new(source.clone(), Some(preview), &options).unwrap();
        let parametric = matches!(source, FeedForward::Forward(_));
        let other = if parametric { CompiledModel::new(&parametric_inverse()) } else { compiled.clone() };
        let count = allocations::count(|| {
            for (x, y) in signal.iter().zip(signal.iter().rev()) {
                let command = Command {
                    target: Some(0.9 * x),
                    correction: 0.1,
                    estimate: None,
                    feedforward: None,
                    reference: *x,
                };
                std::hint::black_box(controller.peek(command, *y));
                std::hint::black_box(controller.step((*x).into(), *y));
                std::hint::black_box(controller.plan(command, *y));
                controller.commit();
            }
            for mode in [Mode::Hold, Mode::Feedforward, Mode::Run] {
                controller.set_mode(mode).unwrap();
                controller.step(1.0.into(), 1.0);
            }
            controller.stop(1e5, 0.0).unwrap();
            for _ in 0..100 {
                std::hint::black_box(controller.peek(1.0.into(), 1.0));
                controller.step(1.0.into(), 1.0);
                controller.plan(1.0.into(), 1.0);
                controller.commit();
            }
            assert_eq!(controller.follow(&[3.0, -2.0]).is_err(), parametric);
            controller.release();
            controller.set_gains(1.0, 0.1).unwrap();
            controller.set_filters(&Sections::default()).unwrap();
            controller.set_model(&other).unwrap();
            controller.reset();
        });
        assert_eq!(count, 0);
    }
}

#[test]
fn several_axes_never_allocate_while_they_run() {
    let compiled = CompiledModel::new(&actuator());
    let limits = (-500.0, 500.0);
    let options = ControllerOptions::new(5.0, 6e3, 1e-4, limits);
    let source = || Inverse::new(&compiled, Some(limits)).unwrap().into();
    let controllers = (0..2).map(|_| HybridController::new(source(), None, &options).unwrap()).collect();
    let mut axes = MultiAxisController::new(controllers, Some(&[1.0, 0.25, -0.5, 1.0])).unwrap();
    let signal = &signal()[..10_000];
    let mut output = vec![0.0; signal.len()];
    let count = allocations::count(|| {
        let mut drives = [0.0; 2];
        for (x, y) in signal.chunks_exact(2).zip(signal.chunks_exact(2).rev()) {
            axes.peek(x.into(), y, &mut drives).unwrap();
            axes.plan(x.into(), y, &mut drives).unwrap();
            axes.commit();
            axes.step(x.into(), y, &mut drives).unwrap();
        }
        axes.run(signal, signal, &mut output).unwrap();
        axes.hold();
        axes.release();
        axes.stop(1e5, &drives).unwrap();
        axes.reset();
    });
    assert_eq!(count, 0);
}
