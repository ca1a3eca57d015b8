//! What the streams are compared with, compiled with the same flags and measured in the same run.

use std::hint::black_box;

use hysteresis_core::{CoupledPlay, ModifiedPrandtlIshlinskii, Offsets, Operator, Process};

use crate::cases::{Case, Mode, What};
use crate::pass::Pass;

/// A loop over all operators for every sample, one after the other: what a user writes first.
#[derive(Clone, Debug)]
pub struct PlainLoop {
    operators: Vec<(f64, CoupledPlay, f64)>,
}

impl PlainLoop {
    /// The operators of a model at rest.
    ///
    /// # Panics
    /// If the model has offsets, or weights of their own below zero: the loop has neither.
    #[must_use]
    pub fn new(model: &ModifiedPrandtlIshlinskii) -> Self {
        assert!(!model.is_split() && model.offsets() == Offsets::default(), "one weight for each operator, no offsets");
        let operators = model.operators().iter().zip(model.weights());
        Self { operators: operators.map(|(operator, weight)| (*weight, *operator, 0.0)).collect() }
    }
}

impl Process for PlainLoop {
    fn step(&mut self, x: f64) -> f64 {
        let mut sum = 0.0;
        for (weight, operator, z) in &mut self.operators {
            *z = operator.next(*z, x);
            sum += *weight * *z;
        }
        sum
    }

    fn peek(&self, x: f64) -> f64 {
        self.operators.iter().map(|(weight, operator, z)| weight * operator.next(*z, x)).sum()
    }

    fn reset(&mut self) {
        for (_, _, z) in &mut self.operators {
            *z = 0.0;
        }
    }
}

/// Every how manieth sample of the signal a loop takes: what a sample costs there does not depend on the sample, and over
/// many operators a whole second would take minutes.
pub(crate) fn thinning(case: Case) -> u32 {
    let loops = case.mode == Mode::Step && What::YARDSTICKS.contains(&case.what);
    if loops { (case.operators / 100).max(1) } else { 1 }
}

pub(crate) fn thinned(drive: &[f64], case: Case) -> Vec<f64> {
    drive.iter().step_by(thinning(case) as usize).copied().collect()
}

/// Copying the samples: what no `run` into an output can undercut.
pub(crate) struct Copied {
    input: Vec<f64>,
    output: Vec<f64>,
}

impl Copied {
    pub(crate) fn new(input: Vec<f64>) -> Self {
        Self { output: vec![0.0; input.len()], input }
    }
}

impl Pass for Copied {
    fn samples(&self) -> usize {
        self.input.len()
    }

    fn pass(&mut self) {
        black_box(&mut self.output).copy_from_slice(black_box(&self.input));
        black_box(&self.output);
    }
}
