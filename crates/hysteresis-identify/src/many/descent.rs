//! Gauss-Newton steps from a start, on normal equations about the residual.
//!
//! A pass visits the samples that operators need to see, on the engine of the core, and makes rows of their outputs
//! with the widest instructions that the processor has. Sums and products are those of the plain loop, element by
//! element, so the processor changes no bit but the sign of zero.

use std::borrow::Cow;

use fearless_simd::Simd;
use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Process};

use crate::algebra::eight::{LANES, SimdLoop, copy_signals, dispatch};
use crate::error::Error;
use crate::fit::descent::{FIRST_RADIUS, Patience, ROUNDING_SQUARES, trusted};
use crate::fit::point::{Parameter, Point};
use crate::fit::projection::{ProjectedFit, Projection};
use crate::fit::space::Space;
use crate::many::normal::{Gram, Normal};
use crate::records::course::{Course, SeenSamples};
use crate::records::record::Record;
use crate::terms::operators::{BLOCK, BankLanes, OperatorBank, Runs, max, min};
use crate::terms::weights::WeightBasis;

/// The problem of one actuator on a selection of its samples.
pub(crate) struct Problem<'a> {
    pub(crate) record: &'a Record<'a>,
    pub(crate) space: &'a Space,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) course: &'a Course,
    pub(crate) smoothness: f64,
    /// Makes the penalty of weights that are not smooth.
    pub(crate) projection: &'a Projection<'a>,
}

/// What a descent starts from.
#[derive(Clone, Debug)]
pub(crate) struct Start {
    pub(crate) point: Point,
    pub(crate) unknowns: Vec<f64>,
    pub(crate) output_offset: f64,
}

/// The best fit at a point, and the problem about the unknowns from which it was found.
pub(crate) struct State {
    pub(crate) best: Start,
    /// What is minimised.
    pub(crate) objective: f64,
    pub(crate) normal: Normal,
    about: Start,
    guess: Vec<usize>,
}

impl State {
    /// Where weights are not solved for anew.
    pub(crate) fn about(start: Start, objective: f64, normal: Normal) -> Self {
        let guess = positive(&start.unknowns);
        Self { best: start.clone(), objective, normal, about: start, guess }
    }
}

impl<'a> Problem<'a> {
    /// The same problem on other samples.
    pub(crate) fn on<'b>(&'b self, course: &'b Course) -> Problem<'b>
    where
        'a: 'b,
    {
        let Self { record, space, basis, smoothness, projection, .. } = *self;
        Problem { record, space, basis, course, smoothness, projection }
    }

    /// The sum of squares of the positions about their mean.
    pub(crate) fn base_squares(&self) -> f64 {
        self.course.squares_of(self.record.output())
    }

    /// One pass: the best weights at the point of a start, and the problem of a step from there. An error where no
    /// model can have the weights of the start: those of a drive of 1e-98 may be beyond 1e100.
    pub(crate) fn pass(&self, about: Start) -> Result<State, Error> {
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
        let measured: Vec<f64> = self.course.of(self.record.output()).map(|y| y - about.output_offset).collect();
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
    pub(crate) fn improve(&self, mut here: State, patience: Patience) -> State {
        let least = ROUNDING_SQUARES * self.base_squares();
        let mut radius = FIRST_RADIUS;
        for _ in 0..patience.passes {
            if self.space.axes().is_empty() || here.objective <= least {
                break;
            }
            let (next, along, promised) = self.step(&here, radius);
            let (size, promised) = (self.space.size_of(&along), here.objective - promised);
            if !patience.is_worth(promised, here.objective, size) {
                break;
            }
            // Where no model can be, nothing is gained.
            let there = self.pass(next).ok();
            let decrease = there.as_ref().map_or(f64::NAN, |there| here.objective - there.objective);
            radius = trusted(radius, size, decrease, promised);
            if let Some(there) = there.filter(|_| decrease > 0.0) {
                here = there;
            }
        }
        here
    }

    /// Where a step leads, along which axes, and the objective that it promises.
    pub(crate) fn step(&self, here: &State, radius: f64) -> (Start, Vec<f64>, f64) {
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
    pub(crate) fn projected(&self, state: &State) -> ProjectedFit {
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

/// z of every operator, visit by visit.
pub(crate) struct Outputs {
    operators: usize,
    z: Vec<f64>,
}

impl Outputs {
    /// What operators put out for inputs that begin at rest.
    pub(crate) fn new(bank: &OperatorBank, input_offset: f64, inputs: &[f64]) -> Self {
        let operators = bank.len();
        let (mut lanes, mut runs) = (BankLanes::new(bank), Runs::new());
        let mut block = vec![[0.0; LANES]; lanes.eights() * BLOCK];
        let mut z = vec![0.0; inputs.len() * operators];
        for (inputs, z) in inputs.chunks(BLOCK).zip(z.chunks_mut(BLOCK * operators)) {
            let mut xs = [0.0; BLOCK];
            xs.iter_mut().zip(inputs).for_each(|(x, u)| *x = u - input_offset);
            let xs = &xs[..inputs.len()];
            runs.take(xs);
            lanes.put_out(xs, &runs, &mut block);
            for (k, row) in z.chunks_exact_mut(operators).enumerate() {
                copy_signals(|eight| &block[eight * BLOCK + k], row);
            }
        }
        Self { operators, z }
    }

    /// Writes the columns of a row behind the dead time: one for each operator, or, in a row twice as long, one for its
    /// output above zero and one for that below.
    #[inline(always)]
    pub(crate) fn write(&self, (place, before): (usize, usize), fraction: f64, row: &mut [f64]) {
        let n = self.operators;
        let (now, before) = (&self.z[place * n..(place + 1) * n], &self.z[before * n..(before + 1) * n]);
        let (above, below) = row.split_at_mut(n);
        if below.is_empty() {
            for i in 0..n {
                above[i] = now[i] + fraction * (before[i] - now[i]);
            }
            return;
        }
        let below = &mut below[..n];
        for i in 0..n {
            let (high, low) = (max(now[i], 0.0), min(now[i], 0.0));
            above[i] = high + fraction * (max(before[i], 0.0) - high);
            below[i] = low + fraction * (min(before[i], 0.0) - low);
        }
    }
}

/// Fills rows \[1 | columns of the weights | derivatives | residual\] one after the other.
pub(crate) struct Rows<'a> {
    visits: &'a Visits<'a>,
    pub(crate) z: &'a Outputs,
    /// The output of the model at the point.
    pub(crate) here: &'a [f64],
    /// For each axis the outputs at a neighbour, or none for the dead time; and over what the change is divided.
    pub(crate) there: &'a [(Option<Vec<f64>>, f64)],
    /// The measured positions, row by row, without the output offset.
    pub(crate) measured: &'a [f64],
}

impl Rows<'_> {
    /// The rows from number `first` on, as many as find room.
    pub(crate) fn write(&self, first: usize, columns: usize, block: &mut [f64]) {
        dispatch(Write { rows: self, first, columns, block });
    }

    #[inline(always)]
    fn fill(&self, first: usize, columns: usize, block: &mut [f64]) {
        let fraction = self.visits.fraction();
        let slopes = columns - 1 - self.there.len();
        for (number, row) in (first..).zip(block.chunks_exact_mut(columns)) {
            let (place, before) = self.visits.places(number);
            row[0] = 1.0;
            self.z.write((place, before), fraction, &mut row[1..slopes]);
            let (now, then) = (self.here[place], self.here[before]);
            let output = now + fraction * (then - now);
            for (slope, (there, distance)) in row[slopes..columns - 1].iter_mut().zip(self.there) {
                let change = match there {
                    Some(there) => there[place] + fraction * (there[before] - there[place]) - output,
                    None => then - now,
                };
                *slope = change / distance;
            }
            row[columns - 1] = self.measured[number] - output;
        }
    }
}

/// The work of [`Rows::write`].
struct Write<'a> {
    rows: &'a Rows<'a>,
    first: usize,
    columns: usize,
    block: &'a mut [f64],
}

impl SimdLoop for Write<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, _: S) {
        self.rows.fill(self.first, self.columns, self.block);
    }
}

/// The inputs that operators need to see for the rows of a course, behind one dead time.
///
/// A row reads the outputs `whole` samples before it and one sample earlier still, as
/// [`Regressor`](crate::fit::response::Regressor) does.
struct Visits<'a> {
    inputs: Cow<'a, [f64]>,
    /// For each row the place of its newest sample among the inputs.
    places: Vec<usize>,
    fraction: f64,
}

impl<'a> Visits<'a> {
    /// `delay` in samples, not negative.
    fn new(input: &'a [f64], course: &Course, delay: f64) -> Self {
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
        let whole = delay.floor() as usize;
        let fraction = delay - delay.floor();
        let newest = (0..course.len()).map(|row| course.sample(row).saturating_sub(whole));
        if course.turns().is_none() {
            return Self { inputs: Cow::Borrowed(input), places: newest.collect(), fraction };
        }
        let seen: Vec<usize> = SeenSamples::new(input.len(), Some(course), whole).collect();
        let mut place = 0;
        let places = newest.map(|newest| {
            place += seen[place..].iter().take_while(|sample| **sample < newest).count();
            place
        });
        let places = places.collect();
        Self { inputs: seen.into_iter().map(|sample| input[sample]).collect(), places, fraction }
    }

    /// The output of the hysteresis at a point, without the output offset, for all inputs.
    fn outputs(&self, point: &Point, weights: &[f64], space: &Space, basis: &WeightBasis) -> Result<Vec<f64>, Error> {
        let (above, below) = basis.families(weights);
        let offsets = Offsets { input: point.get(Parameter::InputOffset), output: 0.0 };
        let (thresholds, ratios) = (space.thresholds(point), space.ratios(point));
        let model = ModifiedPrandtlIshlinskii::from_ratios(above, &thresholds, ratios, offsets)?;
        let model = if let Some(below) = below { model.with_negative_weights(below)? } else { model };
        let mut outputs = vec![0.0; self.inputs.len()];
        model.forward().run(&self.inputs, &mut outputs)?;
        Ok(outputs)
    }

    /// What the operators are to see, from rest.
    fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Of a row the places of its newest sample and of the one before.
    fn places(&self, row: usize) -> (usize, usize) {
        (self.places[row], self.places[row].saturating_sub(1))
    }

    /// The share of the one before.
    fn fraction(&self) -> f64 {
        self.fraction
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;
    use proptest::prelude::*;

    use crate::fit::response::{OperatorsAt, Regressor};

    use super::*;

    proptest! {
        /// The rows of a regressor, bit for bit, on all samples and on a thinned course, whole and split.
        #[test]
        fn rows_are_those_of_a_regressor(
            input in prop::collection::vec(-10.0..10.0_f64, 40..80),
            r in prop::collection::vec(0.0..8.0_f64, 1..20),
            delay in 0.0..5.0_f64,
            stride in 1_usize..5,
            families in 1_usize..3,
        ) {
            let ratios = Ratios::PAPER;
            let record = Record::new(&input, &input, 3).unwrap();
            let course = Course::new(&record, stride, 0).with_all_turns(&input);
            let visits = Visits::new(&input, &course, delay);
            let bank = OperatorBank::from_ratios(&r, ratios);
            let outputs = Outputs::new(&bank, 0.5, visits.inputs());
            let operators = OperatorsAt::alone(bank, 0.5);
            let mut regressor = Regressor::new(&operators, &input, delay, 1.0);
            let mut rows = [vec![0.0; families * r.len()], vec![0.0; families * r.len()]];
            for number in 0..course.len() {
                regressor.go_to(course.sample(number));
                regressor.row(&[], &mut rows[0]);
                outputs.write(visits.places(number), visits.fraction(), &mut rows[1]);
                prop_assert_eq!(&rows[0], &rows[1], "row {}", number);
            }
        }
    }
}
