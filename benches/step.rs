//! Time of `step`, sample by sample: the plain loop over operators, the engine forward and its exact inverse.
//!
//! Criterion reports the time of a whole signal and the rate in elements (samples) per second.

use std::hint::black_box;
use std::time::Duration;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use hysteresis_bench::{OPERATORS, SAMPLES, Signal, actuator, plain_loop};
use hysteresis_core::{Forward, Inverse, Kernel, Process};

fn step(criterion: &mut Criterion) {
    for (signal, name) in Signal::ALL {
        let drive = signal.samples(SAMPLES);
        let mut group = criterion.benchmark_group(name);
        group.throughput(Throughput::Elements(u64::from(SAMPLES)));
        for operators in OPERATORS {
            let kernel = Kernel::new(&actuator(operators));
            let mut target = vec![0.0; drive.len()];
            Forward::new(&kernel).run(&drive, &mut target).expect("the same length");
            let inverse = Inverse::new(&kernel, None).expect("the weights are positive");
            let mut case = |name: &str, input: &[f64], mut stream: Box<dyn Stream>| {
                let id = BenchmarkId::new(name, operators);
                group.bench_function(id, |bencher| bencher.iter(|| stream.steps(black_box(input))));
            };
            case("plain loop", &drive, Box::new(plain_loop(&kernel)));
            case("forward", &drive, Box::new(Forward::new(&kernel)));
            case("inverse", &target, Box::new(inverse));
        }
    }
}

/// A stream behind one call per signal, so that the call itself does not count.
trait Stream {
    fn steps(&mut self, input: &[f64]) -> f64;
}

impl<P: Process> Stream for P {
    fn steps(&mut self, input: &[f64]) -> f64 {
        self.reset();
        input.iter().fold(0.0, |_, x| black_box(self.step(*x)))
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default()
        .sample_size(20)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_secs(1));
    targets = step
}
criterion_main!(benches);
