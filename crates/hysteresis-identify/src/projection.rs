//! The linear half of the problem: at given thresholds, offset and delay, the best weights and output offsets.

use faer::Mat;

use crate::bounded;
use crate::factor::{TriangularFactor, back_substitute};
use crate::quality::as_f64;
use crate::record::Record;
use crate::regressor::Regressor;
use crate::space::{Parameter, Point, Space};

/// The fractional part of the golden ratio: its multiples spread evenly and follow no period of any drive.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// A column that varies by less than this share of its size is constant.
const MIN_VARYING_SHARE: f64 = 1e-11;

/// The best fit at a point.
#[derive(Clone, Debug)]
pub(crate) struct Fit {
    pub(crate) point: Point,
    /// w_i >= 0.
    pub(crate) weights: Vec<f64>,
    /// One per record.
    pub(crate) output_offsets: Vec<f64>,
    /// The sum of squared errors over the rows used.
    pub(crate) squares: f64,
    /// The same of the best constant output.
    pub(crate) base_squares: f64,
}

/// A fit linearised along the axes: [weights | steps] against the residual, as a triangle.
pub(crate) struct Linearised {
    factor: Mat<f64>,
    records: usize,
    free_weights: Vec<usize>,
}

/// Records and search space, with the share of the rows to use: one in `stride` of the fitted samples.
pub(crate) struct Projection<'a> {
    records: &'a [Record<'a>],
    space: &'a Space,
    operators: usize,
    stride: usize,
    rows: usize,
}

impl<'a> Projection<'a> {
    pub(crate) fn new(records: &'a [Record<'a>], space: &'a Space, operators: usize, stride: usize) -> Self {
        let rows_of = |record: &Record<'_>| (0..record.fitted_samples()).filter(|k| is_used(*k, stride)).count();
        Self { records, space, operators, stride, rows: records.iter().map(rows_of).sum() }
    }

    pub(crate) fn space(&self) -> &Space {
        self.space
    }

    /// The root mean square that belongs to a sum of squares over the rows used.
    pub(crate) fn rmse(&self, squares: f64) -> f64 {
        (squares / as_f64(self.rows)).sqrt()
    }

    /// The best weights and output offsets at a point, by QR and non-negative least squares.
    ///
    /// `like` is a fit near by, if there is one: its weights at zero are likely zero here too.
    pub(crate) fn fit(&self, point: &Point, like: Option<&Fit>) -> Fit {
        let factor = self.factor(point, &[], &[]);
        let (offsets, columns) = (self.records.len(), self.operators);
        let guess = like.map_or_else(Vec::new, |fit| positive(&fit.weights));
        let bounds = vec![(0.0, f64::INFINITY); columns];
        let (a, b) = below_offsets(&factor, offsets);
        let solution = bounded::solve(a.as_ref(), &b, &bounds, &guess);
        let mut output_offsets: Vec<f64> = (0..offsets)
            .map(|i| {
                let modelled: f64 = solution.x.iter().enumerate().map(|(j, w)| w * factor[(i, offsets + j)]).sum();
                factor[(i, offsets + columns)] - modelled
            })
            .collect();
        back_substitute(factor.get(..offsets, ..offsets), &mut output_offsets);
        Fit {
            point: *point,
            weights: solution.x,
            output_offsets,
            squares: solution.squares,
            base_squares: b.iter().map(|b| b * b).sum(),
        }
    }

    /// The fit with its derivatives along the axes.
    pub(crate) fn linearise(&self, fit: &Fit) -> Linearised {
        let factor = self.factor(&fit.point, &self.space.neighbours(&fit.point), &fit.weights);
        Linearised { factor, records: self.records.len(), free_weights: positive(&fit.weights) }
    }

    /// R of [output offsets | operators | derivatives | y], a derivative being the change of the output on the way
    /// to a neighbour at fixed weights, over the distance.
    fn factor(&self, point: &Point, neighbours: &[(Point, f64)], weights: &[f64]) -> Mat<f64> {
        let (offsets, n) = (self.records.len(), self.operators);
        let bank = self.space.bank(point);
        let banks: Vec<_> = neighbours.iter().map(|(neighbour, _)| self.space.bank(neighbour)).collect();
        let mut row = vec![0.0; offsets + n + neighbours.len() + 1];
        let mut factor = TriangularFactor::new(row.len());
        for (place, record) in self.records.iter().enumerate() {
            let start = |bank, point: &Point| {
                Regressor::new(bank, record.input(), point.get(Parameter::InputOffset), point.get(Parameter::Delay))
            };
            let mut here = start(&bank, point);
            let mut there: Vec<_> =
                banks.iter().zip(neighbours).map(|(bank, (neighbour, _))| start(bank, neighbour)).collect();
            row.fill(0.0);
            row[place] = 1.0;
            for (k, y) in record.output().iter().enumerate() {
                here.advance();
                there.iter_mut().for_each(Regressor::advance);
                if k < record.skip() || !is_used(k - record.skip(), self.stride) {
                    continue;
                }
                here.row(&mut row[offsets..offsets + n]);
                if !neighbours.is_empty() {
                    let output = here.output(weights);
                    for (j, (there, (_, distance))) in there.iter().zip(neighbours).enumerate() {
                        row[offsets + n + j] = (there.output(weights) - output) / distance;
                    }
                }
                row[offsets + n + neighbours.len()] = *y;
                factor.push(&row);
            }
        }
        factor.finish()
    }
}

impl Linearised {
    /// The best step within bounds together with the weights that go with it, and the sum of squares it promises.
    pub(crate) fn step(&self, bounds: &[(f64, f64)]) -> (Vec<f64>, f64) {
        let (a, b) = below_offsets(&self.factor, self.records);
        let weights = a.ncols() - bounds.len();
        let mut all = vec![(0.0, f64::INFINITY); weights];
        all.extend(bounds);
        let guess: Vec<_> = self.free_weights.iter().copied().chain(weights..all.len()).collect();
        let solution = bounded::solve(a.as_ref(), &b, &all, &guess);
        (solution.x[weights..].to_vec(), solution.squares)
    }
}

/// Eliminates the output offsets: the problem left for all other columns, the last one being the right-hand side.
///
/// An operator that never moves in the fitted samples has a constant column; what is left of it is rounding, and an
/// enormous weight would fit noise with it. Such columns become exactly zero.
fn below_offsets(factor: &Mat<f64>, offsets: usize) -> (Mat<f64>, Vec<f64>) {
    let last = factor.ncols() - 1;
    let mut a = factor.get(offsets.., offsets..last).to_owned();
    for j in 0..a.ncols() {
        if a.col(j).norm_l2() <= MIN_VARYING_SHARE * factor.col(offsets + j).norm_l2() {
            a.col_mut(j).fill(0.0);
        }
    }
    (a, (offsets..factor.nrows()).map(|i| factor[(i, last)]).collect())
}

fn positive(weights: &[f64]) -> Vec<usize> {
    (0..weights.len()).filter(|j| weights[*j] > 0.0).collect()
}

/// Whether the k-th fitted sample is a row: one in every `stride`, at places that follow no period.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of the stride")]
fn is_used(k: usize, stride: usize) -> bool {
    let place = as_f64(stride) * (as_f64(k / stride) * GOLDEN).fract();
    k % stride == place as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{Options, Thresholds};
    use crate::regressor::Bank;

    #[test]
    fn thinning_takes_one_row_per_stride_at_no_fixed_phase() {
        for stride in [1, 2, 7, 200] {
            let used: Vec<_> = (0..50 * stride).filter(|k| is_used(*k, stride)).collect();
            assert_eq!(used.len(), 50);
            assert!(used.iter().enumerate().all(|(block, k)| k / stride == block));
            let phases: std::collections::BTreeSet<_> = used.iter().map(|k| k % stride).collect();
            assert!(phases.len() >= stride.min(40), "stride {stride}: {} phases", phases.len());
        }
    }

    /// The sum of squares from the triangle is that of the residuals, sample by sample, and its linearisation tells
    /// what a small step does.
    #[test]
    fn squares_and_derivatives_are_those_of_the_residuals() {
        // A lopsided hysteresis that no point of the space fits.
        let bank = Bank::from_ratios(&[0.0, 0.5, 1.5], hysteresis_core::Ratios::PAPER);
        let signals = [3.0, 4.5].map(|rate| {
            let input = (0..900).map(|k| f64::from(k) / 30.0).map(|t| (4.0 - t / 10.0) * (rate * t / 3.0).sin());
            let input: Vec<f64> = input.collect();
            let mut regressor = Regressor::new(&bank, &input, 0.2, 0.0);
            let output = input.iter().map(|u| {
                regressor.advance();
                regressor.output(&[1.0, 0.7, 0.5]) + 0.05 * u * u
            });
            let output: Vec<f64> = output.collect();
            (input, output)
        });
        let record = |i: usize, skip| Record::new(&signals[i].0, &signals[i].1, skip).unwrap();
        let records = [record(0, 100), record(1, 0)];
        let options = Options { thresholds: Thresholds::Uniform(4), ..Options::default() };
        let space = Space::new(&records, &options);
        let projection = Projection::new(&records, &space, 4, 1);
        let point = space.starts()[1].with(Parameter::Delay, 1.3);
        let squares = |fit: &Fit, point: &Point| {
            let bank = space.bank(point);
            let (offset, delay) = (point.get(Parameter::InputOffset), point.get(Parameter::Delay));
            let mut squares = 0.0;
            for (record, output_offset) in records.iter().zip(&fit.output_offsets) {
                let mut regressor = Regressor::new(&bank, record.input(), offset, delay);
                for (k, y) in record.output().iter().enumerate() {
                    regressor.advance();
                    if k >= record.skip() {
                        squares += (y - output_offset - regressor.output(&fit.weights)).powi(2);
                    }
                }
            }
            squares
        };
        let fit = projection.fit(&point, None);
        assert!((fit.squares - squares(&fit, &point)).abs() < 1e-10 * fit.squares);
        let linearised = projection.linearise(&fit);
        for axis in 0..space.axes().len() {
            // All other steps held at zero, this one held at a small value: the promise must come true.
            let mut bounds = vec![(0.0, 0.0); space.axes().len()];
            let small = 1e-4 * space.axes()[axis].scale;
            bounds[axis] = (small, small);
            let (step, promised) = linearised.step(&bounds);
            let there = projection.fit(&space.moved(&point, &step), None);
            let (change, expected) = (there.squares - fit.squares, promised - fit.squares);
            assert!((change - expected).abs() < 0.05 * expected.abs(), "axis {axis}: {change} {expected}");
        }
    }
}
