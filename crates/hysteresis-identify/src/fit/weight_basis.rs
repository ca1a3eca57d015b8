//! What enters linearly: weights in a cone, given by columns whose non-negative combinations it holds, and amplitudes of the
//! loop shift of any sign.

use faer::{Mat, MatRef};

use crate::numeric::as_f64;
use crate::options::{Options, Thresholds, WeightLaw};

/// An identity weighs at least this share of all other operators together, so that every model has an inverse, nearly always in single
/// precision too. Records that show no slope right after a reversal hardly tell such a slope from none.
const LEAST_SLOPE: f64 = 1e-3;

/// A weight law: the weights are B c with unknowns c >= 0.
///
/// So every law is non-negative least squares with other columns, and convex.
/// For free weights B is the identity. For quadratic ones its columns are the extreme rays of the cone of quadratics
/// that are nowhere negative at i = 1..n-1. For split ones the weights are those above zero, then those below, and an
/// operator of threshold zero, the identity, has one unknown for both.
///
/// The amplitudes of the loop shift stand behind the weights, and behind their unknowns.
#[derive(Clone, Debug)]
pub(crate) struct WeightBasis {
    operators: usize,
    has_identity: bool,
    split: bool,
    shifts: usize,
    freedom: usize,
    basis: Option<Mat<f64>>,
}

impl WeightBasis {
    /// `shifts` is how many columns the loop shift has.
    pub(crate) fn new(options: &Options, shifts: usize) -> Self {
        let n = options.operators();
        let has_identity = match &options.thresholds {
            Thresholds::Given(r) => r.first() == Some(&0.0),
            _ => true,
        };
        let basis = match options.weights {
            WeightLaw::Auto | WeightLaw::Free => None,
            WeightLaw::Quadratic => quadratics(n),
            WeightLaw::Split => Some(families(n, has_identity)),
        };
        let split = options.weights == WeightLaw::Split;
        let freedom = match options.weights {
            WeightLaw::Auto | WeightLaw::Free => n,
            WeightLaw::Quadratic => n.min(4),
            WeightLaw::Split => 2 * n - usize::from(has_identity),
        };
        Self { operators: n, has_identity, split, shifts, freedom: freedom + shifts, basis }
    }

    /// The same law with an identity that weighs at least [`LEAST_SLOPE`] of the others, if in these weights it weighs less.
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
        let basis = Mat::from_fn(self.weight_columns(), self.unknowns() - self.shifts, of);
        Some(Self { basis: Some(basis), ..self.clone() })
    }

    /// Whether a weight is that of an identity.
    pub(crate) fn is_identity(&self, weight: usize) -> bool {
        self.has_identity && weight < self.weight_columns() && weight.is_multiple_of(self.operators)
    }

    /// How many weights and amplitudes there are: one column of the regressor each.
    pub(crate) fn columns(&self) -> usize {
        self.weight_columns() + self.shifts
    }

    fn weight_columns(&self) -> usize {
        self.operators * self.families_of_weights()
    }

    /// 2 where weights are split, 1 otherwise.
    pub(crate) fn families_of_weights(&self) -> usize {
        if self.split { 2 } else { 1 }
    }

    /// How many unknowns there are.
    pub(crate) fn unknowns(&self) -> usize {
        self.shifts + self.basis.as_ref().map_or(self.operators, Mat::ncols)
    }

    /// Between what each unknown is searched.
    pub(crate) fn bounds(&self) -> Vec<(f64, f64)> {
        let weights = self.unknowns() - self.shifts;
        let bound = |j: usize| (if j < weights { 0.0 } else { f64::NEG_INFINITY }, f64::INFINITY);
        (0..self.unknowns()).map(bound).collect()
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
        &weights[self.weight_columns()..]
    }

    /// The columns of these unknowns from those of a wider law: each of them as a sum of the wider law's; none if it is the same
    /// law.
    pub(crate) fn within(&self, wider: &Self) -> Option<Mat<f64>> {
        let row_of = |unknown: usize| (0..wider.weight_columns()).find(|i| wider.derivative(*i, unknown) != 0.0);
        let columns = self.unknowns() - self.shifts;
        if self.split == wider.split && self.basis.is_none() == wider.basis.is_none() {
            return None;
        }
        Some(Mat::from_fn(wider.unknowns() - wider.shifts, columns, |unknown, j| {
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

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn law(weights: WeightLaw, n: usize) -> WeightBasis {
        WeightBasis::new(&Options { weights, thresholds: Thresholds::Uniform(n), ..Options::default() }, 0)
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
            let found = crate::fit::bounded::solve(basis.as_ref(), &target, &bounds, &[]);
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
        let without = WeightBasis::new(&Options { thresholds, ..Options::default() }, 0);
        assert!(without.with_least_slope(&[0.0, 1.0]).is_none());
    }

    #[test]
    fn amplitudes_stand_behind_the_weights() {
        let thresholds = Thresholds::Uniform(3);
        let law = WeightBasis::new(&Options { weights: WeightLaw::Split, thresholds, ..Options::default() }, 2);
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
