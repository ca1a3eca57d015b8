//! Smooth weights: rows below the triangle that ask for small second differences.

use faer::Mat;

use crate::fit::factor::triangle_of;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;

/// Rows D, one column for each unknown of the law, such that |D c|^2 is `strength` times the sum of the squared second
/// differences of the weights w_i, i = 1..n-1, of every family.
///
/// Where thresholds are uneven, a weight counts per interval that its threshold stands for, and the differences are
/// divided ones: w_i / h_i, h_i half the distance of both neighbours (at the ends: the whole distance of the one), over
/// (r_i - r_j) / h, h the mean interval. For even thresholds that is w_(i-1) - 2 w_i + w_(i+1).
pub(crate) fn penalty(law: &WeightBasis, thresholds: &[f64], strength: f64) -> Mat<f64> {
    let n = thresholds.len();
    let families = law.families_of_weights();
    // No second difference without three weights besides the identity.
    let each = n.saturating_sub(3);
    let mut rows = Mat::zeros(families * each, law.columns());
    let root = strength.sqrt();
    for (row, family, i) in (0..families).flat_map(|family| (0..each).map(move |k| (family * each + k, family, k + 1)))
    {
        for (place, factor) in second_difference(&thresholds[1..], i - 1) {
            rows[(row, family * n + 1 + place)] = root * factor;
        }
    }
    law.in_unknowns(rows.as_ref(), 0)
}

/// The factors of three neighbouring weights, the first of them number `first`.
fn second_difference(r: &[f64], first: usize) -> [(usize, f64); 3] {
    let last = r.len() - 1;
    let mean = (r[last] - r[0]) / as_f64(last);
    let x = |i: usize| r[i] / mean;
    let interval = |i: usize| {
        let (below, above) = (i.saturating_sub(1), (i + 1).min(last));
        (x(above) - x(below)) / as_f64(above - below)
    };
    let [a, b, c] = [first, first + 1, first + 2];
    let distances = [(x(a) - x(b)) * (x(a) - x(c)), (x(b) - x(a)) * (x(b) - x(c)), (x(c) - x(a)) * (x(c) - x(b))];
    [
        (a, 2.0 / distances[0] / interval(a)),
        (b, 2.0 / distances[1] / interval(b)),
        (c, 2.0 / distances[2] / interval(c)),
    ]
}

/// The triangle of \[A | b\] with the rows of a penalty below it; they have no entries in further columns, nor in b.
pub(crate) fn with_penalty(a: &Mat<f64>, b: &[f64], penalty: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
    let (rows, columns) = (a.nrows(), a.ncols());
    let height = (rows + penalty.nrows()).max(columns + 1);
    let all = triangle_of(Mat::from_fn(height, columns + 1, |i, j| {
        if i < rows {
            if j < columns { a[(i, j)] } else { b[i] }
        } else if i - rows < penalty.nrows() && j < penalty.ncols() {
            penalty[(i - rows, j)]
        } else {
            0.0
        }
    }));
    let b = (0..=columns).map(|i| all[(i, columns)]).collect();
    (all.get(..columns + 1, ..columns).to_owned(), b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{Options, Thresholds, WeightLaw};

    fn of(weights: WeightLaw, thresholds: &[f64], unknowns: &[f64]) -> f64 {
        let options = Options { weights, thresholds: Thresholds::Given(thresholds.to_vec()), ..Options::default() };
        let rows = penalty(&WeightBasis::new(&options, 0), thresholds, 4.0);
        let value = |i: usize| unknowns.iter().enumerate().map(|(j, c)| rows[(i, j)] * c).sum::<f64>();
        (0..rows.nrows()).map(|i| value(i).powi(2)).sum()
    }

    #[test]
    fn even_thresholds_have_plain_second_differences() {
        let r = [0.0, 2.0, 4.0, 6.0, 8.0];
        // differences 1 - 2 x 3 + 2 = -3 and 3 - 2 x 2 + 7 = 6, times 4
        assert!((of(WeightLaw::Free, &r, &[9.0, 1.0, 3.0, 2.0, 7.0]) - 180.0).abs() < 1e-12);
        // and those of the other family, 1 - 2 x 1 + 0 and 1 - 0 + 0
        assert!((of(WeightLaw::Split, &r, &[9.0, 1.0, 3.0, 2.0, 7.0, 1.0, 1.0, 0.0, 0.0]) - 188.0).abs() < 1e-12);
        assert_eq!(of(WeightLaw::Free, &r[..3], &[1.0, 5.0, 2.0]), 0.0);
    }

    /// A weight per volt that is a line over the threshold costs nothing, wherever the thresholds lie.
    #[test]
    fn a_straight_density_costs_nothing() {
        let r = [0.0, 1.0, 2.5, 3.0, 6.0, 7.0];
        let interval = [1.5, 1.0, 1.75, 2.0, 1.0];
        let weights = |density: &dyn Fn(f64) -> f64| {
            let each = r[1..].iter().zip(interval).map(|(r, h)| density(*r) * h);
            std::iter::once(5.0).chain(each).collect::<Vec<_>>()
        };
        assert!(of(WeightLaw::Free, &r, &weights(&|r| 3.0 + 0.5 * r)) < 1e-20);
        // r^2 has the second difference 2 at all three places: in mean intervals of 1.5, (2 x 1.5^3)^2 x 4
        let bent = of(WeightLaw::Free, &r, &weights(&|r| r * r));
        assert!((bent / (3.0 * 4.0 * (2.0 * 1.5_f64.powi(3)).powi(2)) - 1.0).abs() < 1e-12, "{bent}");
    }
}
