//! Many samples in one loop: a few of them go through a block of operators before the next block is read.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

use super::super::four_lanes::{FourLanes, Lanes};
use super::super::solve::Point;
use super::block::{Behind, Block};
use super::look::Here;
use super::members::{BankLoop, MOVES_BEFORE_A_LINE, Members};
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
    pub(super) z: &'a mut [Lanes],
    /// The last input and what the outputs sum to, each behind a pointer of its own: side by side they would be one vector, and every
    /// input would wait for the output before it.
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
    fn run<F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> Taken {
        let Self { members, z, input, output, small_moves, origin, samples, outputs } = self;
        let now = Point { input: *input, output: *output };
        let taken = Taken { samples: 0, rejected: 0 };
        let mut runner = Runner { members, z, now, small_moves: *small_moves, origin, taken };
        runner.run::<F, W>(four, blocks, samples, outputs);
        (*input, *output, *small_moves) = (runner.now.input, runner.now.output, runner.small_moves);
        runner.taken
    }
}

/// A bank on its way through the samples.
struct Runner<'a> {
    members: &'a Members,
    z: &'a mut [Lanes],
    now: Point,
    small_moves: u8,
    origin: Point,
    taken: Taken,
}

impl Runner<'_> {
    #[inline(always)]
    fn run<F: FourLanes, W: Weights>(&mut self, four: F, blocks: &[Block], samples: &[f64], outputs: &mut [f64]) {
        let ((samples, last_samples), (outputs, last_outputs)) = (samples.as_chunks(), outputs.as_chunks_mut());
        for (samples, outputs) in samples.iter().zip(outputs) {
            if let Some(inputs) = self.moves(samples) {
                *outputs = self.together::<F, W>(four, blocks, inputs);
            } else if !self.one_by_one::<F, W>(four, blocks, samples, outputs) {
                return;
            }
        }
        self.one_by_one::<F, W>(four, blocks, last_samples, last_outputs);
    }

    /// The inputs of samples that are all admissible, none of them leading to a line.
    #[inline(always)]
    #[expect(clippy::needless_bitwise_bool, reason = "vectors have no branches")]
    fn moves(&mut self, samples: &[f64; TOGETHER]) -> Option<[f64; TOGETHER]> {
        let inputs = samples.map(|sample| sample - self.origin.input);
        let (mut last, mut small_moves, mut all) = (self.now.input, self.small_moves, true);
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
    fn together<F: FourLanes, W: Weights>(
        &mut self,
        four: F,
        blocks: &[Block],
        inputs: [f64; TOGETHER],
    ) -> [f64; TOGETHER] {
        let [a, b, c, d] = inputs;
        let moves = [(self.now.input, a), (a, b), (b, c), (c, d)];
        let falls: u8 = moves.iter().map(|(from, to)| u8::from(to < from)).sum();
        // 1 if none of the four falls, -1 if all do; of moves from zero to -0, where either sign will do, -1. Every product waits for
        // it, so it is not made of `falls`: that would take a conversion.
        let sign = 1.0_f64.copysign(d - self.now.input);
        let sums = match usize::from(falls) {
            0 => self.one_way::<F, W>(four, blocks, inputs, Rising, sign),
            TOGETHER => self.one_way::<F, W>(four, blocks, inputs, Falling, sign),
            _ => self.either_way::<F, W>(four, blocks, inputs, moves.map(|(from, to)| Unguessed::of_move(from, to))),
        };
        self.now = Point { input: d, output: sums[TOGETHER - 1] };
        self.taken.samples += TOGETHER;
        sums.map(|sum| sum + self.origin.output)
    }

    /// The sum at every input, as a [`Sweep`] takes it (a zero of the mirror is made one of this side), all of them being on the way to the
    /// same side. Its sign comes as a number that the compiler does not know, or it would make differences of the products.
    #[inline(always)]
    fn one_way<F: FourLanes, W: Weights>(
        &mut self,
        four: F,
        blocks: &[Block],
        inputs: [f64; TOGETHER],
        side: impl Side,
        sign: f64,
    ) -> [f64; TOGETHER] {
        let (sign, mut sums) = (four.splat(sign), [four.splat(0.0); TOGETHER]);
        for (block, slot) in blocks.iter().zip(&mut *self.z) {
            let thresholds = side.thresholds(block);
            let mut z = side.seen(four, four.load(slot));
            for (x, sum) in inputs.iter().zip(&mut sums) {
                z = four.max(thresholds.least_signed(four, four.splat(*x), sign), z);
                *sum = four.add_product(*sum, W::along(side, block, four, z), z);
            }
            *slot = four.store(side.seen(four, z));
        }
        sums.map(|sum| side.turned(four.total(sum)) + 0.0)
    }

    /// The same for each input on the way to its side.
    #[inline(always)]
    fn either_way<F: FourLanes, W: Weights>(
        &mut self,
        four: F,
        blocks: &[Block],
        inputs: [f64; TOGETHER],
        sides: [Unguessed; TOGETHER],
    ) -> [f64; TOGETHER] {
        let mut sums = [four.splat(0.0); TOGETHER];
        for (block, slot) in blocks.iter().zip(&mut *self.z) {
            let mut z = four.load(slot);
            for ((x, side), sum) in inputs.iter().zip(sides).zip(&mut sums) {
                let least = side.thresholds(block).least(four, four.splat(side.turned(*x)));
                let seen = four.max(least, side.seen(four, z));
                *sum = four.add_product(*sum, W::along(side, block, four, seen), seen);
                z = side.seen(four, seen);
            }
            *slot = four.store(z);
        }
        array::from_fn(|k| sides[k].turned(four.total(sums[k])) + 0.0)
    }

    /// Moves to one input after the other: whether none led to a line.
    #[inline(always)]
    fn one_by_one<F: FourLanes, W: Weights>(
        &mut self,
        four: F,
        blocks: &[Block],
        samples: &[f64],
        outputs: &mut [f64],
    ) -> bool {
        for (sample, put_out) in samples.iter().zip(outputs) {
            if is_admissible(*sample) {
                let (from, x) = (self.now.input, *sample - self.origin.input);
                let small_moves = self.members.small_moves(self.small_moves, x - from);
                if small_moves == MOVES_BEFORE_A_LINE {
                    return false;
                }
                self.small_moves = small_moves;
                let bounds = Behind(Unguessed::of_move(from, x));
                let output = Sweep { outputs: &mut *self.z, start: Here, bounds, x }.run::<F, W>(four, blocks);
                self.now = Point { input: x, output };
            } else {
                self.taken.rejected += 1;
            }
            *put_out = self.now.output + self.origin.output;
            self.taken.samples += 1;
        }
        true
    }
}
