//! The turning-point engine: a model and its memory, moved by its input or by its output.
//!
//! [`EngineState`] is both families on their branches, a plain value; a copy can look ahead. [`Engine`] adds the model
//! and the stacks. Its inverse is [`InverseSearch`]: loops that the target lies beyond are closed first, the last
//! stretch is [solved](solve) for.

use super::branch::{Branch, Checkpoint, Stack, Stacks};
use super::family::{Evaluates, Families};
use super::memory::Memory;
use super::polyline::{Direction, Line, Path, Piece, Point, Reach, first_guess, solve};
use crate::real::Real;
use crate::store::Store;

/// Both families on their branches, and the direction of the input. A copy can look ahead.
#[derive(Clone, Copy, Debug)]
pub(crate) struct EngineState<T> {
    pub(crate) direction: Direction,
    pub(crate) positive: Branch<T>,
    pub(crate) negative: Branch<T>,
}

impl<T: Real> EngineState<T> {
    /// At rest: all operators at zero, the input at zero.
    pub(crate) fn virgin(families: &Families<T, impl Store>) -> Self {
        Self {
            direction: Direction::Rising,
            positive: Branch::virgin(&families.positive, Direction::Rising),
            negative: Branch::virgin(&families.negative, Direction::Falling),
        }
    }

    /// Turns round at the input `x`, which becomes turning point number `reversal`.
    #[inline]
    pub(crate) fn reverse(&mut self, families: &Families<T, impl Store>, x: T, reversal: u64) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.reverse_from(Direction::Rising, families, x, reversal),
            Direction::Falling => self.reverse_from(Direction::Falling, families, x, reversal),
        }
    }

    #[inline(always)]
    fn reverse_from(&mut self, ended: Direction, families: &Families<T, impl Store>, x: T, reversal: u64) {
        let (output, mirrored) = (self.line(families).at(x), ended.reversed());
        self.direction = mirrored;
        self.positive.reverse(&families.positive, ended, x, output, reversal);
        self.negative.reverse(&families.negative, mirrored, -x, output, reversal);
    }

    /// Moves on to the input `x`, ahead on this branch.
    #[inline(never)]
    pub(crate) fn advance(&mut self, families: &Families<T, impl Store>, stacks: &Stacks<T, impl Store>, x: T) {
        // One body, compiled for each direction.
        match self.direction {
            Direction::Rising => self.advance_in(Direction::Rising, families, stacks, x),
            Direction::Falling => self.advance_in(Direction::Falling, families, stacks, x),
        }
    }

    #[inline(always)]
    fn advance_in(
        &mut self,
        direction: Direction,
        families: &Families<T, impl Store>,
        stacks: &Stacks<T, impl Store>,
        x: T,
    ) {
        self.positive.advance(&families.positive, &stacks.positive, direction, x);
        self.negative.advance(&families.negative, &stacks.negative, direction.reversed(), -x);
    }

    /// Puts what the last reversal froze on the stacks.
    #[inline]
    pub(crate) fn keep_top(&self, stacks: &mut Stacks<T, impl Store>) {
        self.positive.keep_top(&mut stacks.positive);
        self.negative.keep_top(&mut stacks.negative);
    }

    /// Reads a number of each line of memory.
    #[cfg(feature = "alloc")]
    #[inline]
    pub(crate) fn fetch(&self) -> u64 {
        self.positive.fetch() ^ self.negative.fetch()
    }

    /// Reads the thresholds at which the next operators begin to slide.
    #[cfg(feature = "alloc")]
    #[inline]
    fn fetch_next(&self, families: &Families<T, impl Store>) -> u64 {
        families.positive.fetch(self.positive.moved) ^ families.negative.fetch(self.negative.moved)
    }

    /// The output of the model over the input, up to the next breakpoint.
    #[inline]
    pub(crate) fn line(&self, families: &Families<T, impl Store>) -> Line<T> {
        let (positive, negative) = (self.positive.line(), self.negative.line());
        Line {
            slope: T::narrow(families.identity_weight + positive.slope + negative.slope),
            offset: T::narrow(positive.offset - negative.offset),
        }
    }

    /// Where the line ends behind the input, if that may go back on it: if no operator slides.
    #[inline]
    pub(crate) fn back(&self, families: &Families<T, impl Store>) -> Option<T> {
        if self.positive.slides() || self.negative.slides() {
            return None;
        }
        let back = self.direction.reversed();
        let positive = self.positive.next_start(&families.positive, back);
        Some(back.nearer(positive, -self.negative.next_start(&families.negative, self.direction)))
    }

    /// The line and its breakpoints, over the input.
    #[inline]
    pub(crate) fn piece(&self, families: &Families<T, impl Store>) -> Piece<T> {
        self.piece_in(self.direction, families)
    }

    #[inline(always)]
    fn piece_in(&self, direction: Direction, families: &Families<T, impl Store>) -> Piece<T> {
        let begin = direction.further(self.positive.begin(), -self.negative.begin());
        let end = direction.nearer(self.positive.end(), -self.negative.end());
        Piece { direction, line: self.line(families), begin, end }
    }
}

/// An engine state on the move that may turn out to be too far. `start` is where it began if the turning points of the
/// last reversal are not on the stacks.
struct InverseSearch<'a, T: Real, S: Store> {
    pub(super) state: &'a mut EngineState<T>,
    pub(super) start: Option<&'a EngineState<T>>,
    pub(super) families: &'a Families<T, S>,
    pub(super) stacks: &'a Stacks<T, S>,
}

impl<T: Real, S: Store> InverseSearch<'_, T, S> {
    /// Moves the state on from `near` until the output is `to` or the input is at `limit`.
    #[inline(never)]
    pub(super) fn run(self, near: Point<T>, to: T, limit: T) -> Reach<T> {
        // One body, compiled for each direction.
        match self.state.direction {
            Direction::Rising => self.find(Direction::Rising, near, to, limit),
            Direction::Falling => self.find(Direction::Falling, near, to, limit),
        }
    }

    #[inline(always)]
    fn find(mut self, direction: Direction, near: Point<T>, to: T, limit: T) -> Reach<T> {
        let (near, far) = self.close_loops(direction, near, to, limit);
        let slope = self.state.line(self.families).slope;
        solve(&mut self, direction, near, far, first_guess(near, slope, far, to), to, limit)
    }

    /// Closes every loop whose turning point has an output that `to` lies beyond; where that comes to, and the turning
    /// point at which the loop that holds `to` closes.
    #[inline(always)]
    pub(super) fn close_loops(
        &mut self,
        direction: Direction,
        mut near: Point<T>,
        to: T,
        limit: T,
    ) -> (Point<T>, Option<Point<T>>) {
        let (EngineState { positive, negative, .. }, families, stacks) = (&mut *self.state, self.families, self.stacks);
        loop {
            let one = positive.closes_at(&stacks.positive, direction);
            let other = negative.closes_at(&stacks.negative, direction.reversed()).map(Point::mirrored);
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

impl<T: Real, S: Store> Path<T> for InverseSearch<'_, T, S> {
    type Checkpoint = (Checkpoint<T>, Checkpoint<T>);

    #[inline(always)]
    fn checkpoint(&self) -> (Checkpoint<T>, Checkpoint<T>) {
        (self.state.positive.checkpoint(), self.state.negative.checkpoint())
    }

    #[inline(always)]
    fn go_back(&mut self, (positive, negative): (Checkpoint<T>, Checkpoint<T>)) {
        let (start, stacks) = (self.start, self.stacks);
        self.state.positive.go_back(positive, start.map(|start| &start.positive), &stacks.positive);
        self.state.negative.go_back(negative, start.map(|start| &start.negative), &stacks.negative);
    }

    #[inline(always)]
    fn look(&mut self, direction: Direction, input: T) -> Piece<T> {
        self.state.advance_in(direction, self.families, self.stacks, input);
        self.state.piece_in(direction, self.families)
    }
}

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
    use alloc::sync::Arc;
    use alloc::vec::Vec;
    use core::cell::Cell;

    use super::*;
    use crate::model::{ModifiedPrandtlIshlinskii, Offsets, Ratios};
    use crate::store::Heap;

    impl Evaluates for Arc<Families<f64, Heap>> {
        type Number = f64;
        type Store = Heap;

        fn families(&self) -> &Families<f64, Heap> {
            self
        }
    }

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
    fn looks(engine: &Engine<Arc<Families<f64, Heap>>>, from: Point, to: f64) -> u32 {
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
                let mut engine = Engine::new(Arc::new(Families::of(model.members()).unwrap()));
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
