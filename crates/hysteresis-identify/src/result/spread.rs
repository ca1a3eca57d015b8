//! How far a predicted output may be from the truth.

use faer::Mat;

use crate::fit::projection::{Linearised, ProjectedFit};
use crate::fit::root::Root;
use crate::fit::space::Space;
use crate::fit::tangent::Tangent;
use crate::fit::weight_basis::WeightBasis;

/// What the covariance of all parameters makes of an output, linearised at the fit.
///
/// The output is g'p + o, with p the weights and searched parameters, o the output offset of the first record. Least
/// squares makes o + m'p, m the means of the columns over that record, independent of p and uncertain by s^2 / N. So the
/// variance of the output is |X'(g - m)|^2 + s^2 / N, with X X' the covariance of p.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Spread {
    /// X, one row per weight, then one per axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::matrix"))]
    root: Mat<f64>,
    /// X'm.
    mean: Vec<f64>,
    /// s^2 / N.
    of_offset: f64,
    tangent: Tangent,
}

impl Spread {
    pub(crate) fn new(
        fit: &ProjectedFit,
        root: &Root,
        linearised: &Linearised,
        basis: &WeightBasis,
        space: &Space,
    ) -> Self {
        let (unknowns, weights, axes) = (fit.unknowns.len(), fit.weights.len(), space.axes().len());
        let free = root.x.ncols();
        let of_parameter = |j: usize, k: usize| root.places[j].map_or(0.0, |place| root.x[(place, k)]);
        let of_weight = |i: usize, k: usize| (0..unknowns).map(|j| basis.derivative(i, j) * of_parameter(j, k)).sum();
        let (means, rows) = linearised.means();
        let mean = |k: usize| means.iter().enumerate().map(|(j, mean)| mean * of_parameter(j, k)).sum();
        Self {
            root: Mat::from_fn(weights + axes, free, |i, k| match i.checked_sub(weights) {
                None => of_weight(i, k),
                Some(axis) => of_parameter(unknowns + axis, k),
            }),
            mean: (0..free).map(mean).collect(),
            of_offset: root.deviation * root.deviation / rows,
            tangent: space.tangent(&fit.point, weights, Some(&fit.weights)),
        }
    }

    /// The standard deviation of every sample of the output for an input that starts from the virgin state.
    pub(crate) fn of(&self, input: &[f64], dt: f64) -> Vec<f64> {
        let mut rows = self.tangent.rows(input, dt);
        let mut gradient = vec![0.0; self.root.nrows()];
        let mut sums = self.mean.clone();
        let deviation = |k: usize| {
            rows.write(k, None, &mut gradient);
            for (j, (sum, mean)) in sums.iter_mut().zip(&self.mean).enumerate() {
                let column = self.root.col(j);
                *sum = gradient.iter().enumerate().map(|(i, slope)| slope * column[i]).sum::<f64>() - mean;
            }
            (sums.iter().map(|sum| sum * sum).sum::<f64>() + self.of_offset).sqrt()
        };
        (0..input.len()).map(deviation).collect()
    }
}
