//! How far an estimate may be from the truth, given what the fit leaves.

use faer::Mat;

use crate::fit::factor::{back_substitute, triangle_of};
use crate::fit::projection::{Linearised, ProjectedFit};
use crate::fit::space::{Parameter, Space};
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;

/// A column whose part beside the others is below this share of its norm tells nothing of its parameter.
const MIN_INDEPENDENT_SHARE: f64 = 1e-9;

/// Standard errors of what was identified: the square roots of the diagonal of s^2 (J'J)^-1, from the fit linearised in
/// weights and searched parameters together, s^2 the mean square error per degree of freedom.
///
/// They take the errors of successive samples for independent and the model for true: where the residuals follow the
/// input, the truth may be several of them away. Zero for what was given. NaN for what lies at a bound (a weight of
/// zero, a ratio at its limit): it has no such error, and the others are those of the fit with it held there; and NaN
/// for a parameter that the data do not tell.
#[derive(Clone, Debug, Default)]
#[non_exhaustive]
pub struct StandardErrors {
    /// Of the weights w_i, in output unit per input unit.
    pub weights: Vec<f64>,
    /// Of the weights v_i below zero; empty unless they are split.
    pub weights_negative: Vec<f64>,
    /// Of ra/r, rb/r and rc/r.
    pub ratios: [f64; 3],
    /// Of the input offset, in the unit of the input.
    pub input_offset: f64,
    /// Of the delay, in samples.
    pub delay: f64,
}

/// Bit for bit, so that equal results are equal where there is no error to tell.
impl PartialEq for StandardErrors {
    fn eq(&self, other: &Self) -> bool {
        let bits = |errors: &Self| {
            let numbers = errors.weights.iter().chain(&errors.weights_negative).chain(&errors.ratios);
            numbers.chain([&errors.input_offset, &errors.delay]).map(|e| e.to_bits()).collect::<Vec<_>>()
        };
        self.weights.len() == other.weights.len() && bits(self) == bits(other)
    }
}

/// The root of the covariance of the free parameters, unknowns first, then searched ones: the covariance is X X'.
///
/// What lies at a bound has no place in it, and neither has what depends on others.
pub(crate) struct Root {
    pub(crate) x: Mat<f64>,
    /// The place of every parameter in it.
    pub(crate) places: Vec<Option<usize>>,
    /// The standard deviation s of one sample.
    pub(crate) deviation: f64,
}

impl Root {
    pub(crate) fn of(fit: &ProjectedFit, linearised: &Linearised, space: &Space, rows: usize) -> Self {
        let unknowns = fit.unknowns.len();
        let inside = |value: f64, lower: f64, upper: f64| lower < value && value < upper;
        let mut free: Vec<usize> = (0..unknowns).filter(|j| fit.unknowns[*j] > 0.0).collect();
        for (k, axis) in space.axes().iter().enumerate() {
            if inside(fit.point.get(axis.parameter), axis.lower, axis.upper) {
                free.push(unknowns + k);
            }
        }
        root(fit, linearised, free, rows)
    }

    /// The standard error of a sum of parameters, each with its factor.
    fn error(&self, gradient: impl Iterator<Item = (usize, f64)>) -> f64 {
        let mut sum = vec![0.0; self.x.ncols()];
        for (parameter, slope) in gradient.filter(|(_, slope)| *slope != 0.0) {
            if let Some(place) = self.places[parameter] {
                sum.iter_mut().enumerate().for_each(|(k, sum)| *sum += slope * self.x[(place, k)]);
            }
        }
        sum.iter().map(|e| e * e).sum::<f64>().sqrt()
    }
}

impl StandardErrors {
    pub(crate) fn of(fit: &ProjectedFit, root: &Root, law: &WeightBasis, space: &Space) -> Self {
        let unknowns = fit.unknowns.len();
        let weights: Vec<f64> = fit
            .weights
            .iter()
            .enumerate()
            .map(|(i, w)| {
                let slopes = (0..unknowns).map(|j| (j, law.derivative(i, j)));
                if *w > 0.0 { root.error(slopes) } else { f64::NAN }
            })
            .collect();
        let of = |slopes: &[(Parameter, f64)]| {
            let place = |parameter| space.axes().iter().position(|axis| axis.parameter == parameter);
            let known: Vec<_> = slopes.iter().filter_map(|(p, slope)| Some((unknowns + place(*p)?, *slope))).collect();
            let untold = known.iter().any(|(parameter, _)| root.places[*parameter].is_none());
            if untold { f64::NAN } else { root.error(known.into_iter()) }
        };
        let (ra, share) = (fit.point.get(Parameter::Ra), fit.point.get(Parameter::RbShare));
        let (above, below) = law.families(&weights);
        Self {
            weights: above.to_vec(),
            weights_negative: below.unwrap_or(&[]).to_vec(),
            ratios: [
                of(&[(Parameter::Ra, 1.0)]),
                // rb is searched as its share of ra; with the share at a bound it follows ra.
                of(&[(Parameter::Ra, share), (Parameter::RbShare, ra)]),
                of(&[(Parameter::Rc, 1.0)]),
            ],
            input_offset: of(&[(Parameter::InputOffset, 1.0)]),
            delay: of(&[(Parameter::Delay, 1.0)]),
        }
    }
}

/// s R^-1 of the free columns, those left out that depend on others.
fn root(fit: &ProjectedFit, linearised: &Linearised, mut free: Vec<usize>, rows: usize) -> Root {
    let (a, _) = linearised.below_offsets();
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
    let estimated = free.len() + fit.output_offsets.len();
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
    Root { x, places, deviation: s }
}
