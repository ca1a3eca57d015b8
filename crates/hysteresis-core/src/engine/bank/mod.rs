//! The loop over all operators: for few of them, for thresholds that are not nested, and for arbitrary initial outputs.
//!
//! After some small moves a bank draws the straight line that it is on, so that samples on it cost as little as those of turning points.

mod block;
mod blocks;
mod find;
mod look;
mod members;
mod moves;
mod run;
mod side;
mod sweep;
#[cfg(test)]
mod tests;
mod weights;

use alloc::boxed::Box;
use alloc::sync::Arc;
use core::iter;

use super::checks::restore_tolerance;
use super::direction::Direction;
use super::line::Piece;
use super::memory_state::BankState;
use super::solve::Point;
use super::vectors::WIDEST;
use crate::error::{Error, check_finite, check_length};
use crate::operator::Operator;
use members::MOVES_BEFORE_A_LINE;
pub(crate) use members::Members;

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

    /// How many moves were small, one after the other. On a line that counts as enough of them, however far the moves along it were.
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
        for (i, z) in initial.iter().enumerate() {
            check_finite("initial", Some(i), *z)?;
        }
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

    /// Starts from the outputs as they are, the input being `input`, which need not have led to them. No line is drawn yet.
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
