//! The operators of a bank and their weights, side by side as vectors take them.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use alloc::boxed::Box;

use super::super::checks::{check_same, check_same_count};
use super::super::vectors::Processor;
use super::blocks::{BankLoop, Blocks};
use super::weights::{Split, Whole};
use crate::error::Error;
use crate::model::ModifiedPrandtlIshlinskii;
use crate::operator::CoupledPlay;

/// The weights and operators of a model.
#[derive(Debug)]
pub(crate) struct Members {
    /// In the order of the model.
    operators: Box<[(SplitWeight, CoupledPlay)]>,
    /// The same for vectors.
    pub(super) blocks: Blocks,
    /// Whether any operator weighs differently above and below zero: the sum of all others needs no choice.
    split: bool,
    /// The largest move that counts as small.
    pub(super) small_move: f64,
    /// About the slope of a long move: where a search begins.
    pub(super) slope: f64,
}

/// So many moves as the last one lead from one breakpoint to the next if it counts as small: fewer would not pay for a line.
const MOVES_ON_A_LINE: f64 = 16.0;

/// After so many small moves in a row a line is drawn: where a drive just turns round, as a sine at its peak, a line would not pay.
pub(super) const MOVES_BEFORE_A_LINE: u8 = 8;

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
        let operators: Box<[_]> =
            model.members().map(|(above, below, operator)| (SplitWeight { above, below }, operator)).collect();
        let blocks = Blocks::on(processor, &operators);
        let small_move = mean_distance(operators.iter().map(|(_, operator)| *operator)) / MOVES_ON_A_LINE;
        let (least, greatest) = model.slope_range();
        let slope = 0.5 * (least + greatest);
        Self { operators, blocks, split: model.is_split(), small_move, slope }
    }

    pub(crate) fn len(&self) -> usize {
        self.operators.len()
    }

    /// Runs a loop for the weights of the model and the instructions of the processor. Inline, so that a loop is not copied first.
    #[inline(always)]
    pub(super) fn run<L: BankLoop>(&self, work: L) -> L::Output {
        if self.split { self.blocks.run::<_, Split>(work) } else { self.blocks.run::<_, Whole>(work) }
    }

    /// How many small moves in a row there are with this one, `before` of them before it. To stay is none, and ends none.
    #[inline(always)]
    pub(super) fn small_moves(&self, before: u8, distance: f64) -> u8 {
        let with_it = MOVES_BEFORE_A_LINE.min(before + u8::from(distance != 0.0));
        if distance.abs() <= self.small_move { with_it } else { 0 }
    }

    /// The operators with their weights, in the order of the model.
    pub(super) fn iter(&self) -> impl Iterator<Item = (SplitWeight, CoupledPlay)> + Clone {
        self.operators.iter().copied()
    }

    /// The same as a model gives them: weights above and below zero, and the operator.
    pub(crate) fn of_model(&self) -> impl Iterator<Item = (f64, f64, CoupledPlay)> + Clone {
        self.iter().map(|(SplitWeight { above, below }, operator)| (above, below, operator))
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
