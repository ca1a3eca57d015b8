//! A model between two breakpoints: both families on their branches.

use alloc::vec::Vec;

use super::branch::Branch;
use super::family::{Family, Line, Member};
use super::solve::{Known, solve};
use super::turning_points::{Direction, Stack};
use super::{Piece, Reach};
use crate::model::ModifiedPrandtlIshlinskii;

/// A model as w_0 x plus two families of one-sided plays, the second one mirrored.
///
/// A coupled play is p(x; a = r, b = rb) - p(-x; a = ra, b = rc), which needs r >= rc and ra >= rb.
#[derive(Debug)]
pub(crate) struct Families {
    pub(crate) identity_weight: f64,
    pub(crate) positive: Family,
    pub(crate) negative: Family,
}

impl Families {
    /// The families of a model, or nothing if the thresholds of one of them are not nested in any order.
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Option<Self> {
        let mut identity_weight = 0.0;
        let (mut positive, mut negative) = (Vec::new(), Vec::new());
        for (&weight, z) in model.weights().iter().zip(model.operators()) {
            if z.is_identity() {
                identity_weight += weight;
            } else {
                positive.push(Member { weight, rise: z.r(), fall: z.rb() });
                negative.push(Member { weight, rise: z.ra(), fall: z.rc() });
            }
        }
        Some(Self { identity_weight, positive: Family::nested(positive)?, negative: Family::nested(negative)? })
    }

    /// An upper bound of what is summed for an output at inputs of that magnitude: what rounding is relative to.
    pub(crate) fn output_scale(&self, input: f64) -> f64 {
        self.identity_weight.abs() * input + self.positive.output_scale(input) + self.negative.output_scale(input)
    }
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
        self.positive.holds(x) && self.negative.holds(-x)
    }

    /// Turns round at the input `x`, which becomes turning point number `reversal`.
    #[inline]
    pub(crate) fn reverse(&mut self, families: &Families, x: f64, reversal: u64) {
        let output = self.line(families).at(x);
        self.direction = self.direction.reversed();
        self.positive.reverse(&families.positive, x, output, reversal);
        self.negative.reverse(&families.negative, -x, output, reversal);
    }

    /// Moves on to the input `x`, ahead on this branch.
    #[inline]
    pub(crate) fn advance(&mut self, families: &Families, stacks: &Stacks, x: f64) {
        self.positive.advance(&families.positive, &stacks.positive, x);
        self.negative.advance(&families.negative, &stacks.negative, -x);
    }

    /// Moves on from `near` until the output is `to` or the input is at `limit`. `slope` is that of the line that left
    /// there, if it is known.
    #[inline]
    pub(crate) fn advance_to_output(
        &mut self,
        families: &Families,
        stacks: &Stacks,
        near: Known,
        slope: f64,
        to: f64,
        limit: f64,
    ) -> Reach {
        let (near, slope, far) = self.close_loops(stacks, near, slope, to, limit);
        let look = |place: &mut Self, x: f64| {
            place.advance(families, stacks, x);
            place.piece(families)
        };
        solve(self, self.direction, near, slope, far, to, limit, look)
    }

    /// Wipes out every loop whose turning point has an output that `to` lies beyond; where that comes to, and the
    /// turning point at which the loop that holds `to` closes.
    #[inline]
    fn close_loops(
        &mut self,
        stacks: &Stacks,
        mut near: Known,
        mut slope: f64,
        to: f64,
        limit: f64,
    ) -> (Known, f64, Option<Known>) {
        let direction = self.direction;
        loop {
            let positive = self.positive.closes_at(&stacks.positive);
            let negative = self.negative.closes_at(&stacks.negative);
            let positive = positive.map(|point| Known { input: point.input, output: point.output });
            let negative = negative.map(|point| Known { input: -point.input, output: point.output });
            let nearest = match (positive, negative) {
                (Some(one), Some(other)) if direction.has_passed(one.input, other.input) => Some(one),
                (_, Some(other)) => Some(other),
                (one, None) => one,
            };
            let Some(close) = nearest else { return (near, slope, None) };
            let ahead = !direction.has_passed(close.input, near.input) && !direction.has_passed(limit, close.input);
            if !ahead {
                return (near, slope, None);
            }
            if !direction.has_passed(close.output, to) {
                return (near, slope, Some(close));
            }
            self.positive.wipe_out(&stacks.positive, close.input);
            self.negative.wipe_out(&stacks.negative, -close.input);
            (near, slope) = (close, f64::NAN);
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

    /// The line and the next breakpoint, over the input.
    #[inline]
    pub(crate) fn piece(&self, families: &Families) -> Piece {
        let direction = self.direction;
        let begin = direction.reversed().nearer(self.positive.begin(), -self.negative.begin());
        let end = direction.nearer(self.positive.end(), -self.negative.end());
        Piece { direction, line: self.line(families), begin, end }
    }
}
