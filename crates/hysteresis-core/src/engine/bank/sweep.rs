//! The loop over all operators, four at once, without a branch.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::four_lanes::{FourLanes, Lanes};
use super::super::solve::Point;
use super::block::{Block, Both, Bounds, Lower, LowerBelowZero, Unmoved, Upper, UpperAboveZero};
use super::course::{Push, Turns};
use super::look::{Here, Start};
use super::members::{BankLoop, Members};
use super::weights::Weights;
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

/// Every operator at the input `x`, coming from `start`: the sum of w_i z_i.
pub(super) struct Sweep<O, S> {
    pub(super) outputs: O,
    pub(super) start: S,
    pub(super) push: Push,
    pub(super) x: f64,
}

impl<O: IntoIterator<Item: Slot>, S: Start> BankLoop for Sweep<O, S> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> f64 {
        match self.push {
            Push::Up => self.pushed_by::<Lower, F, W>(four, blocks),
            Push::UpBelowZero => self.pushed_by::<LowerBelowZero, F, W>(four, blocks),
            Push::Down => self.pushed_by::<Upper, F, W>(four, blocks),
            Push::DownAboveZero => self.pushed_by::<UpperAboveZero, F, W>(four, blocks),
            Push::Either => self.pushed_by::<Both, F, W>(four, blocks),
            Push::Nowhere => self.pushed_by::<Unmoved, F, W>(four, blocks),
        }
    }
}

impl<O: IntoIterator<Item: Slot>, S: Start> Sweep<O, S> {
    /// Each lane is summed in the order of the model.
    #[inline(always)]
    fn pushed_by<B: Bounds, F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> f64 {
        let (x, mut sum) = (four.splat(self.x), four.splat(0.0));
        for (block, slot) in blocks.iter().zip(self.outputs) {
            let z = B::next(block, four, x, self.start.of(block, four, four.load(slot.last())));
            slot.keep(four.store(z));
            sum = four.mul_add(W::of(block, four, z), z, sum);
        }
        four.total(sum)
    }
}

/// A sweep for every sample that is admissible, up to the first one after which a line is to be drawn. Inputs and outputs are
/// relative to `origin`, samples and what is put out are not.
pub(super) struct Run<'a> {
    pub(super) members: &'a Members,
    pub(super) z: &'a mut [Lanes],
    pub(super) now: &'a mut Point,
    pub(super) turns: &'a mut Turns,
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
        let Self { members, z, origin, .. } = self;
        let (Point { mut input, mut output }, mut turns) = (*self.now, *self.turns);
        let mut taken = Taken { samples: 0, rejected: 0 };
        for (sample, put_out) in self.samples.iter().zip(self.outputs) {
            if is_admissible(*sample) {
                let x = *sample - origin.input;
                if members.is_small(x - input) && x != input {
                    break;
                }
                let push = turns.push(input, x);
                output = Sweep { outputs: &mut *z, start: Here, push, x }.run::<F, W>(four, blocks);
                input = x;
            } else {
                taken.rejected += 1;
            }
            *put_out = output + origin.output;
            taken.samples += 1;
        }
        (*self.now, *self.turns) = (Point { input, output }, turns);
        taken
    }
}
