//! What a stage of several axes does, sample by sample.

use hysteresis_core::{Error, check_length, is_admissible, unless_faded};
use serde::{Deserialize, Serialize};

use super::model::{Matrices, MultiAxisStage};
use super::operator::{OperatorState, OperatorStream};
use crate::checks::check_numbers;

/// The positions of a stage of several axes, sample by sample: `step(u, y)` writes y(k), then holds u(k) for one
/// interval; `advance(u, y)` holds u(k), then writes y(k+1), as a plant in a loop.
///
/// Begins at rest: x = 0 and w = 0. A drive that is not finite, or beyond 1e100, counts as the last one of its axis.
/// A sub-step that would bring a state beyond 1e100 leaves the states as they are, and is the last one of its interval.
/// Both are counted. Nothing is allocated.
#[derive(Clone, Debug)]
pub struct MultiAxisForward {
    /// Columns for x, then for u, of the rows of x+ without Bw, of y and of q, one column after the other.
    through: Box<[f64]>,
    /// Columns of Bw.
    bw: Box<[f64]>,
    output_offset: Box<[f64]>,
    operators: Vec<OperatorStream>,
    /// x, then the last drives.
    from: Box<[f64]>,
    /// x+, y and q.
    to: Box<[f64]>,
    states: usize,
    sub_steps: usize,
    rejected: u64,
}

/// Everything that a stream remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MultiAxisForwardState {
    /// x.
    pub states: Vec<f64>,
    /// The last drives.
    pub drives: Vec<f64>,
    /// What each operator remembers.
    pub operators: Vec<OperatorState>,
}

impl MultiAxisForward {
    /// At rest.
    #[must_use]
    pub fn new(stage: &MultiAxisStage) -> Self {
        let Matrices { a, b, bw, c, d, cq, dq } = stage.matrices();
        let from_states = (0..a.ncols())
            .flat_map(|j| a.column(j).iter().chain(&c.column(j)).chain(&cq.column(j)).copied().collect::<Vec<_>>());
        let from_drives = (0..b.ncols())
            .flat_map(|j| b.column(j).iter().chain(&d.column(j)).chain(&dq.column(j)).copied().collect::<Vec<_>>());
        Self {
            through: from_states.chain(from_drives).collect(),
            bw: bw.as_slice().into(),
            output_offset: stage.output_offset().into(),
            operators: stage.operators().iter().map(OperatorStream::new).collect(),
            from: vec![0.0; a.ncols() + b.ncols()].into(),
            to: vec![0.0; a.nrows() + c.nrows() + cq.nrows()].into(),
            states: a.nrows(),
            sub_steps: stage.sub_steps(),
            rejected: 0,
        }
    }

    /// The number of drives.
    #[must_use]
    pub fn drives(&self) -> usize {
        self.from.len() - self.states
    }

    /// The number of positions.
    #[must_use]
    pub fn positions(&self) -> usize {
        self.output_offset.len()
    }

    /// How many drives were not admissible, and how many samples would have brought a state beyond 1e100.
    #[must_use]
    pub fn rejected(&self) -> u64 {
        self.rejected
    }

    /// Writes the positions y(k), then holds the drives u(k) for one interval.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are as many drives and positions as the stage has; nothing happens then.
    pub fn step(&mut self, drives: &[f64], positions: &mut [f64]) -> Result<(), Error> {
        check_length("u", self.drives(), drives.len())?;
        check_length("out", self.positions(), positions.len())?;
        self.walk(drives, positions);
        Ok(())
    }

    /// A plant in a loop: holds the drives u(k) for one interval, then writes the positions y(k+1) at its end, while
    /// they are still held.
    ///
    /// # Errors
    /// As [`step`](Self::step).
    pub fn advance(&mut self, drives: &[f64], positions: &mut [f64]) -> Result<(), Error> {
        self.step(drives, positions)?;
        self.to.fill(0.0);
        add_columns(&self.through, &self.from, &mut self.to);
        let outputs = self.to.iter().skip(self.states).zip(&self.output_offset);
        positions.iter_mut().zip(outputs).for_each(|(position, (output, offset))| *position = output + offset);
        Ok(())
    }

    /// Steps through rows of drives, one after the other, and writes the rows of positions.
    ///
    /// # Errors
    /// [`Error::Length`] unless there are whole rows of drives, and as many of positions; nothing happens then.
    pub fn run(&mut self, drives: &[f64], positions: &mut [f64]) -> Result<(), Error> {
        let (m, p) = (self.drives(), self.positions());
        let rows = drives.len() / m.max(1);
        check_length("u", rows * m, drives.len())?;
        check_length("out", rows * p, positions.len())?;
        for (u, y) in drives.chunks_exact(m.max(1)).zip(positions.chunks_exact_mut(p.max(1))) {
            self.walk(u, y);
        }
        Ok(())
    }

    /// x, then the last drives.
    #[inline]
    pub(super) fn held(&self) -> &[f64] {
        &self.from
    }

    /// The operators with their memory.
    #[inline]
    pub(super) fn operators(&self) -> &[OperatorStream] {
        &self.operators
    }

    #[inline]
    pub(super) fn walk(&mut self, drives: &[f64], positions: &mut [f64]) {
        let Self { through, bw, output_offset, operators, from, to, states, sub_steps, rejected } = self;
        for (last, drive) in from.iter_mut().skip(*states).zip(drives) {
            if is_admissible(*drive) {
                *last = *drive;
            } else {
                *rejected = rejected.saturating_add(1);
            }
        }
        for sub_step in 0..*sub_steps {
            to.fill(0.0);
            add_columns(through, from, to);
            // As long as they were made: nothing is left out.
            let Some((next, rest)) = to.split_at_mut_checked(*states) else { return };
            let Some((outputs, queries)) = rest.split_at_checked(output_offset.len()) else { return };
            if sub_step == 0 {
                for ((position, output), offset) in positions.iter_mut().zip(outputs).zip(&*output_offset) {
                    *position = output + offset;
                }
            }
            for ((operator, q), column) in operators.iter_mut().zip(queries).zip(bw.chunks_exact((*states).max(1))) {
                let w = operator.step(*q);
                next.iter_mut().zip(column).for_each(|(next, entry)| *next += entry * w);
            }
            if !next.iter().all(|x| is_admissible(*x)) {
                *rejected = rejected.saturating_add(1);
                return;
            }
            from.iter_mut().zip(&*next).for_each(|(x, next)| *x = unless_faded(*next));
        }
    }

    /// Back to rest.
    pub fn reset(&mut self) {
        self.from.fill(0.0);
        self.operators.iter_mut().for_each(OperatorStream::reset);
        self.rejected = 0;
    }

    /// Everything that it remembers.
    #[must_use]
    pub fn state(&self) -> MultiAxisForwardState {
        let (states, drives) = self.from.split_at(self.states);
        let operators = self.operators.iter().map(OperatorStream::state).collect();
        MultiAxisForwardState { states: states.to_vec(), drives: drives.to_vec(), operators }
    }

    /// Goes on from a saved state, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what is wrong, for another number of states, drives or operators, operators of another
    /// kind, or a number that is not finite; the stream is as before then.
    pub fn set_state(&mut self, state: &MultiAxisForwardState) -> Result<(), Error> {
        check_numbers("state.states", self.states, &state.states)?;
        check_numbers("state.drives", self.drives(), &state.drives)?;
        check_length("state.operators", self.operators.len(), state.operators.len())?;
        let mut operators = self.operators.clone();
        operators.iter_mut().zip(&state.operators).try_for_each(|(own, state)| own.set_state(state))?;
        self.operators = operators;
        self.from.iter_mut().zip(state.states.iter().chain(&state.drives)).for_each(|(own, x)| *own = *x);
        Ok(())
    }
}

/// Adds each column times its number: rows are sums in the order of the columns, so they fill vectors.
#[inline]
fn add_columns(columns: &[f64], numbers: &[f64], sums: &mut [f64]) {
    for (column, number) in columns.chunks_exact(sums.len().max(1)).zip(numbers) {
        sums.iter_mut().zip(column).for_each(|(sum, entry)| *sum += entry * number);
    }
}
