//! How a bank moves by its input or its output, and where it would come to.

use core::marker::PhantomData;

use super::super::direction::Direction;
use super::super::line::{Line, Piece};
use super::super::solve::{Path, Point, Reach, first_guess, solve};
use super::Bank;
use super::block::{Split, Weights, Whole};
use super::course::Push;
use super::find::{Find, FirstLine};
use super::look::{At, Falling, Here, Look, LookBack, Rising, Side, SlidingWeights, Start, Stretch};
use super::members::Members;
use super::sweep::{Detour, Run, Slot, Sweep, Taken};

impl Bank {
    /// Moves the input from `from`, on the line that was drawn, to `to`. After a small move the next line is drawn.
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        let from = if self.knows_its_input() { from } else { f64::NAN };
        self.go(from, to);
        if self.members.is_small(to - from) {
            self.draw_line(self.turns.direction());
        }
    }

    /// [`move_input`](Self::move_input) if no line is drawn after that: the output there.
    #[inline]
    pub(crate) fn jump(&mut self, from: f64, to: f64) -> Option<f64> {
        if self.stays(from, to) {
            return Some(self.now.output);
        }
        if self.members.is_small(to - from) || !self.knows_its_input() {
            return None;
        }
        self.go(from, to);
        Some(self.now.output)
    }

    /// Whether a bank without a line is at `to` already.
    #[inline]
    fn stays(&self, from: f64, to: f64) -> bool {
        to == from && self.ahead.is_none() && self.knows_its_input()
    }

    #[inline]
    fn go(&mut self, from: f64, to: f64) {
        let push = self.turns.push(from, to);
        let Self { members, outputs, now, .. } = self;
        let output = if from == now.input || from.is_nan() {
            sweep(members, &mut **outputs, push, to)
        } else {
            detour(members, &mut **outputs, from, to)
        };
        *now = Point { input: to, output };
        self.ahead = None;
    }

    /// Moves the input along the line that was drawn.
    pub(super) fn settle(&mut self, input: f64) {
        if self.knows_its_input() && input != self.now.input {
            self.now.output = sweep(&self.members, &mut *self.outputs, Push::Either, input);
            self.now.input = input;
        }
    }

    /// Draws the line in `direction` from where the bank is, if that is known.
    pub(super) fn draw_line(&mut self, direction: Direction) {
        let x = self.now.input;
        self.ahead = self.knows_its_input().then(|| match direction {
            Direction::Rising => self.piece::<Rising>(Here, x),
            Direction::Falling => self.piece::<Falling>(Here, x),
        });
    }

    fn piece<S: Side>(&self, start: impl Start, x: f64) -> Piece {
        let Members { blocks, split, processor, .. } = &*self.members;
        let outputs = &*self.outputs;
        let Stretch { line, begin, end } = if *split {
            processor.run(Look::<S, Split, _> { blocks, outputs, start, x, by: PhantomData })
        } else {
            processor.run(Look::<S, Whole, _> { blocks, outputs, start, x, by: PhantomData })
        };
        Piece { direction: S::DIRECTION, line, begin, end }
    }

    /// The line from where the bank is, if it was drawn.
    #[inline]
    pub(crate) fn ahead(&self) -> Option<Piece> {
        self.ahead
    }

    /// Where the line ends behind the bank, if it holds on both sides.
    #[inline]
    pub(crate) fn back(&self) -> Option<f64> {
        let direction = self.ahead?.direction;
        let back = match direction {
            Direction::Rising => self.look_back::<Rising>(),
            Direction::Falling => self.look_back::<Falling>(),
        };
        (back != direction.sign::<f64>() * f64::INFINITY).then_some(back)
    }

    fn look_back<S: Side>(&self) -> f64 {
        let Members { blocks, processor, .. } = &*self.members;
        processor.run(LookBack::<S> { blocks, outputs: &self.outputs, x: self.now.input, by: PhantomData })
    }

    /// [`move_input`](Self::move_input) sample by sample in one loop, up to the first one after which a line is drawn. Inputs and
    /// outputs are relative to `origin`, samples and what is put out are not. No line was drawn before.
    pub(crate) fn run(&mut self, samples: &[f64], outputs: &mut [f64], origin: Point) -> Taken {
        if self.members.split {
            self.run_weighed::<Split>(samples, outputs, origin)
        } else {
            self.run_weighed::<Whole>(samples, outputs, origin)
        }
    }

    fn run_weighed<W: Weights>(&mut self, samples: &[f64], outputs: &mut [f64], origin: Point) -> Taken {
        let Self { members, outputs: z, now, turns, .. } = self;
        members.processor.run(Run::<W> { members, z, now, turns, origin, samples, outputs, by: PhantomData })
    }

    /// The sum of the outputs as they are.
    pub(super) fn sum(&self) -> f64 {
        sweep(&self.members, &*self.outputs, Push::Nowhere, 0.0)
    }

    /// The output after a move of the input from `from` to `to`: on the line that would be drawn then, or the sum.
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        if !self.knows_its_input() {
            sweep(&self.members, &*self.outputs, Push::Either, to)
        } else if self.stays(from, to) {
            self.now.output
        } else if self.members.is_small(to - from) {
            let line =
                if to >= from { self.piece::<Rising>(At(from), to) } else { self.piece::<Falling>(At(from), to) }.line;
            line.at(to)
        } else if from == self.now.input {
            sweep(&self.members, &*self.outputs, Push::between(from, to), to)
        } else {
            detour(&self.members, &*self.outputs, from, to)
        }
    }

    /// Moves on from `from`, on the line that was drawn, until the output is `to` or the input is at a limit.
    #[inline]
    pub(crate) fn move_output(&mut self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        if !self.knows_its_input() {
            let reach = self.first_move(from.input, to, limits);
            self.now = Point {
                input: reach.input,
                output: sweep(&self.members, &mut *self.outputs, Push::Either, reach.input),
            };
            self.ahead = None;
            return reach;
        }
        self.settle(from.input);
        let (reach, piece) = self.find(Here, direction, from, to, direction.limit(limits));
        let push = Push::between(from.input, reach.input);
        self.now = Point { input: reach.input, output: sweep(&self.members, &mut *self.outputs, push, reach.input) };
        self.ahead = Some(piece);
        reach
    }

    /// Where [`move_output`](Self::move_output) would come to.
    pub(crate) fn peek_output(&self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        let limit = direction.limit(limits);
        if !self.knows_its_input() {
            self.first_move(from.input, to, limits)
        } else if from.input == self.now.input {
            self.find(Here, direction, from, to, limit).0
        } else {
            self.find(At(from.input), direction, from, to, limit).0
        }
    }

    #[inline]
    fn find(&self, start: impl Start, direction: Direction, near: Point, to: f64, limit: f64) -> (Reach, Piece) {
        match (direction, self.members.split) {
            (Direction::Rising, false) => self.find_by::<Rising, Whole, _>(start, near, to, limit),
            (Direction::Rising, true) => self.find_by::<Rising, Split, _>(start, near, to, limit),
            (Direction::Falling, false) => self.find_by::<Falling, Whole, _>(start, near, to, limit),
            (Direction::Falling, true) => self.find_by::<Falling, Split, _>(start, near, to, limit),
        }
    }

    #[inline]
    fn find_by<S: Side, W: SlidingWeights, O: Start>(
        &self,
        start: O,
        near: Point,
        to: f64,
        limit: f64,
    ) -> (Reach, Piece) {
        let Members { blocks, processor, .. } = &*self.members;
        let slope = self
            .ahead
            .filter(|piece| piece.direction == S::DIRECTION)
            .map_or(self.members.slope, |piece| piece.line.slope);
        let guess = first_guess(near, slope, None, to);
        let outputs = &*self.outputs;
        processor.run(Find::<S, W, O> { blocks, outputs, start, near, guess, to, limit, by: PhantomData })
    }

    /// The first move by the output, from outputs that no input has led to: where it comes to, the search starting at `from`.
    fn first_move(&self, from: f64, to: f64, limits: (f64, f64)) -> Reach {
        let input = from.max(limits.0).min(limits.1);
        let near = Point { input, output: self.peek_input(input, input) };
        if near.output == to {
            return Reach { input, output: to, saturated: false };
        }
        let direction = if near.output <= to { Direction::Rising } else { Direction::Falling };
        let limit = direction.limit(limits);
        let guess = self.first_line(input).inverted().at(to);
        let found = solve(&mut FirstMove(self), direction, near, None, guess, to, limit);
        if found.input != limit {
            return Reach { saturated: false, output: to, ..found };
        }
        let most = self.peek_input(limit, limit);
        let saturated = direction.leads_away(to, most);
        Reach { input: limit, output: if saturated { most } else { to }, saturated }
    }

    fn first_line(&self, x: f64) -> Line {
        let Members { blocks, split, processor, .. } = &*self.members;
        let outputs = &*self.outputs;
        if *split {
            processor.run(FirstLine::<Split> { blocks, outputs, x, by: PhantomData })
        } else {
            processor.run(FirstLine::<Whole> { blocks, outputs, x, by: PhantomData })
        }
    }
}

/// Inputs to which the first move may lead: no look moves the bank.
struct FirstMove<'a>(&'a Bank);

impl Path<f64> for FirstMove<'_> {
    type Checkpoint = ();

    fn checkpoint(&self) {}

    fn go_back(&mut self, (): ()) {}

    /// How far a line goes is not known: its piece is a point, but for rounding.
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        let rounding = direction.sign::<f64>() * 4.0 * f64::EPSILON * input.abs();
        Piece { direction, line: self.0.first_line(input), begin: input - rounding, end: input + rounding }
    }
}

/// Every operator after a move of the input to `x`: the sum of w_i z_i.
#[inline]
fn sweep(members: &Members, outputs: impl IntoIterator<Item: Slot>, push: Push, x: f64) -> f64 {
    let Members { blocks, split, processor, .. } = members;
    if *split {
        processor.run(Sweep::<_, Split> { blocks, outputs, push, x, by: PhantomData })
    } else {
        processor.run(Sweep::<_, Whole> { blocks, outputs, push, x, by: PhantomData })
    }
}

/// The same for a move by way of the input `by`.
fn detour(members: &Members, outputs: impl IntoIterator<Item: Slot>, by: f64, to: f64) -> f64 {
    let Members { blocks, split, processor, .. } = members;
    let start = At(by);
    if *split {
        processor.run(Detour::<_, Split> { blocks, outputs, start, to, by: PhantomData })
    } else {
        processor.run(Detour::<_, Whole> { blocks, outputs, start, to, by: PhantomData })
    }
}
