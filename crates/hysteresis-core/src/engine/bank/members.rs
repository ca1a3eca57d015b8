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
    /// The largest move after which a line is drawn.
    pub(super) small_move: f64,
    /// About the slope of a long move: where a search begins.
    pub(super) slope: f64,
}

/// So many moves as the last one lead from one breakpoint to the next if a line is to be drawn: fewer would not pay.
const MOVES_ON_A_LINE: f64 = 16.0;

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
        let small_move = mean_distance(all.iter().map(|(_, operator)| *operator)) / MOVES_ON_A_LINE;
        let (least, greatest) = model.slope_range();
        let slope = 0.5 * (least + greatest);
        Self { blocks, operators: all.len(), split: model.is_split(), processor, small_move, slope }
    }

    pub(crate) fn len(&self) -> usize {
        self.operators
    }

    /// Whether a line is drawn after a move.
    #[inline(always)]
    pub(super) fn is_small(&self, distance: f64) -> bool {
        distance.abs() <= self.small_move
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

/// The mean distance between breakpoints of operators whose widest one just moves.
fn mean_distance(operators: impl Iterator<Item = CoupledPlay>) -> f64 {
    let (mut widest, mut count) = (0.0, 0.0);
    for operator in operators.filter(|operator| !operator.is_identity()) {
        widest = f64::max(widest, operator.r().max(operator.ra()));
        count += 1.0;
    }
    // Without any, a line holds everywhere.
    if count > 0.0 { widest / count } else { f64::INFINITY }
}
