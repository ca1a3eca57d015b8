//! The loop itself, written once and compiled for several instruction sets.

use std::array;

use hysteresis_core::{CoupledPlay, ModifiedPrandtlIshlinskii, Offsets};

/// As many operators as an instruction takes at once: outputs, thresholds and weights.
#[derive(Clone, Copy, Debug)]
pub(super) struct Block<V> {
    pub(super) z: V,
    pub(super) r: V,
    pub(super) ra: V,
    pub(super) rb: V,
    pub(super) rc: V,
    pub(super) w: V,
}

/// The operators of a model at rest, `LANES` to a block. What is left of the last block never moves and weighs nothing.
///
/// # Panics
/// If the model has offsets, or weights of their own below zero: the loop has neither.
pub(super) fn blocks<const LANES: usize>(model: &ModifiedPrandtlIshlinskii) -> Vec<Block<[f64; LANES]>> {
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
        pub(in crate::fused) struct Banks {
            blocks: Vec<Block<Vector>>,
            /// The blocks of an actuator.
            width: usize,
        }

        /// The operators of `models`, which have the same number of them, at rest.
        $(#[$attribute])*
        pub(in crate::fused) fn banks(models: &[ModifiedPrandtlIshlinskii]) -> Banks {
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
        pub(in crate::fused) fn steps(banks: &mut Banks, inputs: &[f64], mut take: impl FnMut(f64)) {
            let bank = &mut banks.blocks[..banks.width];
            for x in inputs {
                take(step(bank, *x));
            }
        }

        /// One sample of every actuator.
        $(#[$attribute])*
        pub(in crate::fused) fn each(banks: &mut Banks, inputs: &[f64], outputs: &mut [f64]) {
            let all = banks.blocks.chunks_exact_mut(banks.width);
            for ((bank, x), y) in all.zip(inputs).zip(outputs) {
                *y = step(bank, *x);
            }
        }
    };
}
pub(super) use kernel;
