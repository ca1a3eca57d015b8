//! A model between two breakpoints: both families on their branches.

use alloc::vec::Vec;

use super::branch::Branch;
use super::family::{Family, Line, Member};
use super::scout::Scout;
use super::solve::Known;
use super::turning_points::{Direction, Stack};
use super::{Piece, Reach, check_same, check_same_count};
use crate::error::Error;
use crate::model::ModifiedPrandtlIshlinskii;

/// A model as w_0 x plus two families of one-sided plays, the second one mirrored.
///
/// A coupled play is p(x; a = r, b = rb) - p(-x; a = ra, b = rc), which needs r >= rc and ra >= rb.
#[derive(Debug)]
pub(crate) struct Families {
    identity_weight: f64,
    pub(crate) positive: Family,
    pub(crate) negative: Family,
}

impl Families {
    /// The families of a model, or nothing if the thresholds of one of them are not nested in any order.
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Option<Self> {
        let mut identity_weight = 0.0;
        let (mut positive, mut negative) = (Vec::new(), Vec::new());
        for (above, below, z) in model.members() {
            // What both sides of an identity have is a straight line that always slides, so the slope stays above it;
            // the rest, if it is split, is a one-sided play of no width.
            let straight = if z.is_identity() { above.min(below) } else { 0.0 };
            identity_weight += straight;
            if !z.is_identity() || above > straight {
                positive.push(Member { weight: above - straight, rise: z.r(), fall: z.rb() });
            }
            if !z.is_identity() || below > straight {
                negative.push(Member { weight: below - straight, rise: z.ra(), fall: z.rc() });
            }
        }
        Some(Self { identity_weight, positive: Family::nested(positive)?, negative: Family::nested(negative)? })
    }

    /// Whether the weights differ too.
    ///
    /// # Errors
    /// [`Error::OtherOperators`] if the thresholds differ.
    pub(crate) fn check_same_operators(&self, other: &Self) -> Result<bool, Error> {
        let positive = compare(["r", "rb"], &self.positive, &other.positive)?;
        let negative = compare(["ra", "rc"], &self.negative, &other.negative)?;
        Ok(self.identity_weight != other.identity_weight || positive || negative)
    }

    /// An upper bound of what is summed for an output at inputs of that magnitude: what rounding is relative to.
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        self.identity_weight.abs() * input + self.positive.output_scale(input) + self.negative.output_scale(input)
    }
}

/// Whether the weights of two families differ; their thresholds may not.
fn compare([rise, fall]: [&'static str; 2], running: &Family, new: &Family) -> Result<bool, Error> {
    check_same_count(running.len(), new.len())?;
    let mut differ = false;
    for ((a, b, w), (other_a, other_b, other_w)) in running.rungs().zip(new.rungs()) {
        check_same(rise, a, other_a)?;
        check_same(fall, b, other_b)?;
        differ |= w != other_w;
    }
    Ok(differ)
}

/// Room for the turning points of both families.
#[derive(Clone, Debug)]
pub(crate) struct Stacks {
    pub(crate) positive: Stack,
    pub(crate) negative: Stack,
}

/// A place on a branch of the model: both families and the way the input is heading. A copy can look ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    pub(crate) direction: Direction,
    pub(crate) positive: Branch,
    pub(crate) negative: Branch,
}

impl Place {
    /// At rest: all operators at zero, the input at zero.
    pub(crate) fn virgin(families: &Families) -> Self {
        Self {
            direction: Direction::Rising,
            positive: Branch::virgin(&families.positive, Direction::Rising),
            negative: Branch::virgin(&families.negative, Direction::Falling),
        }
    }

    /// Whether the input `x` lies on both branches.
    pub(crate) fn holds(&self, x: f64) -> bool {
        self.positive.holds(self.direction, x) && self.negative.holds(self.direction.reversed(), -x)
    }

    /// Turns round at the input `x`, which becomes turning point number `reversal`.
    #[inline]
    pub(crate) fn reverse(&mut self, families: &Families, x: f64, reversal: u64) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.reverse_from(Direction::Rising, families, x, reversal),
            Direction::Falling => self.reverse_from(Direction::Falling, families, x, reversal),
        }
    }

    #[inline(always)]
    fn reverse_from(&mut self, ended: Direction, families: &Families, x: f64, reversal: u64) {
        let (output, mirrored) = (self.line(families).at(x), ended.reversed());
        self.direction = mirrored;
        self.positive.reverse(&families.positive, ended, x, output, reversal);
        self.negative.reverse(&families.negative, mirrored, -x, output, reversal);
    }

    /// Moves on to the input `x`, ahead on this branch.
    #[inline(never)]
    pub(crate) fn advance(&mut self, families: &Families, stacks: &Stacks, x: f64) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.advance_in(Direction::Rising, families, stacks, x),
            Direction::Falling => self.advance_in(Direction::Falling, families, stacks, x),
        }
    }

    #[inline(always)]
    pub(super) fn advance_in(&mut self, direction: Direction, families: &Families, stacks: &Stacks, x: f64) {
        self.positive.advance(&families.positive, &stacks.positive, direction, x);
        self.negative.advance(&families.negative, &stacks.negative, direction.reversed(), -x);
    }

    /// Moves on from `near` until the output is `to` or the input is at `limit`.
    #[inline(never)]
    pub(crate) fn advance_to_output(
        &mut self,
        families: &Families,
        stacks: &Stacks,
        start: Option<&Self>,
        near: Known,
        to: f64,
        limit: f64,
    ) -> Reach {
        let direction = self.direction;
        let scout = Scout { place: self, start, families, stacks };
        match direction {
            Direction::Rising => scout.find(Direction::Rising, near, to, limit),
            Direction::Falling => scout.find(Direction::Falling, near, to, limit),
        }
    }

    /// Puts what the last reversal froze on the stacks.
    #[inline]
    pub(crate) fn keep_top(&self, stacks: &mut Stacks) {
        self.positive.keep_top(&mut stacks.positive);
        self.negative.keep_top(&mut stacks.negative);
    }

    /// The output of the model over the input, up to the next breakpoint.
    #[inline]
    pub(crate) fn line(&self, families: &Families) -> Line {
        let (positive, negative) = (self.positive.line(), self.negative.line());
        Line {
            slope: families.identity_weight + positive.slope + negative.slope,
            offset: positive.offset - negative.offset,
        }
    }

    /// The line and its breakpoints, over the input.
    #[inline]
    pub(crate) fn piece(&self, families: &Families) -> Piece {
        self.piece_in(self.direction, families)
    }

    #[inline(always)]
    pub(super) fn piece_in(&self, direction: Direction, families: &Families) -> Piece {
        let begin = direction.further(self.positive.begin(), -self.negative.begin());
        let end = direction.nearer(self.positive.end(), -self.negative.end());
        Piece { direction, line: self.line(families), begin, end }
    }
}
