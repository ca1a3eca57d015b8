//! The way of the inverse: a place that moves until the output is what was asked for.

use super::branch::Foothold;
use super::place::{Families, Place, Stacks};
use super::solve::{Known, Traveller, first_guess, solve};
use super::turning_points::Direction;
use super::{Piece, Reach};

/// A place on the move that may turn out to be too far. `start` is where it began if the turning points of the last
/// reversal are not on the stacks.
pub(super) struct Scout<'a> {
    pub(super) place: &'a mut Place,
    pub(super) start: Option<&'a Place>,
    pub(super) families: &'a Families,
    pub(super) stacks: &'a Stacks,
}

impl Scout<'_> {
    /// Moves on from `near` until the output is `to` or the input is at `limit`.
    #[inline(always)]
    pub(super) fn find(mut self, direction: Direction, near: Known, to: f64, limit: f64) -> Reach {
        let (near, far) = self.close_loops(direction, near, to, limit);
        let slope = self.place.line(self.families).slope;
        solve(&mut self, direction, near, far, first_guess(near, slope, far, to), to, limit)
    }

    /// Closes every loop whose turning point has an output that `to` lies beyond; where that comes to, and the turning
    /// point at which the loop that holds `to` closes.
    #[inline(always)]
    fn close_loops(&mut self, direction: Direction, mut near: Known, to: f64, limit: f64) -> (Known, Option<Known>) {
        let (Place { positive, negative, .. }, families, stacks) = (&mut *self.place, self.families, self.stacks);
        loop {
            let one = positive.closes_at(&stacks.positive, direction);
            let other = negative.closes_at(&stacks.negative, direction.reversed()).map(Known::mirrored);
            let nearest = match (one, other) {
                (Some(one), Some(other)) if direction.leads_away(one.input, other.input) => Some(other),
                (one, other) => one.or(other),
            };
            let Some(close) = nearest else { return (near, None) };
            let ahead = !direction.has_passed(close.input, near.input) & !direction.has_passed(limit, close.input);
            if !ahead {
                return (near, None);
            }
            if !direction.has_passed(close.output, to) {
                return (near, Some(close));
            }
            positive.close_loops(&families.positive, &stacks.positive, direction, close.input);
            negative.close_loops(&families.negative, &stacks.negative, direction.reversed(), -close.input);
            near = close;
        }
    }
}

impl Traveller for Scout<'_> {
    type Foothold = (Foothold, Foothold);

    #[inline(always)]
    fn foothold(&self) -> (Foothold, Foothold) {
        (self.place.positive.foothold(), self.place.negative.foothold())
    }

    #[inline(always)]
    fn go_back(&mut self, (positive, negative): (Foothold, Foothold)) {
        let (start, stacks) = (self.start, self.stacks);
        self.place.positive.go_back(positive, start.map(|start| &start.positive), &stacks.positive);
        self.place.negative.go_back(negative, start.map(|start| &start.negative), &stacks.negative);
    }

    #[inline(always)]
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        self.place.advance_in(direction, self.families, self.stacks, input);
        self.place.piece_in(direction, self.families)
    }
}

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;
    use core::cell::Cell;

    use super::super::engine::Engine;
    use super::*;
    use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

    /// Counts the looks of a scout.
    struct Counting<'a>(Scout<'a>, &'a Cell<u32>);

    impl Traveller for Counting<'_> {
        type Foothold = (Foothold, Foothold);

        fn foothold(&self) -> Self::Foothold {
            self.0.foothold()
        }

        fn go_back(&mut self, to: Self::Foothold) {
            self.0.go_back(to);
        }

        fn look(&mut self, direction: Direction, input: f64) -> Piece {
            self.1.set(self.1.get() + 1);
            self.0.look(direction, input)
        }
    }

    fn noise(state: &mut u64) -> f64 {
        *state ^= *state << 13;
        *state ^= *state >> 7;
        *state ^= *state << 17;
        f64::from(u32::try_from(*state >> 32).unwrap()) / f64::from(u32::MAX)
    }

    /// How many looks the way from the place of an engine to an output takes, on the whole range of inputs.
    fn looks(engine: &Engine, from: Known, to: f64) -> u32 {
        let (mut place, families, stacks) = engine.parts();
        let direction = if to < from.output { Direction::Falling } else { Direction::Rising };
        if direction != place.direction {
            place.reverse(families, from.input, u64::MAX);
        }
        let start = place;
        let count = Cell::new(0);
        let mut scout = Scout { place: &mut place, start: Some(&start), families, stacks };
        let limit = direction.limit((-1e100, 1e100));
        let (near, far) = scout.close_loops(direction, from, to, limit);
        let guess = first_guess(near, scout.place.line(families).slope, far, to);
        solve(&mut Counting(scout, &count), direction, near, far, guess, to, limit);
        count.get()
    }

    #[test]
    fn few_looks_lead_to_any_output() {
        let spacings: [fn(f64) -> f64; 3] = [|t| 500.0 * t, |t| 500.0 * t.powi(4), |t| 1e-3 * 5e5_f64.powf(t)];
        for spacing in spacings {
            for n in [1_u32, 20, 1000] {
                let r: Vec<f64> =
                    (0..n).map(|i| if i == 0 { 0.0 } else { spacing(f64::from(i) / f64::from(n)) }).collect();
                let weights: Vec<f64> = (0..n).map(|i| if i == 0 { 1.0 } else { 0.7 / f64::from(n) }).collect();
                let model =
                    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap();
                let mut engine = Engine::new(Families::of(&model).unwrap().into());
                let (mut seed, mut at, mut most) = (0x9E37_79B9_7F4A_7C15, 0.0, 0);
                for k in 0..4000 {
                    // Every tenth move goes back to the middle, every third is small.
                    let reach = if k % 3 == 0 { 5.0 } else { 600.0 };
                    let x = if k % 10 == 0 { 0.0 } else { at + reach * (noise(&mut seed) - 0.5) };
                    let from = Known { input: at, output: engine.piece().line.at(at) };
                    let to = engine.peek_input(at, x);
                    if to != from.output {
                        most = most.max(looks(&engine, from, to));
                    }
                    engine.move_input(at, x);
                    at = x;
                }
                // Halving finds one of 6 n breakpoints in their logarithm; every fourth look halves.
                let bound = 8 + 2 * (6 * n).ilog2();
                assert!(most <= bound, "{most} looks with {n} operators, not {bound}");
            }
        }
    }
}
