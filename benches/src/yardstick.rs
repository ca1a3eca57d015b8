//! What the streams are compared with, compiled with the same flags and measured in the same run.

use std::hint::black_box;

use hysteresis_core::{CompiledModel, Forward};

use crate::cases::{Case, Mode, What};
use crate::pass::Pass;

/// A loop over all operators for every sample: the core's bank, forward.
///
/// # Panics
/// Never: there is one initial output per operator.
#[must_use]
pub fn plain_loop(compiled: &CompiledModel) -> Forward {
    Forward::with_initial(compiled, &vec![0.0; compiled.operators()]).expect("one initial output per operator")
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
