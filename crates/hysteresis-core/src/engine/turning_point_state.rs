//! What a turning-point engine remembers as a plain value: out of it, into it, and with other weights of the same
//! operators.

use alloc::sync::Arc;
use alloc::vec::Vec;

use super::bank::Members;
use super::branch::{Branch, Remembered, Stack, Stacks, TurningPoint};
use super::family::{Evaluates, Families, Family};
use super::memory::Memory;
use super::polyline::Direction;
use super::turning_point_engine::{Engine, EngineState};
use crate::error::{Error, is_admissible, restore_tolerance};
use crate::store::{Heap, Store};

/// The turning points of both families of one-sided plays.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct TurningPointState {
    /// Which way the input moved when it last let an operator slide, or was about to.
    pub direction: Direction,
    /// How many reversals were noted, for numbering: where a step back lets nothing slide, none need be.
    pub reversals: u64,
    /// The family above zero.
    pub positive: FamilyState,
    /// The family below zero, in the mirrored coordinate.
    pub negative: FamilyState,
}

/// The turning points of one family and its position on the present branch.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct FamilyState {
    /// How many operators slide on the present branch.
    pub moved: usize,
    /// How many of them rest at zero.
    pub at_zero: usize,
    /// What froze the others, oldest first.
    pub turning_points: Vec<TurningPoint>,
}

impl FamilyState {
    /// Whether a family of `operators` can be in this state: only such a state is ever restored.
    pub(crate) fn check(&self, operators: usize, reversals: u64, direction: Direction) -> Result<(), Error> {
        let mut below = operators;
        for (height, point) in self.turning_points.iter().enumerate() {
            // Only the lowest turning point may have moved every operator, as many as the virgin state below it.
            let fewer = point.moved < below || height == 0 && point.moved == below;
            if !fewer
                || point.moved == 0
                || point.at_zero > if point.ended == Direction::Falling { point.moved } else { 0 }
                || !is_admissible(0.5 * point.input) // it is relative to an offset, which is admissible too
                || !point.output.is_finite()
            {
                return Err(Error::State {
                    expected: "turning points at finite inputs, each with fewer operators than the one below it \
                               and no more than the model has",
                });
            }
            if point.reversal == 0 || point.reversal > reversals {
                return Err(Error::State { expected: "turning points numbered from 1 to the number of reversals" });
            }
            below = point.moved;
        }
        let resting = if direction == Direction::Falling { self.moved } else { 0 };
        if self.moved > below || self.at_zero > resting || (self.moved == below && !self.turning_points.is_empty()) {
            return Err(Error::State { expected: "fewer sliding operators than the newest turning point has moved" });
        }
        Ok(())
    }
}

impl Branch<f64> {
    /// The branch and the stack that a checked state describes.
    pub(crate) fn restored<S: Store>(
        family: &Family<f64, S>,
        state: &FamilyState,
        direction: Direction,
    ) -> (Self, Stack<f64, S>) {
        let mut stack = Stack::new(family.len());
        let mut branch = Self::virgin(family, direction);
        for point in &state.turning_points {
            branch.moved = point.moved;
            let (beyond, released) = (branch.frozen(family), branch.released(family, point.ended, point.input));
            branch.top = Remembered { point: *point, beyond, released };
            branch.height += 1;
            branch.keep_top(&mut stack);
        }
        (branch.moved, branch.at_zero) = (state.moved, state.at_zero);
        branch.draw(family, direction);
        (branch, stack)
    }

    /// The same position with other weights: what is remembered of the operators at older turning points is summed
    /// anew.
    pub(crate) fn reweigh(
        &mut self,
        family: &Family<f64, impl Store>,
        stack: &mut Stack<f64, impl Store>,
        direction: Direction,
    ) {
        let (moved, height) = (self.moved, self.height);
        self.top = Remembered::virgin(family.len());
        for level in 1..=height {
            let older = *stack.get(level);
            self.moved = older.point.moved;
            self.top = Remembered { beyond: self.frozen(family), ..older };
            stack.put(level, self.top);
        }
        self.moved = moved;
        self.draw(family, direction);
    }

    /// Takes the newest turning point from the stack, where it was changed.
    fn renew_top(&mut self, stack: &Stack<f64, impl Store>) {
        self.top = *stack.get(self.height);
    }

    /// How many turning points the stack holds.
    pub(crate) fn height(&self) -> usize {
        self.height
    }

    /// Whether `x` lies on the branch but for rounding: past the reversal it began with, or before the one where its
    /// loop closes.
    pub(crate) fn holds(&self, direction: Direction, x: f64) -> bool {
        let TurningPoint { input, ended, .. } = self.top.point;
        let (past, slack) = (direction.sign::<f64>() * (x - input), restore_tolerance(x.abs() + input.abs()));
        if ended == direction { past <= slack } else { past >= -slack }
    }

    /// What restores the branch.
    pub(crate) fn state(&self, stack: &Stack<f64, impl Store>) -> FamilyState {
        FamilyState { moved: self.moved, at_zero: self.at_zero, turning_points: self.remembered(stack).collect() }
    }

    /// The turning points that still matter, oldest first.
    pub(crate) fn remembered(&self, stack: &Stack<f64, impl Store>) -> impl Iterator<Item = TurningPoint> {
        stack.points(self.height)
    }
}

/// Far more reversals than any stream sees, and far from the end of the counter.
const MAX_REVERSALS: u64 = 1 << 63;

/// A model of nested thresholds, its tables on the heap.
#[derive(Debug)]
pub(crate) struct NestedModel {
    pub(super) families: Families<f64, Heap>,
    /// Its operators in the order of the model: for states of a bank.
    pub(super) members: Arc<Members>,
}

impl NestedModel {
    /// # Errors
    /// As [`Families::of`].
    pub(crate) fn of(members: &Arc<Members>) -> Result<Self, Error> {
        Ok(Self { families: Families::of(members.of_model())?, members: members.clone() })
    }
}

impl Evaluates for Arc<NestedModel> {
    type Number = f64;
    type Store = Heap;

    #[inline(always)]
    fn families(&self) -> &Families<f64, Heap> {
        &self.families
    }
}

/// The engine of a model that its streams share.
pub(crate) type SharedEngine = Engine<Arc<NestedModel>>;

impl EngineState<f64> {
    /// Whether the input `x` lies on both branches.
    pub(crate) fn holds(&self, x: f64) -> bool {
        self.positive.holds(self.direction, x) && self.negative.holds(self.direction.reversed(), -x)
    }
}

impl SharedEngine {
    /// Takes over other weights of the same operators, the input being at `input`: whether they differ.
    pub(crate) fn reweigh(&mut self, model: &Arc<NestedModel>, input: f64) -> Result<bool, Error> {
        let differ = self.model.families.check_same_operators(&model.families)?;
        // Also where no weight differs: the operators may have another order.
        self.model = model.clone();
        if differ {
            let Self { model, state, stacks, .. } = self;
            let (families, direction) = (model.families(), state.direction);
            state.positive.reweigh(&families.positive, &mut stacks.positive, direction);
            state.negative.reweigh(&families.negative, &mut stacks.negative, direction.reversed());
            self.renew_all_outputs(input);
        }
        Ok(differ)
    }

    /// The number of operators with memory.
    pub(crate) fn operators(&self) -> usize {
        self.model.families.positive.len()
    }

    /// Computes the output at every turning point, the input being at `input`.
    fn renew_all_outputs(&mut self, input: f64) {
        for direction in [Direction::Rising, Direction::Falling] {
            self.renew_outputs(direction, input);
        }
        self.state.positive.renew_top(&self.stacks.positive);
        self.state.negative.renew_top(&self.stacks.negative);
    }

    /// Computes the output at every turning point that lies in `direction` of `input`: the model is back at it when the
    /// input is back there, so a copy of the state goes there and looks.
    fn renew_outputs(&mut self, direction: Direction, input: f64) {
        let Self { model, state, stacks, reversals } = self;
        let families = model.families();
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
        let candidate = Self::of_state(&self.model, state)?;
        candidate.check_position(input, output)?;
        candidate.check_turning_points(input)?;
        *self = candidate;
        Ok(())
    }

    /// A state that was at `input`, with the outputs that the model has at its turning points, whatever it says there.
    pub(crate) fn with_outputs(
        model: &Arc<NestedModel>,
        state: &TurningPointState,
        input: f64,
    ) -> Result<TurningPointState, Error> {
        let mut engine = Self::of_state(model, state)?;
        engine.renew_all_outputs(input);
        Ok(engine.state())
    }

    /// The engine that a saved state describes, wherever its input was.
    fn of_state(model: &Arc<NestedModel>, state: &TurningPointState) -> Result<Self, Error> {
        let TurningPointState { direction, reversals, .. } = *state;
        if reversals > MAX_REVERSALS {
            return Err(Error::State { expected: "at most 2^63 reversals" });
        }
        let restored = |family: &Family<f64, Heap>, saved: &FamilyState, direction: Direction| {
            saved.check(family.len(), reversals, direction)?;
            Ok(Branch::restored(family, saved, direction))
        };
        let families = model.families();
        let (positive, positive_stack) = restored(&families.positive, &state.positive, direction)?;
        let (negative, negative_stack) = restored(&families.negative, &state.negative, direction.reversed())?;
        let engine_state = EngineState { direction, positive, negative };
        let stacks = Stacks { positive: positive_stack, negative: negative_stack };
        Ok(Self { model: model.clone(), state: engine_state, stacks, reversals })
    }

    /// The input must lie on the branches that the state tells of, and the model have the output there.
    fn check_position(&self, input: f64, output: f64) -> Result<(), Error> {
        if self.state.holds(input) && self.agree(self.state.line(self.model.families()).at(input), output, input) {
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
        (one - other).abs() <= restore_tolerance(self.model.families.output_scale(input.abs() + f64::MIN_POSITIVE))
    }
}
