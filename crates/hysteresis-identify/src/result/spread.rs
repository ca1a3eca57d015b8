//! How far a predicted output may be from the truth.

use faer::Mat;

use crate::fit::projection::{Linearised, ProjectedFit};
use crate::fit::regressor::{OperatorBank, Regressor};
use crate::fit::space::{Parameter, Point, Space};
use crate::fit::weight_basis::WeightBasis;
use crate::result::standard_errors::Root;

/// What the covariance of all parameters makes of an output, linearised at the fit.
///
/// The output is g'p + o, with p the weights and searched parameters, o the output offset of the first record. Least
/// squares makes o + m'p, m the means of the columns over that record, independent of p and uncertain by s^2 / N. So the
/// variance of the output is |X'(g - m)|^2 + s^2 / N, with X X' the covariance of p.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Spread {
    /// X, one row per weight, then one per axis.
    root: Mat<f64>,
    /// X'm.
    mean: Vec<f64>,
    /// s^2 / N.
    of_offset: f64,
    weights: Vec<f64>,
    here: OperatorsAt,
    /// For every axis a neighbour and how far away it is; none for the delay, whose derivative is at hand without.
    neighbours: Vec<Option<(OperatorsAt, f64)>>,
}

/// The operators at a point.
#[derive(Clone, Debug, PartialEq)]
struct OperatorsAt {
    bank: OperatorBank,
    input_offset: f64,
    delay: f64,
}

impl OperatorsAt {
    fn at(space: &Space, point: &Point) -> Self {
        let (input_offset, delay) = (point.get(Parameter::InputOffset), point.get(Parameter::Delay));
        Self { bank: space.bank(point), input_offset, delay }
    }

    fn start<'a>(&'a self, input: &'a [f64]) -> Regressor<'a> {
        Regressor::new(&self.bank, input, self.input_offset, self.delay)
    }
}

impl Spread {
    pub(crate) fn new(
        fit: &ProjectedFit,
        root: &Root,
        linearised: &Linearised,
        law: &WeightBasis,
        space: &Space,
    ) -> Self {
        let (unknowns, weights, axes) = (fit.unknowns.len(), fit.weights.len(), space.axes().len());
        let free = root.x.ncols();
        let of_parameter = |j: usize, k: usize| root.places[j].map_or(0.0, |place| root.x[(place, k)]);
        let of_weight = |i: usize, k: usize| (0..unknowns).map(|j| law.derivative(i, j) * of_parameter(j, k)).sum();
        let (means, rows) = linearised.means();
        let mean = |k: usize| means.iter().enumerate().map(|(j, mean)| mean * of_parameter(j, k)).sum();
        let neighbours = space.neighbours(&fit.point).into_iter().map(|(axis, neighbour, distance)| {
            (axis != Parameter::Delay).then(|| (OperatorsAt::at(space, &neighbour), distance))
        });
        Self {
            root: Mat::from_fn(weights + axes, free, |i, k| match i.checked_sub(weights) {
                None => of_weight(i, k),
                Some(axis) => of_parameter(unknowns + axis, k),
            }),
            mean: (0..free).map(mean).collect(),
            of_offset: root.deviation * root.deviation / rows,
            weights: fit.weights.clone(),
            here: OperatorsAt::at(space, &fit.point),
            neighbours: neighbours.collect(),
        }
    }

    /// The standard deviation of every sample of the output for an input that starts from the virgin state.
    pub(crate) fn of(&self, input: &[f64]) -> Vec<f64> {
        let mut here = self.here.start(input);
        let mut there: Vec<_> =
            self.neighbours.iter().map(|one| one.as_ref().map(|(place, _)| place.start(input))).collect();
        let columns = self.weights.len();
        let mut gradient = vec![0.0; self.root.nrows()];
        let mut sums = self.mean.clone();
        let deviation = |k: usize| {
            here.go_to(k, None);
            here.row(&mut gradient[..columns]);
            let output = here.output(&self.weights);
            for ((slope, there), neighbour) in gradient[columns..].iter_mut().zip(&mut there).zip(&self.neighbours) {
                *slope = match (there, neighbour) {
                    (Some(there), Some((_, distance))) => {
                        there.go_to(k, None);
                        (there.output(&self.weights) - output) / distance
                    }
                    _ => here.slope_over_delay(&self.weights),
                };
            }
            for (j, (sum, mean)) in sums.iter_mut().zip(&self.mean).enumerate() {
                let column = self.root.col(j);
                *sum = gradient.iter().enumerate().map(|(i, slope)| slope * column[i]).sum::<f64>() - mean;
            }
            (sums.iter().map(|sum| sum * sum).sum::<f64>() + self.of_offset).sqrt()
        };
        (0..input.len()).map(deviation).collect()
    }
}
