//! Cross-validation: how well what is fitted to some stretches of the records predicts the others.

use faer::Mat;

use crate::fit::bounded;
use crate::fit::factor::triangle_of;
use crate::fit::projection::{ProjectedFit, Projection, below_offsets, output_offsets, penalised};
use crate::numeric::as_f64;
use crate::options::{Options, WeightLaw};

/// Into how many stretches every record is cut.
const FOLDS: usize = 8;

/// What is tried where the smoothness is left to cross-validation: none, and decades.
pub(crate) const SMOOTHNESS: [f64; 10] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2];

/// How a model predicts stretches that it was not fitted to.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct CrossValidation {
    /// What the weights may be.
    pub weights: WeightLaw,
    /// How many operators the model has.
    pub operators: usize,
    /// How smooth its weights are asked to be; see [`Options::smoothness`](crate::Options::smoothness).
    pub smoothness: f64,
    /// The root mean square error, the mean taken over the stretches, each predicted from the others, in the unit of the output.
    pub rmse: f64,
    /// The mean square error on every stretch, in the unit of the output squared.
    pub stretches: Vec<f64>,
}

impl CrossValidation {
    /// The one of the least mean square error.
    pub(crate) fn best(all: &[Self]) -> Option<&Self> {
        all.iter().min_by(|p, q| p.rmse.total_cmp(&q.rmse))
    }

    /// The places of those that are as good as the best: whose mean square error is larger by a factor that is 1 within
    /// its standard error, stretch by stretch. What is better by less than that is better by chance.
    ///
    /// Factors and not differences, as stretches differ: in a decaying sweep the first one has most of the error, and
    /// differences would be those of one stretch.
    pub(crate) fn good(all: &[Self]) -> impl Iterator<Item = usize> {
        let best = Self::best(all);
        let factor = |(p, q): (&f64, &f64)| ((p + f64::MIN_POSITIVE) / (q + f64::MIN_POSITIVE)).ln();
        let is_good = move |one: &Self| {
            let excess = |best: &Self| one.stretches.iter().zip(&best.stretches).map(factor).collect::<Vec<_>>();
            best.map(excess).is_some_and(|excess| mean(&excess) <= standard_error(&excess))
        };
        (0..all.len()).filter(move |i| is_good(&all[*i]))
    }
}

/// The records cut into stretches, each with the triangle of its rows about one fit.
///
/// The triangle of a stretch tells its squared error for any weights exactly, and the triangles of several stretches,
/// one below the other, are those of all their samples: so one pass is enough. The searched parameters are fitted anew
/// to every selection of stretches, linearised about the fit to all.
pub(crate) struct Stretches<'a> {
    projection: &'a Projection<'a>,
    fit: &'a ProjectedFit,
    parts: Vec<(Mat<f64>, usize)>,
    /// The triangle of all stretches but one, for each.
    others: Vec<Mat<f64>>,
}

impl<'a> Stretches<'a> {
    pub(crate) fn new(projection: &'a Projection<'a>, fit: &'a ProjectedFit) -> Self {
        let parts = projection.parts(fit, FOLDS);
        let others = (0..FOLDS).map(|held_out| without(&parts, held_out)).collect();
        Self { projection, fit, parts, others }
    }

    /// Predicts every stretch from the others.
    pub(crate) fn cross_validate(&self, options: &Options, smoothness: f64) -> CrossValidation {
        let penalty = self.projection.penalty(&self.fit.point, smoothness);
        let stretches: Vec<f64> = (self.parts.iter().zip(&self.others))
            // A record of fewer samples than stretches leaves some without any.
            .filter(|((_, rows), _)| *rows > 0)
            .map(|((part, rows), others)| {
                let solution = self.solution(others, &penalty);
                let squares: f64 = (0..part.nrows())
                    .map(|i| {
                        let modelled: f64 = solution.iter().enumerate().map(|(j, x)| part[(i, j)] * x).sum();
                        (part[(i, part.ncols() - 1)] - modelled).powi(2)
                    })
                    .sum();
                squares / as_f64(*rows)
            })
            .collect();
        let rmse = mean(&stretches).sqrt();
        CrossValidation { weights: options.weights, operators: options.operators(), smoothness, rmse, stretches }
    }

    /// Output offsets, unknowns and steps of the searched parameters.
    fn solution(&self, factor: &Mat<f64>, penalty: &Mat<f64>) -> Vec<f64> {
        let offsets = self.projection.records();
        let (a, b) = below_offsets(factor, offsets);
        let (a, b) = penalised(&a, &b, penalty);
        let steps = self.projection.space().step_bounds(&self.fit.point, STEP);
        let mut bounds = vec![(0.0, f64::INFINITY); self.fit.unknowns.len()];
        bounds.extend(steps);
        let likely = |j: &usize| self.fit.unknowns.get(*j).is_none_or(|c| *c > 0.0);
        let guess: Vec<usize> = (0..bounds.len()).filter(likely).collect();
        let found = bounded::solve(a.as_ref(), &b, &bounds, &guess).x;
        let mut all = output_offsets(factor, offsets, &found);
        all.extend(found);
        all
    }
}

/// How far the searched parameters may move from their values for all stretches, in scales: as far as they may be
/// taken for linear.
const STEP: f64 = 0.1;

/// The triangle of all parts but one.
fn without(parts: &[(Mat<f64>, usize)], held_out: usize) -> Mat<f64> {
    let columns = parts[0].0.ncols();
    let others: Vec<_> = (0..parts.len()).filter(|i| *i != held_out).map(|i| &parts[i].0).collect();
    let height = parts[0].0.nrows();
    let stacked = Mat::from_fn(others.len() * height, columns, |i, j| others[i / height][(i % height, j)]);
    triangle_of(stacked).get(..columns, ..).to_owned()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / as_f64(values.len())
}

/// Of the mean of independent values.
fn standard_error(values: &[f64]) -> f64 {
    let (mean, count) = (mean(values), as_f64(values.len()));
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (variance / count).sqrt()
}
