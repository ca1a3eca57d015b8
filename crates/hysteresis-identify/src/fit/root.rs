//! The covariance of what was fitted, as a root.

use faer::Mat;

use super::factor::{back_substitute, triangle_of};
use super::gradients::Gradient;
use super::projection::{Linearised, ProjectedFit};
use super::space::Space;
use crate::numeric::as_f64;

/// A column whose part beside the others is below this share of its norm tells nothing of its parameter.
const MIN_INDEPENDENT_SHARE: f64 = 1e-9;

/// The root of the covariance of the free parameters, unknowns first, then searched ones: the covariance is X X'.
///
/// What lies at a bound has no place in it, and neither has what depends on others.
pub(crate) struct Root {
    pub(crate) x: Mat<f64>,
    /// The place of every parameter in it.
    pub(crate) places: Vec<Option<usize>>,
    /// How many of the parameters are unknowns of the weights.
    unknowns: usize,
    /// The standard deviation s of one sample.
    pub(crate) deviation: f64,
}

impl Root {
    pub(crate) fn of(fit: &ProjectedFit, linearised: &Linearised, space: &Space, rows: usize) -> Self {
        let unknowns = fit.unknowns.len();
        let inside = |value: f64, lower: f64, upper: f64| lower < value && value < upper;
        let mut free: Vec<usize> = (0..unknowns).filter(|j| fit.unknowns[*j] != 0.0).collect();
        for (k, axis) in space.axes().iter().enumerate() {
            if inside(fit.point.get(axis.parameter), axis.lower, axis.upper) {
                free.push(unknowns + k);
            }
        }
        root(fit, linearised, free, rows)
    }

    /// Whether all parameters of a gradient have a place.
    pub(crate) fn tells(&self, gradient: &Gradient) -> bool {
        gradient.iter().all(|(parameter, _)| self.places[*parameter].is_some())
    }

    /// X'g for a gradient g; what has no place counts as known.
    pub(crate) fn along(&self, gradient: &Gradient) -> Vec<f64> {
        let mut sum = vec![0.0; self.x.ncols()];
        for (parameter, slope) in gradient {
            if let Some(place) = self.places[*parameter] {
                sum.iter_mut().enumerate().for_each(|(k, sum)| *sum += slope * self.x[(place, k)]);
            }
        }
        sum
    }

    /// The standard error of a sum of parameters: zero of none, and not a number if a searched one has no place, at a bound
    /// or not told. Of weights, those at zero count as known.
    pub(crate) fn error_of(&self, gradient: &Gradient) -> f64 {
        let is_untold =
            |(parameter, _): &(usize, f64)| *parameter >= self.unknowns && self.places[*parameter].is_none();
        if gradient.iter().any(is_untold) {
            return f64::NAN;
        }
        self.along(gradient).iter().map(|e| e * e).sum::<f64>().sqrt()
    }
}

/// s R^-1 of the free columns, those left out that depend on others.
fn root(fit: &ProjectedFit, linearised: &Linearised, mut free: Vec<usize>, rows: usize) -> Root {
    let (a, _) = linearised.below_own();
    let r = loop {
        let r = triangle_of(Mat::from_fn(a.nrows().max(free.len()), free.len(), |i, j| {
            if i < a.nrows() { a[(i, free[j])] } else { 0.0 }
        }));
        let depends =
            |place: &usize| r[(*place, *place)].abs() <= MIN_INDEPENDENT_SHARE * a.col(free[*place]).norm_l2();
        match (0..free.len()).find(depends) {
            Some(place) => free.remove(place),
            None => break r,
        };
    };
    let estimated = free.len() + fit.output_offsets.len() + fit.underway.iter().filter(|d| **d != 0.0).count();
    let s = (fit.squares / as_f64(rows.saturating_sub(estimated).max(1))).sqrt();
    let mut x = Mat::zeros(free.len(), free.len());
    for k in 0..free.len() {
        let mut column = vec![0.0; free.len()];
        column[k] = s;
        back_substitute(r.as_ref(), &mut column);
        for (i, value) in column.into_iter().enumerate() {
            x[(i, k)] = value;
        }
    }
    let mut places = vec![None; a.ncols()];
    free.iter().enumerate().for_each(|(place, parameter)| places[*parameter] = Some(place));
    Root { x, places, unknowns: fit.unknowns.len(), deviation: s }
}
