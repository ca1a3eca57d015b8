//! Gauss-Newton steps from a start, on normal equations about the residual.

use super::columns::{Outputs, Rows};
use super::normal::{Gram, Normal};
use super::visits::Visits;
use crate::error::Error;
use crate::fit::bank::OperatorBank;
use crate::fit::course::Course;
use crate::fit::point::{Parameter, Point};
use crate::fit::projection::{ProjectedFit, Projection};
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;
use crate::record::Record;

/// The trust region of the first step, in scales of the axes.
pub(super) const FIRST_RADIUS: f64 = 0.25;

/// Below this share of the sum of squares of the data the residual is rounding.
const ROUNDING_SQUARES: f64 = 1e-28;

/// Steps below this, in scales, change nothing.
const MIN_STEP: f64 = 1e-13;

/// The problem of one actuator on a selection of its samples.
pub(super) struct Problem<'a> {
    pub(super) record: &'a Record<'a>,
    pub(super) space: &'a Space,
    pub(super) basis: &'a WeightBasis,
    pub(super) course: &'a Course,
    pub(super) smoothness: f64,
    /// Makes the penalty of weights that are not smooth.
    pub(super) projection: &'a Projection<'a>,
}

/// What a descent starts from.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub(super) point: Point,
    pub(super) unknowns: Vec<f64>,
    pub(super) output_offset: f64,
}

/// The best fit at a point, and the problem about the unknowns from which it was found.
pub(super) struct State {
    pub(super) best: Start,
    /// What is minimised.
    pub(super) objective: f64,
    pub(super) normal: Normal,
    about: Start,
    guess: Vec<usize>,
}

/// When to stop improving.
#[derive(Clone, Copy)]
pub(super) struct Patience {
    /// The promised decrease, as a share of the objective, that is not worth a step.
    pub(super) gain: f64,
    /// How many passes over the samples the steps may take.
    pub(super) passes: usize,
}

impl State {
    /// Where weights are not solved for anew.
    pub(super) fn about(start: Start, objective: f64, normal: Normal) -> Self {
        let guess = positive(&start.unknowns);
        Self { best: start.clone(), objective, normal, about: start, guess }
    }
}

impl<'a> Problem<'a> {
    /// The same problem on other samples.
    pub(super) fn on<'b>(&'b self, course: &'b Course) -> Problem<'b>
    where
        'a: 'b,
    {
        let Self { record, space, basis, smoothness, projection, .. } = *self;
        Problem { record, space, basis, course, smoothness, projection }
    }

    /// The sum of squares of the positions about their mean.
    pub(super) fn base_squares(&self) -> f64 {
        let outputs = || (0..self.course.len()).map(|row| self.record.output()[self.course.sample(row)]);
        let mean = outputs().sum::<f64>() / as_f64(self.course.len());
        outputs().map(|y| (y - mean).powi(2)).sum()
    }

    /// One pass: the best weights at the point of a start, and the problem of a step from there. An error where no model can have the
    /// weights of the start: those of a drive of 1e-98 may be beyond 1e100.
    pub(super) fn pass(&self, about: Start) -> Result<State, Error> {
        let normal = self.normal(&about)?;
        let guess = positive(&about.unknowns);
        let (step, objective) = normal.solve(&at_least_zero(&about.unknowns), &guess);
        let unknowns = moved(&about.unknowns, &step);
        let output_offset = about.output_offset + normal.offset(&step);
        let guess = positive(&unknowns);
        let best = Start { point: about.point, unknowns, output_offset };
        Ok(State { best, objective, normal, about, guess })
    }

    /// The problem about a start; the derivatives are those at its weights.
    fn normal(&self, about: &Start) -> Result<Normal, Error> {
        let weights = self.basis.weights(&about.unknowns);
        let dt = self.space.intervals().of_record(0);
        let visits = Visits::new(self.record.input(), self.course, about.point.get(Parameter::DeadTime) / dt);
        let outputs = |point: &Point| visits.outputs(point, &weights, self.space, self.basis);
        let here = outputs(&about.point)?;
        let mut there = Vec::new();
        for (parameter, point, distance) in self.space.neighbours(&about.point) {
            let is_delay = parameter == Parameter::DeadTime;
            there.push((if is_delay { None } else { Some(outputs(&point)?) }, if is_delay { dt } else { distance }));
        }
        let (thresholds, ratios) = (self.space.thresholds(&about.point), self.space.ratios(&about.point));
        let bank = OperatorBank::from_ratios(&thresholds, ratios);
        let z = Outputs::new(&bank, about.point.get(Parameter::InputOffset), visits.inputs());
        let measured: Vec<f64> = (0..self.course.len())
            .map(|row| self.record.output()[self.course.sample(row)] - about.output_offset)
            .collect();
        let rows = Rows { visits: &visits, z: &z, here: &here, there: &there, measured: &measured };
        let columns = 1 + self.basis.columns() + there.len() + 1;
        let gram = Gram::of(self.course.len(), columns, |first, block| rows.write(first, columns, block));
        Ok(gram.finish(
            self.basis,
            &self.projection.penalty(self.basis, &about.point, self.smoothness),
            &about.unknowns,
        ))
    }

    /// Descends from a start in a box-shaped trust region, as the search of a single fit does.
    pub(super) fn improve(&self, mut here: State, patience: Patience) -> State {
        let least = ROUNDING_SQUARES * self.base_squares();
        let axes = self.space.axes();
        let mut radius = FIRST_RADIUS;
        for _ in 0..patience.passes {
            if axes.is_empty() || here.objective <= least {
                break;
            }
            let (next, along, promised) = self.step(&here, radius);
            let size = axes.iter().zip(&along).map(|(axis, step)| step.abs() / axis.scale).fold(0.0, f64::max);
            let decrease_promised = here.objective - promised;
            if decrease_promised.is_nan() || decrease_promised <= patience.gain * here.objective || size < MIN_STEP {
                break;
            }
            // Where no model can be, nothing is gained.
            let there = self.pass(next).ok();
            let decrease = there.as_ref().map_or(f64::NAN, |there| here.objective - there.objective);
            if decrease > 0.75 * decrease_promised {
                radius = radius.max(2.0 * size);
            } else if decrease.is_nan() || decrease < 0.25 * decrease_promised {
                radius = 0.25 * size;
            }
            if let Some(there) = there.filter(|_| decrease > 0.0) {
                here = there;
            }
        }
        here
    }

    /// Where a step leads, along which axes, and the objective that it promises.
    pub(super) fn step(&self, here: &State, radius: f64) -> (Start, Vec<f64>, f64) {
        let about = &here.about;
        let mut bounds = at_least_zero(&about.unknowns);
        bounds.extend(self.space.step_bounds(&about.point, radius));
        let count = about.unknowns.len();
        let guess: Vec<usize> = here.guess.iter().copied().chain(count..bounds.len()).collect();
        let (step, promised) = here.normal.solve(&bounds, &guess);
        let (unknowns, along) = step.split_at(count);
        let next = Start {
            point: self.space.moved(&about.point, along),
            unknowns: moved(&about.unknowns, unknowns),
            output_offset: about.output_offset + here.normal.offset(&step),
        };
        (next, along.to_vec(), promised)
    }

    /// The same fit as a single one has it.
    pub(super) fn projected(&self, state: &State) -> ProjectedFit {
        let Start { point, unknowns, output_offset } = &state.best;
        ProjectedFit {
            point: *point,
            weights: self.basis.weights(unknowns),
            unknowns: unknowns.clone(),
            output_offsets: vec![*output_offset],
            underway: vec![0.0],
            squares: state.objective,
            objective: state.objective,
            base_squares: self.base_squares(),
            // The conditions of the minimum are met as far as rounding lets the normal equations meet them.
            kkt_residual: 0.0,
        }
    }
}

/// The bounds of a step that leaves no unknown below zero.
fn at_least_zero(unknowns: &[f64]) -> Vec<(f64, f64)> {
    unknowns.iter().map(|c| (-c, f64::INFINITY)).collect()
}

/// The unknowns after a step: exactly zero where it leads to the bound.
fn moved(unknowns: &[f64], step: &[f64]) -> Vec<f64> {
    unknowns.iter().zip(step).map(|(c, d)| if *d == -c { 0.0 } else { (c + d).max(0.0) }).collect()
}

fn positive(unknowns: &[f64]) -> Vec<usize> {
    (0..unknowns.len()).filter(|j| unknowns[*j] > 0.0).collect()
}
