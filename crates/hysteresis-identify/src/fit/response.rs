//! The output of a whole model for an input.

use super::creep_filter::CreepFilter;
use super::dynamics_filter::DynamicsFilter;
use super::linear_part::{LinearPart, SampledPart};
use super::regressor::{OperatorsAt, Regressor};

/// The weighted sum of the operators' outputs from the virgin state, through what follows them, at rest at the first.
pub(crate) fn response(
    operators: &OperatorsAt,
    weights: &[f64],
    linear: &LinearPart,
    input: &[f64],
    dt: f64,
) -> Vec<f64> {
    if linear.is_dead_time_alone() && linear.dead_time >= 0.0 {
        return hysteresis(operators, weights, input, linear.dead_time / dt, dt);
    }
    through(linear, &hysteresis(operators, weights, input, 0.0, dt), dt)
}

/// The weighted sum of the operators' outputs from the virgin state, and the loop shift, `delay` samples later.
pub(crate) fn hysteresis(operators: &OperatorsAt, weights: &[f64], input: &[f64], delay: f64, dt: f64) -> Vec<f64> {
    let mut regressor = Regressor::new(operators, input, delay, dt);
    let next = |k| {
        regressor.go_to(k);
        regressor.output(weights)
    };
    (0..input.len()).map(next).collect()
}

/// A signal through creep, dynamics and dead time, at rest at its first value.
pub(crate) fn through(linear: &LinearPart, signal: &[f64], dt: f64) -> Vec<f64> {
    let part = SampledPart::new(linear, dt);
    let (mut creep, mut dynamics) = (CreepFilter::new(&part), DynamicsFilter::new(&part));
    let (mut taken, mut rest) = (0, 0.0);
    let reading = |k| {
        let source = part.source(k);
        while taken < source.map_or(1, |source| source + 1) {
            let p = creep.next(signal[taken.min(signal.len() - 1)]);
            if taken == 0 {
                rest = p;
            }
            dynamics.take(p);
            taken += 1;
        }
        if source.is_none() { rest } else { dynamics.reading() }
    };
    (0..signal.len()).map(reading).collect()
}
