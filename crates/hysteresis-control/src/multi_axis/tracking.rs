//! Drives that lead a stage of several axes along references that come early, and what disturbs it.

use std::sync::Arc;

use hysteresis_core::{Error, check_length, is_admissible};
use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

use super::forward::{MultiAxisForward, MultiAxisForwardState};
use super::model::MultiAxisStage;
use super::operator::middle;
use super::tracking_gains::{TrackingGains, TrackingOptions};
use crate::checks::{check_numbers, check_terms, check_whole};

/// The most drives and operators: what a sample needs lies on the stack.
const MOST: usize = 16;

/// How often what hysteresis adds is found anew with the drives that it asks for. Each time little is left of the
/// change since the last sample.
const ROUNDS: usize = 4;

/// A number for each drive, position or operator; those behind the last one are 0.
pub(super) type Numbers = [f64; MOST];

/// Matrices by rows.
#[derive(Debug)]
struct Tables {
    /// Of x and the last drives: to the drives, to the mean q of a sample, to the positions.
    by_held: Box<[f64]>,
    query: Box<[f64]>,
    output: Box<[f64]>,
    /// Of the references of now and later, m rows of (ahead + 1) p.
    by_reference: Box<[f64]>,
    /// Of what w is beside middle slope times q.
    by_operator: Box<[f64]>,
    /// Of what measurements are beside the model: to the states, then to the disturbance.
    correction: Box<[f64]>,
    /// A and B of a sample, with middle slopes.
    mean: Box<[f64]>,
    middle: Box<[f64]>,
    offset: Box<[f64]>,
    /// Of each drive.
    limits: Box<[(f64, f64)]>,
    static_inverse: Box<[f64]>,
    ahead: usize,
}

/// The feed-forward and the observer of a stage of several axes.
///
/// ```text
/// u(k)      = least squares of position errors and changes of drives from now on, of the model at x(k), w(k)
/// d(k)      = Kalman filter of y - y of the model: a disturbance, as if it came in with the drives
/// ```
///
/// The model with its hysteresis runs with the drives of the feed-forward, so it knows what it remembers. References
/// come `ahead` samples early; later ones are taken as the newest. What hysteresis does beside its middle slope is
/// taken to stay as it is: the next sample knows better. Drives are kept within limits before the model has them.
#[derive(Clone, Debug)]
pub struct Tracking {
    tables: Arc<Tables>,
    model: MultiAxisForward,
    /// What the states are beside those of the model, then the disturbance of each drive.
    beside: Box<[f64]>,
    /// What the last drives that went out were beside those of the model, with the disturbance.
    beside_drives: Box<[f64]>,
    /// Room for the next states.
    next: Box<[f64]>,
    /// All references of the window but the newest, a ring of rows of p.
    window: Box<[f64]>,
    /// Where its oldest row begins.
    oldest: usize,
    /// How many references came since the motion began, up to those of its start.
    begun: u32,
    /// Over how many samples a motion leads from where the model is to its references.
    start_samples: u32,
    /// Where the first reference is beside that place.
    gap: Box<[f64]>,
    dt: f64,
}

/// Everything that a [`Tracking`] remembers.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrackingState {
    /// The model.
    pub model: MultiAxisForwardState,
    /// What the states are beside those of the model, then the disturbance of each drive.
    pub beside: Vec<f64>,
    /// What the last drives that went out were beside those of the model, with the disturbance.
    pub beside_drives: Vec<f64>,
    /// The references before the newest, oldest first.
    pub window: Vec<f64>,
    /// How many references came since the motion began, up to those of its start.
    pub begun: u32,
    /// Where the first reference was beside the position of the model.
    pub gap: Vec<f64>,
}

/// What a sample asks for.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Asked {
    /// The drives of the feed-forward; NaN where anything that was asked for is not admissible.
    pub(super) volts: Numbers,
    /// What comes in with the drives.
    pub(super) disturbance: Numbers,
    /// What measurements are beside the model and its observer; zeros where they are not believed.
    missed: Numbers,
    /// The newest reference, and the same led from where the motion began.
    wanted: Numbers,
    newest: Numbers,
}

impl Asked {
    /// Whether there are drives of the feed-forward.
    #[inline]
    pub(super) fn is_admissible(&self) -> bool {
        self.volts.iter().all(|volts| is_admissible(*volts))
    }
}

impl Tracking {
    /// For a stage whose drives have limits, one pair for each. A motion is led to its references over `start_samples`.
    ///
    /// # Errors
    /// [`Error`] for a stage with other numbers of drives and positions, with more than 16 of them or of operators, or
    /// that drives cannot bring everywhere; for other numbers of limits, and options out of their ranges.
    pub fn new(
        stage: &MultiAxisStage,
        limits: &[(f64, f64)],
        start_samples: u32,
        options: &TrackingOptions,
    ) -> Result<Self, Error> {
        let (most, m) = (stage.drives().max(stage.operators().len()).max(stage.positions()), stage.drives());
        check_whole("stage", most <= MOST, "a stage with at most 16 drives, positions and operators", most)?;
        check_length("limits", m, limits.len())?;
        let gains = TrackingGains::new(stage, options)?;
        let (matrices, p) = (stage.matrices(), stage.positions());
        let middle: Box<[f64]> = stage.operators().iter().map(middle).collect();
        let sample = stage.sample(&middle);
        let seen = sample.held(middle.len());
        let by_reference = (0..m).flat_map(|i| gains.by_reference.iter().flat_map(move |gain| row(gain, i)));
        let ahead = gains.by_reference.len() - 1;
        let tables = Tables {
            by_held: rows(&[&gains.by_held]),
            query: rows(&[&seen.cq, &seen.dq]),
            output: rows(&[&matrices.c, &matrices.d]),
            by_reference: by_reference.collect(),
            by_operator: rows(&[&gains.by_operator]),
            correction: rows(&[&gains.correction]),
            mean: rows(&[&sample.a, &sample.b]),
            middle,
            offset: stage.output_offset().into(),
            limits: limits.into(),
            static_inverse: rows(&[&gains.static_inverse]),
            ahead,
        };
        let mut made = Self {
            tables: tables.into(),
            model: MultiAxisForward::new(stage),
            beside: vec![0.0; stage.states() + m].into(),
            beside_drives: vec![0.0; m].into(),
            next: vec![0.0; stage.states()].into(),
            window: vec![0.0; ahead * p].into(),
            oldest: 0,
            begun: 0,
            start_samples,
            gap: vec![0.0; p].into(),
            dt: stage.dt(),
        };
        made.rest();
        Ok(made)
    }

    /// How many samples early references come.
    #[must_use]
    pub fn ahead(&self) -> usize {
        self.tables.ahead
    }

    /// The number of drives, and of positions.
    #[must_use]
    pub fn axes(&self) -> usize {
        self.gap.len()
    }

    /// The limits of the drives.
    #[must_use]
    pub fn limits(&self) -> &[(f64, f64)] {
        &self.tables.limits
    }

    /// From positions to the drives that keep them there, row by row: the decoupling of a controller.
    #[must_use]
    pub fn decoupling(&self) -> &[f64] {
        &self.tables.static_inverse
    }

    /// The sampling interval in seconds.
    #[must_use]
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// The last drives of the model.
    #[inline]
    pub(super) fn last_drives(&self) -> Numbers {
        let (mut last, held) = ([0.0; MOST], self.model.held());
        let drives = held.iter().skip(held.len().saturating_sub(self.axes()));
        last.iter_mut().zip(drives).for_each(|(last, drive)| *last = *drive);
        last
    }

    /// What comes in with the drives that is not of the model: the feedback takes it away.
    #[must_use]
    pub fn disturbance(&self) -> &[f64] {
        let states = self.beside.len().saturating_sub(self.axes());
        self.beside.get(states..).unwrap_or(&[])
    }

    /// What a sample asks for; `believed` is whether its measurements are.
    #[inline]
    pub(super) fn ask(&self, wanted: &Numbers, measured: &[f64], believed: bool) -> Asked {
        let mut asked = Asked { wanted: *wanted, ..Asked::default() };
        if believed {
            self.miss(measured, &mut asked.missed);
        }
        let tables = &*self.tables;
        let states = self.beside.len().saturating_sub(self.axes());
        let corrections = tables.correction.chunks_exact(self.axes().max(1)).skip(states);
        for ((disturbance, own), row) in asked.disturbance.iter_mut().zip(self.disturbance()).zip(corrections) {
            *disturbance = own + product(row, &asked.missed);
        }
        self.lead(wanted, &mut asked.newest);
        if wanted.iter().all(|one| is_admissible(*one)) {
            self.drives(&asked.newest, &mut asked.volts);
        } else {
            asked.volts = [f64::NAN; MOST];
        }
        asked
    }

    /// What measurements are beside model and observer.
    #[inline]
    fn miss(&self, measured: &[f64], missed: &mut Numbers) {
        let tables = &*self.tables;
        let (held, states) = (self.model.held(), self.beside.len().saturating_sub(self.axes()));
        let expected = tables.output.chunks_exact(held.len().max(1)).zip(&tables.offset);
        for ((missed, measured), (row, offset)) in missed.iter_mut().zip(measured).zip(expected) {
            let (of_states, of_drives) = row.split_at_checked(states).unwrap_or((row, &[]));
            let beside = product(of_states, &self.beside) + product(of_drives, &self.beside_drives);
            *missed = measured - offset - product(row, held) - beside;
        }
    }

    /// The newest reference, led from where the model was when the motion began.
    #[inline]
    fn lead(&self, wanted: &Numbers, newest: &mut Numbers) {
        let left = if self.begun < self.start_samples {
            let share = f64::from(self.begun) / f64::from(self.start_samples);
            1.0 - share * share * (3.0 - 2.0 * share)
        } else {
            0.0
        };
        for (i, ((newest, wanted), gap)) in newest.iter_mut().zip(wanted).zip(&self.gap).enumerate() {
            let gap = if self.begun == 0 { wanted - self.window.get(i).copied().unwrap_or_default() } else { *gap };
            *newest = wanted - left * gap;
        }
    }

    /// The drives of the feed-forward.
    #[inline]
    fn drives(&self, newest: &Numbers, volts: &mut Numbers) {
        let (tables, held, p) = (&*self.tables, self.model.held(), self.axes().max(1));
        let states = held.len().saturating_sub(self.axes());
        let (newer, older) = self.window.split_at_checked(self.oldest).unwrap_or((&[], &self.window));
        let mut base = [0.0; MOST];
        let of_held = tables.by_held.chunks_exact(held.len().max(1));
        let of_references = tables.by_reference.chunks_exact(tables.ahead.saturating_add(1).saturating_mul(p).max(1));
        for ((base, by_held), by_reference) in base.iter_mut().zip(of_held).zip(of_references) {
            *base = product(by_held, held);
            let references = older.chunks_exact(p).chain(newer.chunks_exact(p)).chain(core::iter::once(&newest[..]));
            for (row, references) in by_reference.chunks_exact(p).zip(references) {
                let pairs = row.iter().zip(references.iter().zip(&tables.offset));
                *base += pairs.fold(0.0, |sum, (gain, (reference, offset))| sum + gain * (reference - offset));
            }
        }
        volts.iter_mut().zip(held.iter().skip(states)).for_each(|(volts, held)| *volts = *held);
        for _ in 0..ROUNDS {
            let mut added = [0.0; MOST];
            self.operators(volts, &mut added);
            let operators = self.model.operators().len().max(1);
            let mut rows = tables.by_operator.chunks_exact(operators);
            for ((volts, base), (low, high)) in volts.iter_mut().zip(&base).zip(&tables.limits) {
                let asked = base + rows.next().map_or(0.0, |row| product(row, &added));
                *volts = asked.max(*low).min(*high);
            }
        }
    }

    /// What w is beside middle slope times q, with these drives.
    #[inline]
    fn operators(&self, volts: &Numbers, added: &mut Numbers) {
        let (tables, held) = (&*self.tables, self.model.held());
        let states = held.len().saturating_sub(self.axes());
        let rows = tables.query.chunks_exact(held.len().max(1)).zip(&tables.middle);
        for ((added, (row, middle)), operator) in added.iter_mut().zip(rows).zip(self.model.operators()) {
            let (of_states, of_drives) = row.split_at_checked(states).unwrap_or((row, &[]));
            let q = product(of_states, held) + product(of_drives, volts);
            *added = operator.peek(q) - middle * q;
        }
    }

    /// Moves on: with the newest reference, if the motion goes on, with the drives that the model is to have, and those
    /// that went out.
    #[inline]
    pub(super) fn take(&mut self, asked: &Asked, goes_on: bool, (own, out): (&Numbers, &[f64])) {
        let Self { tables, model, beside, beside_drives, next, .. } = self;
        let axes = self.gap.len();
        for (beside, row) in beside.iter_mut().zip(tables.correction.chunks_exact(axes.max(1))) {
            *beside += product(row, &asked.missed);
        }
        let Some((states, disturbance)) = beside.split_at_mut_checked(beside.len().saturating_sub(axes)) else {
            return;
        };
        for (((more, own), out), disturbance) in beside_drives.iter_mut().zip(own).zip(out).zip(disturbance) {
            *more = out - own + *disturbance;
        }
        let width = states.len().saturating_add(axes).max(1);
        for (next, row) in next.iter_mut().zip(tables.mean.chunks_exact(width)) {
            let (of_states, of_drives) = row.split_at_checked(states.len()).unwrap_or((row, &[]));
            *next = product(of_states, states) + product(of_drives, beside_drives);
        }
        states.iter_mut().zip(&**next).for_each(|(state, next)| *state = *next);
        let mut positions = [0.0; MOST];
        model.walk(own, &mut positions);
        if goes_on {
            self.push(asked);
        } else {
            self.rest();
        }
    }

    /// The newest reference enters the window.
    #[inline]
    fn push(&mut self, asked: &Asked) {
        let p = self.gap.len();
        if self.begun == 0 {
            for ((gap, newest), rests) in self.gap.iter_mut().zip(&asked.wanted).zip(&*self.window) {
                *gap = newest - rests;
            }
        }
        self.begun = self.begun.saturating_add(1).min(self.start_samples.max(1));
        let row = self.window.iter_mut().skip(self.oldest);
        row.zip(&asked.newest).take(p).for_each(|(old, newest)| *old = *newest);
        self.oldest = self.oldest.saturating_add(p);
        if self.oldest >= self.window.len() {
            self.oldest = 0;
        }
    }

    /// The next motion begins where the model is.
    fn rest(&mut self) {
        let Self { tables, model, window, .. } = self;
        let held = model.held();
        let mut place = [0.0; MOST];
        let rows = tables.output.chunks_exact(held.len().max(1)).zip(&tables.offset);
        for (place, (row, offset)) in place.iter_mut().zip(rows) {
            *place = offset + product(row, held);
        }
        for row in window.chunks_exact_mut(self.gap.len().max(1)) {
            row.iter_mut().zip(&place).for_each(|(old, place)| *old = *place);
        }
        (self.begun, self.oldest) = (0, 0);
    }

    /// Back to rest.
    pub(super) fn reset(&mut self) {
        self.model.reset();
        self.beside.fill(0.0);
        self.beside_drives.fill(0.0);
        self.gap.fill(0.0);
        self.rest();
    }

    /// Takes over what was driven before, rows of drives.
    pub(super) fn follow(&mut self, drives: &[f64]) {
        let mut positions = [0.0; MOST];
        for row in drives.chunks_exact(self.axes().max(1)) {
            self.model.walk(row, &mut positions);
        }
        self.beside.fill(0.0);
        self.beside_drives.fill(0.0);
        self.rest();
    }

    /// One sample more without a measurement, in which other drives go out than those that were asked for: the stage
    /// follows them, and so does its hysteresis. The next motion begins where that leads.
    pub(super) fn hold(&mut self, drives: &[f64]) {
        let mut own = Numbers::default();
        own.iter_mut().zip(drives).for_each(|(own, drive)| *own = *drive);
        self.take(&Asked::default(), false, (&own, drives));
    }

    /// Everything that it remembers. Allocates.
    #[must_use]
    pub fn state(&self) -> TrackingState {
        let (newer, older) = self.window.split_at(self.oldest);
        TrackingState {
            model: self.model.state(),
            beside: self.beside.to_vec(),
            beside_drives: self.beside_drives.to_vec(),
            window: [older, newer].concat(),
            begun: self.begun,
            gap: self.gap.to_vec(),
        }
    }

    /// Goes on from a saved state, bit for bit.
    ///
    /// # Errors
    /// [`Error`] that names what does not fit; all is as before then.
    pub fn set_state(&mut self, state: &TrackingState) -> Result<(), Error> {
        check_terms("state.tracking.beside", self.beside.len(), &state.beside)?;
        check_terms("state.tracking.beside_drives", self.beside_drives.len(), &state.beside_drives)?;
        check_numbers("state.tracking.window", self.window.len(), &state.window)?;
        check_terms("state.tracking.gap", self.gap.len(), &state.gap)?;
        self.model.set_state(&state.model)?;
        self.beside.copy_from_slice(&state.beside);
        self.beside_drives.copy_from_slice(&state.beside_drives);
        self.window.copy_from_slice(&state.window);
        self.gap.copy_from_slice(&state.gap);
        (self.oldest, self.begun) = (0, state.begun.min(self.start_samples.max(1)));
        Ok(())
    }
}

/// A row times numbers.
#[inline]
fn product(row: &[f64], numbers: &[f64]) -> f64 {
    row.iter().zip(numbers).fold(0.0, |sum, (entry, number)| sum + entry * number)
}

fn row(matrix: &DMatrix<f64>, i: usize) -> Vec<f64> {
    matrix.row(i).iter().copied().collect()
}

/// The rows of matrices side by side.
fn rows(matrices: &[&DMatrix<f64>]) -> Box<[f64]> {
    let count = matrices.first().map_or(0, |one| one.nrows());
    (0..count).flat_map(|i| matrices.iter().flat_map(move |one| row(one, i))).collect()
}
