//! How long single steps take: the tail matters to a control loop, and an average hides it.

use std::hint::black_box;
use std::time::Instant;

use hdrhistogram::Histogram;
use hysteresis_core::{CompiledModel, Forward, Inverse, Process};
use yardsticks::{SAMPLES, Signal, actuator};

use crate::cases::What;
use crate::results::{Latency, Steps};

/// What is timed: the smooth signal and the one that jumps, few operators and many.
#[must_use]
pub fn all() -> Vec<Option<Steps>> {
    let mut steps = vec![None];
    for operators in [20, 10_000] {
        for signal in [Signal::SlowSine, Signal::White] {
            for what in [What::Forward, What::Inverse] {
                steps.push(Some(Steps { signal, operators, what }));
            }
        }
    }
    steps
}

/// Times `seconds` of a signal, sample by sample. No noise comes twice, so that no predictor learns it by heart.
///
/// # Panics
/// Never: the actuators are invertible, and a day is within the range of the histogram.
#[must_use]
pub fn measure(step: Option<Steps>, seconds: u64) -> Latency {
    let mut times = Histogram::new_with_bounds(1, 86_400_000_000_000, 3).expect("valid bounds");
    match step {
        None => record(seconds, &mut times, |_| vec![0.0; SAMPLES as usize], |x| x),
        Some(Steps { signal, operators, what }) => {
            let compiled = CompiledModel::new(&actuator(operators));
            let mut plant = Forward::new(&compiled);
            let drive = |second| signal.samples(second);
            let targets = |second| drive(second).into_iter().map(|x| plant.step(x)).collect();
            if what == What::Inverse {
                let mut inverse = Inverse::new(&compiled, None).expect("the weights are positive");
                record(seconds, &mut times, targets, |y| inverse.step(y));
            } else {
                let mut forward = Forward::new(&compiled);
                record(seconds, &mut times, drive, |x| forward.step(x));
            }
        }
    }
    let at = |quantile| times.value_at_quantile(quantile);
    Latency { step, count: times.len(), median: at(0.5), p99: at(0.99), p999: at(0.999), max: times.max() }
}

/// The clock is read right before and right after each step. The inputs of a second are made before it is timed.
fn record(
    seconds: u64,
    times: &mut Histogram<u64>,
    mut input: impl FnMut(u64) -> Vec<f64>,
    mut step: impl FnMut(f64) -> f64,
) {
    for second in 0..seconds {
        for x in input(second) {
            let start = Instant::now();
            black_box(step(black_box(x)));
            let elapsed = start.elapsed().as_nanos();
            times.saturating_record(u64::try_from(elapsed).unwrap_or(u64::MAX));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_step_is_counted_and_the_quantiles_grow() {
        for step in all() {
            let found = measure(step, 1);
            assert_eq!(found.count, u64::from(SAMPLES));
            assert!(found.median <= found.p99 && found.p99 <= found.p999 && found.p999 <= found.max, "{found:?}");
        }
    }
}
