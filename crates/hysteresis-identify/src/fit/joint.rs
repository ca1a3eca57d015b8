//! The joint fit: hysteresis and linear part together, searched in a space from points in it.
//!
//! Beside a gain of every record's own: hysteresis that is not quite that of the model answers small movements with
//! another gain than large ones, a sweep of 1 % of the range with 16 % more or less. With one gain for all records,
//! damping, bandwidth and dead time stand in for the difference, as the height of a resonance is gain / (2 damping).
//! Beside a gain of each record's own they are told by the shape of its answer.

use faer::Mat;

use crate::algebra::bounded::solve;
use crate::algebra::factor::TriangularFactor;
use crate::error::Error;
use crate::fit::colour::Colour;
use crate::fit::descent::{FIRST_RADIUS, best_attempt, search};
use crate::fit::own_columns::below_own;
use crate::fit::point::{Parameter, Point};
use crate::fit::progress::{SearchMonitor, Span};
use crate::fit::projection::{Linearised, ProjectedFit, Projection, levels};
use crate::fit::response::Chain;
use crate::fit::space::Space;
use crate::options::Options;
use crate::records::course::Course;
use crate::records::record::Record;
use crate::records::signal::{Line, as_f64};
use crate::terms::weights::WeightBasis;

/// How many passes over the records a start may take before the best of them goes on.
pub(crate) const PASSES: usize = 10;

/// A dead time that is less than so many samples below zero is none: a record that is off by a row has -1.
pub(crate) const MIN_NEGATIVE_SAMPLES: f64 = 0.5;

/// How starts are tried: on the rows of which level, and with how many passes over the records each.
#[derive(Clone, Copy)]
pub(crate) struct Attempts {
    pub(crate) level: usize,
    pub(crate) passes: usize,
}

/// A fit of hysteresis and linear part, and where it was searched.
#[derive(Clone)]
pub(crate) struct JointFit {
    pub(crate) space: Space,
    pub(crate) fit: ProjectedFit,
    pub(crate) linearised: Linearised,
}

impl JointFit {
    /// A fit in a space that goes on from there: its output map is linear about these weights. About others, the same
    /// point has another fit, and a far worse one where the map bends.
    pub(crate) fn new(space: Space, (fit, linearised): (ProjectedFit, Linearised)) -> Self {
        Self { space: space.about(&fit.weights), fit, linearised }
    }

    /// How many rows were fitted.
    pub(crate) fn rows(&self, records: &[Record<'_>]) -> usize {
        let unread = self.space.unread_samples();
        records.iter().map(|record| Course::new(record, 1, unread).len()).sum()
    }

    /// What it predicts; `dt` for records that have no sampling interval.
    pub(crate) fn chain(&self, dt: f64) -> Chain {
        self.fit.chain(&self.space, dt)
    }

    /// Whether an amplifier that was searched beside modes is as fast as it may be: it is none, and stands for what is
    /// lacking elsewhere.
    pub(crate) fn has_amplifier_at_bound(&self) -> bool {
        let axis = self.space.axis(Parameter::LogBandwidth).filter(|_| self.space.order().is_some());
        axis.is_some_and(|axis| axis.is_at_upper(&self.fit.point))
    }

    /// Whether the position would answer before the drive: a dead time below zero beside dynamics that is no noise.
    pub(crate) fn leads(&self) -> bool {
        self.space.order().is_some() && self.dead_time_samples() < -MIN_NEGATIVE_SAMPLES
    }

    /// The dead time in samples of the fastest record.
    pub(crate) fn dead_time_samples(&self) -> f64 {
        self.fit.point.get(Parameter::DeadTime) / self.space.intervals().smallest()
    }
}

impl ProjectedFit {
    /// What it predicts in the space that it was fitted in; `dt` for records that have no sampling interval.
    fn chain(&self, space: &Space, dt: f64) -> Chain {
        Chain {
            operators: space.operators(&self.point),
            weights: self.weights.clone(),
            linear: space.linear_part(&self.point),
            underway: self.underway.clone(),
            creep_underway: space.underway().clone(),
            dt,
        }
    }
}

/// Records and what is known before the linear part is searched.
#[derive(Clone, Copy)]
pub(crate) struct JointProblem<'a> {
    pub(crate) records: &'a [Record<'a>],
    /// With everything chosen that is left to cross-validation.
    pub(crate) options: &'a Options,
    pub(crate) basis: &'a WeightBasis,
    pub(crate) smoothness: f64,
}

impl JointProblem<'_> {
    /// The best fit in a space, from a point in it.
    pub(crate) fn search_from(
        &self,
        space: Space,
        point: &Point,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        self.search_starts(space, &[*point], Attempts { level: 1, passes: PASSES }, monitor)
    }

    /// The best fit in a space, from a point in it and from others with the usual ratios in place of its own.
    pub(crate) fn search_around(
        &self,
        space: Space,
        point: &Point,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let starts = space.with_other_ratios(point);
        self.search_starts(space, &starts, Attempts { level: 0, passes: PASSES }, monitor)
    }

    /// The best fit in a space, from the best of what a few passes make of each start.
    pub(crate) fn search_starts(
        &self,
        space: Space,
        starts: &[Point],
        Attempts { level, passes }: Attempts,
        monitor: &mut SearchMonitor<'_>,
    ) -> Result<JointFit, Error> {
        let levels = levels(self.records, &space, self.basis, self.smoothness, false)?;
        // What is left is the work once the best of them is found.
        let span = Span { from: 0.0, to: 0.6 };
        let start = best_attempt(&levels[level], starts, passes, span, monitor)?;
        let found = search(&levels, Some(&start), monitor)?;
        drop(levels);
        Ok(JointFit::new(space, found))
    }

    /// The fit at a point, without a search.
    pub(crate) fn at(&self, space: &Space, point: &Point) -> Result<JointFit, Error> {
        let levels = levels(self.records, space, self.basis, self.smoothness, false)?;
        let all = &levels[levels.len() - 1];
        Ok(JointFit::new(space.clone(), all.at(point)))
    }
}

impl JointProblem<'_> {
    /// How the residuals of all records follow from each other.
    pub(crate) fn colour(&self, found: &JointFit) -> Colour {
        self.colour_of(self.residuals(found))
    }

    /// The same of a fit in a space.
    pub(crate) fn colour_in(&self, space: &Space, fit: &ProjectedFit) -> Colour {
        self.colour_of(self.residuals_in(space, fit))
    }

    fn colour_of(&self, residuals: impl Iterator<Item = Vec<f64>>) -> Colour {
        let of_record = |(record, residual): (&Record<'_>, Vec<f64>)| {
            (Colour::new(&residual, record.output_range()), as_f64(record.fitted_samples()))
        };
        Colour::pooled(&self.records.iter().zip(residuals).map(of_record).collect::<Vec<_>>())
    }

    /// By how many variances of the noise of each record one fit lowers the sums of squares of another, all together.
    pub(crate) fn evidence(&self, without: &JointFit, with: &JointFit) -> f64 {
        self.evidence_between(self.residuals(without), self.residuals(with)).into_iter().sum()
    }

    /// The same for each record, from the residuals.
    fn evidence_between(
        &self,
        without: impl Iterator<Item = Vec<f64>>,
        with: impl Iterator<Item = Vec<f64>>,
    ) -> Vec<f64> {
        let squares = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
        let pairs = without.zip(with);
        let of_record = |(record, (without, with)): (&Record<'_>, (Vec<f64>, Vec<f64>))| {
            let colour = Colour::new(&with, record.output_range());
            let noise = squares(&with) / as_f64(with.len()) * colour.correlation_time;
            if noise > 0.0 { (squares(&without) - squares(&with)) / noise } else { 0.0 }
        };
        self.records.iter().zip(pairs).map(of_record).collect()
    }

    /// What a fit leaves of the fitted samples of every record.
    pub(crate) fn residuals(&self, found: &JointFit) -> impl Iterator<Item = Vec<f64>> {
        self.residuals_in(&found.space, &found.fit)
    }

    /// The same of a fit in a space.
    fn residuals_in(&self, space: &Space, fit: &ProjectedFit) -> impl Iterator<Item = Vec<f64>> {
        let chain = fit.chain(space, 1.0);
        self.records.iter().enumerate().map(move |(place, record)| {
            let predicted = chain.response_in(place, record.input(), space.intervals().of_record(place));
            let left = |k: usize| record.output()[k] - predicted[k] - fit.output_offsets[place];
            record.fitted().map(left).collect()
        })
    }
}

/// How many passes over the records the steps may take.
const PASSES_BESIDE_GAINS: usize = 12;

/// A step that promises a smaller share of the sum of squares is not worth a pass.
const MIN_GAIN: f64 = 1e-7;

/// A record is never taken for less noisy than this share of the noisiest.
const MIN_NOISE_SHARE: f64 = 1e-3;

impl JointProblem<'_> {
    /// The fit with the dynamics that are told beside a gain of every record's own, and everything else as it suits
    /// them.
    pub(crate) fn with_own_gains(&self, found: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        if found.space.order().is_none() || !self.may_stand_in(found) {
            return Ok(found.clone());
        }
        self.keeping_dynamics(&self.with_dynamics_beside_gains(found), monitor)
    }

    /// Whether dynamics may stand in for what the hysteresis lacks: a single record has the gain of the model anyway,
    /// and what leaves white noise has one gain.
    pub(crate) fn may_stand_in(&self, found: &JointFit) -> bool {
        self.records.len() > 1 && !found.fit.is_exact() && self.colour(found).is_coloured()
    }

    /// The fit with the dynamics that are told beside a gain of every record's own, everything else as it was.
    pub(crate) fn with_dynamics_beside_gains(&self, found: &JointFit) -> JointFit {
        if found.space.order().is_none() {
            return found.clone();
        }
        JointFit {
            fit: ProjectedFit { point: self.dynamics_beside_gains(found), ..found.fit.clone() },
            ..found.clone()
        }
    }

    /// The best fit with the dynamics of this one, near by.
    pub(crate) fn keeping_dynamics(&self, of: &JointFit, monitor: &mut SearchMonitor<'_>) -> Result<JointFit, Error> {
        let point = of.fit.point;
        let rest = self.search_from(of.space.knowing_dynamics(&point), &point, monitor)?;
        self.at(&of.space.clone().about(&rest.fit.weights), &rest.fit.point)
    }

    /// By how many variances of the noise of each record one fit lowers its sum of squares of another, each with a gain
    /// of its own.
    pub(crate) fn evidence_beside_gains(&self, without: &JointFit, with: &JointFit) -> Vec<f64> {
        self.evidence_between(self.residuals_beside_gains(without), self.residuals_beside_gains(with))
    }

    /// What a fit leaves of the fitted samples of every record beside a gain and an offset of its own.
    pub(crate) fn residuals_beside_gains(&self, found: &JointFit) -> impl Iterator<Item = Vec<f64>> {
        let chain = found.chain(1.0);
        self.records.iter().enumerate().map(move |(place, record)| {
            let predicted = chain.response_in(place, record.input(), found.space.intervals().of_record(place));
            beside_gain(record.fitted_of(record.output()), &record.fitted_of(&predicted))
        })
    }

    /// The point of a fit with the dynamics that leave least beside the gains, at its hysteresis and its weights.
    fn dynamics_beside_gains(&self, found: &JointFit) -> Point {
        let space = found.space.searching_dynamics_alone(&found.fit.point);
        let gains = RecordGains {
            projection: Projection::new(self.records, &space, self.basis, self.smoothness, 1),
            weights: &found.fit.weights,
            noises: self.noises(found),
        };
        let all: Vec<usize> = (0..space.axes().len()).collect();
        let (mut here, mut radius) = (gains.at(found.fit.point), FIRST_RADIUS);
        for _ in 0..PASSES_BESIDE_GAINS {
            let step = solve(here.a.as_ref(), &here.b, &space.step_bounds(&here.point, radius), &all);
            if here.squares - step.squares <= MIN_GAIN * here.squares {
                break;
            }
            let there = gains.at(space.moved(&here.point, &step.x));
            if there.squares < here.squares {
                here = there;
            } else {
                radius *= 0.25;
            }
        }
        here.point
    }

    /// The root mean square of what a fit leaves of every record.
    fn noises(&self, found: &JointFit) -> Vec<f64> {
        let rms = |residual: Vec<f64>| (residual.iter().map(|e| e * e).sum::<f64>() / as_f64(residual.len())).sqrt();
        let noises: Vec<f64> = self.residuals(found).map(rms).collect();
        let most = noises.iter().copied().fold(0.0, f64::max);
        noises.into_iter().map(|noise| noise.max(MIN_NOISE_SHARE * most)).collect()
    }
}

/// What the best gain of a signal and an offset leave of another.
fn beside_gain(mut values: Vec<f64>, signal: &[f64]) -> Vec<f64> {
    let line = Line::through(signal, &values);
    values.iter_mut().zip(signal).for_each(|(value, signal)| *value -= line.at(*signal));
    values
}

/// Records that each have a gain of their own, and count by their noise.
struct RecordGains<'a> {
    projection: Projection<'a>,
    weights: &'a [f64],
    noises: Vec<f64>,
}

/// What the dynamics of a point leave beside the best gains: the derivatives along the axes, and the residual.
struct Left {
    point: Point,
    a: Mat<f64>,
    b: Vec<f64>,
    squares: f64,
}

impl RecordGains<'_> {
    fn at(&self, point: Point) -> Left {
        let (projection, weights) = (&self.projection, self.weights);
        let tangent = projection.space().tangent(&point, weights.len(), Some(weights));
        let (own, slopes) = (projection.own(), tangent.slopes.len());
        // [the records' own | their gains | derivatives | residual]
        let told = own + self.noises.len();
        let mut factor = TriangularFactor::new(told + slopes + 1);
        let mut row = vec![0.0; told + slopes + 1];
        for (place, noise) in self.noises.iter().enumerate() {
            projection.rows_of(place, &tangent, |_, values, known| {
                let (of_record, values) = values.split_at(own);
                let (columns, values) = values.split_at(weights.len());
                let output: f64 = columns.iter().zip(weights).map(|(column, weight)| column * weight).sum();
                row[..own].copy_from_slice(of_record);
                row[own..told].fill(0.0);
                row[own + place] = output + known;
                row[told..].copy_from_slice(values);
                row[told + slopes] -= output;
                for value in &mut row {
                    *value /= noise;
                }
                factor.push(&row);
            });
        }
        let (a, b) = below_own(&factor.finish(), told);
        Left { point, squares: b.iter().map(|e| e * e).sum(), a, b }
    }
}

#[cfg(test)]
mod tests {
    use core::ops::ControlFlow;

    use hysteresis_control::linear::SecondOrder;
    use hysteresis_core::Ratios;

    use crate::fit::response::{OperatorsAt, response};
    use crate::terms::creep::CreepModel;
    use crate::terms::dynamics::{DynamicsModel, LinearPart, Order};
    use crate::terms::maps::{Curve, OutputMap};
    use crate::terms::operators::{OperatorBank, Thresholds};

    use super::*;

    /// A map that bends much has another linear fit about weights that are far from those of the search.
    #[test]
    fn a_fit_with_the_dynamics_of_another_stays_as_good_behind_a_map() {
        let dt = 1e-3;
        let bounds = (-12.0, 12.0);
        let operators = OperatorsAt {
            output_map: Some(Curve::new(bounds, [0.0, -1.5, 0.0])),
            ..OperatorsAt::alone(OperatorBank::from_ratios(&[0.0, 1.5, 3.0, 4.5], Ratios::PAPER), 0.0)
        };
        let dynamics = Some(SecondOrder::new(60.0, 0.1).unwrap().into());
        let linear = LinearPart { dynamics, ..LinearPart::default() };
        let signals = [3.0, 40.0].map(|rate| {
            let input = (0..900).map(|k| f64::from(k) * dt).map(|t| (6.0 - 4.0 * t) * (rate * 6.0 * t).sin());
            let input: Vec<f64> = input.collect();
            let output = response(&operators, &[1.0, 0.7, 0.5, 0.3], &linear, &input, dt);
            (input, output)
        });
        let records = signals.each_ref().map(|(u, y)| Record::new(u, y, 0).unwrap().sampled_every(dt).unwrap());
        let options = Options {
            thresholds: Thresholds::Uniform(4),
            dynamics: DynamicsModel::Order(Order::Second),
            creep: CreepModel::None,
            ..Options::default()
        };
        let far = OutputMap { bounds, reference: [0.01; 4].into() };
        let space = Space::new(&records, &options).unwrap().with_output_map(far);
        let basis = options.weight_basis(space.sides());
        let problem = JointProblem { records: &records, options: &options, basis: &basis, smoothness: 0.0 };
        let point = space.starts()[0]
            .with(Parameter::OutputMap(1), -1.2)
            .with(Parameter::LogFrequency, 55.0_f64.ln())
            .with(Parameter::LogDamping, 0.1_f64.ln());
        let mut report = |_: &crate::fit::progress::Progress| ControlFlow::Continue(());
        let mut monitor = SearchMonitor::new(&mut report);
        let found = problem.search_from(space, &point, &mut monitor).unwrap();
        let kept = problem.keeping_dynamics(&found, &mut monitor).unwrap();
        let again = problem.at(&found.space, &found.fit.point).unwrap();
        let [before, kept, again] =
            [&found, &kept, &again].map(|fit| problem.residuals(fit).flatten().map(|left| left * left).sum::<f64>());
        assert!(kept < 1.2 * before + 1e-9 && again < 1.2 * before + 1e-9, "{before} {kept} {again}");
    }
}
