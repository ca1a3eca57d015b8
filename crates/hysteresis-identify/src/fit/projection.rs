//! The linear half of the problem: at given thresholds, offset and delay, the best weights and output offsets.
//!
//! The same problem is solved on ever more rows, if there are enough of them.

use faer::Mat;

use crate::algebra::bounded;
use crate::algebra::factor::{Echelon, TriangularFactor};
use crate::error::Error;
use crate::fit::own_columns::{below_own, own_values};
use crate::fit::point::Point;
use crate::fit::space::Space;
use crate::fit::tangent::{Slope, Tangent};
use crate::records::course::Course;
use crate::records::record::Record;
use crate::records::signal::as_f64;
use crate::terms::weights::{WeightBasis, penalised, penalty};

/// The best fit at a point.
#[derive(Clone, Debug)]
pub(crate) struct ProjectedFit {
    pub(crate) point: Point,
    /// The unknowns c >= 0 of the weight law, and those of the columns beside the operators.
    pub(crate) unknowns: Vec<f64>,
    /// The weights that belong to them, and those amplitudes.
    pub(crate) weights: Vec<f64>,
    /// One per record.
    pub(crate) output_offsets: Vec<f64>,
    /// The creep that was under way, one per record: 0 where there was none.
    pub(crate) underway: Vec<f64>,
    /// The sum of squared errors over the rows used.
    pub(crate) squares: f64,
    /// What is minimised: that sum, and the penalty of weights that are not smooth.
    pub(crate) objective: f64,
    /// The same of the best constant output.
    pub(crate) base_squares: f64,
    /// By how much the weights miss the conditions of a minimum; see [`bounded::Solution`].
    pub(crate) kkt_residual: f64,
}

/// Below this share of the squares of the data nothing is left for another part of the model to explain.
const EXACT: f64 = 1e-12;

impl ProjectedFit {
    /// Whether the fit leaves nothing to speak of: without noise, with the true model.
    pub(crate) fn is_exact(&self) -> bool {
        self.squares <= EXACT * self.base_squares
    }
}

/// A fit linearised along the axes: [the records' own | unknowns | steps | y], of which the first columns are a
/// triangle.
#[derive(Clone)]
pub(crate) struct Linearised {
    factor: Mat<f64>,
    penalty: Mat<f64>,
    /// How many columns the records have of their own.
    own: usize,
    free: Vec<usize>,
}

/// A step that a linearised fit proposes.
pub(crate) struct Step {
    /// Along the axes.
    pub(crate) along: Vec<f64>,
    /// The weights that go with it.
    pub(crate) weights: Vec<f64>,
    /// The objective that it promises.
    pub(crate) objective: f64,
}

/// Records, search space, weight law and smoothness, with the rows to use: one in `stride` of the fitted samples.
pub(crate) struct Projection<'a> {
    records: &'a [Record<'a>],
    space: &'a Space,
    basis: &'a WeightBasis,
    smoothness: f64,
    courses: Vec<Course>,
    rows: usize,
    /// The sum of squares of the input about its mean in every record.
    input_squares: f64,
}

impl<'a> Projection<'a> {
    pub(crate) fn new(
        records: &'a [Record<'a>],
        space: &'a Space,
        basis: &'a WeightBasis,
        smoothness: f64,
        stride: usize,
    ) -> Self {
        let course = |record| Course::new(record, stride, space.unread_samples());
        let courses: Vec<_> = records.iter().map(course).collect();
        let rows = courses.iter().map(Course::len).sum();
        let input_squares =
            records.iter().zip(&courses).map(|(record, course)| course.squares_of(record.input())).sum();
        Self { records, space, basis, smoothness, courses, rows, input_squares }
    }

    /// The rows that penalise weights that are not smooth, one column for each unknown; none for smoothness zero.
    pub(crate) fn penalty(&self, law: &WeightBasis, point: &Point, smoothness: f64) -> Mat<f64> {
        if smoothness == 0.0 {
            return Mat::new();
        }
        penalty(law, &self.space.thresholds(point), smoothness * self.input_squares)
    }

    pub(crate) fn basis(&self) -> &WeightBasis {
        self.basis
    }

    pub(crate) fn space(&self) -> &Space {
        self.space
    }

    pub(crate) fn rows(&self) -> usize {
        self.rows
    }

    /// How many columns the records have of their own.
    pub(crate) fn own(&self) -> usize {
        self.space.own().len()
    }

    /// The root mean square that belongs to a sum of squares over the rows used.
    pub(crate) fn rmse(&self, squares: f64) -> f64 {
        (squares / as_f64(self.rows)).sqrt()
    }

    /// The best weights and output offsets at a point, by QR and non-negative least squares.
    ///
    /// `like` is a fit near by, if there is one: its weights at zero are likely zero here too.
    pub(crate) fn fit(&self, point: &Point, like: Option<&ProjectedFit>) -> ProjectedFit {
        self.solve(point, &self.factor(point, None), 0, like)
    }

    /// The fit at a point together with its derivatives along the axes, in one pass over the records.
    ///
    /// The derivatives are those at the weights given: where they are the best ones but for a small difference, so are
    /// the derivatives.
    pub(crate) fn linearise(
        &self,
        point: &Point,
        weights: &[f64],
        like: Option<&ProjectedFit>,
    ) -> (ProjectedFit, Linearised) {
        let factor = self.factor(point, Some(weights));
        let fit = self.solve(point, &factor, self.space.axes().len(), like);
        let free = free(&fit.unknowns);
        let penalty = self.penalty(self.basis, point, self.smoothness);
        (fit, Linearised { factor, penalty, own: self.own(), free })
    }

    /// The derivatives at a fit along the axes, and behind them those of other models.
    pub(crate) fn linearise_beside(&self, fit: &ProjectedFit, more: impl Iterator<Item = Slope>) -> Linearised {
        let mut tangent = self.space.tangent(&fit.point, self.basis.columns(), Some(&fit.weights));
        tangent.slopes.extend(more);
        let penalty = self.penalty(self.basis, &fit.point, self.smoothness);
        Linearised { factor: self.factor_of(&tangent), penalty, own: self.own(), free: free(&fit.unknowns) }
    }

    /// The fit at a point and its derivatives there.
    pub(crate) fn at(&self, point: &Point) -> (ProjectedFit, Linearised) {
        let fit = self.fit(point, None);
        self.linearise(point, &fit.weights, Some(&fit))
    }

    fn solve(&self, point: &Point, factor: &Mat<f64>, derivatives: usize, like: Option<&ProjectedFit>) -> ProjectedFit {
        let own = self.own();
        let unknowns = factor.ncols() - own - derivatives - 1;
        let guess = like.map_or_else(Vec::new, |fit| free(&fit.unknowns));
        let bounds = self.basis.bounds();
        let (all, b) = below_own(factor, own);
        let data = all.get(.., ..unknowns).to_owned();
        let penalty = self.penalty(self.basis, point, self.smoothness);
        let (a, target) = penalised(&data, &b, &penalty);
        let solution = bounded::solve(a.as_ref(), &target, &bounds, &guess);
        let squares = if penalty.nrows() == 0 { solution.squares } else { squares(&data, &b, &solution.x) };
        let (output_offsets, underway) = self.space.own().split(&own_values(factor, own, &solution.x));
        ProjectedFit {
            point: *point,
            weights: self.basis.weights(&solution.x),
            unknowns: solution.x,
            output_offsets,
            underway,
            squares,
            objective: solution.squares,
            base_squares: b.iter().map(|b| b * b).sum(),
            kkt_residual: solution.kkt_residual,
        }
    }

    /// R of [the records' own | unknowns | derivatives | y], a derivative being the change of the output on the way to
    /// a neighbour at fixed weights, over the distance.
    fn factor(&self, point: &Point, weights: Option<&[f64]>) -> Mat<f64> {
        self.factor_of(&self.space.tangent(point, self.basis.columns(), weights))
    }

    fn factor_of(&self, tangent: &Tangent) -> Mat<f64> {
        let own = self.own();
        let mut factor = TriangularFactor::new(own + tangent.columns + tangent.slopes.len() + 1);
        for place in 0..self.records.len() {
            self.rows_of(place, tangent, |_, row, _| factor.push(row));
        }
        self.basis.in_unknowns(factor.finish().as_ref(), own)
    }

    /// R of [the records' own | unknowns | derivatives | y] for each of `count` parts: every record is cut into so many
    /// stretches `turns` times over, and part i has the i-th of each turn; with the number of its rows.
    pub(crate) fn parts(&self, fit: &ProjectedFit, count: usize, turns: usize) -> Vec<(Mat<f64>, usize)> {
        let own = self.own();
        let tangent = self.space.tangent(&fit.point, self.basis.columns(), Some(&fit.weights));
        let columns = own + tangent.columns + tangent.slopes.len() + 1;
        let mut factors: Vec<_> = (0..count).map(|_| (TriangularFactor::new(columns), 0)).collect();
        for place in 0..self.records.len() {
            let rows = self.courses[place].len();
            self.rows_of(place, &tangent, |row, values, _| {
                let (factor, rows) = &mut factors[row * count * turns / rows % count];
                factor.push(values);
                *rows += 1;
            });
        }
        let finished =
            |(factor, rows): (TriangularFactor, usize)| (self.basis.in_unknowns(factor.finish().as_ref(), own), rows);
        factors.into_iter().map(finished).collect()
    }

    /// Hands over the rows of one record, numbered, and what is known beside each.
    pub(crate) fn rows_of(&self, place: usize, tangent: &Tangent, mut take: impl FnMut(usize, &[f64], f64)) {
        let (own, record, course) = (self.own(), &self.records[place], &self.courses[place]);
        let mut rows = tangent.rows(record.input(), self.space.intervals().of_record(place), Some(course));
        let last = own + tangent.columns + tangent.slopes.len();
        let mut row = vec![0.0; last + 1];
        for number in 0..course.len() {
            let k = course.sample(number);
            self.space.own().write(place, k, &mut row[..own]);
            let known = rows.write(k, &mut row[own..last]);
            row[last] = record.output()[k] - known;
            take(number, &row, known);
        }
    }
}

impl Linearised {
    /// The best step within bounds together with the weights that go with it.
    pub(crate) fn step(&self, bounds: &[(f64, f64)], law: &WeightBasis) -> Step {
        self.step_within(&law.bounds(), bounds, law)
    }

    /// The same with other bounds of the unknowns that weights are made of.
    pub(crate) fn step_within(&self, weights: &[(f64, f64)], bounds: &[(f64, f64)], law: &WeightBasis) -> Step {
        let (a, b) = self.below_own();
        let unknowns = law.unknowns();
        let all: Vec<_> = weights.iter().chain(bounds).copied().collect();
        let guess: Vec<_> = self.free.iter().copied().chain(unknowns..all.len()).collect();
        let solution = bounded::solve(a.as_ref(), &b, &all, &guess);
        let (c, along) = solution.x.split_at(unknowns);
        Step { along: along.to_vec(), weights: law.weights(c), objective: solution.squares }
    }

    /// The columns of unknowns and steps with the records' own eliminated, and the right-hand side: of what is
    /// minimised, the penalty of weights that are not smooth included.
    pub(crate) fn below_own(&self) -> (Mat<f64>, Vec<f64>) {
        let (a, b) = below_own(&self.factor, self.own);
        penalised(&a, &b, &self.penalty)
    }

    /// The rows that ask for smooth weights; none for smoothness zero.
    pub(crate) fn into_penalty(self) -> Mat<f64> {
        self.penalty
    }

    /// How many columns the records have of their own.
    pub(crate) fn own(&self) -> usize {
        self.own
    }

    /// Those of them that do not depend on others, and the rows of the triangle that they take, but for the right-hand
    /// side.
    pub(crate) fn own_rows(&self) -> (Vec<usize>, Mat<f64>) {
        let Echelon { pivots, .. } = Echelon::of(self.factor.get(.., ..self.own));
        let rows = self.factor.get(..pivots.len(), ..self.factor.ncols() - 1).to_owned();
        (pivots, rows)
    }

    pub(crate) fn penalty(&self) -> &Mat<f64> {
        &self.penalty
    }
}

/// |A x - b|^2.
pub(crate) fn squares(a: &Mat<f64>, b: &[f64], x: &[f64]) -> f64 {
    let error = |i: usize| b[i] - x.iter().enumerate().map(|(j, x)| a[(i, j)] * x).sum::<f64>();
    (0..b.len()).map(|i| error(i).powi(2)).sum()
}

/// Those that are not at their bound, zero.
fn free(unknowns: &[f64]) -> Vec<usize> {
    (0..unknowns.len()).filter(|j| unknowns[*j] != 0.0).collect()
}

/// The scan uses about this many samples per unknown, however long the records are.
pub(crate) const SCAN_SAMPLES_PER_UNKNOWN: usize = 40;

/// Before the descent on all samples, others on about so many: most steps of a long record cost little.
pub(crate) const REFINE_SAMPLES: [usize; 2] = [20_000, 60_000];

/// How many samples there are, if there are enough for so many unknowns, and the latter.
pub(crate) fn enough(records: &[Record<'_>], space: &Space, basis: &WeightBasis) -> Result<(usize, usize), Error> {
    let unknowns = basis.freedom() + space.own().len() + space.axes().len();
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    if samples < 2 * unknowns {
        return Err(Error::TooFewSamples { expected: 2 * unknowns, got: samples });
    }
    Ok((samples, unknowns))
}

/// The problem on so many rows that a term can be judged, but not on all of a long record.
pub(crate) fn rough<'a>(
    records: &'a [Record<'a>],
    space: &'a Space,
    basis: &'a WeightBasis,
    smoothness: f64,
) -> Result<Projection<'a>, Error> {
    let mut levels = levels(records, space, basis, smoothness, true)?;
    Ok(levels.swap_remove(levels.len() - 1))
}

/// The same problem on ever more rows; `roughly` without the last of them.
pub(crate) fn levels<'a>(
    records: &'a [Record<'a>],
    space: &'a Space,
    basis: &'a WeightBasis,
    smoothness: f64,
    roughly: bool,
) -> Result<Vec<Projection<'a>>, Error> {
    let (samples, unknowns) = enough(records, space, basis)?;
    let mut strides = vec![(samples / (SCAN_SAMPLES_PER_UNKNOWN * unknowns)).max(1)];
    strides.extend(REFINE_SAMPLES.map(|rows| samples / rows).into_iter().filter(|stride| *stride > 1));
    strides.truncate(if roughly { 2 } else { strides.len() });
    if !roughly || strides.len() == 1 {
        strides.push(1);
    }
    Ok(strides.iter().map(|stride| Projection::new(records, space, basis, smoothness, *stride)).collect())
}

#[cfg(test)]
mod tests {
    use crate::fit::point::Parameter;
    use crate::fit::response::{OperatorsAt, Regressor, response};
    use crate::options::Options;
    use crate::terms::creep::CreepModel;
    use crate::terms::duhem::{DuhemModel, DuhemTable};
    use crate::terms::dynamics::{DynamicsModel, Order};
    use crate::terms::loop_shift::LoopShiftModel;
    use crate::terms::maps::OutputMap;
    use crate::terms::operators::{OperatorBank, RatiosModel, Thresholds};

    use super::*;

    /// The sum of squares from the triangle is that of the residuals, sample by sample, and its linearisation tells
    /// what a small step does.
    #[test]
    fn squares_and_derivatives_are_those_of_the_residuals() {
        // A lopsided hysteresis that no point of the space fits.
        let bank = OperatorBank::from_ratios(&[0.0, 0.5, 1.5], hysteresis_core::Ratios::PAPER);
        let signals = [3.0, 4.5].map(|rate| {
            let input = (0..900).map(|k| f64::from(k) / 30.0).map(|t| (4.0 - t / 10.0) * (rate * t / 3.0).sin());
            let input: Vec<f64> = input.collect();
            let operators = OperatorsAt::alone(bank.clone(), 0.2);
            let mut regressor = Regressor::new(&operators, &input, 0.0, 1.0);
            let output = input.iter().enumerate().map(|(k, u)| {
                regressor.go_to(k);
                regressor.output(&[1.0, 0.7, 0.5]) + 0.05 * u * u
            });
            let output: Vec<f64> = output.collect();
            (input, output)
        });
        let record = |i: usize, skip| Record::new(&signals[i].0, &signals[i].1, skip).unwrap();
        let records = [record(0, 100), record(1, 0)];
        let plain = Options { thresholds: Thresholds::Uniform(4), ratios: RatiosModel::Fit, ..Options::default() };
        let joint = Options {
            dt: Some(0.01),
            dynamics: DynamicsModel::Order(Order::Second),
            creep: CreepModel::TimeConstants(vec![0.3, 1.0]),
            loop_shift: LoopShiftModel::Both(0.3),
            ..plain.clone()
        };
        let lag = Options {
            dynamics: DynamicsModel::Order(Order::First),
            creep: CreepModel::None,
            loop_shift: LoopShiftModel::None,
            ..joint.clone()
        };
        let table = DuhemTable { rising: vec![1.3, 0.9, 0.2], ..DuhemTable::bouc_wen(2.0, 1.4).scaled(0.5) };
        let beside = Options { duhem: DuhemModel::Near(table), ..joint.clone() };
        let spaces = [&plain, &joint, &lag].map(|options| Space::new(&records, options).unwrap());
        let map = OutputMap { bounds: (-4.0, 5.0), reference: [0.3; 4].into() };
        let maps = |space: &Space| space.with_input_map().with_output_map(map.clone());
        check_derivatives(&records, &beside, &maps(&Space::new(&records, &beside).unwrap()));
        check_derivatives(&records, &plain, &maps(&spaces[0]));
        check_derivatives(&records, &joint, &maps(&spaces[1]).with_amplifier());
        for (options, space) in [plain, joint, lag].iter().zip(&spaces) {
            check_derivatives(&records, options, space);
        }
    }

    fn check_derivatives(records: &[Record<'_>], options: &Options, space: &Space) {
        let basis = options.weight_basis(space.sides());
        let projection = Projection::new(records, space, &basis, 0.0, 1);
        let dt = space.intervals().of_record(0);
        let point = space.starts()[1]
            .with(Parameter::DeadTime, 1.3 * dt)
            .with(Parameter::LogFrequency, 25.0_f64.ln())
            .with(Parameter::LogDamping, -1.0)
            .with(Parameter::LogBandwidth, 15.0_f64.ln())
            .with(Parameter::InputMap(1), 0.3)
            .with(Parameter::OutputMap(0), -0.2)
            .with(Parameter::OutputMap(2), 0.1)
            .with(Parameter::Creep(0), 0.02)
            .with(Parameter::Creep(1), 0.04);
        let unread = space.unread_samples();
        let squares = |fit: &ProjectedFit, point: &Point| {
            let of_record = |(record, output_offset): (&Record<'_>, &f64)| {
                let (operators, linear) = (space.operators(point), space.linear_part(point));
                let predicted = response(&operators, &fit.weights, &linear, record.input(), dt);
                let rows = record.skip()..record.input().len() - unread;
                rows.map(|k| (record.output()[k] - output_offset - predicted[k]).powi(2)).sum::<f64>()
            };
            records.iter().zip(&fit.output_offsets).map(of_record).sum::<f64>()
        };
        // An output map is linear about the last weights: a few times the best ones are those of the whole.
        let settled = (0..30)
            .fold(projection.fit(&point, None), |fit, _| projection.linearise(&point, &fit.weights, Some(&fit)).0);
        let fit = projection.linearise(&point, &settled.weights, None).0;
        assert!((fit.squares - squares(&fit, &point)).abs() < 1e-10 * fit.squares);
        let (again, linearised) = projection.linearise(&point, &fit.weights, None);
        assert!((again.squares - fit.squares).abs() < 1e-12 * fit.squares);
        for axis in 0..space.axes().len() {
            // All other steps held at zero, this one held at a small value: the promise must come true.
            let mut bounds = vec![(0.0, 0.0); space.axes().len()];
            let small = 1e-4 * space.axes()[axis].scale;
            bounds[axis] = (small, small);
            let step = linearised.step(&bounds, &basis);
            let there = projection.linearise(&space.moved(&point, &step.along), &step.weights, None).0;
            let (change, expected) = (there.squares - fit.squares, step.objective - fit.squares);
            let parameter = space.axes()[axis].parameter;
            let close = (change - expected).abs() < 0.05 * expected.abs();
            assert!(close && expected.abs() > 1e-9 * fit.squares, "{parameter:?}: {change} {expected}");
        }
    }
}
