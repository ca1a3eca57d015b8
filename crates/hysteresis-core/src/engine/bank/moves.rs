//! How a bank moves by its input or its output, and where it would come to.

use super::super::direction::Direction;
use super::super::line::{Line, Piece};
use super::super::solve::{Path, Point, Reach, first_guess, solve};
use super::block::{Behind, Both, Unmoved};
use super::find::{Find, FirstLine};
use super::look::{At, Here, Look, LookBack, Start};
use super::members::{MOVES_BEFORE_A_LINE, Members};
use super::run::{Run, Taken};
use super::side::Unguessed;
use super::sweep::{Outputs, Sweep};
use super::{Bank, Prospect};

impl Bank {
    /// Moves the input from `from`, on the line that was drawn, to `to`. After some small moves the next line is drawn.
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        if self.jump(from, to).is_none() {
            self.go(from, to, MOVES_BEFORE_A_LINE);
            self.draw_line(Direction::of_move(from, to));
        }
    }

    /// [`move_input`](Self::move_input); the piece there and where it ends behind the bank.
    #[inline(never)]
    pub(crate) fn move_on(&mut self, from: f64, to: f64) -> (Piece, Option<f64>) {
        self.move_input(from, to);
        (self.forward_piece(to), self.back())
    }

    /// [`move_input`](Self::move_input) if no line is drawn after that: the output there.
    #[inline(never)]
    pub(crate) fn jump(&mut self, from: f64, to: f64) -> Option<f64> {
        let from = self.known(from);
        if !self.stays(from, to) {
            let small_moves = self.small_moves(from, to);
            if small_moves == MOVES_BEFORE_A_LINE {
                return None;
            }
            self.go(from, to, small_moves);
        }
        Some(self.now.output)
    }

    /// [`jump`](Self::jump) by more than a small move, no line having been drawn: what a drive that only jumps does, by itself, as
    /// it is short.
    #[inline(always)]
    pub(crate) fn leap(&mut self, to: f64) -> Option<f64> {
        let distance = to - self.now.input;
        let Prospect::SmallMoves(small_moves) = &mut self.prospect else { return None };
        // Not from an unknown input, where it is NaN.
        let is_long = distance.abs() > self.members.small_move;
        if !is_long {
            return None;
        }
        *small_moves = 0;
        let bounds = Behind(Unguessed::of_distance(distance));
        let output = self.members.run(Sweep { outputs: &mut *self.outputs, start: Here, bounds, x: to });
        self.now = Point { input: to, output };
        Some(output)
    }

    /// Where the input is, NaN if none may have led to the outputs.
    #[inline]
    fn known(&self, input: f64) -> f64 {
        if self.knows_its_input() { input } else { f64::NAN }
    }

    /// Whether a bank without a line is at `to` already.
    #[inline]
    fn stays(&self, from: f64, to: f64) -> bool {
        to == from && self.prospect.line().is_none()
    }

    /// How many small moves in a row there will be after one from `from` to `to`.
    #[inline]
    fn small_moves(&self, from: f64, to: f64) -> u8 {
        self.members.small_moves(self.prospect.small_moves(), to - from)
    }

    #[inline]
    fn go(&mut self, from: f64, to: f64, small_moves: u8) {
        self.now.output = sweep(&self.members, &mut *self.outputs, self.now.input, from, to);
        self.now.input = to;
        self.prospect = Prospect::SmallMoves(small_moves);
    }

    /// Moves the input along the line that was drawn.
    pub(super) fn settle(&mut self, input: f64) {
        if self.knows_its_input() && input != self.now.input {
            self.now.output =
                self.members.run(Sweep { outputs: &mut *self.outputs, start: Here, bounds: Both, x: input });
            self.now.input = input;
        }
    }

    /// Draws the line in `direction` from where the bank is, if that is known.
    pub(super) fn draw_line(&mut self, direction: Direction) {
        if self.knows_its_input() {
            self.prospect = Prospect::Line(self.piece(Here, direction, self.now.input));
        }
    }

    fn piece(&self, start: impl Start, direction: Direction, x: f64) -> Piece {
        self.members.run(Look { outputs: &self.outputs, start, direction, x })
    }

    /// The line from where the bank is, if it was drawn.
    #[inline]
    pub(crate) fn ahead(&self) -> Option<Piece> {
        self.prospect.line()
    }

    /// The same, or a point where there is none, the input being `input`.
    pub(crate) fn forward_piece(&self, input: f64) -> Piece {
        self.ahead().unwrap_or_else(|| Piece::point(Direction::Rising, input, self.now.output))
    }

    /// Where the line ends behind the bank, if it holds on both sides.
    #[inline]
    pub(crate) fn back(&self) -> Option<f64> {
        let direction = self.ahead()?.direction;
        let back = self.members.run(LookBack { outputs: &self.outputs, direction, x: self.now.input });
        (back != direction.sign::<f64>() * f64::INFINITY).then_some(back)
    }

    /// [`move_input`](Self::move_input) sample by sample in one loop, up to the first one after which a line is drawn. Inputs and
    /// outputs are relative to `origin`, samples and what is put out are not. None if a line was drawn before, or if no input may have
    /// led to the outputs.
    pub(crate) fn run(&mut self, samples: &[f64], outputs: &mut [f64], origin: Point) -> Option<Taken> {
        let Self { members, outputs: z, now: Point { input, output }, prospect, .. } = self;
        match prospect {
            Prospect::SmallMoves(small_moves) if !input.is_nan() => {
                Some(members.run(Run { members, z, input, output, small_moves, origin, samples, outputs }))
            }
            _ => None,
        }
    }

    /// The sum of the outputs as they are.
    pub(super) fn sum(&self) -> f64 {
        self.members.run(Sweep { outputs: &*self.outputs, start: Here, bounds: Unmoved, x: 0.0 })
    }

    /// The output after a move of the input from `from` to `to`: on the line that would be drawn then, or the sum.
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        let from = self.known(from);
        if self.stays(from, to) {
            self.now.output
        } else if self.small_moves(from, to) == MOVES_BEFORE_A_LINE {
            self.piece(At(from), Direction::of_move(from, to), to).line.at(to)
        } else {
            sweep(&self.members, &*self.outputs, self.now.input, from, to)
        }
    }

    /// Moves on from `from`, on the line that was drawn, until the output is `to` or the input is at a limit.
    #[inline]
    pub(crate) fn move_output(&mut self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        if !self.knows_its_input() {
            let reach = self.first_move(from.input, to, limits);
            self.go(f64::NAN, reach.input, 0);
            return reach;
        }
        self.settle(from.input);
        let (reach, piece) = self.find(Here, direction, from, to, direction.limit(limits));
        self.go(from.input, reach.input, 0);
        self.prospect = Prospect::Line(piece);
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
        let same_way = self.ahead().filter(|piece| piece.direction == direction);
        let slope = same_way.map_or(self.members.slope, |piece| piece.line.slope);
        let look = Look { outputs: &self.outputs, start, direction, x: first_guess(near, slope, None, to) };
        self.members.run(Find { look, near, to, limit })
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

    pub(super) fn first_line(&self, x: f64) -> Line {
        self.members.run(FirstLine { outputs: &self.outputs, x })
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

/// Every operator after a move of the input from `from` to `to`, the outputs being those of the input `here`: the sum of w_i z_i.
#[inline]
fn sweep(members: &Members, outputs: impl Outputs, here: f64, from: f64, to: f64) -> f64 {
    let bounds = Behind(Unguessed::of_move(from, to));
    if from == here {
        members.run(Sweep { outputs, start: Here, bounds, x: to })
    } else if from.is_nan() {
        members.run(Sweep { outputs, start: Here, bounds: Both, x: to })
    } else {
        members.run(Sweep { outputs, start: At(from), bounds, x: to })
    }
}
