//! The turning-point engine: a model and its memory, moved by its input or by its output.

use alloc::sync::Arc;
use alloc::vec::Vec;

use super::branch::Branch;
use super::family::Family;
use super::place::{Families, Place, Stacks};
use super::solve::Known;
use super::state::{FamilyState, TurningPointState};
use super::turning_points::{Direction, Stack, TurningPoint};
use super::{Piece, Reach, restore_tolerance};
use crate::error::Error;

/// Far more reversals than any stream sees, and far from the end of the counter.
const MAX_REVERSALS: u64 = 1 << 63;

/// A model with its memory.
#[derive(Clone, Debug)]
pub(crate) struct Engine {
    families: Arc<Families>,
    place: Place,
    stacks: Stacks,
    reversals: u64,
}

impl Engine {
    pub(crate) fn new(families: Arc<Families>) -> Self {
        let place = Place::virgin(&families);
        let (positive, negative) = (Stack::new(families.positive.len()), Stack::new(families.negative.len()));
        Self { families, place, stacks: Stacks { positive, negative }, reversals: 0 }
    }

    /// What a scout needs.
    #[cfg(test)]
    pub(super) fn parts(&self) -> (Place, &Families, &Stacks) {
        (self.place, &self.families, &self.stacks)
    }

    pub(crate) fn reset(&mut self) {
        self.place = Place::virgin(&self.families);
        self.reversals = 0;
    }

    /// Moves the input from `from` to `to`.
    #[inline]
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        if self.place.direction.leads_away(from, to) {
            self.reverse(from);
        }
        self.place.advance(&self.families, &self.stacks, to);
    }

    /// Turns round at the input `x`.
    #[inline]
    fn reverse(&mut self, x: f64) {
        self.reversals += 1;
        self.place.reverse(&self.families, x, self.reversals);
        self.place.keep_top(&mut self.stacks);
    }

    /// The output after a move of the input from `from` to `to`.
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        let mut place = self.place;
        if place.direction.leads_away(from, to) {
            place.reverse(&self.families, from, self.reversals + 1);
        }
        place.advance(&self.families, &self.stacks, to);
        place.line(&self.families).at(to)
    }

    /// Moves on from `from` in `direction` until the output is `to` or the input is at a limit.
    #[inline]
    pub(crate) fn move_output(&mut self, direction: Direction, from: Known, to: f64, limits: (f64, f64)) -> Reach {
        if direction != self.place.direction {
            self.reverse(from.input);
        }
        self.place.advance_to_output(&self.families, &self.stacks, None, from, to, direction.limit(limits))
    }

    /// Where [`move_output`](Self::move_output) would come to.
    pub(crate) fn peek_output(&self, direction: Direction, from: Known, to: f64, limits: (f64, f64)) -> Reach {
        let mut place = self.place;
        if direction != place.direction {
            place.reverse(&self.families, from.input, self.reversals + 1);
        }
        let start = place;
        place.advance_to_output(&self.families, &self.stacks, Some(&start), from, to, direction.limit(limits))
    }

    /// The line at the present place and the next breakpoint, over the input.
    #[inline]
    pub(crate) fn piece(&self) -> Piece {
        self.place.piece(&self.families)
    }

    /// The same line with the roles of input and output swapped, up to the next breakpoint or limit.
    #[inline]
    pub(crate) fn inverse_piece(&self, limits: (f64, f64)) -> Piece {
        let Piece { direction, line, begin, end } = self.piece();
        let end = direction.nearer(end, direction.limit(limits));
        Piece { direction, line: line.inverted(), begin: line.at(begin), end: line.at(end) }
    }

    /// Takes over other weights of the same operators, the input being at `input`: whether they differ.
    pub(crate) fn reweigh(&mut self, families: &Arc<Families>, input: f64) -> Result<bool, Error> {
        let differ = self.families.check_same_operators(families)?;
        if differ {
            self.families = families.clone();
            let Self { families, place, stacks, .. } = self;
            let direction = place.direction;
            place.positive.reweigh(&families.positive, &mut stacks.positive, direction);
            place.negative.reweigh(&families.negative, &mut stacks.negative, direction.reversed());
            for direction in [Direction::Rising, Direction::Falling] {
                self.renew_outputs(direction, input);
            }
            self.place.positive.renew_top(&self.stacks.positive);
            self.place.negative.renew_top(&self.stacks.negative);
        }
        Ok(differ)
    }

    /// The number of operators with memory.
    pub(crate) fn operators(&self) -> usize {
        self.families.positive.len()
    }

    /// Computes the output at every turning point that lies in `direction` of `input`: the model is back at it when the
    /// input is back there, so a copy of the place goes and looks.
    fn renew_outputs(&mut self, direction: Direction, input: f64) {
        let Self { families, place, stacks, reversals } = self;
        let mut start = *place;
        if direction != start.direction {
            start.reverse(families, input, *reversals + 1);
        }
        let mut look = start;
        for height in (1..=place.positive.height()).rev() {
            let point = stacks.positive.get(height).point;
            if point.ended == direction {
                look.advance(families, stacks, point.input);
                stacks.positive.set_output(height, look.line(families).at(point.input));
            }
        }
        let mut look = start;
        for height in (1..=place.negative.height()).rev() {
            let point = stacks.negative.get(height).point;
            if point.ended.reversed() == direction {
                look.advance(families, stacks, -point.input);
                stacks.negative.set_output(height, look.line(families).at(-point.input));
            }
        }
    }

    /// The turning points of both families, those of the negative one mirrored back to the input of the model.
    fn remembered(&self) -> impl Iterator<Item = TurningPoint> {
        let mirrored = |point: TurningPoint| TurningPoint { input: -point.input, ..point };
        let negative = self.place.negative.remembered(&self.stacks.negative).map(mirrored);
        self.place.positive.remembered(&self.stacks.positive).chain(negative)
    }

    /// The reversals that still determine the output of some operator, oldest first.
    pub(crate) fn memory(&self) -> Vec<f64> {
        let mut all: Vec<TurningPoint> = self.remembered().collect();
        all.sort_by_key(|point| point.reversal);
        all.dedup_by_key(|point| point.reversal);
        all.into_iter().map(|point| point.input).collect()
    }

    pub(crate) fn state(&self) -> TurningPointState {
        TurningPointState {
            direction: self.place.direction,
            reversals: self.reversals,
            positive: self.place.positive.state(&self.stacks.positive),
            negative: self.place.negative.state(&self.stacks.negative),
        }
    }

    /// Continues from a saved state that was at this input and output.
    pub(crate) fn restore(&mut self, state: &TurningPointState, input: f64, output: f64) -> Result<(), Error> {
        let TurningPointState { direction, reversals, .. } = *state;
        if reversals > MAX_REVERSALS {
            return Err(Error::State { expected: "at most 2^63 reversals" });
        }
        let restored = |family: &Family, saved: &FamilyState, direction: Direction| {
            saved.check(family.len(), reversals, direction)?;
            Ok(Branch::restored(family, saved, direction))
        };
        let families = self.families.clone();
        let (positive, positive_stack) = restored(&families.positive, &state.positive, direction)?;
        let (negative, negative_stack) = restored(&families.negative, &state.negative, direction.reversed())?;
        let place = Place { direction, positive, negative };
        let stacks = Stacks { positive: positive_stack, negative: negative_stack };
        let candidate = Self { families, place, stacks, reversals };
        candidate.check_place(input, output)?;
        candidate.check_turning_points(input)?;
        *self = candidate;
        Ok(())
    }

    /// The input must lie on the branches that the state tells of, and the model have the output there.
    fn check_place(&self, input: f64, output: f64) -> Result<(), Error> {
        if self.place.holds(input) && self.agree(self.place.line(&self.families).at(input), output, input) {
            Ok(())
        } else {
            Err(Error::State { expected: "the output that the model has at the last input on this branch" })
        }
    }

    /// Back at a remembered turning point the model is back at its output: so the inverse may rely on those.
    fn check_turning_points(&self, input: f64) -> Result<(), Error> {
        for TurningPoint { input: turn, output, .. } in self.remembered() {
            if !self.agree(self.peek_input(input, turn), output, input.abs() + turn.abs()) {
                return Err(Error::State { expected: "turning points with the outputs that the model has there" });
            }
        }
        Ok(())
    }

    /// Whether two outputs at inputs of that magnitude are equal but for rounding.
    fn agree(&self, one: f64, other: f64, input: f64) -> bool {
        (one - other).abs() <= restore_tolerance(self.families.output_scale(input.abs() + f64::MIN_POSITIVE))
    }
}
