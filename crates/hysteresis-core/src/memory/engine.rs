//! The turning-point engine: a whole model as one straight line between breakpoints.

use alloc::sync::Arc;
use alloc::vec::Vec;

use super::branch::Branch;
use super::family::{Family, Line, Member};
use super::solve::solve;
use super::state::{FamilyState, TurningPointState};
use super::turning_points::{Direction, Stack};
use super::{Piece, Reach};
use crate::error::Error;
use crate::model::ModifiedPrandtlIshlinskii;

/// A model as w_0 x plus two families of one-sided plays, the second one mirrored.
///
/// A coupled play is p(x; a = r, b = rb) - p(-x; a = ra, b = rc), which needs r >= rc and ra >= rb.
#[derive(Debug)]
pub(crate) struct Families {
    identity_weight: f64,
    positive: Family,
    negative: Family,
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
}

/// A place on a branch of the model: both families and the way they are heading.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    direction: Direction,
    positive: Branch,
    negative: Branch,
}

/// A model with its memory.
#[derive(Clone, Debug)]
pub(crate) struct Engine {
    families: Arc<Families>,
    place: Place,
    positive: Stack,
    negative: Stack,
    reversals: u64,
}

impl Engine {
    pub(crate) fn new(families: Arc<Families>) -> Self {
        let (p, n) = (families.positive.len(), families.negative.len());
        Self { families, place: Place::virgin(p, n), positive: Stack::new(p), negative: Stack::new(n), reversals: 0 }
    }

    pub(crate) fn reset(&mut self) {
        self.place = Place::virgin(self.families.positive.len(), self.families.negative.len());
        self.positive.clear();
        self.negative.clear();
        self.reversals = 0;
    }

    /// Moves the input from `from` to `to`.
    #[inline]
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        self.settle(self.look_input(from, to));
    }

    /// The output after a move of the input from `from` to `to`.
    #[inline]
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        self.line(&self.look_input(from, to)).at(to)
    }

    /// Moves the input from `from` in `direction` until the output is `to` or the input is at a limit.
    #[inline]
    pub(crate) fn move_output(&mut self, direction: Direction, from: f64, to: f64, limits: (f64, f64)) -> Reach {
        let (place, reach) = self.look_output(direction, from, to, limits);
        self.settle(place);
        reach
    }

    fn look_input(&self, from: f64, to: f64) -> Place {
        let direction = match self.place.direction {
            Direction::Rising if to < from => Direction::Falling,
            Direction::Falling if to > from => Direction::Rising,
            direction => direction,
        };
        self.advanced(self.heading(direction, from), to)
    }

    pub(crate) fn look_output(&self, direction: Direction, from: f64, to: f64, limits: (f64, f64)) -> (Place, Reach) {
        let (sign, limit) = (direction.sign(), direction.limit(limits));
        let (mut place, mut near) = (self.heading(direction, from), from);
        loop {
            let wiped_out = self.next_wipe_out(&place);
            let far = if sign * wiped_out < sign * limit { wiped_out } else { limit };
            let ahead = self.advanced(place, far);
            let reached = self.line(&ahead).at(far);
            if sign * to < sign * reached {
                place = self.advanced(place, solve(|x| self.line(&self.advanced(place, x)), to, near, far));
                let input = self.line(&place).inverted().at(to);
                return (place, Reach { input, output: to, saturated: false });
            }
            if far == limit {
                return (ahead, Reach { input: limit, output: reached, saturated: to != reached });
            }
            (place, near) = (ahead, far);
        }
    }

    /// The present place, or the start of the branch back from it.
    fn heading(&self, direction: Direction, from: f64) -> Place {
        let Place { direction: present, positive, negative } = self.place;
        if direction == present {
            return self.place;
        }
        let reversal = self.reversals + 1;
        Place {
            direction,
            positive: positive.reversed(&self.families.positive, &self.positive, from, reversal),
            negative: negative.reversed(&self.families.negative, &self.negative, -from, reversal),
        }
    }

    #[inline]
    fn advanced(&self, place: Place, x: f64) -> Place {
        Place {
            direction: place.direction,
            positive: place.positive.advanced(&self.families.positive, &self.positive, x),
            negative: place.negative.advanced(&self.families.negative, &self.negative, -x),
        }
    }

    fn settle(&mut self, place: Place) {
        if place.direction != self.place.direction {
            self.reversals += 1;
        }
        place.positive.settle(&mut self.positive);
        place.negative.settle(&mut self.negative);
        self.place = place;
    }

    #[inline]
    fn line(&self, place: &Place) -> Line {
        let positive = place.positive.line(&self.families.positive);
        let negative = place.negative.line(&self.families.negative);
        Line {
            slope: self.families.identity_weight + positive.slope + negative.slope,
            offset: positive.offset - negative.offset,
        }
    }

    /// The line at the present place and the next breakpoint, over the input.
    #[inline]
    pub(crate) fn piece(&self) -> Piece {
        let positive = self.place.positive.next_breakpoint(&self.families.positive);
        let negative = -self.place.negative.next_breakpoint(&self.families.negative);
        let end = self.place.nearer(positive, negative);
        Piece { direction: self.place.direction, line: self.line(&self.place), end }
    }

    /// The same line with the roles of input and output swapped, up to the next breakpoint or limit.
    #[inline]
    pub(crate) fn inverse_piece(&self, limits: (f64, f64)) -> Piece {
        let Piece { direction, line, end } = self.piece();
        let end = self.place.nearer(end, direction.limit(limits));
        Piece { direction, line: line.inverted(), end: line.at(end) }
    }

    fn next_wipe_out(&self, place: &Place) -> f64 {
        let positive = place.positive.next_wipe_out(&self.families.positive);
        let negative = -place.negative.next_wipe_out(&self.families.negative);
        place.nearer(positive, negative)
    }

    /// The reversals that still determine the output of some operator, oldest first.
    pub(crate) fn memory(&self) -> Vec<f64> {
        let remembered = |stack: &Stack, sign: f64| -> Vec<(u64, f64)> {
            stack.points().map(|point| (point.reversal, sign * point.input)).collect()
        };
        let mut all = remembered(&self.positive, 1.0);
        all.extend(remembered(&self.negative, -1.0));
        all.sort_by_key(|(reversal, _)| *reversal);
        all.dedup_by_key(|(reversal, _)| *reversal);
        all.into_iter().map(|(_, input)| input).collect()
    }

    pub(crate) fn state(&self) -> TurningPointState {
        TurningPointState {
            direction: self.place.direction,
            reversals: self.reversals,
            positive: self.place.positive.state(&self.positive),
            negative: self.place.negative.state(&self.negative),
        }
    }

    /// Continues from a saved state.
    pub(crate) fn restore(&mut self, state: &TurningPointState) -> Result<(), Error> {
        let restore = |family: &Family, saved: &FamilyState, direction: Direction| {
            saved.check(family.len(), state.reversals)?;
            Ok::<_, Error>(Branch::restored(family, saved, direction))
        };
        let (positive_branch, positive) = restore(&self.families.positive, &state.positive, state.direction)?;
        let (negative_branch, negative) =
            restore(&self.families.negative, &state.negative, state.direction.reversed())?;
        self.place = Place { direction: state.direction, positive: positive_branch, negative: negative_branch };
        (self.positive, self.negative, self.reversals) = (positive, negative, state.reversals);
        Ok(())
    }
}

impl Place {
    fn virgin(positive: usize, negative: usize) -> Self {
        Self {
            direction: Direction::Rising,
            positive: Branch::virgin(positive, Direction::Rising),
            negative: Branch::virgin(negative, Direction::Falling),
        }
    }

    #[inline]
    fn nearer(&self, one: f64, other: f64) -> f64 {
        match self.direction {
            Direction::Rising => one.min(other),
            Direction::Falling => one.max(other),
        }
    }
}
