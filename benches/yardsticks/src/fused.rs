//! The fused loop: all operators in one loop over vectors. What a user can write with care, for one instruction set
//! each.
//!
//! Outputs, thresholds and weights lie in vectors of as many operators as an instruction takes. There is no branch, so
//! a sample costs the same on any signal. The loop over samples is compiled for the same instructions as the loop over
//! operators, which is inlined into it.

use std::array;
use std::env::consts::ARCH;

use hysteresis_core::{CoupledPlay, ModifiedPrandtlIshlinskii, Offsets};
use serde::{Deserialize, Serialize};

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

    /// Takes one sample of every actuator.
    pub fn step_each(&mut self, inputs: &[f64], outputs: &mut [f64]) {
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

/// As many operators as an instruction takes at once: outputs, thresholds and weights.
#[derive(Clone, Copy, Debug)]
struct Block<V> {
    z: V,
    r: V,
    ra: V,
    rb: V,
    rc: V,
    w: V,
}

/// The operators of a model at rest, `LANES` to a block. What is left of the last block never moves and weighs nothing.
///
/// # Panics
/// If the model has offsets, or weights of their own below zero: the loop has neither.
fn blocks<const LANES: usize>(model: &ModifiedPrandtlIshlinskii) -> Vec<Block<[f64; LANES]>> {
    assert!(!model.is_split() && model.offsets() == Offsets::default(), "one weight for each operator, no offsets");
    let operators: Vec<_> = model.operators().iter().zip(model.weights()).collect();
    let block = |chunk: &[(&CoupledPlay, &f64)]| {
        let threshold = |of: fn(&CoupledPlay) -> f64| {
            array::from_fn(|lane| chunk.get(lane).map_or(f64::INFINITY, |(operator, _)| of(operator)))
        };
        Block {
            z: [0.0; LANES],
            r: threshold(CoupledPlay::r),
            ra: threshold(CoupledPlay::ra),
            rb: threshold(CoupledPlay::rb),
            rc: threshold(CoupledPlay::rc),
            w: array::from_fn(|lane| chunk.get(lane).map_or(0.0, |(_, weight)| **weight)),
        }
    };
    operators.chunks(LANES).map(block).collect()
}

/// The loop over blocks of a `Vector` with `LANES` lanes. Where the macro is used, these names and those of the
/// operations on vectors (`splat`, `add`, `sub`, `min`, `max`, `mul_add`, `total`, `vector`) are those of the
/// instruction set, and the attributes turn it on.
macro_rules! kernel {
    ($(#[$attribute:meta])*) => {
        /// The banks of all actuators, one behind the other.
        #[derive(Clone, Debug)]
        pub(super) struct Banks {
            blocks: Vec<Block<Vector>>,
            /// The blocks of an actuator.
            width: usize,
        }

        /// The operators of `models`, which have the same number of them, at rest.
        $(#[$attribute])*
        pub(super) fn banks(models: &[ModifiedPrandtlIshlinskii]) -> Banks {
            let mut all = Vec::new();
            for model in models {
                for Block { z, r, ra, rb, rc, w } in blocks::<LANES>(model) {
                    let (z, r, ra) = (vector(z), vector(r), vector(ra));
                    all.push(Block { z, r, ra, rb: vector(rb), rc: vector(rc), w: vector(w) });
                }
            }
            Banks { width: all.len() / models.len(), blocks: all }
        }

        /// One sample of one actuator: every z_i between its bounds, equation (5), and the sum of w_i z_i.
        #[inline]
        $(#[$attribute])*
        fn step(bank: &mut [Block<Vector>], x: f64) -> f64 {
            let (x, zero) = (splat(x), splat(0.0));
            let mut sum = zero;
            for block in bank {
                let lo = max(sub(x, block.r), min(sub(x, block.rc), zero));
                let hi = min(add(x, block.ra), max(add(x, block.rb), zero));
                block.z = max(lo, min(hi, block.z));
                sum = mul_add(block.w, block.z, sum);
            }
            total(sum)
        }

        /// One sample of the first actuator after the other; `take` gets the outputs.
        $(#[$attribute])*
        pub(super) fn steps(banks: &mut Banks, inputs: &[f64], mut take: impl FnMut(f64)) {
            let bank = &mut banks.blocks[..banks.width];
            for x in inputs {
                take(step(bank, *x));
            }
        }

        /// One sample of every actuator.
        $(#[$attribute])*
        pub(super) fn each(banks: &mut Banks, inputs: &[f64], outputs: &mut [f64]) {
            let all = banks.blocks.chunks_exact_mut(banks.width);
            for ((bank, x), y) in all.zip(inputs).zip(outputs) {
                *y = step(bank, *x);
            }
        }
    };
}
/// Pairs of numbers in plain Rust, which every 64-bit processor has instructions for.
mod portable {
    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use super::{Block, blocks};

    const LANES: usize = 2;

    /// Aligned, so that an instruction may take it from memory.
    #[derive(Clone, Copy, Debug)]
    #[repr(align(16))]
    struct Vector([f64; LANES]);

    #[inline(always)]
    fn lanewise(a: Vector, b: Vector, f: impl Fn(f64, f64) -> f64) -> Vector {
        Vector([f(a.0[0], b.0[0]), f(a.0[1], b.0[1])])
    }

    fn vector(lanes: [f64; LANES]) -> Vector {
        Vector(lanes)
    }

    #[inline(always)]
    fn splat(x: f64) -> Vector {
        Vector([x; LANES])
    }

    #[inline(always)]
    fn add(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, |a, b| a - b)
    }

    /// `f64::min` is one instruction on aarch64. On x86-64 it is several, because of NaN, and the comparison is one.
    #[inline(always)]
    fn min(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, if cfg!(target_arch = "x86_64") { |a, b| if a < b { a } else { b } } else { f64::min })
    }

    #[inline(always)]
    fn max(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, if cfg!(target_arch = "x86_64") { |a, b| if a > b { a } else { b } } else { f64::max })
    }

    /// Fused where every processor of the architecture can.
    #[inline(always)]
    fn mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
        if cfg!(target_arch = "aarch64") {
            Vector([a.0[0].mul_add(b.0[0], c.0[0]), a.0[1].mul_add(b.0[1], c.0[1])])
        } else {
            add(lanewise(a, b, |a, b| a * b), c)
        }
    }

    #[inline(always)]
    fn total(sum: Vector) -> f64 {
        sum.0[0] + sum.0[1]
    }

    kernel!();
}

/// Four numbers at once: AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
mod v3 {
    use std::arch::x86_64::{
        __m256d as Vector, _mm_add_pd, _mm_add_sd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm256_add_pd as add,
        _mm256_castpd256_pd128, _mm256_extractf128_pd, _mm256_fmadd_pd as mul_add, _mm256_max_pd as max,
        _mm256_min_pd as min, _mm256_set1_pd as splat, _mm256_setr_pd, _mm256_sub_pd as sub,
    };

    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use super::{Block, blocks};

    const LANES: usize = 4;

    #[target_feature(enable = "avx2,fma")]
    fn vector([a, b, c, d]: [f64; LANES]) -> Vector {
        _mm256_setr_pd(a, b, c, d)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn total(sum: Vector) -> f64 {
        let pair = _mm_add_pd(_mm256_castpd256_pd128(sum), _mm256_extractf128_pd::<1>(sum));
        _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)))
    }

    kernel!(#[target_feature(enable = "avx2,fma")]);
}

/// Eight numbers at once: AVX-512.
#[cfg(target_arch = "x86_64")]
mod v4 {
    use std::arch::x86_64::{
        __m512d as Vector, _mm512_add_pd as add, _mm512_fmadd_pd as mul_add, _mm512_max_pd as max,
        _mm512_min_pd as min, _mm512_reduce_add_pd as total, _mm512_set1_pd as splat, _mm512_setr_pd,
        _mm512_sub_pd as sub,
    };

    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use super::{Block, blocks};

    const LANES: usize = 8;

    #[target_feature(enable = "avx512f")]
    fn vector([a, b, c, d, e, f, g, h]: [f64; LANES]) -> Vector {
        _mm512_setr_pd(a, b, c, d, e, f, g, h)
    }

    kernel!(#[target_feature(enable = "avx512f")]);
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Process;

    use super::*;
    use crate::{PlainLoop, Signal, actuator, individual};

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
        for operators in [1, 2, 3, 7, 13, 20, 100, 1_000, 10_000] {
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
                fused.step_each(row, &mut found);
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
