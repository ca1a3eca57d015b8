//! A model in the form that evaluates it, and the memory of one stream of it: turning points where the thresholds are
//! nested; else, or if asked for, a bank of operators.

use alloc::boxed::Box;
use alloc::sync::Arc;
use alloc::vec::Vec;

use super::bank::{Bank, BankState, Members};
use super::memory::Memory;
use super::polyline::{Direction, Piece, Point, Reach};
use super::state_of_other_method::{operators_of, turning_points_of};
use super::turning_point_engine::Engine;
use super::turning_point_state::{NestedModel, SharedEngine, TurningPointState};
use crate::error::Error;
use crate::model::{ModifiedPrandtlIshlinskii, Offsets};
use crate::real::count_as_f64;

/// Which algorithm evaluates a stream.
///
/// Both give the same outputs, to 1e-12 of the range. Streams of nested thresholds take turning points unless they are
/// asked for the other one by [`Forward::with_method`](crate::Forward::with_method). Either takes the saved states of
/// the other.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let thresholds = [0.0, 150.0, 300.0]; // V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// assert_eq!(Forward::new(&compiled).method(), Method::TurningPoints);
/// assert_eq!(Forward::with_initial(&compiled, &[0.1; 3])?.method(), Method::Bank);
/// let (mut one, mut other) = (Forward::new(&compiled), Forward::with_method(&compiled, Method::Bank)?);
/// assert!((one.step(400.0) - other.step(400.0)).abs() < 1e-15);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Method {
    /// Turning points and prefix sums: the cost does not grow with the number of operators, and hardly anything is left
    /// of it on a smooth drive.
    TurningPoints,
    /// All operators at once: thresholds that are not nested, arbitrary initial outputs, or few operators along a drive
    /// that jumps. A sample on the line that is drawn after small moves costs as little as with turning points; any
    /// other takes one pass over all operators, whatever the drive does. The feature `simd` makes it faster on
    /// x86-64-v3 and with AVX-512, and changes no bit.
    Bank,
}

/// A model in the form that evaluates it, shared by all streams of the model.
///
/// Made once per model; [`Forward::new`](crate::Forward::new) and [`Inverse::new`](crate::Inverse::new) then only
/// allocate the memory of one stream. Cloning shares.
///
/// ```
/// use hysteresis_core::{CompiledModel, Forward, Inverse, Method, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};
/// let weights = [4.3e-3, 1.7e-3, 1.7e-3]; // um/V
/// let thresholds = [0.0, 150.0, 300.0]; // V
/// let model = ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default())?;
/// let compiled = CompiledModel::new(&model);
/// assert_eq!(compiled.method(), Method::TurningPoints);
/// let (mut actuator, mut inverse) = (Forward::new(&compiled), Inverse::new(&compiled, None)?);
/// assert!((actuator.step(inverse.step(1.5)) - 1.5).abs() < 1e-14); // um
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct CompiledModel {
    pub(crate) offsets: Offsets,
    pub(crate) invertible: Result<(), Error>,
    slopes: (f64, f64),
    fingerprint: u64,
    min_weight: f64,
    pub(super) nested: Result<Arc<NestedModel>, Error>,
    pub(super) members: Arc<Members>,
}

impl CompiledModel {
    /// Sorts the thresholds and sums the weights: O(n log n).
    #[must_use]
    pub fn new(model: &ModifiedPrandtlIshlinskii) -> Self {
        let members = Arc::new(Members::of(model));
        Self {
            offsets: model.offsets(),
            invertible: model.check_invertible(),
            slopes: model.slope_range(),
            fingerprint: model.fingerprint(),
            min_weight: model.members().fold(f64::INFINITY, |least, (w, v, _)| least.min(w).min(v)),
            nested: NestedModel::of(&members).map(Arc::new),
            members,
        }
    }

    /// Which algorithm evaluates a stream that starts at rest.
    #[must_use]
    pub fn method(&self) -> Method {
        if self.nested.is_ok() { Method::TurningPoints } else { Method::Bank }
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
}

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

/// The memory of a model, in one of two forms.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(tag = "method", rename_all = "snake_case", deny_unknown_fields)
)]
pub enum MemoryState {
    /// The turning points of nested thresholds.
    TurningPoints(TurningPointState),
    /// All operators of a bank.
    Bank(BankState),
}

/// A model's parameters together with the memory of one stream.
///
/// Behind a pointer, as only a sample that leaves its line needs it: a stream is two cache lines, many fit in the
/// cache.
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

    /// The reversals that still determine the output, oldest first, for inputs that count from `origin`: nothing for a
    /// bank.
    pub(crate) fn turning_points(&self, origin: f64) -> Vec<f64> {
        match self {
            Self::TurningPoints(engine) => engine.memory().into_iter().map(|x| x + origin).collect(),
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
