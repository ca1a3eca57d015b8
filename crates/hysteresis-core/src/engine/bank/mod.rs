//! The loop over all operators: for few of them, for thresholds that are not nested, and for arbitrary initial outputs.
//!
//! After some small moves a bank draws the straight line that it is on, so that samples on it cost as little as those
//! of turning points. A larger move takes one pass over the operators and draws none, as the next sample would leave
//! it. Whether a line is drawn depends on the last moves alone, and a line has the same bits from wherever on it one
//! looks: `run` gives the bits of `step`, and so does a stream that was restored.
//!
//! Three facts make the loops fast. A rising input pushes operators by their lower bound alone, a falling one by the
//! upper, which is a lower one in the mirror. The side of a move is an index and a sign, not a branch. And `run` takes
//! four samples through a block of operators before it reads the next. There are four partial sums whatever the width
//! of a vector, and products of the output are not fused: the bits are the same on every processor.

mod blocks;
mod loops;
#[cfg(test)]
mod tests;

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::iter;

use super::polyline::{Direction, Line, Path, Piece, Point, Reach, first_guess, solve};
use super::vectors::WIDEST;
use crate::error::{Error, check_all_finite, check_length, restore_tolerance};
use crate::operator::Operator;
pub(crate) use blocks::Members;
use blocks::{Behind, Both, MOVES_BEFORE_A_LINE, Unguessed, Unmoved};
use loops::{At, Find, FirstLine, Here, Look, LookBack, Outputs, Run, Start, Sweep, Taken};

/// All operators of a bank.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct BankState {
    /// Their outputs z_i.
    pub outputs: Box<[f64]>,
    /// In which direction a straight line was drawn that the next sample may be on; None if none was.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "Option::is_none"))]
    pub line: Option<Direction>,
    /// Without a line: how many moves in a row were small up to now. After 8 of them one is drawn.
    #[cfg_attr(feature = "serde", serde(default, skip_serializing_if = "is_zero"))]
    pub small_moves: u8,
}

#[cfg(feature = "serde")]
#[expect(clippy::trivially_copy_pass_by_ref, reason = "serde asks with a reference")]
fn is_zero(count: &u8) -> bool {
    *count == 0
}

/// A bank of operators, each with its output.
#[derive(Clone, Debug)]
pub(crate) struct Bank {
    members: Arc<Members>,
    initial: Box<[f64]>,
    outputs: Box<[f64]>,
    /// The input that has led to the outputs, NaN if none may have; and what they sum to.
    now: Point,
    prospect: Prospect,
}

/// What a bank knows of the samples to come.
#[derive(Clone, Copy, Debug)]
enum Prospect {
    /// The line that they may be on.
    Line(Piece),
    /// No line was drawn; how many moves up to now were small, one after the other.
    SmallMoves(u8),
}

impl Prospect {
    #[inline]
    fn line(self) -> Option<Piece> {
        if let Self::Line(piece) = self { Some(piece) } else { None }
    }

    /// How many moves were small, one after the other. On a line that counts as enough of them, however far the moves
    /// along it were.
    #[inline]
    fn small_moves(self) -> u8 {
        if let Self::SmallMoves(count) = self { count } else { MOVES_BEFORE_A_LINE }
    }
}

impl Bank {
    /// A bank whose operators all start from zero.
    pub(crate) fn at_rest(members: Arc<Members>) -> Self {
        let zeros: Box<[f64]> = iter::repeat_n(0.0, members.len().next_multiple_of(WIDEST)).collect();
        let now = Point { input: 0.0, output: 0.0 };
        let mut bank = Self { members, initial: zeros.clone(), outputs: zeros, now, prospect: Prospect::SmallMoves(0) };
        bank.reset();
        bank
    }

    /// A bank that starts from the outputs `initial`; the first sample projects them onto what can be reached.
    pub(crate) fn new(members: Arc<Members>, initial: &[f64]) -> Result<Self, Error> {
        check_length("initial", members.len(), initial.len())?;
        check_all_finite("initial", initial)?;
        let mut bank = Self::at_rest(members);
        put(&mut bank.initial, initial);
        bank.reset();
        Ok(bank)
    }

    pub(crate) fn reset(&mut self) {
        put(&mut self.outputs, &self.initial);
        self.start_at(0.0);
        self.draw_line(Direction::Rising);
    }

    /// Starts from the outputs as they are, the input being `input`, which need not have led to them. No line is drawn
    /// yet.
    fn start_at(&mut self, input: f64) {
        let led_to_them =
            self.members.iter().zip(self.outputs()).all(|((_, operator), z)| operator.next(*z, input) == *z);
        self.now = Point { input: if led_to_them { input } else { f64::NAN }, output: self.sum() };
        self.prospect = Prospect::SmallMoves(0);
    }

    /// The weights and operators.
    pub(crate) fn members(&self) -> &Arc<Members> {
        &self.members
    }

    /// Whether an input is known to have led to the outputs: a move to where the bank is changes nothing then.
    pub(crate) fn knows_its_input(&self) -> bool {
        !self.now.input.is_nan()
    }

    /// The operator outputs z_i.
    pub(crate) fn outputs(&self) -> &[f64] {
        self.outputs.get(..self.members.len()).unwrap_or(&self.outputs)
    }

    /// What it remembers, the input being `input`.
    pub(crate) fn state(&self, input: f64) -> BankState {
        let mut settled = self.clone();
        settled.settle(input);
        // In the mirror zero has the other sign: files have none.
        let outputs = settled.outputs().iter().map(|z| z + 0.0).collect();
        let (line, small_moves) = match self.prospect {
            Prospect::Line(piece) => (Some(piece.direction), 0),
            Prospect::SmallMoves(count) => (None, count),
        };
        BankState { outputs, line, small_moves }
    }

    /// Continues from saved operator outputs, which must sum to `output` but for rounding.
    pub(crate) fn restore(&mut self, state: &BankState, input: f64, output: f64) -> Result<(), Error> {
        let outputs = &*state.outputs;
        if outputs.len() != self.members.len() || outputs.iter().any(|z| !z.is_finite()) {
            return Err(Error::State { expected: "one finite output for each operator" });
        }
        let (mut sum, mut scale) = (0.0, 0.0);
        for ((weight, _), z) in self.members.iter().zip(outputs) {
            sum += weight.at(*z) * z;
            scale += weight.magnitude() * (z.abs() + input.abs() + f64::MIN_POSITIVE);
        }
        if (sum - output).abs() > restore_tolerance(scale) {
            return Err(Error::State { expected: "operator outputs that sum to the output" });
        }
        let most = if state.line.is_some() { 0 } else { MOVES_BEFORE_A_LINE - 1 };
        if state.small_moves > most {
            return Err(Error::State { expected: "fewer small moves than lead to a line, and none on a line" });
        }
        put(&mut self.outputs, outputs);
        self.start_at(input);
        match state.line {
            Some(direction) => self.draw_line(direction),
            None => self.prospect = Prospect::SmallMoves(state.small_moves),
        }
        Ok(())
    }

    /// Takes over other weights of the same operators in the same order, the input being `input`: whether they differ.
    pub(crate) fn reweigh(&mut self, members: &Arc<Members>, input: f64) -> Result<bool, Error> {
        let differ = self.members.weigh_otherwise(members)?;
        self.settle(input);
        self.members = members.clone();
        self.now.output = self.sum();
        if let Prospect::Line(Piece { direction, .. }) = self.prospect {
            self.draw_line(direction);
        }
        Ok(differ)
    }

    /// Reads what a move needs and lies `depth` pointers deep.
    #[inline]
    pub(crate) fn fetch(&self, depth: usize) -> u64 {
        match depth {
            0 => self.now.input.to_bits() ^ self.outputs.len() as u64 ^ u64::from(self.prospect.small_moves()),
            1 => self.outputs.iter().step_by(WIDEST).fold(self.members.len() as u64, |read, z| read ^ z.to_bits()),
            2 => self.members.blocks.fetch(),
            _ => 0,
        }
    }

    /// The input that has led to the outputs, NaN if none may have; and what they sum to.
    pub(crate) fn now(&self) -> Point {
        self.now
    }
}

/// Puts numbers of operators into outputs; those that are left over stay.
fn put(outputs: &mut [f64], numbers: &[f64]) {
    for (output, number) in outputs.iter_mut().zip(numbers) {
        *output = *number;
    }
}

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

    /// [`jump`](Self::jump) by more than a small move, no line having been drawn: what a drive that only jumps does, by
    /// itself, as it is short.
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

    /// [`move_input`](Self::move_input) sample by sample in one loop, up to the first one after which a line is drawn.
    /// Inputs and outputs are relative to `origin`, samples and what is put out are not. None if a line was drawn
    /// before, or if no input may have led to the outputs.
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

    /// The first move by the output, from outputs that no input has led to: where it comes to, the search starting at
    /// `from`.
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

/// Every operator after a move of the input from `from` to `to`, the outputs being those of the input `here`: the sum
/// of w_i z_i.
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
