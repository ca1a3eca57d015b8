//! Cross-validation: how well what is fitted to some stretches of the records predicts the others.

use faer::Mat;

use crate::algebra::bounded;
use crate::algebra::factor::echelon_of;
use crate::fit::own_columns::{below_own, own_values};
use crate::fit::point::Parameter;
use crate::fit::projection::{ProjectedFit, Projection};
use crate::options::{Options, Setting};
use crate::records::signal::{as_f64, mean};
use crate::terms::loop_shift::LoopShiftModel;
use crate::terms::weights::{WeightBasis, WeightLaw, combined, penalised};

/// Into how many stretches every record is cut.
pub(crate) const FOLDS: usize = 8;

/// Below this share of the mean square of the output about its mean an error is rounding.
const ROUNDING: f64 = 1e-18;

/// Mean square errors whose logarithms differ by less are alike.
const ALIKE: f64 = 1e-3;

/// What is tried where the smoothness is left to cross-validation: none, and decades.
const SMOOTHNESS: [f64; 10] = [0.0, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2, 1e-1, 1.0, 1e1, 1e2];

impl Options {
    /// What cross-validation tries for the smoothness.
    pub(crate) fn smoothnesses(&self) -> &[f64] {
        match &self.smoothness {
            Setting::Fixed(smoothness) => std::slice::from_ref(smoothness),
            Setting::Fit => &SMOOTHNESS,
        }
    }
}

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
    /// How many amplitudes of creep it has.
    pub creep: usize,
    /// Its loop shift.
    pub loop_shift: LoopShiftModel,
    /// The root mean square error, the mean taken over the stretches, each predicted from the others, in the unit of
    /// the output.
    pub rmse: f64,
    /// The mean square error on every stretch, in the unit of the output squared.
    pub stretches: Vec<f64>,
    /// A mean square error that is rounding: below it no candidate is better than another.
    pub(crate) rounding: f64,
}

impl CrossValidation {
    /// The one of the least [`typical_error`](Self::typical_error); of those that are alike the first.
    pub(crate) fn best(all: &[Self]) -> Option<&Self> {
        let least = all.iter().map(Self::mean_log).fold(f64::INFINITY, f64::min);
        all.iter().find(|one| one.mean_log() <= least + ALIKE)
    }

    /// The geometric mean of the root mean square errors on the stretches: by it candidates are compared, for no
    /// stretch outweighs the others in it.
    #[must_use]
    pub fn typical_error(&self) -> f64 {
        (0.5 * self.mean_log()).exp()
    }

    /// The mean logarithm of the mean square errors on the stretches.
    fn mean_log(&self) -> f64 {
        let log = |square: &f64| square.max(self.rounding).max(f64::MIN_POSITIVE).ln();
        mean(&self.stretches.iter().map(log).collect::<Vec<_>>())
    }

    /// The places of those that are as good as the best: whose mean square error is larger by a factor that is 1 within
    /// its standard error, stretch by stretch. What is better by less than that is better by chance.
    ///
    /// Factors and not differences, as stretches differ: in a decaying sweep the first one has most of the error, and
    /// differences would be those of one stretch. Where stretches are alike, in records without variety, predicting one
    /// from the others says little, and a factor below `margin` is none.
    pub(crate) fn good(all: &[Self], margin: f64) -> impl Iterator<Item = usize> {
        let best = Self::best(all);
        let is_good = move |one: &Self| {
            best.map(|best| one.excess(best)).is_some_and(|excess| mean(&excess) <= chance(&excess, margin))
        };
        (0..all.len()).filter(move |i| is_good(&all[*i]))
    }

    /// By which factor of the typical error one must be better than another, so that this is neither chance nor below
    /// the `margin`; see [`good`](Self::good).
    pub(crate) fn needed_beside(&self, other: &Self, margin: f64) -> f64 {
        (0.5 * chance(&other.excess(self), margin)).exp()
    }

    /// The logarithms of the factors by which the mean square errors on the stretches are larger than those of another.
    fn excess(&self, other: &Self) -> Vec<f64> {
        let rounding = other.rounding.max(f64::MIN_POSITIVE);
        let factor = |(p, q): (&f64, &f64)| (p.max(rounding) / q.max(rounding)).ln();
        self.stretches.iter().zip(&other.stretches).map(factor).collect()
    }
}

/// What such logarithms are in the mean by chance, or by less than matters.
fn chance(excess: &[f64], margin: f64) -> f64 {
    standard_error(excess).max(margin.ln())
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

/// What a candidate has of the terms that may be left out, and how smooth its weights are.
#[derive(Clone, Copy)]
pub(crate) struct Terms {
    /// How many amplitudes of creep.
    pub(crate) creep: usize,
    pub(crate) loop_shift: LoopShiftModel,
    pub(crate) smoothness: f64,
}

impl<'a> Stretches<'a> {
    pub(crate) fn new(projection: &'a Projection<'a>, fit: &'a ProjectedFit) -> Self {
        Self::spread(projection, fit, 1)
    }

    /// The same with every stretch made of so many short ones, spread over the records.
    pub(crate) fn spread(projection: &'a Projection<'a>, fit: &'a ProjectedFit, turns: usize) -> Self {
        let parts = projection.parts(fit, FOLDS, turns);
        let others = (0..FOLDS).map(|held_out| without(&parts, held_out, projection.own())).collect();
        Self { projection, fit, parts, others }
    }

    /// The same under a weight law that is not wider than that of the fit.
    pub(crate) fn under(&self, options: &Options, law: &'a WeightBasis) -> StretchesUnderLaw<'_> {
        let own = self.projection.own();
        let map = law.within(self.projection.basis());
        let mapped = |columns: &Mat<f64>| {
            map.as_ref().map_or_else(|| columns.clone(), |map| combined(columns.as_ref(), map, own))
        };
        StretchesUnderLaw {
            weights: options.weights,
            operators: options.operators(),
            law,
            parts: self.parts.iter().map(|(part, rows)| (mapped(part), *rows)).collect(),
            others: self.others.iter().map(mapped).collect(),
            all: self,
        }
    }
}

/// [`Stretches`] under one weight law.
pub(crate) struct StretchesUnderLaw<'a> {
    weights: WeightLaw,
    operators: usize,
    law: &'a WeightBasis,
    parts: Vec<(Mat<f64>, usize)>,
    others: Vec<Mat<f64>>,
    all: &'a Stretches<'a>,
}

impl StretchesUnderLaw<'_> {
    /// Predicts every stretch from the others.
    pub(crate) fn cross_validate(&self, terms: &Terms) -> CrossValidation {
        let Self { weights, operators, .. } = *self;
        let Terms { creep, loop_shift, smoothness } = *terms;
        let penalty = self.all.projection.penalty(self.law, &self.all.fit.point, smoothness);
        let bounds = self.bounds(terms);
        let mut guess: Vec<usize> = (0..bounds.len()).collect();
        let stretches: Vec<f64> = (self.parts.iter().zip(&self.others))
            // A record of fewer samples than stretches leaves some without any.
            .filter(|((_, rows), _)| *rows > 0)
            .map(|((part, rows), others)| {
                let solution = self.solution(others, &penalty, &bounds, &mut guess);
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
        let rounding = ROUNDING * self.all.fit.base_squares / as_f64(self.all.projection.rows());
        CrossValidation { weights, operators, smoothness, creep, loop_shift, rmse, stretches, rounding }
    }

    /// The same with the smoothness that predicts best; that of the terms if none does.
    pub(crate) fn at_best(&self, smoothnesses: &[f64], terms: &Terms) -> CrossValidation {
        let with = |smoothness: &f64| self.cross_validate(&Terms { smoothness: *smoothness, ..*terms });
        let tried: Vec<_> = smoothnesses.iter().map(with).collect();
        CrossValidation::best(&tried).cloned().unwrap_or_else(|| self.cross_validate(terms))
    }

    /// Between what unknowns and steps of the searched parameters lie; what a candidate does not have is held at zero.
    fn bounds(&self, terms: &Terms) -> Vec<(f64, f64)> {
        let (space, point) = (self.all.projection.space(), &self.all.fit.point);
        let mut bounds = self.law.bounds();
        let used = space.side().map_or_else(Vec::new, |side| side.used_by(terms.loop_shift));
        let first = bounds.len() - used.len();
        for (bound, used) in bounds[first..].iter_mut().zip(used) {
            *bound = if used { *bound } else { (0.0, 0.0) };
        }
        for (axis, bound) in space.axes().iter().zip(space.step_bounds(point, STEP)) {
            let back = -point.get(axis.parameter);
            let left_out = matches!(axis.parameter, Parameter::Creep(number) if number >= terms.creep);
            bounds.push(if left_out { (back, back) } else { bound });
        }
        bounds
    }

    /// The records' own, unknowns and steps of the searched parameters; `guess` is which of the latter two lie between
    /// their bounds, of the stretch before and then of this one.
    fn solution(
        &self,
        factor: &Mat<f64>,
        penalty: &Mat<f64>,
        bounds: &[(f64, f64)],
        guess: &mut Vec<usize>,
    ) -> Vec<f64> {
        let own = self.all.projection.own();
        let (a, b) = below_own(factor, own);
        let (a, b) = penalised(&a, &b, penalty);
        let found = bounded::solve(a.as_ref(), &b, bounds, guess).x;
        let is_inside = |j: &usize| bounds[*j].0 < found[*j] && found[*j] < bounds[*j].1;
        *guess = (0..found.len()).filter(is_inside).collect();
        let mut all = own_values(factor, own, &found);
        all.extend(found);
        all
    }
}

/// How far the searched parameters may move from their values for all stretches, in scales: as far as they may be
/// taken for linear.
const STEP: f64 = 0.1;

/// The triangle of all parts but one, of `own` columns of the records' own and others.
fn without(parts: &[(Mat<f64>, usize)], held_out: usize, own: usize) -> Mat<f64> {
    let columns = parts[0].0.ncols();
    let others: Vec<_> = (0..parts.len()).filter(|i| *i != held_out).map(|i| &parts[i].0).collect();
    let height = parts[0].0.nrows();
    let stacked = Mat::from_fn(others.len() * height, columns, |i, j| others[i / height][(i % height, j)]);
    echelon_of(stacked, own).get(..columns, ..).to_owned()
}

/// Of the mean of independent values.
fn standard_error(values: &[f64]) -> f64 {
    let (mean, count) = (mean(values), as_f64(values.len()));
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    (variance / count).sqrt()
}
