//! `step`, `peek`, `reset` and `run` into a given slice never allocate.

use hysteresis_core::{
    Command, ControllerOptions, FeedForward, Forward, HybridController, Inverse, Kernel, Mode, Preview, Process,
    StreamArray, paper,
};

/// Jumps, reversals, plateaus, samples out of reach and samples that are rejected.
fn signal() -> Vec<f64> {
    let mut samples = vec![f64::NAN, f64::INFINITY, -1e300];
    samples.extend((0..5000_u32).map(|k| 600.0 * (f64::from(k) * f64::from(k) * 1e-4).sin()));
    samples.extend((0..5000_u32).map(|k| 3.2 * (f64::from(k) * f64::from(k) * 1e-4).sin()));
    samples
}

#[test]
fn the_hot_path_never_allocates() {
    let kernel = Kernel::new(&paper::table_1_recovered());
    let zeros = vec![0.0; kernel.operators()];
    let limits = Some((-500.0, 500.0));
    let streams: [Box<dyn Process>; 4] = [
        Box::new(Forward::new(&kernel)),
        Box::new(Inverse::new(&kernel, limits).unwrap()),
        Box::new(Forward::with_initial(&kernel, &zeros).unwrap()),
        Box::new(Inverse::with_initial(&kernel, limits, &zeros).unwrap()),
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
    let kernels = vec![Kernel::new(&paper::table_1_recovered()); 10];
    let (mut forward, mut inverse) =
        (StreamArray::forward(&kernels), StreamArray::inverse(&kernels, Some((-500.0, 500.0))).unwrap());
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
fn a_controller_never_allocates_while_it_runs() {
    let kernel = Kernel::new(&paper::table_1_recovered());
    let limits = (-500.0, 500.0);
    let sources: [FeedForward; 2] =
        [Inverse::new(&kernel, Some(limits)).unwrap().into(), paper::table_2().forward().into()];
    let set = ControllerOptions {
        measurement_range: Some((-5.0, 5.0)),
        max_measurement_step: Some(0.1),
        ..ControllerOptions::new(5.0, 6e3, 1e-4, limits)
    };
    let options = ControllerOptions { slew: Some(1e6), ..set };
    let signal = signal();
    for source in sources {
        let preview = Preview::new(&[-1.0, 3.0, -1.0], 1).unwrap();
        let mut controller = HybridController::new(source.clone(), Some(preview), &options).unwrap();
        let other =
            if matches!(source, FeedForward::Inverse(_)) { kernel.clone() } else { Kernel::new(&paper::table_2()) };
        let count = allocations::count(|| {
            for (x, y) in signal.iter().zip(signal.iter().rev()) {
                let command = Command { target: Some(0.9 * x), feedforward: None, reference: *x };
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
            controller.release();
            controller.set_gains(1.0, 0.1).unwrap();
            controller.set_model(&other).unwrap();
            controller.reset();
        });
        assert_eq!(count, 0);
    }
}
