//! The operators of a bank and their weights, side by side as vectors take them.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::super::checks::{check_same, check_same_count};
use super::super::four_lanes::{LANES, Processor};
use super::block::Block;
use crate::error::Error;
use crate::model::ModifiedPrandtlIshlinskii;
use crate::operator::CoupledPlay;

/// The weights and operators of a model.
#[derive(Debug)]
pub(crate) struct Members {
    pub(super) blocks: Box<[Block]>,
    operators: usize,
    /// Whether any operator weighs differently above and below zero: the sum of all others needs no choice.
    pub(super) split: bool,
    pub(super) processor: Processor,
}

/// The weights of an operator above and below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SplitWeight {
    pub(super) above: f64,
    pub(super) below: f64,
}

impl SplitWeight {
    /// The weight of the output z; at zero either will do.
    #[inline]
    pub(super) fn at(self, z: f64) -> f64 {
        if z > 0.0 { self.above } else { self.below }
    }

    pub(super) fn magnitude(self) -> f64 {
        self.above.abs().max(self.below.abs())
    }
}

impl Members {
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Self {
        Self::on(Processor::here(), model)
    }

    pub(super) fn on(processor: Processor, model: &ModifiedPrandtlIshlinskii) -> Self {
        let all: Vec<_> =
            model.members().map(|(above, below, operator)| (SplitWeight { above, below }, operator)).collect();
        let blocks = all.chunks(LANES).map(Block::of).collect();
        Self { blocks, operators: all.len(), split: model.is_split(), processor }
    }

    pub(crate) fn len(&self) -> usize {
        self.operators
    }

    /// The operators with their weights, in the order of the model.
    pub(super) fn iter(&self) -> impl Iterator<Item = (SplitWeight, CoupledPlay)> {
        self.blocks.iter().flat_map(Block::operators).take(self.operators)
    }

    /// Whether the weights of the same operators in the same order differ.
    pub(super) fn weigh_otherwise(&self, others: &Self) -> Result<bool, Error> {
        check_same_count(self.len(), others.len())?;
        let mut differ = false;
        for ((weight, z), (other_weight, other)) in self.iter().zip(others.iter()) {
            check_same("r", z.r(), other.r())?;
            check_same("ra", z.ra(), other.ra())?;
            check_same("rb", z.rb(), other.rb())?;
            check_same("rc", z.rc(), other.rc())?;
            differ |= weight != other_weight;
        }
        Ok(differ)
    }
}
