//! The weights of the operators: a law, w = B c with unknowns c >= 0, and how smooth they are asked to be.
//!
//! What enters linearly is this: weights in a cone, given by columns whose non-negative combinations it holds, and what
//! stands beside them: amplitudes of the loop shift, of any sign, and weights of relaxing plays. Rows below the
//! triangle ask for small second differences.

use faer::{Mat, MatRef};

use crate::algebra::factor::triangle_of;
use crate::records::signal::as_f64;
use crate::terms::operators::Thresholds;
use crate::terms::side_columns::Sides;

/// What the weights of the operators may be; never negative, and that of the identity at least a thousandth of the sum
/// of all others, so that the model is invertible.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum WeightLaw {
    /// One of the other laws, as cross-validation over stretches of the records asks for: of
    /// [`Quadratic`](Self::Quadratic), [`Free`](Self::Free) and [`Split`](Self::Split) the first that predicts
    /// stretches that it was not fitted to as well as the best: the ratio of their mean square errors is 1 within its
    /// standard error. For the conventional model there are the first two.
    #[default]
    Auto,
    /// Any w_i >= 0.
    Free,
    /// w_0 >= 0, and w_i = c_0 + c_1 i + c_2 i^2 >= 0 for i = 1..n-1: the four numbers behind the tables of the paper.
    /// With fewer than five operators that is no condition.
    Quadratic,
    /// Weights of their own for the family of one-sided plays below zero; the identity has one for both. For the
    /// modified model only.
    Split,
}

impl WeightLaw {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Auto, Self::Free, Self::Quadratic, Self::Split];

    /// Its name in lower case.
    ///
    /// ```
    /// use hysteresis_identify::WeightLaw;
    /// assert_eq!(WeightLaw::default().name(), "auto");
    /// ```
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Free => "free",
            Self::Quadratic => "quadratic",
            Self::Split => "split",
        }
    }
}

/// An identity weighs at least this share of all other operators together, so that every model has an inverse, nearly
/// always in single precision too. Records that show no slope right after a reversal hardly tell such a slope from
/// none.
const LEAST_SLOPE: f64 = 1e-3;

/// A weight law: the weights are B c with unknowns c >= 0.
///
/// So every law is non-negative least squares with other columns, and convex.
/// For free weights B is the identity. For quadratic ones its columns are the extreme rays of the cone of quadratics
/// that are nowhere negative at i = 1..n-1. For split ones the weights are those above zero, then those below, and an
/// operator of threshold zero, the identity, has one unknown for both.
///
/// Amplitudes of the loop shift and weights of relaxing plays stand behind the weights, and behind their unknowns.
#[derive(Clone, Debug)]
pub(crate) struct WeightBasis {
    operators: usize,
    has_identity: bool,
    split: bool,
    sides: Sides,
    freedom: usize,
    basis: Option<Mat<f64>>,
}

impl WeightBasis {
    /// `sides` is how many columns there are beside the operators.
    pub(crate) fn new(law: WeightLaw, thresholds: &Thresholds, sides: Sides) -> Self {
        let n = thresholds.operators();
        let has_identity = match thresholds {
            Thresholds::Given(r) => r.first() == Some(&0.0),
            _ => true,
        };
        let basis = match law {
            WeightLaw::Auto | WeightLaw::Free => None,
            WeightLaw::Quadratic => quadratics(n),
            WeightLaw::Split => Some(families(n, has_identity)),
        };
        let split = law == WeightLaw::Split;
        let freedom = match law {
            WeightLaw::Auto | WeightLaw::Free => n,
            WeightLaw::Quadratic => n.min(4),
            WeightLaw::Split => 2 * n - usize::from(has_identity),
        };
        Self { operators: n, has_identity, split, sides, freedom: freedom + sides.len(), basis }
    }

    /// The same law with an identity that weighs at least [`LEAST_SLOPE`] of the others, if in these weights it weighs
    /// less.
    ///
    /// What an unknown makes of the others it adds to the identity, too: so the law is a cone still, whatever the unit.
    pub(crate) fn with_least_slope(&self, weights: &[f64]) -> Option<Self> {
        let others = |weight: &dyn Fn(usize) -> f64| {
            let sum: f64 = (0..self.weight_columns()).filter(|i| !self.is_identity(*i)).map(weight).sum();
            LEAST_SLOPE * sum / as_f64(self.families_of_weights())
        };
        if !self.has_identity || weights[0] >= others(&|i| weights[i]) {
            return None;
        }
        let added = |i: usize, j: usize| if self.is_identity(i) { others(&|i| self.derivative(i, j)) } else { 0.0 };
        let of = |i, j| self.derivative(i, j) + added(i, j);
        let basis = Mat::from_fn(self.weight_columns(), self.unknowns() - self.sides.len(), of);
        Some(Self { basis: Some(basis), ..self.clone() })
    }

    /// Whether a weight is that of an identity.
    pub(crate) fn is_identity(&self, weight: usize) -> bool {
        self.has_identity && weight < self.weight_columns() && weight.is_multiple_of(self.operators)
    }

    /// How many weights and amplitudes there are: one column of the regressor each.
    pub(crate) fn columns(&self) -> usize {
        self.weight_columns() + self.sides.len()
    }

    fn weight_columns(&self) -> usize {
        self.operators * self.families_of_weights()
    }

    /// 2 where weights are split, 1 otherwise.
    fn families_of_weights(&self) -> usize {
        if self.split { 2 } else { 1 }
    }

    /// How many unknowns there are.
    pub(crate) fn unknowns(&self) -> usize {
        self.sides.len() + self.basis.as_ref().map_or(self.operators, Mat::ncols)
    }

    /// Between what each unknown is searched.
    pub(crate) fn bounds(&self) -> Vec<(f64, f64)> {
        let weights = self.unknowns() - self.sides.len();
        let has_sign = weights..weights + self.sides.of_any_sign;
        let bound = |j: usize| (if has_sign.contains(&j) { f64::NEG_INFINITY } else { 0.0 }, f64::INFINITY);
        (0..self.unknowns()).map(bound).collect()
    }

    /// The same where every operator but the identity weighs nothing.
    pub(crate) fn bounds_of_the_identity(&self) -> Vec<(f64, f64)> {
        let is_other = |i: usize, j: usize| !self.is_identity(i) && self.derivative(i, j) != 0.0;
        let weighs = |j: usize| (0..self.weight_columns()).any(|i| is_other(i, j));
        let bounds = self.bounds().into_iter().enumerate();
        bounds.map(|(j, bounds)| if weighs(j) { (0.0, 0.0) } else { bounds }).collect()
    }

    /// How many unknowns are independent at most.
    pub(crate) fn freedom(&self) -> usize {
        self.freedom
    }

    /// The weights that belong to the unknowns, and the amplitudes.
    pub(crate) fn weights(&self, unknowns: &[f64]) -> Vec<f64> {
        let Some(basis) = &self.basis else { return unknowns.to_vec() };
        let (unknowns, amplitudes) = unknowns.split_at(basis.ncols());
        let weight = |i| unknowns.iter().enumerate().map(|(j, c)| basis[(i, j)] * c).sum();
        (0..basis.nrows()).map(weight).chain(amplitudes.iter().copied()).collect()
    }

    /// The derivative of weight or amplitude i by unknown j.
    pub(crate) fn derivative(&self, i: usize, j: usize) -> f64 {
        match &self.basis {
            Some(basis) if i < basis.nrows() && j < basis.ncols() => basis[(i, j)],
            Some(basis) => {
                let amplitude = i.checked_sub(basis.nrows());
                f64::from(u8::from(amplitude.is_some() && amplitude == j.checked_sub(basis.ncols())))
            }
            None => f64::from(u8::from(i == j)),
        }
    }

    /// The weights above zero, and those below if they are split.
    pub(crate) fn families<'a>(&self, weights: &'a [f64]) -> (&'a [f64], Option<&'a [f64]>) {
        let (above, below) = weights[..self.weight_columns()].split_at(self.operators);
        (above, self.split.then_some(below))
    }

    /// The amplitudes of the loop shift.
    pub(crate) fn amplitudes<'a>(&self, weights: &'a [f64]) -> &'a [f64] {
        self.beside(weights).0
    }

    /// The weights of relaxing plays.
    pub(crate) fn relaxing<'a>(&self, weights: &'a [f64]) -> &'a [f64] {
        self.beside(weights).1
    }

    fn beside<'a>(&self, weights: &'a [f64]) -> (&'a [f64], &'a [f64]) {
        weights[self.weight_columns()..].split_at(self.sides.of_any_sign)
    }

    /// The columns of these unknowns from those of a wider law: each of them as a sum of the wider law's; none if it is
    /// the same law.
    pub(crate) fn within(&self, wider: &Self) -> Option<Mat<f64>> {
        let row_of = |unknown: usize| (0..wider.weight_columns()).find(|i| wider.derivative(*i, unknown) != 0.0);
        let columns = self.unknowns() - self.sides.len();
        if self.split == wider.split && self.basis.is_none() == wider.basis.is_none() {
            return None;
        }
        Some(Mat::from_fn(wider.unknowns() - wider.sides.len(), columns, |unknown, j| {
            row_of(unknown).map_or(0.0, |i| self.derivative(if self.split { i } else { i % self.operators }, j))
        }))
    }

    /// The columns of the unknowns in place of those of the weights, which begin at `from`.
    pub(crate) fn in_unknowns(&self, columns: MatRef<'_, f64>, from: usize) -> Mat<f64> {
        self.basis.as_ref().map_or_else(|| columns.to_owned(), |basis| combined(columns, basis, from))
    }
}

/// Combinations of some columns, which begin at `from`, in their place.
pub(crate) fn combined(columns: MatRef<'_, f64>, combinations: &Mat<f64>, from: usize) -> Mat<f64> {
    let (before, after) = (combinations.nrows(), combinations.ncols());
    let mapped = columns.get(.., from..from + before) * combinations;
    Mat::from_fn(columns.nrows(), columns.ncols() - before + after, |i, j| match j {
        _ if j < from => columns[(i, j)],
        _ if j < from + after => mapped[(i, j - from)],
        _ => columns[(i, j - after + before)],
    })
}

/// w_0 alone, and the extreme rays of the quadratics in i that are not negative at i = 1..m: those that vanish at two
/// neighbours, and the one that vanishes at both ends. Three points or fewer bear any weights.
fn quadratics(n: usize) -> Option<Mat<f64>> {
    if n < 5 {
        return None;
    }
    let m = as_f64(n - 1);
    let ray = |i: f64, j: f64| if j < m { (i - j) * (i - j - 1.0) } else { (i - 1.0) * (m - i) };
    let largest = |j: f64| (1..n).map(|i| ray(as_f64(i), j)).fold(0.0, f64::max);
    Some(Mat::from_fn(n, n, |i, j| match (i, j) {
        (0, 0) => 1.0,
        (0, _) | (_, 0) => 0.0,
        _ => ray(as_f64(i), as_f64(j)) / largest(as_f64(j)),
    }))
}

/// One unknown for both weights of the identity, one for each of the others.
fn families(n: usize, has_identity: bool) -> Mat<f64> {
    let shared = usize::from(has_identity);
    Mat::from_fn(2 * n, 2 * n - shared, |i, j| {
        let unknown = if i < n || i - n < shared { i % n } else { i - shared };
        f64::from(u8::from(unknown == j))
    })
}

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
fn with_penalty(a: &Mat<f64>, b: &[f64], penalty: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
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

/// The problem with a penalty, or as it is without one.
pub(crate) fn penalised(a: &Mat<f64>, b: &[f64], penalty: &Mat<f64>) -> (Mat<f64>, Vec<f64>) {
    if penalty.nrows() == 0 { (a.clone(), b.to_vec()) } else { with_penalty(a, b, penalty) }
}

#[cfg(test)]
mod tests_of_weight_basis {
    use proptest::prelude::*;

    use super::*;

    fn law(weights: WeightLaw, n: usize) -> WeightBasis {
        WeightBasis::new(weights, &Thresholds::Uniform(n), Sides::default())
    }

    proptest! {
        /// Every quadratic that is nowhere negative is a non-negative combination of the rays, and no other is.
        #[test]
        fn rays_span_the_quadratics_that_are_not_negative(n in 5..25_usize, c in prop::array::uniform3(-1.0..1.0_f64)) {
            let law = law(WeightLaw::Quadratic, n);
            let value = |i: usize| c[0] + as_f64(i) * (c[1] + as_f64(i) * c[2] / as_f64(n)) / as_f64(n);
            let mut target: Vec<f64> = (0..n).map(value).collect();
            target[0] = 0.3;
            let lowest = target.iter().copied().fold(f64::INFINITY, f64::min);
            let basis = law.basis.as_ref().unwrap();
            let bounds = vec![(0.0, f64::INFINITY); n];
            let found = crate::algebra::bounded::solve(basis.as_ref(), &target, &bounds, &[]);
            let close = found.squares < 1e-18;
            prop_assert!(close || lowest < 1e-9, "{target:?} left {}", found.squares);
            prop_assert!(!close || lowest > -1e-8);
            prop_assert!(law.weights(&found.x).iter().all(|w| *w >= 0.0));
        }
    }

    #[test]
    fn split_weights_share_the_identity() {
        let law = law(WeightLaw::Split, 3);
        assert_eq!((law.columns(), law.freedom()), (6, 5));
        let weights = law.weights(&[9.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(law.families(&weights), (&[9.0, 1.0, 2.0][..], Some(&[9.0, 3.0, 4.0][..])));
        assert_eq!(law.derivative(3, 0), 1.0);
    }

    #[test]
    fn an_identity_weighs_at_least_a_share_of_the_others() {
        for weights in [WeightLaw::Free, WeightLaw::Quadratic, WeightLaw::Split] {
            let plain = law(weights, 6);
            let unknowns: Vec<f64> = (0..plain.unknowns()).map(|j| if j == 0 { 0.0 } else { as_f64(j) }).collect();
            let before = plain.weights(&unknowns);
            let steep = plain.with_least_slope(&before).unwrap();
            let after = steep.weights(&unknowns);
            for (i, (before, after)) in before.iter().zip(&after).enumerate() {
                assert!(steep.is_identity(i) || before == after);
            }
            let families = plain.families_of_weights();
            let others = before.iter().sum::<f64>() / as_f64(families);
            assert!((after[0] - LEAST_SLOPE * others).abs() < 1e-12 * others);
            assert_eq!(after[0], after[6 * (families - 1)]);
            assert!(
                plain.with_least_slope(&after).is_none() && plain.with_least_slope(&vec![0.0; after.len()]).is_none()
            );
        }
        let thresholds = Thresholds::Given(vec![1.0, 2.0]);
        let without = WeightBasis::new(WeightLaw::Auto, &thresholds, Sides::default());
        assert!(without.with_least_slope(&[0.0, 1.0]).is_none());
    }

    #[test]
    fn amplitudes_stand_behind_the_weights() {
        let thresholds = Thresholds::Uniform(3);
        let law = WeightBasis::new(WeightLaw::Split, &thresholds, Sides { of_any_sign: 2, non_negative: 0 });
        assert_eq!((law.columns(), law.unknowns(), law.freedom()), (8, 7, 7));
        let weights = law.weights(&[9.0, 1.0, 2.0, 3.0, 4.0, -5.0, 6.0]);
        assert_eq!(law.families(&weights), (&[9.0, 1.0, 2.0][..], Some(&[9.0, 3.0, 4.0][..])));
        assert_eq!(law.amplitudes(&weights), [-5.0, 6.0]);
        let free = (f64::NEG_INFINITY, f64::INFINITY);
        assert_eq!(law.bounds()[4..], [(0.0, f64::INFINITY), free, free]);
        let derivatives = [(6, 5), (7, 6), (6, 6), (6, 0), (0, 5)].map(|(i, j)| law.derivative(i, j));
        assert_eq!(derivatives, [1.0, 1.0, 0.0, 0.0, 0.0]);
    }

    #[test]
    fn columns_of_unknowns_stand_where_those_of_weights_stood() {
        let law = law(WeightLaw::Split, 2);
        let columns = Mat::from_fn(1, 7, |_, j| as_f64(10_usize.pow(u32::try_from(j).unwrap())));
        // offset, [w0 w1 v0 v1] -> [w0 + v0, w1, v1], two more
        let mapped = law.in_unknowns(columns.as_ref(), 1);
        assert_eq!(mapped, faer::mat![[1.0, 1_010.0, 100.0, 10_000.0, 100_000.0, 1_000_000.0]]);
    }
}

#[cfg(test)]
mod tests_of_smoothness {
    use super::*;

    fn of(weights: WeightLaw, thresholds: &[f64], unknowns: &[f64]) -> f64 {
        let law = WeightBasis::new(weights, &Thresholds::Given(thresholds.to_vec()), Sides::default());
        let rows = penalty(&law, thresholds, 4.0);
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
