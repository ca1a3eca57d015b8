//! Many samples in one loop: a few of them go through a block of operators before the next block is read.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

use super::super::solve::Point;
use super::super::vectors::{Lanes, Vectors};
use super::block::{Behind, Block};
use super::blocks::BankLoop;
use super::look::Here;
use super::members::{MOVES_BEFORE_A_LINE, Members};
use super::side::{Falling, Rising, Side, Unguessed};
use super::sweep::Sweep;
use super::weights::Weights;
use crate::error::is_admissible;

/// How many samples go through a block together: as many as there are registers for.
const TOGETHER: usize = 4;

/// Takes every sample, up to the first admissible one after which a line is to be drawn. Inputs and outputs are relative to `origin`,
/// samples and what is put out are not.
pub(super) struct Run<'a> {
    pub(super) members: &'a Members,
    pub(super) z: &'a mut [f64],
    /// The last input and what the outputs sum to.
    pub(super) input: &'a mut f64,
    pub(super) output: &'a mut f64,
    /// How many moves were small, one after the other.
    pub(super) small_moves: &'a mut u8,
    pub(super) origin: Point,
    pub(super) samples: &'a [f64],
    pub(super) outputs: &'a mut [f64],
}

/// What a run took: how many samples, and how many of them are not admissible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taken {
    pub(crate) samples: usize,
    pub(crate) rejected: u64,
}

impl BankLoop for Run<'_> {
    type Output = Taken;

    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Taken {
        let Self { members, z, input, output, small_moves, origin, samples, outputs } = self;
        let taken = Taken { samples: 0, rejected: 0 };
        let mut runner =
            Runner { members, z, input: *input, output: output.to_bits(), small_moves: *small_moves, origin, taken };
        runner.run::<V, W>(v, blocks, samples, outputs);
        (*input, *output, *small_moves) = (runner.input, f64::from_bits(runner.output), runner.small_moves);
        runner.taken
    }
}

/// A bank on its way through the samples.
struct Runner<'a> {
    members: &'a Members,
    z: &'a mut [f64],
    input: f64,
    /// As bits: as a number it would be kept in one vector with the input, and every input would wait for the output before it.
    output: u64,
    small_moves: u8,
    origin: Point,
    taken: Taken,
}

impl Runner<'_> {
    #[inline(always)]
    fn run<V: Vectors, W: Weights>(&mut self, v: V, blocks: &[Block<V::Lanes>], samples: &[f64], outputs: &mut [f64]) {
        let ((samples, last_samples), (outputs, last_outputs)) = (samples.as_chunks(), outputs.as_chunks_mut());
        for (samples, outputs) in samples.iter().zip(outputs) {
            if let Some(inputs) = self.moves(samples) {
                *outputs = self.together::<V, W>(v, blocks, inputs);
            } else if !self.one_by_one::<V, W>(v, blocks, samples, outputs) {
                return;
            }
        }
        self.one_by_one::<V, W>(v, blocks, last_samples, last_outputs);
    }

    /// The inputs of samples that are all admissible, none of them leading to a line.
    #[inline(always)]
    #[expect(clippy::needless_bitwise_bool, reason = "vectors have no branches")]
    fn moves(&mut self, samples: &[f64; TOGETHER]) -> Option<[f64; TOGETHER]> {
        let inputs = samples.map(|sample| sample - self.origin.input);
        let (mut last, mut small_moves, mut all) = (self.input, self.small_moves, true);
        for (sample, x) in samples.iter().zip(inputs) {
            small_moves = self.members.small_moves(small_moves, x - last);
            all &= is_admissible(*sample) & (small_moves < MOVES_BEFORE_A_LINE);
            last = x;
        }
        if all {
            self.small_moves = small_moves;
        }
        all.then_some(inputs)
    }

    /// Moves to every input: the outputs there.
    #[inline(always)]
    fn together<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
    ) -> [f64; TOGETHER] {
        let [a, b, c, d] = inputs;
        let moves = [(self.input, a), (a, b), (b, c), (c, d)];
        let falls: u8 = moves.iter().map(|(from, to)| u8::from(to < from)).sum();
        // 1 if none of the four falls, -1 if all do; of moves from zero to -0, where either sign will do, -1. Every product waits for
        // it, so it is not made of `falls`: that would take a conversion.
        let sign = 1.0_f64.copysign(d - self.input);
        let sums = match usize::from(falls) {
            0 => self.one_way::<V, W>(v, blocks, inputs, Rising, sign),
            TOGETHER => self.one_way::<V, W>(v, blocks, inputs, Falling, sign),
            _ => self.either_way::<V, W>(v, blocks, inputs, moves.map(|(from, to)| Unguessed::of_move(from, to))),
        };
        (self.input, self.output) = (d, sums[TOGETHER - 1].to_bits());
        self.taken.samples += TOGETHER;
        sums.map(|sum| sum + self.origin.output)
    }

    /// The sum at every input, as a [`Sweep`] takes it (a zero of the mirror is made one of this side), all of them being on the way to the
    /// same side. Its sign comes as a number that the compiler does not know, or it would make differences of the products.
    #[inline(always)]
    fn one_way<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
        side: impl Side,
        sign: f64,
    ) -> [f64; TOGETHER] {
        let (sign, mut sums) = (v.splat(sign), [v.nothing(); TOGETHER]);
        for (block, slot) in blocks.iter().zip(V::Lanes::vectors_mut(self.z)) {
            let thresholds = side.thresholds(block);
            let mut z = side.seen(v, v.load(slot));
            for (x, sum) in inputs.iter().zip(&mut sums) {
                z = v.max(thresholds.least_signed(v, v.splat(*x), sign), z);
                *sum = v.sum_product(*sum, W::along(side, block, v, z), z);
            }
            *slot = v.store(side.seen(v, z));
        }
        sums.map(|sum| side.turned(v.total(sum)) + 0.0)
    }

    /// The same for each input on the way to its side.
    #[inline(always)]
    fn either_way<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        inputs: [f64; TOGETHER],
        sides: [Unguessed; TOGETHER],
    ) -> [f64; TOGETHER] {
        let mut sums = [v.nothing(); TOGETHER];
        for (block, slot) in blocks.iter().zip(V::Lanes::vectors_mut(self.z)) {
            let mut z = v.load(slot);
            for ((x, side), sum) in inputs.iter().zip(sides).zip(&mut sums) {
                let least = side.thresholds(block).least(v, v.splat(side.turned(*x)));
                let seen = v.max(least, side.seen(v, z));
                *sum = v.sum_product(*sum, W::along(side, block, v, seen), seen);
                z = side.seen(v, seen);
            }
            *slot = v.store(z);
        }
        array::from_fn(|k| sides[k].turned(v.total(sums[k])) + 0.0)
    }

    /// Moves to one input after the other: whether none led to a line.
    #[inline(always)]
    fn one_by_one<V: Vectors, W: Weights>(
        &mut self,
        v: V,
        blocks: &[Block<V::Lanes>],
        samples: &[f64],
        outputs: &mut [f64],
    ) -> bool {
        for (sample, put_out) in samples.iter().zip(outputs) {
            if is_admissible(*sample) {
                let (from, x) = (self.input, *sample - self.origin.input);
                let small_moves = self.members.small_moves(self.small_moves, x - from);
                if small_moves == MOVES_BEFORE_A_LINE {
                    return false;
                }
                self.small_moves = small_moves;
                let bounds = Behind(Unguessed::of_move(from, x));
                let output = Sweep { outputs: &mut *self.z, start: Here, bounds, x }.run::<V, W>(v, blocks);
                (self.input, self.output) = (x, output.to_bits());
            } else {
                self.taken.rejected += 1;
            }
            *put_out = f64::from_bits(self.output) + self.origin.output;
            self.taken.samples += 1;
        }
        true
    }
}
