//! The covariance of what was fitted, as a root.

use faer::Mat;

use super::factor::{back_substitute, triangle_of};
use super::gradients::Gradient;
use super::projection::{Linearised, ProjectedFit};
use super::space::Space;
use crate::numeric::as_f64;

/// A column whose part beside the others is below this share of its norm tells nothing of its parameter.
const MIN_INDEPENDENT_SHARE: f64 = 1e-9;

/// The root of the covariance of what was fitted: the covariance is X X'. Its rows are what the records have of their own, first
/// the output offset of the first record, then the free unknowns of the weights, then the free searched parameters.
///
/// What lies at a bound has no place in it, and neither has what depends on others.
pub(crate) struct Root {
    pub(crate) x: Mat<f64>,
    /// The row of every parameter.
    pub(crate) places: Vec<Option<usize>>,
    /// How many of the parameters are unknowns of the weights.
    unknowns: usize,
    /// The standard deviation s of one sample.
    pub(crate) deviation: f64,
}

impl Root {
    /// For white residuals: s R^-1, with R the triangle of the columns, so that X X' is s^2 (J'J)^-1.
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

    /// The same with another covariance, in which only these rows are told.
    pub(crate) fn with(self, x: Mat<f64>, told: &[usize]) -> Self {
        let places = self.places.iter().map(|place| place.filter(|row| told.contains(row))).collect();
        Self { x, places, ..self }
    }

    /// The parameters that have a place, in the order of their rows.
    pub(crate) fn free(&self) -> Vec<usize> {
        (0..self.places.len()).filter(|parameter| self.places[*parameter].is_some()).collect()
    }

    /// X'g for the output offset of the first record.
    pub(crate) fn of_offset(&self) -> Vec<f64> {
        (0..self.x.ncols()).map(|k| self.x[(0, k)]).collect()
    }

    /// How many of its columns come from noise: the first ones, as many as there are rows. What the model lacks has the others.
    pub(crate) fn of_noise(&self) -> usize {
        self.x.nrows()
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

/// s R^-1 of the records' own columns and the free ones, those left out that depend on others.
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
    let (own, (of_own, above)) = (linearised.own(), linearised.own_rows());
    // The columns that are told, and their rows of the triangle.
    let told: Vec<usize> = of_own.iter().copied().chain(free.iter().map(|j| own + j)).collect();
    let whole = Mat::from_fn(told.len(), told.len(), |i, j| match (i.checked_sub(of_own.len()), j) {
        (None, j) => above[(i, told[j])],
        (Some(_), j) if j < of_own.len() => 0.0,
        (Some(i), j) => r[(i, j - of_own.len())],
    });
    let estimated = free.len() + of_own.len();
    let s = (fit.squares / as_f64(rows.saturating_sub(estimated).max(1))).sqrt();
    // One of the records' own columns that depends on others has a row of zeros.
    let of_told: Vec<usize> = of_own.iter().copied().chain(own..own + free.len()).collect();
    let mut x = Mat::zeros(own + free.len(), own + free.len());
    for k in 0..told.len() {
        let mut column = vec![0.0; told.len()];
        column[k] = s;
        back_substitute(whole.as_ref(), &mut column);
        column.into_iter().enumerate().for_each(|(i, value)| x[(of_told[i], k)] = value);
    }
    let mut places = vec![None; a.ncols()];
    free.iter().enumerate().for_each(|(place, parameter)| places[*parameter] = Some(own + place));
    Root { x, places, unknowns: fit.unknowns.len(), deviation: s }
}
