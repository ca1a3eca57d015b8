//! The fused loop: all operators in one loop over vectors. What a user can write with care, for one instruction set each.
//!
//! Outputs, thresholds and weights lie in vectors of as many operators as an instruction takes. There is no branch, so a
//! sample costs the same on any signal. The loop over samples is compiled for the same instructions as the loop over
//! operators, which is inlined into it.

mod kernel;
mod sets;

use std::env::consts::ARCH;
use std::hint::black_box;

use hysteresis_core::ModifiedPrandtlIshlinskii;
use serde::{Deserialize, Serialize};

use crate::pass::{Actuators, Pass, Reel};
use sets::portable;
#[cfg(target_arch = "x86_64")]
use sets::{v3, v4};

/// The instructions that a fused loop is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Instructions {
    /// What every processor of the architecture has.
    Portable,
    /// x86-64-v3: AVX2 and FMA, four numbers at once.
    V3,
    /// x86-64-v4: AVX-512, eight numbers at once.
    V4,
}

impl Instructions {
    /// All of them, the narrowest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::V3, Self::V4];

    /// Whether this processor has them.
    #[must_use]
    pub fn are_here(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::V3 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::V4 => is_x86_feature_detected!("avx512f"),
            #[cfg(not(target_arch = "x86_64"))]
            Self::V3 | Self::V4 => false,
        }
    }

    /// The name of the instruction set: for the portable one that of the architecture, as x86-64.
    #[must_use]
    pub fn name(self) -> String {
        let suffix = match self {
            Self::Portable => return ARCH.replace('_', "-"),
            Self::V3 => "v3",
            Self::V4 => "v4",
        };
        format!("x86-64-{suffix}")
    }
}

/// One actuator or several with as many operators each, and the loop for one instruction set.
#[derive(Clone, Debug)]
pub struct FusedLoop(Compiled);

/// There is a value of a variant only on a processor with its instructions: [`FusedLoop::new`] makes sure of that.
#[derive(Clone, Debug)]
enum Compiled {
    Portable(portable::Banks),
    #[cfg(target_arch = "x86_64")]
    V3(v3::Banks),
    #[cfg(target_arch = "x86_64")]
    V4(v4::Banks),
}

impl FusedLoop {
    /// A loop over the operators of each model, all at rest. None if this processor does not have the instructions.
    ///
    /// # Panics
    /// Without models, with models of different size, and with offsets or weights of their own below zero: the loop
    /// has none of them.
    #[must_use]
    pub fn new(models: &[ModifiedPrandtlIshlinskii], instructions: Instructions) -> Option<Self> {
        let size = models[0].operators().len();
        assert!(models.iter().all(|model| model.operators().len() == size), "as many operators in every model");
        instructions.are_here().then(|| {
            Self(match instructions {
                Instructions::Portable => Compiled::Portable(portable::banks(models)),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the processor has been asked for these instructions.
                Instructions::V3 => Compiled::V3(unsafe { v3::banks(models) }),
                #[cfg(target_arch = "x86_64")]
                // SAFETY: the processor has been asked for these instructions.
                Instructions::V4 => Compiled::V4(unsafe { v4::banks(models) }),
                #[cfg(not(target_arch = "x86_64"))]
                Instructions::V3 | Instructions::V4 => unreachable!("not on this architecture"),
            })
        })
    }

    /// Takes one sample of the first actuator after the other, and gives each output to `take`.
    pub fn steps(&mut self, inputs: &[f64], take: impl FnMut(f64)) {
        match &mut self.0 {
            Compiled::Portable(banks) => portable::steps(banks, inputs, take),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: there are such banks only where the processor has these instructions.
            Compiled::V3(banks) => unsafe { v3::steps(banks, inputs, take) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: there are such banks only where the processor has these instructions.
            Compiled::V4(banks) => unsafe { v4::steps(banks, inputs, take) },
        }
    }
}

impl Actuators for FusedLoop {
    fn step(&mut self, inputs: &[f64], outputs: &mut [f64]) {
        match &mut self.0 {
            Compiled::Portable(banks) => portable::each(banks, inputs, outputs),
            #[cfg(target_arch = "x86_64")]
            // SAFETY: there are such banks only where the processor has these instructions.
            Compiled::V3(banks) => unsafe { v3::each(banks, inputs, outputs) },
            #[cfg(target_arch = "x86_64")]
            // SAFETY: there are such banks only where the processor has these instructions.
            Compiled::V4(banks) => unsafe { v4::each(banks, inputs, outputs) },
        }
    }
}

/// The loop along a signal: one sample after the other, as a control loop takes them.
pub(crate) struct FusedSteps {
    pub(crate) operators: FusedLoop,
    pub(crate) input: Reel,
}

impl Pass for FusedSteps {
    fn samples(&self) -> usize {
        self.input.samples()
    }

    fn pass(&mut self) {
        self.operators.steps(self.input.next(), |y| _ = black_box(y));
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Process;

    use super::*;
    use crate::cases::{OPERATORS, actuator, individual};
    use crate::signals::Signal;
    use crate::yardstick::PlainLoop;

    /// The largest difference as a share of the range.
    fn difference(found: &[f64], expected: &[f64]) -> f64 {
        assert_eq!(found.len(), expected.len());
        let most = expected.iter().copied().fold(f64::MIN, f64::max);
        let least = expected.iter().copied().fold(f64::MAX, f64::min);
        let apart = found.iter().zip(expected).map(|(a, b)| (a - b).abs());
        apart.fold(0.0, f64::max) / (most - least)
    }

    /// Sums of another order differ by rounding: n terms by less than n half units of the last place.
    const ROUNDING: f64 = 1e-12;

    fn here() -> impl Iterator<Item = Instructions> {
        Instructions::ALL.into_iter().filter(|instructions| instructions.are_here())
    }

    #[test]
    fn the_outputs_are_those_of_the_plain_loop_on_every_signal() {
        for operators in OPERATORS.into_iter().chain([2, 3, 7, 13]) {
            let model = actuator(operators);
            let thin = (operators as usize / 20) | 1; // odd: even steps meet the triangle at its zeros
            for signal in Signal::ALL {
                let drive: Vec<f64> = signal.samples(1).into_iter().step_by(thin).collect();
                let mut plain = PlainLoop::new(&model);
                let expected: Vec<f64> = drive.iter().map(|x| plain.step(*x)).collect();
                for instructions in here() {
                    let mut fused = FusedLoop::new(std::slice::from_ref(&model), instructions).expect("it is here");
                    let mut found = Vec::new();
                    fused.steps(&drive, |y| found.push(y));
                    let apart = difference(&found, &expected);
                    assert!(apart < ROUNDING, "{instructions:?}, {signal}, n = {operators}: {apart:.1e}");
                }
            }
        }
    }

    #[test]
    fn every_actuator_has_operators_of_its_own() {
        let models: Vec<_> = (0..5).map(|seed| individual(13, seed)).collect();
        let drive = Signal::White.samples(1);
        for instructions in here() {
            let mut fused = FusedLoop::new(&models, instructions).expect("it is here");
            let mut plain: Vec<_> = models.iter().map(PlainLoop::new).collect();
            for row in drive.chunks_exact(models.len()) {
                let mut found = vec![0.0; row.len()];
                fused.step(row, &mut found);
                let expected: Vec<f64> = plain.iter_mut().zip(row).map(|(plain, x)| plain.step(*x)).collect();
                assert!(difference(&found, &expected) < ROUNDING, "{instructions:?}: {found:?}, {expected:?}");
            }
        }
    }

    #[test]
    fn the_portable_loop_has_the_name_of_the_architecture() {
        let names = Instructions::ALL.map(Instructions::name);
        assert_eq!(names[1..], ["x86-64-v3", "x86-64-v4"]);
        assert!(names[0] == ARCH.replace('_', "-") && Instructions::Portable.are_here());
    }
}
