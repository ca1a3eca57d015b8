//! The loop over all operators for one sample, four at once, without a branch.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::four_lanes::{FourLanes, Lanes};
use super::block::{Block, Bounds};
use super::look::Start;
use super::members::BankLoop;
use super::weights::Weights;

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
pub(super) struct Sweep<O, S, B> {
    pub(super) outputs: O,
    pub(super) start: S,
    pub(super) bounds: B,
    pub(super) x: f64,
}

impl<O: IntoIterator<Item: Slot>, S: Start, B: Bounds> BankLoop for Sweep<O, S, B> {
    type Output = f64;

    /// Each lane is summed in the order of the model.
    #[inline(always)]
    fn run<F: FourLanes, W: Weights>(self, four: F, blocks: &[Block]) -> f64 {
        let (x, mut sum) = (four.splat(self.x), four.splat(0.0));
        for (block, slot) in blocks.iter().zip(self.outputs) {
            let z = self.bounds.next(block, four, x, self.start.of(block, four, four.load(slot.last())));
            slot.keep(four.store(z));
            sum = four.add_product(sum, W::of(block, four, z), z);
        }
        four.total(sum)
    }
}
