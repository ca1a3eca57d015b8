//! Cross-validation: how well weights fitted to some stretches of the records predict the others.

use faer::Mat;

use crate::bounded;
use crate::factor::triangle_of;
use crate::projection::{Projection, below_offsets};
use crate::quality::as_f64;
use crate::space::Point;

/// Into how many stretches every record is cut.
const FOLDS: usize = 8;

/// How a model predicts stretches that its weights were not fitted to.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct CrossValidation {
    /// How many operators the model has.
    pub operators: usize,
    /// The root mean square error over all stretches, each predicted from the others, in the unit of the output.
    pub rmse: f64,
    /// The standard error of the mean square over the stretches, in the unit of the output squared.
    pub spread: f64,
}

impl CrossValidation {
    /// The smallest model whose mean square error is within one standard error of the best one's: the usual rule, as
    /// larger models that are better by less than that are better by chance.
    pub(crate) fn smallest_good(all: &[Self]) -> usize {
        let best = all.iter().min_by(|p, q| p.rmse.total_cmp(&q.rmse));
        let limit = best.map_or(0.0, |best| best.rmse * best.rmse + best.spread);
        let good = all.iter().filter(|one| one.rmse * one.rmse <= limit).map(|one| one.operators);
        good.min().unwrap_or(0)
    }
}

/// Cross-validates the weights at a point. The triangle of a stretch tells its squared error for any weights exactly,
/// and the triangles of several stretches, one below the other, are those of all their samples: so one pass is enough.
pub(crate) fn cross_validate(projection: &Projection<'_>, point: &Point, operators: usize) -> CrossValidation {
    let parts = projection.parts(point, FOLDS);
    let offsets = projection.records();
    let means: Vec<f64> = (0..FOLDS)
        .map(|held_out| {
            let solution = solution(&parts, held_out, offsets);
            let part = &parts[held_out].0;
            let squares: f64 = (0..part.nrows())
                .map(|i| {
                    let modelled: f64 = solution.iter().enumerate().map(|(j, x)| part[(i, j)] * x).sum();
                    (part[(i, part.ncols() - 1)] - modelled).powi(2)
                })
                .sum();
            squares / as_f64(parts[held_out].1)
        })
        .collect();
    let mean = means.iter().sum::<f64>() / as_f64(FOLDS);
    let variance = means.iter().map(|m| (m - mean).powi(2)).sum::<f64>() / as_f64(FOLDS - 1);
    CrossValidation { operators, rmse: mean.sqrt(), spread: (variance / as_f64(FOLDS)).sqrt() }
}

/// Output offsets and unknowns from all parts but one.
fn solution(parts: &[(Mat<f64>, usize)], held_out: usize, offsets: usize) -> Vec<f64> {
    let columns = parts[0].0.ncols();
    let others: Vec<_> = (0..parts.len()).filter(|i| *i != held_out).map(|i| &parts[i].0).collect();
    let height = parts[0].0.nrows();
    let stacked = Mat::from_fn(others.len() * height, columns, |i, j| others[i / height][(i % height, j)]);
    let factor = triangle_of(stacked);
    let factor = factor.get(..columns, ..).to_owned();
    let (a, b) = below_offsets(&factor, offsets);
    let bounds = vec![(0.0, f64::INFINITY); a.ncols()];
    let found = bounded::solve(a.as_ref(), &b, &bounds, &[]).x;
    let mut all = crate::projection::output_offsets(&factor, offsets, &found);
    all.extend(found);
    all
}
