//! The loop over all operators, four at once, without a branch.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::marker::PhantomData;

use super::super::four_lanes::{FourLaneLoop, FourLanes, Lanes};
use super::super::solve::Point;
use super::block::{Block, Both, Bounds, Lower, LowerBelowZero, Slides, Upper, UpperAboveZero, Weights};
use super::course::{Push, Turns};
use crate::error::is_admissible;

/// Where a sweep reads the outputs of a block, and puts the next ones if they are kept.
pub(super) trait Slot {
    fn last(&self) -> &Lanes;
    fn keep(self, next: Lanes);
}

impl Slot for &mut Lanes {
    #[inline(always)]
    fn last(&self) -> &Lanes {
        self
    }

    #[inline(always)]
    fn keep(self, next: Lanes) {
        *self = next;
    }
}

impl Slot for &Lanes {
    #[inline(always)]
    fn last(&self) -> &Lanes {
        self
    }

    #[inline(always)]
    fn keep(self, _: Lanes) {}
}

/// Every operator at the input `x`: the sum of w_i z_i. Each lane is summed in the order of the model.
pub(super) struct Sweep<'a, O, B, W> {
    blocks: &'a [Block],
    outputs: O,
    x: f64,
    by: PhantomData<(B, W)>,
}

impl<'a, O: IntoIterator<Item: Slot>, B: Bounds, W: Weights> Sweep<'a, O, B, W> {
    #[inline(always)]
    pub(super) fn new(blocks: &'a [Block], outputs: O, x: f64) -> Self {
        Self { blocks, outputs, x, by: PhantomData }
    }
}

impl<O: IntoIterator<Item: Slot>, B: Bounds, W: Weights> FourLaneLoop for Sweep<'_, O, B, W> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> f64 {
        let x = four.splat(self.x);
        let mut sum = four.splat(0.0);
        for (block, slot) in self.blocks.iter().zip(self.outputs) {
            let z = B::next(block, four, x, four.load(slot.last()));
            slot.keep(four.store(z));
            sum = four.mul_add(W::of(block, four, z), z, sum);
        }
        four.total(sum)
    }
}

/// A sweep for every sample that is admissible: how many are not. Inputs and outputs are relative to `origin`, samples and what is
/// put out are not.
pub(super) struct Run<'a, W> {
    pub(super) blocks: &'a [Block],
    pub(super) z: &'a mut [Lanes],
    pub(super) input: &'a mut f64,
    pub(super) output: &'a mut f64,
    pub(super) origin: Point,
    pub(super) samples: &'a [f64],
    pub(super) outputs: &'a mut [f64],
    pub(super) by: PhantomData<W>,
}

impl<W: Weights> FourLaneLoop for Run<'_, W> {
    type Output = u64;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> u64 {
        let Self { blocks, z, origin, .. } = self;
        let (mut input, mut output, mut rejected) = (*self.input, *self.output, 0);
        let mut turns = Turns::of(blocks.len());
        for (sample, put_out) in self.samples.iter().zip(self.outputs) {
            if is_admissible(*sample) {
                let x = *sample - origin.input;
                output = match turns.push(input, x) {
                    Push::Up => Sweep::<_, Lower, W>::new(blocks, &mut *z, x).run(four),
                    Push::UpBelowZero => Sweep::<_, LowerBelowZero, W>::new(blocks, &mut *z, x).run(four),
                    Push::Down => Sweep::<_, Upper, W>::new(blocks, &mut *z, x).run(four),
                    Push::DownAboveZero => Sweep::<_, UpperAboveZero, W>::new(blocks, &mut *z, x).run(four),
                    Push::Either => Sweep::<_, Both, W>::new(blocks, &mut *z, x).run(four),
                };
                input = x;
            } else {
                rejected += 1;
            }
            *put_out = output + origin.output;
        }
        (*self.input, *self.output) = (input, output);
        rejected
    }
}

/// The output at the input `x` and the slope from there on, every operator coming from its last output. Of a split operator at zero
/// it is that below zero: a search then takes a look more.
pub(super) struct SlopeSweep<'a, B, W> {
    pub(super) blocks: &'a [Block],
    pub(super) outputs: &'a [Lanes],
    pub(super) x: f64,
    pub(super) by: PhantomData<(B, W)>,
}

impl<B: Slides, W: Weights> FourLaneLoop for SlopeSweep<'_, B, W> {
    type Output = (f64, f64);

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> (f64, f64) {
        let x = four.splat(self.x);
        let (mut output, mut slope) = (four.splat(0.0), four.splat(0.0));
        for (block, last) in self.blocks.iter().zip(self.outputs) {
            let last = four.load(last);
            let z = B::next(block, four, x, last);
            let w = W::of(block, four, z);
            output = four.mul_add(w, z, output);
            slope = four.add(slope, four.select(B::slide(block, four, x, last), w, four.splat(0.0)));
        }
        (four.total(output), four.total(slope))
    }
}
