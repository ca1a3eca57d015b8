//! The turning-point engine: a model and its memory, moved by its input or by its output.

use alloc::sync::Arc;
use alloc::vec::Vec;

use super::branch::Branch;
use super::checks::restore_tolerance;
use super::direction::Direction;
use super::engine_state::EngineState;
use super::families::{Families, Stacks};
use super::family::Family;
use super::inverse_search::InverseSearch;
use super::line::Piece;
use super::memory_state::{FamilyState, TurningPointState};
use super::solve::{Point, Reach};
use super::turning_points::{Stack, TurningPoint};
use crate::error::Error;

/// Far more reversals than any stream sees, and far from the end of the counter.
const MAX_REVERSALS: u64 = 1 << 63;

/// A model with its memory.
#[derive(Clone, Debug)]
pub(crate) struct Engine {
    families: Arc<Families>,
    state: EngineState,
    stacks: Stacks,
    reversals: u64,
}

impl Engine {
    pub(crate) fn new(families: Arc<Families>) -> Self {
        let state = EngineState::virgin(&families);
        let (positive, negative) = (Stack::new(families.positive.len()), Stack::new(families.negative.len()));
        Self { families, state, stacks: Stacks { positive, negative }, reversals: 0 }
    }

    pub(crate) fn reset(&mut self) {
        self.state = EngineState::virgin(&self.families);
        self.reversals = 0;
    }

    /// Moves the input from `from` to `to`.
    #[inline]
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        if self.state.direction.leads_away(from, to) {
            self.reverse(from);
        }
        self.state.advance(&self.families, &self.stacks, to);
    }

    /// Turns round at the input `x`.
    #[inline]
    fn reverse(&mut self, x: f64) {
        self.reversals += 1;
        self.state.reverse(&self.families, x, self.reversals);
        self.state.keep_top(&mut self.stacks);
    }

    /// The output after a move of the input from `from` to `to`.
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        let mut state = self.state;
        if state.direction.leads_away(from, to) {
            state.reverse(&self.families, from, self.reversals + 1);
        }
        state.advance(&self.families, &self.stacks, to);
        state.line(&self.families).at(to)
    }

    /// Moves on from `from` in `direction` until the output is `to` or the input is at a limit.
    #[inline]
    pub(crate) fn move_output(&mut self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        if direction != self.state.direction {
            self.reverse(from.input);
        }
        let Self { families, state, stacks, .. } = self;
        InverseSearch { state, start: None, families, stacks }.run(from, to, direction.limit(limits))
    }

    /// Where [`move_output`](Self::move_output) would come to.
    pub(crate) fn peek_output(&self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        let mut state = self.state;
        if direction != state.direction {
            state.reverse(&self.families, from.input, self.reversals + 1);
        }
        let start = state;
        let Self { families, stacks, .. } = self;
        InverseSearch { state: &mut state, start: Some(&start), families, stacks }.run(
            from,
            to,
            direction.limit(limits),
        )
    }

    /// The line at the present input and the next breakpoint, over the input.
    #[inline]
    pub(crate) fn piece(&self) -> Piece {
        self.state.piece(&self.families)
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
            let Self { families, state, stacks, .. } = self;
            let direction = state.direction;
            state.positive.reweigh(&families.positive, &mut stacks.positive, direction);
            state.negative.reweigh(&families.negative, &mut stacks.negative, direction.reversed());
            for direction in [Direction::Rising, Direction::Falling] {
                self.renew_outputs(direction, input);
            }
            self.state.positive.renew_top(&self.stacks.positive);
            self.state.negative.renew_top(&self.stacks.negative);
        }
        Ok(differ)
    }

    /// The number of operators with memory.
    pub(crate) fn operators(&self) -> usize {
        self.families.positive.len()
    }

    /// Computes the output at every turning point that lies in `direction` of `input`: the model is back at it when the
    /// input is back there, so a copy of the state goes there and looks.
    fn renew_outputs(&mut self, direction: Direction, input: f64) {
        let Self { families, state, stacks, reversals } = self;
        let mut start = *state;
        if direction != start.direction {
            start.reverse(families, input, *reversals + 1);
        }
        let mut look = start;
        for height in (1..=state.positive.height()).rev() {
            let point = stacks.positive.get(height).point;
            if point.ended == direction {
                look.advance(families, stacks, point.input);
                stacks.positive.set_output(height, look.line(families).at(point.input));
            }
        }
        let mut look = start;
        for height in (1..=state.negative.height()).rev() {
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
        let negative = self.state.negative.remembered(&self.stacks.negative).map(mirrored);
        self.state.positive.remembered(&self.stacks.positive).chain(negative)
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
            direction: self.state.direction,
            reversals: self.reversals,
            positive: self.state.positive.state(&self.stacks.positive),
            negative: self.state.negative.state(&self.stacks.negative),
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
        let engine_state = EngineState { direction, positive, negative };
        let stacks = Stacks { positive: positive_stack, negative: negative_stack };
        let candidate = Self { families, state: engine_state, stacks, reversals };
        candidate.check_position(input, output)?;
        candidate.check_turning_points(input)?;
        *self = candidate;
        Ok(())
    }

    /// The input must lie on the branches that the state tells of, and the model have the output there.
    fn check_position(&self, input: f64, output: f64) -> Result<(), Error> {
        if self.state.holds(input) && self.agree(self.state.line(&self.families).at(input), output, input) {
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

#[cfg(test)]
mod tests {
    use alloc::vec::Vec;
    use core::cell::Cell;

    use super::super::branch::Checkpoint;
    use super::super::solve::{Path, first_guess, solve};
    use super::*;
    use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

    /// Counts the looks of a search.
    struct Counting<'a>(InverseSearch<'a>, &'a Cell<u32>);

    impl Path for Counting<'_> {
        type Checkpoint = (Checkpoint, Checkpoint);

        fn checkpoint(&self) -> Self::Checkpoint {
            self.0.checkpoint()
        }

        fn go_back(&mut self, to: Self::Checkpoint) {
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

    /// How many looks the search from the state of an engine to an output takes, on the whole range of inputs.
    fn looks(engine: &Engine, from: Point, to: f64) -> u32 {
        let (mut state, families, stacks) = (engine.state, &*engine.families, &engine.stacks);
        let direction = if to < from.output { Direction::Falling } else { Direction::Rising };
        if direction != state.direction {
            state.reverse(families, from.input, u64::MAX);
        }
        let start = state;
        let count = Cell::new(0);
        let mut search = InverseSearch { state: &mut state, start: Some(&start), families, stacks };
        let limit = direction.limit((-1e100, 1e100));
        let (near, far) = search.close_loops(direction, from, to, limit);
        let guess = first_guess(near, search.state.line(families).slope, far, to);
        solve(&mut Counting(search, &count), direction, near, far, guess, to, limit);
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
                    let from = Point { input: at, output: engine.piece().line.at(at) };
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
