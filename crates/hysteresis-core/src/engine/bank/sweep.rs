//! The loop over all operators for one sample, as many at once as a vector has numbers, without a branch.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use super::super::vectors::{Lanes, Vectors};
use super::block::{Block, Bounds};
use super::blocks::BankLoop;
use super::look::Start;
use super::weights::Weights;

/// Where a sweep reads the outputs of a block, and puts the next ones if they are kept.
pub(super) trait Slot<L> {
    fn last(&self) -> &L;
    fn keep(self, next: L);
}

impl<L> Slot<L> for &mut L {
    #[inline(always)]
    fn last(&self) -> &L {
        self
    }

    #[inline(always)]
    fn keep(self, next: L) {
        *self = next;
    }
}

impl<L> Slot<L> for &L {
    #[inline(always)]
    fn last(&self) -> &L {
        self
    }

    #[inline(always)]
    fn keep(self, _: L) {}
}

/// The outputs of a bank: where they may be written, the next ones are kept.
pub(super) trait Outputs {
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>>;
}

impl Outputs for &mut [f64] {
    #[inline(always)]
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>> {
        L::vectors_mut(self).iter_mut()
    }
}

impl Outputs for &[f64] {
    #[inline(always)]
    fn slots<L: Lanes>(self) -> impl Iterator<Item: Slot<L>> {
        L::vectors(self).iter()
    }
}

/// Every operator at the input `x`, coming from `start`: the sum of w_i z_i.
pub(super) struct Sweep<O, S, B> {
    pub(super) outputs: O,
    pub(super) start: S,
    pub(super) bounds: B,
    pub(super) x: f64,
}

impl<O: Outputs, S: Start, B: Bounds> BankLoop for Sweep<O, S, B> {
    type Output = f64;

    /// Each partial sum is made in the order of the model.
    #[inline(always)]
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> f64 {
        let (x, mut sum) = (v.splat(self.x), v.nothing());
        for (block, slot) in blocks.iter().zip(self.outputs.slots::<V::Lanes>()) {
            let z = self.bounds.next(block, v, x, self.start.of(block, v, v.load(slot.last())));
            slot.keep(v.store(z));
            sum = v.sum_product(sum, W::of(block, v, z), z);
        }
        v.total(sum)
    }
}
