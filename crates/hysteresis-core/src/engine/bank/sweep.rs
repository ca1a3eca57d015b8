//! The loop over all operators, four at once, without a branch.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::marker::PhantomData;

use super::super::four_lanes::{FourLaneLoop, FourLanes, Lanes};
use super::super::solve::Point;
use super::block::{Block, Both, Bounds, Lower, LowerBelowZero, Unmoved, Upper, UpperAboveZero, Weights};
use super::course::{Push, Turns};
use super::look::{At, Start};
use super::members::Members;
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

/// Every operator at the input `x`: the sum of w_i z_i.
pub(super) struct Sweep<'a, O, W> {
    pub(super) blocks: &'a [Block],
    pub(super) outputs: O,
    pub(super) push: Push,
    pub(super) x: f64,
    pub(super) by: PhantomData<W>,
}

impl<O: IntoIterator<Item: Slot>, W: Weights> Sweep<'_, O, W> {
    /// Each lane is summed in the order of the model.
    #[inline(always)]
    fn pushed_by<F: FourLanes, B: Bounds>(self, four: F) -> f64 {
        let (x, mut sum) = (four.splat(self.x), four.splat(0.0));
        for (block, slot) in self.blocks.iter().zip(self.outputs) {
            let z = B::next(block, four, x, four.load(slot.last()));
            slot.keep(four.store(z));
            sum = four.mul_add(W::of(block, four, z), z, sum);
        }
        four.total(sum)
    }
}

impl<O: IntoIterator<Item: Slot>, W: Weights> FourLaneLoop for Sweep<'_, O, W> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> f64 {
        match self.push {
            Push::Up => self.pushed_by::<F, Lower>(four),
            Push::UpBelowZero => self.pushed_by::<F, LowerBelowZero>(four),
            Push::Down => self.pushed_by::<F, Upper>(four),
            Push::DownAboveZero => self.pushed_by::<F, UpperAboveZero>(four),
            Push::Either => self.pushed_by::<F, Both>(four),
            Push::Nowhere => self.pushed_by::<F, Unmoved>(four),
        }
    }
}

/// Every operator at the input `to`, coming from `start`: the sum of w_i z_i.
pub(super) struct Detour<'a, O, W> {
    pub(super) blocks: &'a [Block],
    pub(super) outputs: O,
    pub(super) start: At,
    pub(super) to: f64,
    pub(super) by: PhantomData<W>,
}

impl<O: IntoIterator<Item: Slot>, W: Weights> FourLaneLoop for Detour<'_, O, W> {
    type Output = f64;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> f64 {
        let (to, mut sum) = (four.splat(self.to), four.splat(0.0));
        for (block, slot) in self.blocks.iter().zip(self.outputs) {
            let z = Both::next(block, four, to, self.start.of(block, four, four.load(slot.last())));
            slot.keep(four.store(z));
            sum = four.mul_add(W::of(block, four, z), z, sum);
        }
        four.total(sum)
    }
}

/// A sweep for every sample that is admissible, up to the first one after which a line is to be drawn. Inputs and outputs are
/// relative to `origin`, samples and what is put out are not.
pub(super) struct Run<'a, W> {
    pub(super) members: &'a Members,
    pub(super) z: &'a mut [Lanes],
    pub(super) now: &'a mut Point,
    pub(super) turns: &'a mut Turns,
    pub(super) origin: Point,
    pub(super) samples: &'a [f64],
    pub(super) outputs: &'a mut [f64],
    pub(super) by: PhantomData<W>,
}

/// What a run took: how many samples, and how many of them are not admissible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Taken {
    pub(crate) samples: usize,
    pub(crate) rejected: u64,
}

impl<W: Weights> FourLaneLoop for Run<'_, W> {
    type Output = Taken;

    #[inline(always)]
    fn run<F: FourLanes>(self, four: F) -> Taken {
        let Self { members, z, origin, .. } = self;
        let (blocks, small_move) = (&*members.blocks, members.small_move);
        let (Point { mut input, mut output }, mut turns) = (*self.now, *self.turns);
        let mut taken = Taken { samples: 0, rejected: 0 };
        for (sample, put_out) in self.samples.iter().zip(self.outputs) {
            if is_admissible(*sample) {
                let x = *sample - origin.input;
                if (x - input).abs() <= small_move && x != input {
                    break;
                }
                let push = turns.push(input, x);
                output = Sweep::<_, W> { blocks, outputs: &mut *z, push, x, by: PhantomData }.run(four);
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
