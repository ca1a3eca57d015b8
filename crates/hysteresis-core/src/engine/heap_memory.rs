//! The memory of a stream on the heap: turning points where the thresholds are nested; else, or if asked for, a bank of operators.

use alloc::boxed::Box;
use alloc::vec::Vec;

use super::bank::Bank;
use super::checks::count_as_f64;
use super::compiled_model::{CompiledModel, Method};
use super::direction::Direction;
use super::engine_changes::SharedEngine;
use super::line::Piece;
use super::memory::Memory;
use super::memory_state::MemoryState;
use super::other_method::{operators_of, turning_points_of};
use super::solve::{Point, Reach};
use super::turning_point_engine::Engine;
use crate::error::Error;

impl CompiledModel {
    /// The memory of a stream at rest.
    pub(crate) fn memory_at_rest(&self) -> HeapMemory {
        self.turning_points_at_rest().unwrap_or_else(|_| self.bank_at_rest())
    }

    /// The same by a given method.
    pub(crate) fn memory_by(&self, method: Method) -> Result<HeapMemory, Error> {
        match method {
            Method::TurningPoints => self.turning_points_at_rest(),
            Method::Bank => Ok(self.bank_at_rest()),
        }
    }

    fn turning_points_at_rest(&self) -> Result<HeapMemory, Error> {
        let nested = self.nested.as_ref().map_err(|error| *error)?;
        Ok(HeapMemory::TurningPoints(Box::new(Engine::new(nested.clone()))))
    }

    fn bank_at_rest(&self) -> HeapMemory {
        HeapMemory::Bank(Box::new(Bank::at_rest(self.members.clone())))
    }

    /// The memory of a stream that starts from the operator outputs `initial`.
    pub(crate) fn memory_from(&self, initial: &[f64]) -> Result<HeapMemory, Error> {
        Bank::new(self.members.clone(), initial).map(Box::new).map(HeapMemory::Bank)
    }
}

/// A model's parameters together with the memory of one stream.
///
/// Behind a pointer, as only a sample that leaves its line needs it: a stream is two cache lines, many fit in the cache.
#[derive(Clone, Debug)]
pub(crate) enum HeapMemory {
    TurningPoints(Box<SharedEngine>),
    Bank(Box<Bank>),
}

impl HeapMemory {
    pub(crate) fn method(&self) -> Method {
        match self {
            Self::TurningPoints(_) => Method::TurningPoints,
            Self::Bank(_) => Method::Bank,
        }
    }

    /// The reversals that still determine the output, oldest first: nothing for a bank.
    pub(crate) fn turning_points(&self) -> Vec<f64> {
        match self {
            Self::TurningPoints(engine) => engine.memory(),
            Self::Bank(_) => Vec::new(),
        }
    }

    /// Reads what a move needs and lies `depth` pointers deep.
    #[inline]
    pub(crate) fn fetch(&self, depth: usize) -> u64 {
        match self {
            Self::TurningPoints(engine) => engine.fetch(depth),
            Self::Bank(bank) => bank.fetch(depth),
        }
    }

    /// What it remembers, the input being `input`.
    pub(crate) fn state(&self, input: f64) -> MemoryState {
        match self {
            Self::TurningPoints(engine) => MemoryState::TurningPoints(engine.state()),
            Self::Bank(bank) => MemoryState::Bank(bank.state(input)),
        }
    }

    /// Continues from a saved state, of either method, that was at this input and output.
    pub(crate) fn restore(&mut self, state: &MemoryState, input: f64, output: f64) -> Result<(), Error> {
        match (self, state) {
            (Self::TurningPoints(engine), MemoryState::TurningPoints(state)) => engine.restore(state, input, output),
            (Self::Bank(bank), MemoryState::Bank(state)) => bank.restore(state, input, output),
            (Self::TurningPoints(engine), MemoryState::Bank(state)) => {
                engine.restore(&turning_points_of(engine.model(), state, input, output)?, input, output)
            }
            (Self::Bank(bank), MemoryState::TurningPoints(state)) => {
                bank.restore(&operators_of(bank.members(), state, input, output)?, input, output)
            }
        }
    }

    /// Takes over the weights of another model of the same operators, the input being `input`: whether they differ.
    ///
    /// The position, the turning points and the operator outputs stay; what they sum to is computed anew.
    pub(crate) fn reweigh(&mut self, compiled: &CompiledModel, input: f64) -> Result<bool, Error> {
        match self {
            Self::TurningPoints(engine) => match &compiled.nested {
                Ok(nested) => engine.reweigh(nested, input),
                Err(_) => Err(Error::OtherOperators {
                    what: "number of operators with nested thresholds",
                    expected: count_as_f64(engine.operators()),
                    got: 0.0,
                }),
            },
            Self::Bank(bank) => bank.reweigh(&compiled.members, input),
        }
    }
}

impl Memory<f64> for HeapMemory {
    fn reset(&mut self) {
        match self {
            Self::TurningPoints(engine) => engine.reset(),
            Self::Bank(bank) => bank.reset(),
        }
    }

    #[inline]
    fn move_input(&mut self, from: f64, to: f64) {
        match self {
            Self::TurningPoints(engine) => engine.move_input(from, to),
            Self::Bank(bank) => bank.move_input(from, to),
        }
    }

    #[inline(always)]
    fn move_on(&mut self, from: f64, to: f64, step_back: bool) -> (Piece, Option<f64>) {
        match self {
            Self::TurningPoints(engine) => engine.move_on(from, to, step_back),
            Self::Bank(bank) => bank.move_on(from, to),
        }
    }

    #[inline(always)]
    fn may_jump(&self) -> bool {
        self.method() == Method::Bank
    }

    #[inline(always)]
    fn leap(&mut self, to: f64) -> Option<f64> {
        match self {
            Self::TurningPoints(_) => None,
            Self::Bank(bank) => bank.leap(to),
        }
    }

    #[inline]
    fn jump(&mut self, from: f64, to: f64) -> Option<f64> {
        match self {
            Self::TurningPoints(_) => None,
            Self::Bank(bank) => bank.jump(from, to),
        }
    }

    #[inline]
    fn peek_input(&self, from: f64, to: f64) -> f64 {
        match self {
            Self::TurningPoints(engine) => engine.peek_input(from, to),
            Self::Bank(bank) => bank.peek_input(from, to),
        }
    }

    #[inline(always)]
    fn move_output(&mut self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        match self {
            Self::TurningPoints(engine) => engine.move_output(direction, from, to, limits),
            Self::Bank(bank) => bank.move_output(direction, from, to, limits),
        }
    }

    fn peek_output(&self, direction: Direction, from: Point, to: f64, limits: (f64, f64)) -> Reach {
        match self {
            Self::TurningPoints(engine) => engine.peek_output(direction, from, to, limits),
            Self::Bank(bank) => bank.peek_output(direction, from, to, limits),
        }
    }

    fn is_at(&self, _input: f64) -> bool {
        match self {
            Self::TurningPoints(_) => true,
            Self::Bank(bank) => bank.knows_its_input(),
        }
    }

    fn back(&self) -> Option<f64> {
        match self {
            Self::TurningPoints(engine) => engine.back(),
            Self::Bank(bank) => bank.back(),
        }
    }

    fn forward_piece(&self, input: f64) -> Piece {
        match self {
            Self::TurningPoints(engine) => engine.forward_piece(input),
            Self::Bank(bank) => bank.forward_piece(input),
        }
    }

    #[inline]
    fn inverse_piece(&self, input: f64, output: f64, limits: (f64, f64)) -> Piece {
        match self {
            Self::TurningPoints(engine) => engine.inverse_piece(input, output, limits),
            Self::Bank(bank) => match bank.ahead() {
                Some(piece) => piece.inverse(limits),
                None => Piece::point(Direction::Rising, output, input),
            },
        }
    }

    /// Of a bank whenever it has drawn a line, so that a restored one, whose line is drawn anew, puts out the same.
    #[inline]
    fn back_after(&self, step_back: bool) -> Option<f64> {
        match self {
            Self::TurningPoints(engine) => engine.back_after(step_back),
            Self::Bank(bank) => bank.back(),
        }
    }
}
