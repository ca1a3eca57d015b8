//! The turning-point engine: a model and its memory, moved by its input or by its output.

use super::direction::Direction;
use super::engine_state::EngineState;
use super::families::{Evaluates, Stacks};
use super::inverse_search::InverseSearch;
use super::line::Piece;
use super::memory::Memory;
use super::solve::{Point, Reach};
use super::turning_points::Stack;

/// A model with its memory.
#[derive(Clone, Debug)]
pub(crate) struct Engine<M: Evaluates> {
    pub(super) model: M,
    pub(super) state: EngineState<M::Number>,
    pub(super) stacks: Stacks<M::Number, M::Store>,
    pub(super) reversals: u64,
}

impl<M: Evaluates> Engine<M> {
    pub(crate) fn new(model: M) -> Self {
        let families = model.families();
        let state = EngineState::virgin(families);
        let (positive, negative) = (Stack::new(families.positive.len()), Stack::new(families.negative.len()));
        Self { state, stacks: Stacks { positive, negative }, reversals: 0, model }
    }

    /// What evaluates the model.
    pub(crate) fn model(&self) -> &M {
        &self.model
    }

    /// Turns round at the input `x`.
    #[inline]
    fn reverse(&mut self, x: M::Number) {
        self.reversals += 1;
        self.state.reverse(self.model.families(), x, self.reversals);
        self.state.keep_top(&mut self.stacks);
    }

    /// Reads what a move needs and lies `depth` pointers deep.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch(&self, depth: usize) -> u64 {
        let families = self.model.families();
        match depth {
            0 => self.state.fetch() ^ self.reversals,
            1 => families.identity_weight.to_bits() ^ (families.positive.len() ^ families.negative.len()) as u64,
            2 => self.state.fetch_next(families),
            _ => 0,
        }
    }

    /// The line at the present input and the next breakpoint, over the input.
    #[inline]
    pub(crate) fn piece(&self) -> Piece<M::Number> {
        self.state.piece(self.model.families())
    }
}

impl<M: Evaluates> Memory<M::Number> for Engine<M> {
    fn reset(&mut self) {
        self.state = EngineState::virgin(self.model.families());
        self.reversals = 0;
    }

    #[inline]
    fn move_input(&mut self, from: M::Number, to: M::Number) {
        if self.state.direction.leads_away(from, to) {
            self.reverse(from);
        }
        self.state.advance(self.model.families(), &self.stacks, to);
    }

    /// The output after a move of the input from `from` to `to`.
    fn peek_input(&self, from: M::Number, to: M::Number) -> M::Number {
        let mut state = self.state;
        if state.direction.leads_away(from, to) {
            state.reverse(self.model.families(), from, self.reversals + 1);
        }
        state.advance(self.model.families(), &self.stacks, to);
        state.line(self.model.families()).at(to)
    }

    /// Moves on from `from` in `direction` until the output is `to` or the input is at a limit.
    #[inline]
    fn move_output(
        &mut self,
        direction: Direction,
        from: Point<M::Number>,
        to: M::Number,
        limits: (M::Number, M::Number),
    ) -> Reach<M::Number> {
        if direction != self.state.direction {
            self.reverse(from.input);
        }
        let Self { model, state, stacks, .. } = self;
        let families = model.families();
        InverseSearch { state, start: None, families, stacks }.run(from, to, direction.limit(limits))
    }

    /// Where [`move_output`](Self::move_output) would come to.
    fn peek_output(
        &self,
        direction: Direction,
        from: Point<M::Number>,
        to: M::Number,
        limits: (M::Number, M::Number),
    ) -> Reach<M::Number> {
        let mut state = self.state;
        if direction != state.direction {
            state.reverse(self.model.families(), from.input, self.reversals + 1);
        }
        let start = state;
        let (families, stacks) = (self.model.families(), &self.stacks);
        InverseSearch { state: &mut state, start: Some(&start), families, stacks }.run(
            from,
            to,
            direction.limit(limits),
        )
    }

    /// The same line with the roles of input and output swapped, up to the next breakpoint or limit.
    #[inline]
    fn inverse_piece(&self, _input: M::Number, _output: M::Number, limits: (M::Number, M::Number)) -> Piece<M::Number> {
        self.piece().inverse(limits)
    }

    /// A move to where it is changes nothing.
    fn is_at(&self, _input: M::Number) -> bool {
        true
    }

    #[inline]
    fn back(&self) -> Option<M::Number> {
        self.state.back(self.model.families())
    }

    #[inline]
    fn forward_piece(&self, _input: M::Number) -> Piece<M::Number> {
        self.piece()
    }
}

#[cfg(all(test, feature = "alloc"))]
mod tests {
    use alloc::vec::Vec;
    use core::cell::Cell;

    use super::super::bank::Members;
    use super::super::branch::Checkpoint;
    use super::super::engine_changes::{NestedModel, SharedEngine};
    use super::super::solve::{Path, first_guess, solve};
    use super::*;
    use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
    use crate::store::Heap;

    /// Counts the looks of a search.
    struct Counting<'a>(InverseSearch<'a, f64, Heap>, &'a Cell<u32>);

    impl Path<f64> for Counting<'_> {
        type Checkpoint = (Checkpoint<f64>, Checkpoint<f64>);

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
    fn looks(engine: &SharedEngine, from: Point, to: f64) -> u32 {
        let (mut state, families, stacks) = (engine.state, engine.model.families(), &engine.stacks);
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
                let mut engine = SharedEngine::new(NestedModel::of(&Members::of(&model).into()).unwrap().into());
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
