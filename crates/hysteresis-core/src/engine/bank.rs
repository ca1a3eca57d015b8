//! The plain loop over all operators: for thresholds that are not nested and for arbitrary initial outputs.

use alloc::boxed::Box;
use alloc::sync::Arc;

use super::checks::{check_same, check_same_count, restore_tolerance};
use super::direction::Direction;
use super::line::{Line, Piece};
use super::solve::{Path, Point, Reach, solve};
use crate::error::{Error, check_finite, check_length};
use crate::model::ModifiedPrandtlIshlinskii;
use crate::operator::{CoupledPlay, Operator};

/// The weights and operators of a model, in the order in which they are summed.
#[derive(Debug)]
pub(crate) struct Members {
    all: Box<[(SplitWeight, CoupledPlay)]>,
    /// Whether any operator weighs differently above and below zero: the sum of all others needs no choice.
    split: bool,
}

/// The weights of an operator above and below zero.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SplitWeight {
    above: f64,
    below: f64,
}

impl SplitWeight {
    /// The weight of the output z; at zero either will do.
    #[inline]
    fn at(self, z: f64) -> f64 {
        if z > 0.0 { self.above } else { self.below }
    }

    fn magnitude(self) -> f64 {
        self.above.abs().max(self.below.abs())
    }
}

impl Members {
    pub(crate) fn of(model: &ModifiedPrandtlIshlinskii) -> Self {
        let all = model.members().map(|(above, below, operator)| (SplitWeight { above, below }, operator)).collect();
        Self { all, split: model.is_split() }
    }

    pub(crate) fn len(&self) -> usize {
        self.all.len()
    }
}

/// A bank of operators, each with its output.
#[derive(Clone, Debug)]
pub(crate) struct Bank {
    members: Arc<Members>,
    initial: Box<[f64]>,
    outputs: Box<[f64]>,
}

impl Bank {
    /// A bank whose operators all start from zero.
    pub(crate) fn at_rest(members: Arc<Members>) -> Self {
        let zeros: Box<[f64]> = members.all.iter().map(|_| 0.0).collect();
        Self { members, initial: zeros.clone(), outputs: zeros }
    }

    /// A bank that starts from the outputs `initial`; the first sample projects them onto what can be reached.
    pub(crate) fn new(members: Arc<Members>, initial: &[f64]) -> Result<Self, Error> {
        check_length("initial", members.len(), initial.len())?;
        for (i, z) in initial.iter().enumerate() {
            check_finite("initial", Some(i), *z)?;
        }
        Ok(Self { members, initial: initial.into(), outputs: initial.into() })
    }

    pub(crate) fn reset(&mut self) {
        for (output, initial) in self.outputs.iter_mut().zip(&self.initial) {
            *output = *initial;
        }
    }

    /// Whether a move of the input to `input` changes no operator.
    pub(crate) fn is_at(&self, input: f64) -> bool {
        self.members.all.iter().zip(&self.outputs).all(|((_, operator), z)| operator.next(*z, input) == *z)
    }

    /// The operator outputs z_i.
    pub(crate) fn outputs(&self) -> &[f64] {
        &self.outputs
    }

    /// Continues from saved operator outputs, which must sum to `output` but for rounding.
    pub(crate) fn restore(&mut self, outputs: &[f64], input: f64, output: f64) -> Result<(), Error> {
        if outputs.len() != self.outputs.len() || outputs.iter().any(|z| check_finite("state", None, *z).is_err()) {
            return Err(Error::State { expected: "one finite output for each operator" });
        }
        let (mut sum, mut scale) = (0.0, 0.0);
        for ((weight, _), z) in self.members.all.iter().zip(outputs) {
            sum += weight.at(*z) * z;
            scale += weight.magnitude() * (z.abs() + input.abs() + f64::MIN_POSITIVE);
        }
        if (sum - output).abs() > restore_tolerance(scale) {
            return Err(Error::State { expected: "operator outputs that sum to the output" });
        }
        self.outputs.copy_from_slice(outputs);
        Ok(())
    }

    /// Takes over other weights of the same operators in the same order: whether they differ.
    pub(crate) fn reweigh(&mut self, members: &Arc<Members>) -> Result<bool, Error> {
        check_same_count(self.members.len(), members.len())?;
        let mut differ = false;
        for ((weight, z), (other_weight, other)) in self.members.all.iter().zip(&members.all) {
            check_same("r", z.r(), other.r())?;
            check_same("ra", z.ra(), other.ra())?;
            check_same("rb", z.rb(), other.rb())?;
            check_same("rc", z.rc(), other.rc())?;
            differ |= weight != other_weight;
        }
        self.members = members.clone();
        Ok(differ)
    }

    /// Moves the input to `to`.
    pub(crate) fn move_input(&mut self, to: f64) {
        for ((_, operator), z) in self.members.all.iter().zip(&mut self.outputs) {
            *z = operator.next(*z, to);
        }
    }

    /// The output of the present state.
    pub(crate) fn output(&self) -> f64 {
        self.sum(|_, z| z)
    }

    /// The output after a move of the input to `to`.
    pub(crate) fn peek_input(&self, to: f64) -> f64 {
        self.sum(|operator, z| operator.next(z, to))
    }

    /// Sum of w times what `output` makes of each operator, always in the order of the model.
    #[inline]
    fn sum(&self, output: impl Fn(&CoupledPlay, f64) -> f64) -> f64 {
        let outputs = self.members.all.iter().zip(&self.outputs);
        let outputs = outputs.map(|((weight, operator), z)| (weight, output(operator, *z)));
        if self.members.split {
            outputs.fold(0.0, |sum, (weight, z)| sum + weight.at(z) * z)
        } else {
            outputs.fold(0.0, |sum, (weight, z)| sum + weight.above * z)
        }
    }

    /// The input that brings the output to `to`, or the limit that comes closest. `from` is where the search starts.
    pub(crate) fn look_output(&self, from: Point, to: f64, (low, high): (f64, f64)) -> Reach {
        let (least, most) = (self.peek_input(low), self.peek_input(high));
        if to <= least {
            return Reach { input: low, output: least, saturated: to < least };
        }
        if to >= most {
            return Reach { input: high, output: most, saturated: to > most };
        }
        let near = from.input.max(low).min(high);
        let near = Point { input: near, output: self.peek_input(near) };
        if near.output == to {
            return Reach { input: near.input, output: to, saturated: false };
        }
        let direction = if near.output <= to { Direction::Rising } else { Direction::Falling };
        let guess = self.line_at(near.input).inverted().at(to);
        let found = solve(&mut BankPath(self), direction, near, None, guess, to, direction.limit((low, high)));
        Reach { saturated: false, output: to, ..found }
    }

    /// The line of the outputs over the input around `x`, every operator starting from its present output.
    fn line_at(&self, x: f64) -> Line {
        let mut line = Line { slope: 0.0, offset: 0.0 };
        for ((weight, operator), z) in self.members.all.iter().zip(&self.outputs) {
            let next = operator.next(*z, x);
            let weight = weight.at(next);
            match operator.slide(*z, x) {
                Some(shift) => {
                    line.slope += weight;
                    line.offset += weight * shift;
                }
                None => line.offset += weight * next,
            }
        }
        line
    }
}

/// Moves that do not move the bank: every operator starts from its present output.
struct BankPath<'a>(&'a Bank);

impl Path<f64> for BankPath<'_> {
    type Checkpoint = ();

    fn checkpoint(&self) {}

    fn go_back(&mut self, (): ()) {}

    /// How far a line goes is not known: its piece is a point.
    fn look(&mut self, direction: Direction, input: f64) -> Piece {
        Piece { direction, line: self.0.line_at(input), begin: input, end: input }
    }
}
