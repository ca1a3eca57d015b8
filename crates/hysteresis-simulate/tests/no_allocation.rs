//! What runs sample by sample never allocates: linear streams, plants, learning in the loop, the observer.

use hysteresis_core::{Kernel, Process, paper};
use hysteresis_simulate::learning::{FeedbackLoop, RepetitiveControl, RepetitiveOptions};
use hysteresis_simulate::linear::{Block, Creep, Delay, FirstOrder, LinearDynamics, SecondOrder, Stream};
use hysteresis_simulate::plant::{Design, Plant};
use hysteresis_simulate::{Observer, ObserverOptions};

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
    let dynamics = SecondOrder::new(400.0, 0.95).unwrap().into();
    let feedback = FeedbackLoop { kp: 60.0, ki: 0.6, slope: 5e-3, dynamics, delay: 0.5, dt: 1e-4 };
    let mut repetitive = RepetitiveControl::new(&feedback, 100, &RepetitiveOptions::new(300.0)).unwrap();
    let options = ObserverOptions { delay: 1.5, ..ObserverOptions::new(0.016, 0.5) };
    let mut observer = Observer::new(&Kernel::new(&paper::table_1_recovered()), &dynamics, 1e-4, &options).unwrap();
    let count = allocations::count(|| {
        for k in 0..1000 {
            let x = if k % 97 == 0 { f64::NAN } else { f64::from(k % 13) };
            std::hint::black_box((repetitive.step(1e-3 * x), observer.step(40.0 * x, 0.1 * x)));
        }
    });
    assert_eq!((count, repetitive.rejected(), observer.rejected()), (0, 11, 11));
    repetitive.reset();
    observer.reset();
}

#[test]
fn plants_never_allocate() {
    let design = Design {
        amplifier_pole: Some(FirstOrder::new(279.0).unwrap()),
        dynamics: Some(SecondOrder::new(2000.0, 0.03).unwrap().into()),
        creep: Some(Creep::new(&[0.01, 0.02], &[0.1, 1.0]).unwrap()),
        delay: Delay::new(2.4e-4).unwrap(),
        noise: 0.016,
        limits: Some((-500.0, 500.0)),
        dac_bits: Some(16),
        adc: Some((24, (-4.0, 4.0))),
        ..Design::default()
    };
    let mut plant = Plant::new(&Kernel::new(&paper::table_1_recovered()), &design).unwrap();
    let drives: Vec<f64> =
        (0..1000_u32).map(|k| if k % 97 == 0 { f64::NAN } else { f64::from(k * k % 1201) - 600.0 }).collect();
    let (mut measured, mut position) = (vec![0.0; drives.len()], vec![0.0; drives.len()]);
    let count = allocations::count(|| {
        for u in &drives {
            std::hint::black_box(plant.step(*u));
        }
        plant.reset();
        plant.run(&drives, &mut measured, &mut position).unwrap();
    });
    assert_eq!(count, 0);
    assert_eq!(plant.events().rejected, 11);
}
