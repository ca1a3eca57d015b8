//! The memory of a model: what evaluates it, forward and inverse, between and across breakpoints.
//!
//! Nested thresholds run on the turning-point [`engine`](engine::Engine); anything else on the
//! [`bank`](bank::Bank) of operators. Inputs here are relative to the input offset, outputs to the output offset.

mod bank;
mod branch;
mod engine;
mod family;
mod lookup;
mod place;
mod scout;
mod search;
mod solve;
mod state;
mod turning_points;

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;

pub(crate) use family::Line;
pub(crate) use solve::Known;
pub use state::{FamilyState, MemoryState, TurningPointState};
pub use turning_points::{Direction, TurningPoint};

use crate::error::Error;
use crate::model::{ModifiedPrandtlIshlinskii, Offsets};
use bank::{Bank, Members};
use engine::Engine;
use place::Families;

/// How far a saved number may be from the model's: relative to the scale of what was rounded, far above rounding and
/// far below any use; and no less than what the smallest numbers lose.
fn restore_tolerance(scale: f64) -> f64 {
    1e-9 * scale + f64::MIN_POSITIVE
}

/// Checks a number of a new model against that of the running stream, or names it.
pub(crate) fn check_same(what: &'static str, expected: f64, got: f64) -> Result<(), Error> {
    if expected == got { Ok(()) } else { Err(Error::OtherOperators { what, expected, got }) }
}

fn check_same_count(expected: usize, got: usize) -> Result<(), Error> {
    check_same("number of operators", count_as_f64(expected), count_as_f64(got))
}

#[expect(clippy::cast_precision_loss, reason = "a count, for a message")]
pub(crate) fn count_as_f64(count: usize) -> f64 {
    count as f64
}

/// A straight line and how far, in the direction of travel, it holds: from `begin` up to but not including `end`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Piece {
    pub(crate) direction: Direction,
    pub(crate) line: Line,
    pub(crate) begin: f64,
    pub(crate) end: f64,
}

impl Piece {
    /// A piece of no length: every new sample is evaluated anew.
    pub(crate) fn point(direction: Direction, input: f64, output: f64) -> Self {
        Self { direction, line: Line { slope: 0.0, offset: output }, begin: input, end: input }
    }
}

/// Where a move towards a given output came to.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Reach {
    /// The input there.
    pub(crate) input: f64,
    /// The output there: what was asked for, or what the limit allows.
    pub(crate) output: f64,
    pub(crate) saturated: bool,
}

/// Which algorithm evaluates a stream.
///
/// ```
/// use hysteresis_core::{Forward, Kernel, Method, paper};
/// let kernel = Kernel::new(&paper::table_1());
/// assert_eq!(Forward::new(&kernel).method(), Method::TurningPoints);
/// assert_eq!(Forward::with_initial(&kernel, &[0.1; 20])?.method(), Method::Bank);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Turning points and prefix sums: the cost does not grow with the number of operators.
    TurningPoints,
    /// A loop over all operators: thresholds that are not nested, or arbitrary initial outputs.
    Bank,
}

/// A model in the form that evaluates it, shared by all streams of the model.
///
/// Made once per model; [`Forward::new`](crate::Forward::new) and [`Inverse::new`](crate::Inverse::new) then only
/// allocate the memory of one stream. Cloning shares.
///
/// ```
/// use hysteresis_core::{Forward, Inverse, Kernel, Method, Process, paper};
/// let kernel = Kernel::new(&paper::table_1_recovered());
/// assert_eq!(kernel.method(), Method::TurningPoints);
/// let (mut actuator, mut inverse) = (Forward::new(&kernel), Inverse::new(&kernel, None)?);
/// assert!((actuator.step(inverse.step(1.5)) - 1.5).abs() < 1e-14); // um
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Kernel {
    pub(crate) offsets: Offsets,
    pub(crate) invertible: Result<(), Error>,
    slopes: (f64, f64),
    fingerprint: u64,
    min_weight: f64,
    families: Option<Arc<Families>>,
    members: Arc<Members>,
}

impl Kernel {
    /// Sorts the thresholds and sums the weights: O(n log n).
    #[must_use]
    pub fn new(model: &ModifiedPrandtlIshlinskii) -> Self {
        Self {
            offsets: model.offsets(),
            invertible: model.check_invertible(),
            slopes: model.slope_range(),
            fingerprint: model.fingerprint(),
            min_weight: model.members().fold(f64::INFINITY, |least, (w, v, _)| least.min(w).min(v)),
            families: Families::of(model).map(Arc::new),
            members: Arc::new(Members::of(model)),
        }
    }

    /// Which algorithm evaluates a stream that starts at rest.
    #[must_use]
    pub fn method(&self) -> Method {
        if self.families.is_some() { Method::TurningPoints } else { Method::Bank }
    }

    /// The number of operators.
    #[must_use]
    pub fn operators(&self) -> usize {
        self.members.len()
    }

    /// The least and the greatest slope of the model:
    /// [`ModifiedPrandtlIshlinskii::slope_range`].
    #[must_use]
    pub fn slope_range(&self) -> (f64, f64) {
        self.slopes
    }

    /// A number that tells this model from others, by the values of its parameters: equal models have equal numbers.
    #[must_use]
    pub fn fingerprint(&self) -> u64 {
        self.fingerprint
    }

    /// A negative weight, if there is one.
    pub(crate) fn negative_weight(&self) -> Option<f64> {
        (self.min_weight < 0.0).then_some(self.min_weight)
    }

    /// The memory of a stream at rest.
    pub(crate) fn memory_at_rest(&self) -> Memory {
        match &self.families {
            Some(families) => Memory::TurningPoints(Box::new(Engine::new(families.clone()))),
            None => Memory::Bank(Box::new(Bank::at_rest(self.members.clone()))),
        }
    }

    /// The memory of a stream that starts from the operator outputs `initial`.
    pub(crate) fn memory_from(&self, initial: &[f64]) -> Result<Memory, Error> {
        Bank::new(self.members.clone(), initial).map(Box::new).map(Memory::Bank)
    }
}

/// A model's parameters together with the memory of one stream.
///
/// Behind a pointer, as only a sample that leaves its line needs it: a stream is two cache lines, many fit in the cache.
#[derive(Clone, Debug)]
pub(crate) enum Memory {
    TurningPoints(Box<Engine>),
    Bank(Box<Bank>),
}

impl Memory {
    pub(crate) fn method(&self) -> Method {
        match self {
            Self::TurningPoints(_) => Method::TurningPoints,
            Self::Bank(_) => Method::Bank,
        }
    }

    pub(crate) fn reset(&mut self) {
        match self {
            Self::TurningPoints(engine) => engine.reset(),
            Self::Bank(bank) => bank.reset(),
        }
    }

    /// Moves the input from `from` to `to`.
    #[inline]
    pub(crate) fn move_input(&mut self, from: f64, to: f64) {
        match self {
            Self::TurningPoints(engine) => engine.move_input(from, to),
            Self::Bank(bank) => bank.move_input(to),
        }
    }

    /// The output after a move of the input from `from` to `to`.
    #[inline]
    pub(crate) fn peek_input(&self, from: f64, to: f64) -> f64 {
        match self {
            Self::TurningPoints(engine) => engine.peek_input(from, to),
            Self::Bank(bank) => bank.peek_input(to),
        }
    }

    /// Moves on from `from` in `direction` until the output is `to` or the input is at a limit.
    pub(crate) fn move_output(&mut self, direction: Direction, from: Known, to: f64, limits: (f64, f64)) -> Reach {
        match self {
            Self::TurningPoints(engine) => engine.move_output(direction, from, to, limits),
            Self::Bank(bank) => {
                let reach = bank.look_output(from, to, limits);
                bank.move_input(reach.input);
                reach
            }
        }
    }

    /// Where [`move_output`](Self::move_output) would come to.
    pub(crate) fn peek_output(&self, direction: Direction, from: Known, to: f64, limits: (f64, f64)) -> Reach {
        match self {
            Self::TurningPoints(engine) => engine.peek_output(direction, from, to, limits),
            Self::Bank(bank) => bank.look_output(from, to, limits),
        }
    }

    /// The reversals that still determine the output, oldest first: nothing for a bank.
    pub(crate) fn turning_points(&self) -> Vec<f64> {
        match self {
            Self::TurningPoints(engine) => engine.memory(),
            Self::Bank(_) => Vec::new(),
        }
    }

    pub(crate) fn state(&self) -> MemoryState {
        match self {
            Self::TurningPoints(engine) => MemoryState::TurningPoints(engine.state()),
            Self::Bank(bank) => MemoryState::Bank { outputs: bank.outputs().into() },
        }
    }

    /// Continues from a saved state that was at this input and output.
    pub(crate) fn restore(&mut self, state: &MemoryState, input: f64, output: f64) -> Result<(), Error> {
        match (self, state) {
            (Self::TurningPoints(engine), MemoryState::TurningPoints(state)) => engine.restore(state, input, output),
            (Self::Bank(bank), MemoryState::Bank { outputs }) => bank.restore(outputs, input, output),
            _ => Err(Error::State { expected: "the memory of a stream of the same method" }),
        }
    }

    /// Takes over the weights of another model of the same operators, the input being `input`: whether they differ.
    ///
    /// The place, the turning points and the operator outputs stay; what they sum to is computed anew.
    pub(crate) fn reweigh(&mut self, kernel: &Kernel, input: f64) -> Result<bool, Error> {
        match self {
            Self::TurningPoints(engine) => match &kernel.families {
                Some(families) => engine.reweigh(families, input),
                None => Err(Error::OtherOperators {
                    what: "number of operators with nested thresholds",
                    expected: count_as_f64(engine.operators()),
                    got: 0.0,
                }),
            },
            Self::Bank(bank) => bank.reweigh(&kernel.members),
        }
    }

    /// Whether a move to the present input `input` changes nothing: not so before the first sample of a bank that starts
    /// from arbitrary outputs.
    pub(crate) fn is_at(&self, input: f64) -> bool {
        match self {
            Self::TurningPoints(_) => true,
            Self::Bank(bank) => bank.is_at(input),
        }
    }

    /// The output at the present place, the input being `input`.
    pub(crate) fn output(&self, input: f64) -> f64 {
        self.forward_piece(input).line.at(input)
    }

    /// The piece over the input at the present place, the input being `input`.
    pub(crate) fn forward_piece(&self, input: f64) -> Piece {
        match self {
            Self::TurningPoints(engine) => engine.piece(),
            Self::Bank(bank) => Piece::point(Direction::Rising, input, bank.output()),
        }
    }

    /// The piece over the output at the present place, the output being `output` and the input `input`.
    pub(crate) fn inverse_piece(&self, input: f64, output: f64, limits: (f64, f64)) -> Piece {
        match self {
            Self::TurningPoints(engine) => engine.inverse_piece(limits),
            Self::Bank(_) => Piece::point(Direction::Rising, output, input),
        }
    }
}
