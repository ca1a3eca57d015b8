//! Where to start: the factorisations that actuators of one drive share.

use faer::{Mat, MatRef};
use fearless_simd::Simd;

use crate::algebra::bounded;
use crate::algebra::eight::{SimdLoop, dispatch};
use crate::fit::descent::{DEAD_TIME_MUST_GAIN, FIRST_RADIUS};
use crate::fit::point::{Axis, Parameter, Point};
use crate::fit::space::Space;
use crate::many::descent::{Problem, Start, State};
use crate::many::normal::Normal;
use crate::records::course::Course;
use crate::records::signal::{as_f64, mean};
use crate::terms::weights::WeightBasis;

/// How many points are tried besides the starts of a single fit.
const POINTS: usize = 250;

/// The most numbers in the table of a scan.
const MOST_NUMBERS: usize = 1 << 24;

/// For how many points of a scan the weights are computed: those that free weights fit best.
const WEIGHED: usize = 24;

/// A column of which less than this share is left beside those before it depends on them.
const MIN_INDEPENDENT_SHARE: f64 = 1e-9;

/// The points of a scan: the starts of a single fit, and others spread evenly over the space; `size` is the size of the
/// columns of one point.
///
/// Additive recurrence with the powers of the root of x^(d+1) = x + 1, which fills d dimensions more evenly than
/// chance.
pub(crate) fn points(space: &Space, size: usize) -> Vec<Point> {
    let mut points = space.starts();
    let axes: Vec<_> = space.axes().iter().filter(|axis| axis.parameter != Parameter::DeadTime).collect();
    if axes.is_empty() {
        return points;
    }
    let each = size * (2 + space.axes().len());
    let most = (MOST_NUMBERS / each.max(1)).saturating_sub(points.len()).min(POINTS);
    let exponent = 1.0 / (as_f64(axes.len()) + 1.0);
    let root = (0..64).fold(2.0_f64, |x, _| (1.0 + x).powf(exponent));
    for number in 1..=most {
        let at = |(point, power): (Point, f64), axis: &&Axis| {
            let share = (0.5 + as_f64(number) * power).fract();
            (point.with(axis.parameter, axis.lower + share * (axis.upper - axis.lower)), power / root)
        };
        points.push(axes.iter().fold((*space.origin(), 1.0 / root), at).0);
    }
    points
}

/// Dead times worth a look: none, and each about half as long again as the one before.
pub(crate) fn dead_times(space: &Space) -> Vec<f64> {
    if space.axis(Parameter::DeadTime).is_none() {
        return vec![space.origin().get(Parameter::DeadTime)];
    }
    let doubled = space.dead_times();
    let last = doubled.last().copied().unwrap_or(0.0);
    let between = doubled.iter().flat_map(|d| [*d, 1.5 * d]).filter(|d| *d <= last);
    std::iter::once(0.0).chain(between).collect()
}

/// The columns of one point, orthogonalised: what every actuator that has this drive needs of it.
pub(crate) struct Factored {
    pub(crate) point: Point,
    /// One orthonormal column after the other.
    q: Vec<f64>,
    /// R, one row for each of them.
    r: Mat<f64>,
    /// The means of the columns.
    means: Vec<f64>,
}

impl Factored {
    pub(crate) fn new(point: Point, drive: &Drive<'_>) -> Self {
        let (centred, means) = drive.columns(&point);
        let rows = drive.course.len();
        let q = orthonormal(&centred, &means);
        let r = Mat::from_fn(q.len() / rows, centred.len(), |i, j| dot(&q[i * rows..(i + 1) * rows], &centred[j]));
        Self { point, q, r, means }
    }

    /// Q'y, and what is left of the sum of squares of y.
    fn project(&self, positions: &Positions) -> (Vec<f64>, f64) {
        let along: Vec<f64> = self.q.chunks_exact(positions.y.len()).map(|q| dot(q, &positions.y)).collect();
        let left = positions.squares - along.iter().map(|b| b * b).sum::<f64>();
        (along, left)
    }

    /// The weights at this point and the sum of squares that they leave, from Q'y.
    fn weigh(&self, along: &[f64], left: f64, mean: f64) -> (Start, f64) {
        let bounds = vec![(0.0, f64::INFINITY); self.r.ncols()];
        let guess: Vec<usize> = (0..bounds.len()).collect();
        let solution = bounded::solve(self.r.as_ref(), along, &bounds, &guess);
        let modelled: f64 = solution.x.iter().zip(&self.means).map(|(c, mean)| c * mean).sum();
        let start = Start { point: self.point, unknowns: solution.x, output_offset: mean - modelled };
        (start, left + solution.squares)
    }
}

/// A point of the scan with the derivatives of its columns.
pub(crate) struct Candidate {
    factored: Factored,
    /// One column after the other, about their means: those of the unknowns, and for each axis the derivatives of those
    /// of the weights.
    columns: Vec<f64>,
    /// Their products.
    gram: Mat<f64>,
    means: Vec<f64>,
}

impl Candidate {
    pub(crate) fn new(point: Point, drive: &Drive<'_>) -> Self {
        let rows = drive.course.len();
        let (of_unknowns, mut means) = drive.columns(&point);
        let mut columns: Vec<f64> = of_unknowns.concat();
        let (here, here_means) = drive.weight_columns(&point);
        for (_, neighbour, distance) in drive.space.neighbours(&point) {
            let (there, there_means) = drive.weight_columns(&neighbour);
            for j in 0..there.len() {
                means.push((there_means[j] - here_means[j]) / distance);
                columns.extend(there[j].iter().zip(&here[j]).map(|(there, here)| (there - here) / distance));
            }
        }
        let all = MatRef::from_column_major_slice(&columns, rows, means.len());
        let gram = all.transpose() * all;
        Self { factored: Factored::new(point, drive), columns, gram, means }
    }

    /// The problem of a step from these weights.
    fn linearised(&self, positions: &Positions, start: &Start, basis: &WeightBasis) -> State {
        let weights = basis.weights(&start.unknowns);
        let (p, n) = (start.unknowns.len(), self.means.len());
        let axes = (n - p) / weights.len();
        let mut mix = Mat::<f64>::zeros(n, p + axes);
        for j in 0..p {
            mix[(j, j)] = 1.0;
        }
        for axis in 0..axes {
            for (i, weight) in weights.iter().enumerate() {
                mix[(p + axis * weights.len() + i, p + axis)] = *weight;
            }
        }
        let half = &self.gram * &mix;
        let small = mix.transpose() * &half;
        let with_y: Vec<f64> =
            self.columns.chunks_exact(positions.y.len()).map(|column| dot(column, &positions.y)).collect();
        let with_y = |j: usize| (0..n).map(|i| mix[(i, j)] * with_y[i]).sum::<f64>();
        let with_model = |j: usize| start.unknowns.iter().enumerate().map(|(i, c)| small[(i, j)] * c).sum::<f64>();
        let mut all = Mat::<f64>::zeros(p + axes + 1, p + axes + 1);
        let mut squares = positions.squares;
        for j in 0..p + axes {
            for i in 0..p + axes {
                all[(i, j)] = small[(i, j)];
            }
            let (y, model) = (with_y(j), with_model(j));
            all[(j, p + axes)] = y - model;
            all[(p + axes, j)] = y - model;
            if j < p {
                squares += start.unknowns[j] * (model - 2.0 * y);
            }
        }
        all[(p + axes, p + axes)] = squares;
        let mut means: Vec<f64> = (0..p + axes).map(|j| (0..n).map(|i| mix[(i, j)] * self.means[i]).sum()).collect();
        means.push(0.0);
        State::about(start.clone(), squares, Normal::new(all, means, positions.y.len()))
    }
}

/// A drive, and the samples of it that are looked at.
pub(crate) struct Drive<'a> {
    pub(crate) input: &'a [f64],
    pub(crate) course: &'a Course,
    pub(crate) space: &'a Space,
    pub(crate) basis: &'a WeightBasis,
}

impl Drive<'_> {
    /// The columns of the weights at a point, each about its mean, and the means.
    fn weight_columns(&self, point: &Point) -> (Vec<Vec<f64>>, Vec<f64>) {
        centred(self.raw(point).as_ref())
    }

    /// The same of the unknowns.
    fn columns(&self, point: &Point) -> (Vec<Vec<f64>>, Vec<f64>) {
        centred(self.basis.in_unknowns(self.raw(point).as_ref(), 0).as_ref())
    }

    fn raw(&self, point: &Point) -> Mat<f64> {
        let tangent = self.space.tangent(point, self.basis.columns(), None);
        let mut rows = tangent.rows(self.input, self.space.intervals().of_record(0), Some(self.course));
        let mut columns = Mat::<f64>::zeros(self.course.len(), tangent.columns);
        let mut row = vec![0.0; tangent.columns];
        for number in 0..self.course.len() {
            rows.write(self.course.sample(number), &mut row);
            for (j, value) in row.iter().enumerate() {
                columns[(number, j)] = *value;
            }
        }
        columns
    }
}

fn centred(columns: MatRef<'_, f64>) -> (Vec<Vec<f64>>, Vec<f64>) {
    let of = |j: usize| {
        let values: Vec<f64> = (0..columns.nrows()).map(|i| columns[(i, j)]).collect();
        let mean = mean(&values);
        (values.iter().map(|value| value - mean).collect(), mean)
    };
    (0..columns.ncols()).map(of).unzip()
}

/// Gram and Schmidt, twice: a column that depends on those before it is left out.
fn orthonormal(columns: &[Vec<f64>], means: &[f64]) -> Vec<f64> {
    let mut q: Vec<f64> = Vec::new();
    for (column, mean) in columns.iter().zip(means) {
        let size = dot(column, column).sqrt() + mean.abs() * as_f64(column.len()).sqrt();
        let mut rest = column.clone();
        for _ in 0..2 {
            for q in q.chunks_exact(column.len()) {
                let part = dot(q, &rest);
                rest.iter_mut().zip(q).for_each(|(rest, q)| *rest -= part * q);
            }
        }
        let length = dot(&rest, &rest).sqrt();
        if length > MIN_INDEPENDENT_SHARE * size {
            q.extend(rest.iter().map(|value| value / length));
        }
    }
    q
}

/// In strands that do not wait for each other, as many on every processor.
fn dot(a: &[f64], b: &[f64]) -> f64 {
    dispatch(Dot(a, b))
}

/// The work of [`dot`].
struct Dot<'a>(&'a [f64], &'a [f64]);

impl SimdLoop for Dot<'_> {
    type Output = f64;

    #[inline(always)]
    fn run<S: Simd>(self, _: S) -> f64 {
        strands(self.0, self.1)
    }
}

#[inline(always)]
fn strands(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<16>(), b.as_chunks::<16>());
    let mut sums = [0.0; 16];
    for (a, b) in a.iter().zip(b) {
        for i in 0..16 {
            sums[i] += a[i] * b[i];
        }
    }
    sums.iter().sum::<f64>() + a_rest.iter().zip(b_rest).map(|(a, b)| a * b).sum::<f64>()
}

/// The positions of the rows of a course, about their mean.
pub(crate) struct Positions {
    y: Vec<f64>,
    mean: f64,
    squares: f64,
}

impl Positions {
    pub(crate) fn new(output: &[f64], course: &Course) -> Self {
        let y: Vec<f64> = course.of(output).collect();
        let mean = mean(&y);
        let y: Vec<f64> = y.iter().map(|y| y - mean).collect();
        let squares = dot(&y, &y);
        Self { y, mean, squares }
    }

    /// The number of the dead time that suits best; `tables` has a few points for each.
    pub(crate) fn dead_time(&self, tables: &[Vec<Factored>]) -> usize {
        let least = |table: &Vec<Factored>| {
            let left = |factored: &Factored| factored.project(self).1;
            table.iter().map(left).fold(f64::INFINITY, f64::min)
        };
        let mut best = (0, f64::INFINITY);
        for (number, left) in tables.iter().map(least).enumerate() {
            if left < (1.0 - DEAD_TIME_MUST_GAIN) * best.1 {
                best = (number, left);
            }
        }
        best.0
    }

    /// Where one step from the most promising points leads, the best promise first.
    pub(crate) fn starts(&self, table: &[Candidate], problem: &Problem<'_>, count: usize) -> Vec<Start> {
        let mut projected: Vec<_> =
            table.iter().map(|candidate| (candidate, candidate.factored.project(self))).collect();
        projected.sort_by(|(_, (_, p)), (_, (_, q))| p.total_cmp(q));
        let mut starts: Vec<(Start, f64)> = Vec::new();
        for (candidate, (along, left)) in projected.iter().take(WEIGHED) {
            let (start, _) = candidate.factored.weigh(along, *left, self.mean);
            let state = candidate.linearised(self, &start, problem.basis);
            let (next, _, promised) = problem.step(&state, FIRST_RADIUS);
            starts.push((next, promised));
        }
        starts.sort_by(|(_, p), (_, q)| p.total_cmp(q));
        starts.into_iter().take(count).map(|(start, _)| start).collect()
    }
}
