//! How far a predicted output may be from the truth.

use faer::Mat;

use crate::fit::projection::ProjectedFit;
use crate::fit::root::Root;
use crate::fit::space::Space;
use crate::fit::tangent::Tangent;
use crate::fit::weight_basis::WeightBasis;

/// What the covariance of all parameters makes of an output, linearised at the fit.
///
/// The output is g'p + o, with p the weights and searched parameters, o the output offset of the first record. So its variance is
/// |X'(g, 1)|^2, with X X' the covariance of p and o that noise makes. Where the model lacks creep or dynamics, p moves so that it
/// predicts the records all the same: that is no error of what is predicted for records like them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Spread {
    /// X, one row per weight, then one per axis.
    #[cfg_attr(feature = "serde", serde(with = "crate::saved::matrix"))]
    root: Mat<f64>,
    /// The row of the output offset.
    of_offset: Vec<f64>,
    tangent: Tangent,
}

impl Spread {
    pub(crate) fn new(fit: &ProjectedFit, root: &Root, basis: &WeightBasis, space: &Space) -> Self {
        let (unknowns, weights, axes) = (fit.unknowns.len(), fit.weights.len(), space.axes().len());
        let columns = root.of_noise();
        let of_parameter = |j: usize, k: usize| root.places[j].map_or(0.0, |place| root.x[(place, k)]);
        let of_weight = |i: usize, k: usize| (0..unknowns).map(|j| basis.derivative(i, j) * of_parameter(j, k)).sum();
        Self {
            root: Mat::from_fn(weights + axes, columns, |i, k| match i.checked_sub(weights) {
                None => of_weight(i, k),
                Some(axis) => of_parameter(unknowns + axis, k),
            }),
            of_offset: root.of_offset().into_iter().take(columns).collect(),
            tangent: space.tangent(&fit.point, weights, Some(&fit.weights)),
        }
    }

    /// The standard deviation of every sample of the output for an input that starts from the virgin state.
    pub(crate) fn of(&self, input: &[f64], dt: f64) -> Vec<f64> {
        let mut rows = self.tangent.rows(input, dt, None);
        let mut gradient = vec![0.0; self.root.nrows()];
        let mut sums = self.of_offset.clone();
        let deviation = |k: usize| {
            rows.write(k, &mut gradient);
            for (j, (sum, of_offset)) in sums.iter_mut().zip(&self.of_offset).enumerate() {
                let column = self.root.col(j);
                *sum = gradient.iter().enumerate().map(|(i, slope)| slope * column[i]).sum::<f64>() + of_offset;
            }
            sums.iter().map(|sum| sum * sum).sum::<f64>().sqrt()
        };
        (0..input.len()).map(deviation).collect()
    }
}
