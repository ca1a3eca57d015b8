//! The memory of a stream as a plain value, to keep and to continue from.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::direction::Direction;
use super::turning_points::TurningPoint;
use crate::error::{Error, is_admissible};

/// The memory of a model, in one of two forms.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)
)]
pub enum MemoryState {
    /// The turning points of nested thresholds.
    TurningPoints(TurningPointState),
    /// All operators of a bank.
    Bank(BankState),
}

/// All operators of a bank.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct BankState {
    /// Their outputs z_i.
    pub outputs: Box<[f64]>,
    /// In which direction a straight line was drawn that the next sample may be on; None if none was.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub line: Option<Direction>,
    /// Without a line: how many moves in a row were small up to now. After 8 of them one is drawn.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub small_moves: u8,
}

#[cfg(feature = "serde")]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_zero(count: &u8) -> bool {
    *count == 0
}

/// The turning points of both families of one-sided plays.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TurningPointState {
    /// Which way the input moved when it last let an operator slide, or was about to.
    pub direction: Direction,
    /// How many reversals were noted, for numbering: where a step back lets nothing slide, none need be.
    pub reversals: u64,
    /// The family above zero.
    pub positive: FamilyState,
    /// The family below zero, in the mirrored coordinate.
    pub negative: FamilyState,
}

/// The turning points of one family and its position on the present branch.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct FamilyState {
    /// How many operators slide on the present branch.
    pub moved: usize,
    /// How many of them rest at zero.
    pub at_zero: usize,
    /// What froze the others, oldest first.
    pub turning_points: Vec<TurningPoint>,
}

impl FamilyState {
    /// Whether a family of `operators` can be in this state: only such a state is ever restored.
    pub(crate) fn check(&self, operators: usize, reversals: u64, direction: Direction) -> Result<(), Error> {
        let mut below = operators;
        for (height, point) in self.turning_points.iter().enumerate() {
            // Only the lowest turning point may have moved every operator, as many as the virgin state below it.
            let fewer = point.moved < below || height == 0 && point.moved == below;
            if !fewer
                || point.moved == 0
                || point.at_zero > if point.ended == Direction::Falling { point.moved } else { 0 }
                || !is_admissible(0.5 * point.input) // it is relative to an offset, which is admissible too
                || !point.output.is_finite()
            {
                return Err(Error::State {
                    expected: "turning points at finite inputs, each with fewer operators than the one below it \
                               and no more than the model has",
                });
            }
            if point.reversal == 0 || point.reversal > reversals {
                return Err(Error::State { expected: "turning points numbered from 1 to the number of reversals" });
            }
            below = point.moved;
        }
        let resting = if direction == Direction::Falling { self.moved } else { 0 };
        if self.moved > below || self.at_zero > resting || (self.moved == below && !self.turning_points.is_empty()) {
            return Err(Error::State { expected: "fewer sliding operators than the newest turning point has moved" });
        }
        Ok(())
    }
}
