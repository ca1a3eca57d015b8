//! The covariance of everything that was estimated, by name.

use crate::fit::gradients::{Gradients, Quantity};
use crate::fit::projection::ProjectedFit;
use crate::fit::root::Root;
use crate::fit::space::Space;
use crate::fit::weight_basis::WeightBasis;

/// The covariance of the parameters that were estimated, from the same linearisation as the
/// [`StandardErrors`](crate::StandardErrors).
///
/// What was given is left out, and so is what lies at a bound or is not told: it counts as known.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Covariance {
    /// The names, in the order of the rows: `weights[i]`, `weights_negative[i]`, `ra`, `rb`, `rc`, `input_offset`,
    /// `dead_time`, `frequency`, `damping`, `creep[j]`, and `output_offset` of the first record. Several modes have `frequency[k]`,
    /// `damping[k]` and `gain[k]`, from the lowest frequency up.
    pub parameters: Vec<String>,
    /// The covariance, row by row, in the units of the parameters.
    pub matrix: Vec<Vec<f64>>,
}

impl Covariance {
    pub(crate) fn new(fit: &ProjectedFit, root: &Root, basis: &WeightBasis, space: &Space) -> Self {
        let gradients = Gradients { fit, basis, space };
        let mut names = Vec::new();
        let mut roots: Vec<Vec<f64>> = Vec::new();
        for (name, quantity) in quantities(fit, basis, space) {
            let gradient = gradients.of(quantity);
            // A weight of zero is at its bound.
            let is_zero = matches!(quantity, Quantity::Weight(i) if fit.weights[i] == 0.0);
            if !gradient.is_empty() && !is_zero && (matches!(quantity, Quantity::Weight(_)) || root.tells(&gradient)) {
                names.push(name);
                roots.push(root.along(&gradient));
            }
        }
        names.push("output_offset".to_owned());
        roots.push(root.of_offset());
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let matrix = roots.iter().map(|a| roots.iter().map(|b| product(a, b)).collect()).collect();
        Self { parameters: names, matrix }
    }
}

fn quantities(fit: &ProjectedFit, basis: &WeightBasis, space: &Space) -> Vec<(String, Quantity)> {
    let (above, _) = basis.families(&fit.weights);
    let weights = fit.weights.len() - space.shift_len();
    let weight = |i: usize| match (i.checked_sub(above.len()), i.checked_sub(weights)) {
        (_, Some(amplitude)) => (format!("loop_shift[{amplitude}]"), Quantity::Weight(i)),
        (None, _) => (format!("weights[{i}]"), Quantity::Weight(i)),
        (Some(below), _) => (format!("weights_negative[{below}]"), Quantity::Weight(i)),
    };
    let single = [
        ("ra", Quantity::Ra),
        ("rb", Quantity::Rb),
        ("rc", Quantity::Rc),
        ("input_offset", Quantity::InputOffset),
        ("dead_time", Quantity::DeadTime),
    ];
    let single = single.into_iter().map(|(name, quantity)| (name.to_owned(), quantity));
    let order: Vec<usize> = space.linear_part(&fit.point).in_order().into_iter().map(|(number, _)| number).collect();
    let of_mode = |(place, number): (usize, &usize)| {
        let named = [("frequency", Quantity::Frequency), ("damping", Quantity::Damping), ("gain", Quantity::Gain)]
            as [(&str, fn(usize) -> Quantity); 3];
        named.map(|(name, of)| (format!("{name}[{place}]"), of(*number)))
    };
    let one = [("frequency", Quantity::Frequency(0)), ("damping", Quantity::Damping(0))];
    let dynamics: Vec<_> = if order.len() > 1 {
        order.iter().enumerate().flat_map(of_mode).collect()
    } else {
        one.into_iter().map(|(name, quantity)| (name.to_owned(), quantity)).collect()
    };
    let creep = (0..space.creep_amplitudes()).map(|j| (format!("creep[{j}]"), Quantity::Creep(j)));
    (0..fit.weights.len()).map(weight).chain(single).chain(dynamics).chain(creep).collect()
}
