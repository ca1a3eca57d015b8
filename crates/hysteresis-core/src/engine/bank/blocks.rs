//! The blocks of a bank, made for the vectors of the processor.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use alloc::boxed::Box;
use core::marker::PhantomData;

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use super::super::vectors::{Avx2, Avx512};
use super::super::vectors::{Portable, Processor, VectorLoop, Vectors};
use super::block::Block;
use super::members::SplitWeight;
use super::weights::Weights;
use crate::operator::CoupledPlay;

/// A loop over the blocks of a bank, with what its operators weigh.
pub(super) trait BankLoop {
    type Output;
    fn run<V: Vectors, W: Weights>(self, v: V, blocks: &[Block<V::Lanes>]) -> Self::Output;
}

/// The blocks of all operators.
#[derive(Debug)]
pub(super) enum Blocks {
    Portable(BlocksOf<Portable>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx2(BlocksOf<Avx2>),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx512(BlocksOf<Avx512>),
}

impl Blocks {
    pub(super) fn on(processor: Processor, operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        match processor {
            Processor::Portable => Self::Portable(BlocksOf::new(Portable, operators)),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Processor::Avx2(avx2) => Self::Avx2(BlocksOf::new(avx2, operators)),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Processor::Avx512(avx512) => Self::Avx512(BlocksOf::new(avx512, operators)),
        }
    }

    /// Runs a loop with the instructions of the processor.
    #[inline(always)]
    pub(super) fn run<L: BankLoop, W: Weights>(&self, work: L) -> L::Output {
        match self {
            Self::Portable(all) => all.run::<L, W>(work),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx2(all) => all.run::<L, W>(work),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx512(all) => all.run::<L, W>(work),
        }
    }

    /// Reads of their memory so much that it is at hand.
    #[inline]
    pub(super) fn fetch(&self) -> u64 {
        match self {
            Self::Portable(all) => all.fetch(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx2(all) => all.fetch(),
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            Self::Avx512(all) => all.fetch(),
        }
    }
}

/// The blocks for vectors of one width.
#[derive(Debug)]
pub(super) struct BlocksOf<V: Vectors> {
    v: V,
    blocks: Box<[Block<V::Lanes>]>,
}

impl<const N: usize, V: Vectors<Lanes = [f64; N]>> BlocksOf<V> {
    fn new(v: V, operators: &[(SplitWeight, CoupledPlay)]) -> Self {
        Self { v, blocks: operators.chunks(N).map(Block::of).collect() }
    }

    #[inline(always)]
    fn run<L: BankLoop, W: Weights>(&self, work: L) -> L::Output {
        self.v.compiled(Weighed { work, blocks: &self.blocks, weights: PhantomData::<W> })
    }

    #[inline]
    fn fetch(&self) -> u64 {
        self.blocks.iter().fold(0, |read, block| read ^ block.fetch())
    }
}

/// A loop with what outputs weigh.
struct Weighed<'a, L, B, W> {
    work: L,
    blocks: &'a [Block<B>],
    weights: PhantomData<W>,
}

impl<L: BankLoop, V: Vectors, W: Weights> VectorLoop<V> for Weighed<'_, L, V::Lanes, W> {
    type Output = L::Output;

    #[inline(always)]
    fn run(self, v: V) -> L::Output {
        self.work.run::<V, W>(v, self.blocks)
    }
}
