//! Least squares with bounds on the unknowns; non-negative least squares (NNLS) is the case of bounds 0 and infinity.
//!
//! The active-set method of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23), with two bounds as in
//! Stark and Parker (1995).

use faer::{Mat, MatRef};

use crate::algebra::factor::{back_substitute, triangle_of};

/// A column is taken as dependent on others if what is left of it is below this share of its norm.
const MIN_INDEPENDENT_SHARE: f64 = 1e-11;

/// The minimiser of |A x - b| over lower <= x <= upper.
#[derive(Clone, Debug)]
pub(crate) struct Solution {
    pub(crate) x: Vec<f64>,
    /// The smallest |A x - b|^2.
    pub(crate) squares: f64,
    /// By how much the conditions of Karush, Kuhn and Tucker are missed: the largest gradient a_j'(b - A x) that would
    /// lower |A x - b| within the bounds, as a share of |a_j| |b|.
    pub(crate) kkt_residual: f64,
}

/// Solves min |A x - b| over lower_j <= x_j <= upper_j, as [`minimise`] does, by a QR of A.
///
/// Bounds may be infinite; an unknown without a lower bound starts at 0. `free` is the guess of [`minimise`].
pub(crate) fn solve(a: MatRef<'_, f64>, b: &[f64], bounds: &[(f64, f64)], free: &[usize]) -> Solution {
    let problem = LeastSquares::new(a, b);
    let start = bounds.iter().map(|(lower, _)| if lower.is_finite() { *lower } else { 0.0 }).collect();
    let x = minimise(&problem, bounds, start, free);
    Solution { squares: problem.squares(&x), kkt_residual: problem.kkt_residual(bounds, &x), x }
}

struct LeastSquares<'a> {
    a: MatRef<'a, f64>,
    b: &'a [f64],
    norms: Vec<f64>,
    b_norm: f64,
}

impl<'a> LeastSquares<'a> {
    fn new(a: MatRef<'a, f64>, b: &'a [f64]) -> Self {
        let norms = (0..a.ncols()).map(|j| a.col(j).norm_l2()).collect();
        let b_norm = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        Self { a, b, norms, b_norm }
    }

    fn squares(&self, x: &[f64]) -> f64 {
        self.residual(x).iter().map(|e| e * e).sum()
    }

    fn kkt_residual(&self, bounds: &[(f64, f64)], x: &[f64]) -> f64 {
        let gradient = self.downhill(x);
        let missed = |(j, (lower, upper)): (usize, &(f64, f64))| {
            let downhill = gradient(j);
            let within = if downhill > 0.0 { x[j] < *upper } else { x[j] > *lower };
            let share = downhill.abs() / (self.norms[j] * self.b_norm);
            if within && downhill != 0.0 { share } else { 0.0 }
        };
        bounds.iter().enumerate().map(missed).fold(0.0, f64::max)
    }

    /// b - A x.
    fn residual(&self, x: &[f64]) -> Vec<f64> {
        let mut residual = self.b.to_vec();
        for (j, x) in x.iter().enumerate().filter(|(_, x)| **x != 0.0) {
            for (i, e) in residual.iter_mut().enumerate() {
                *e -= self.a[(i, j)] * x;
            }
        }
        residual
    }
}

impl SumOfSquares for LeastSquares<'_> {
    const GRADIENT_TOLERANCE: f64 = 1e-13;

    fn column_norm(&self, j: usize) -> f64 {
        self.norms[j]
    }

    fn size(&self) -> f64 {
        self.b_norm
    }

    fn downhill(&self, x: &[f64]) -> impl Fn(usize) -> f64 {
        let residual = self.residual(x);
        move |j| residual.iter().enumerate().map(|(i, e)| self.a[(i, j)] * e).sum()
    }

    fn minimum_over(&self, free: &[usize], held: &[f64]) -> Result<Vec<f64>, usize> {
        let rest = self.residual(held);
        let rows = self.b.len().max(free.len() + 1);
        let r = triangle_of(Mat::from_fn(rows, free.len() + 1, |i, column| match free.get(column) {
            _ if i >= self.b.len() => 0.0,
            Some(j) => self.a[(i, *j)],
            None => rest[i],
        }));
        let independent = |place: &usize| r[(*place, *place)].abs() > MIN_INDEPENDENT_SHARE * self.norms[free[*place]];
        if let Some(place) = (0..free.len()).find(|place| !independent(place)) {
            return Err(place);
        }
        let mut x: Vec<f64> = (0..free.len()).map(|i| r[(i, free.len())]).collect();
        back_substitute(r.as_ref(), &mut x);
        Ok(x)
    }
}

/// |A x - b|^2, as the method asks for it.
pub(crate) trait SumOfSquares {
    /// A gradient below this share of |a_j| |b| is rounding.
    const GRADIENT_TOLERANCE: f64;

    /// |a_j|.
    fn column_norm(&self, j: usize) -> f64;

    /// |b|.
    fn size(&self) -> f64;

    /// The gradient a_j'(b - A x) of any unknown j: the sum falls where the unknown goes this way.
    fn downhill(&self, x: &[f64]) -> impl Fn(usize) -> f64;

    /// The values of the unknowns `free` at the minimum, the others being `held`, where the free ones are zero. Or the
    /// place of the first free one whose column depends on those before it.
    fn minimum_over(&self, free: &[usize], held: &[f64]) -> Result<Vec<f64>, usize>;
}

/// The x of the least sum over lower_j <= x_j <= upper_j. Unknowns that are not `free` at first are where `x` has them:
/// at a bound, or anywhere if they have none.
///
/// `free` names the unknowns that are expected between their bounds: a good guess (the answer of a neighbouring
/// problem) saves most of the work, a bad one changes nothing but the time. The answer satisfies the conditions of
/// Karush, Kuhn and Tucker up to rounding; where columns depend on each other it is one of several.
pub(crate) fn minimise(sum: &impl SumOfSquares, bounds: &[(f64, f64)], x: Vec<f64>, free: &[usize]) -> Vec<f64> {
    let mut search = Search { sum, bounds, x, free: free.to_vec() };
    search.start();
    // Every round lowers the sum, so no set of free unknowns comes back; the limit only guards against rounding.
    for _ in 0..10 * (bounds.len() + 1) {
        if !search.improve() {
            break;
        }
    }
    search.x
}

struct Search<'a, S> {
    sum: &'a S,
    bounds: &'a [(f64, f64)],
    x: Vec<f64>,
    /// The unknowns between their bounds, in the order of their release.
    free: Vec<usize>,
}

impl<S: SumOfSquares> Search<'_, S> {
    /// Goes to the minimum over the free unknowns, and binds those that depend on others or would leave their bounds.
    fn start(&mut self) {
        loop {
            match self.minimum_over_free() {
                Err(place) => {
                    self.free.remove(place);
                }
                Ok(target) => {
                    let before = self.free.len();
                    for (j, x) in std::mem::take(&mut self.free).into_iter().zip(target) {
                        let (lower, upper) = self.bounds[j];
                        self.x[j] = x.clamp(lower, upper);
                        if self.x[j] == x {
                            self.free.push(j);
                        }
                    }
                    if self.free.len() == before {
                        return;
                    }
                }
            }
        }
    }

    /// Releases the bound unknown that promises most and moves to the new minimum; false if none can be released.
    fn improve(&mut self) -> bool {
        for (downhill, j) in self.promising() {
            self.free.push(j);
            // Rounding alone made the gradient if the column depends on free ones, or if the unknown would at once
            // move out of its domain: Lawson and Hanson's guard against cycling.
            match self.minimum_over_free() {
                Ok(target) if (target[target.len() - 1] - self.x[j]) * downhill > 0.0 => {
                    self.descend(target);
                    return true;
                }
                _ => self.free.pop(),
            };
        }
        false
    }

    /// The gradients of the bound unknowns that may go downhill, and the unknowns, the most promising one first.
    fn promising(&self) -> Vec<(f64, usize)> {
        let (gradient, size) = (self.sum.downhill(&self.x), self.sum.size());
        let mut promising = Vec::new();
        for j in (0..self.x.len()).filter(|j| !self.free.contains(j)) {
            let (downhill, norm, (lower, upper)) = (gradient(j), self.sum.column_norm(j), self.bounds[j]);
            let admissible = if downhill > 0.0 { self.x[j] < upper } else { self.x[j] > lower };
            if admissible && downhill.abs() > S::GRADIENT_TOLERANCE * norm * size {
                promising.push((downhill.abs() / norm, downhill, j));
            }
        }
        promising.sort_by(|(p, ..), (q, ..)| q.total_cmp(p));
        promising.into_iter().map(|(_, downhill, j)| (downhill, j)).collect()
    }

    /// Moves towards the minimum over the free unknowns, binding what meets its bound on the way.
    fn descend(&mut self, mut target: Vec<f64>) {
        while let Some((step, place, bound)) = self.first_bound_met(&target) {
            for (j, target) in self.free.iter().zip(&target) {
                let (lower, upper) = self.bounds[*j];
                self.x[*j] = (self.x[*j] + step * (target - self.x[*j])).clamp(lower, upper);
            }
            self.x[self.free.remove(place)] = bound;
            // Fewer columns of an independent set are independent.
            let Ok(next) = self.minimum_over_free() else { return };
            target = next;
        }
        for (j, target) in self.free.iter().zip(target) {
            self.x[*j] = target;
        }
    }

    /// The share of the way to the target at which the first free unknown meets a bound, its place, and the bound.
    fn first_bound_met(&self, target: &[f64]) -> Option<(f64, usize, f64)> {
        let met = self.free.iter().zip(target).enumerate().filter_map(|(place, (j, target))| {
            let (lower, upper) = self.bounds[*j];
            let bound = target.clamp(lower, upper);
            (bound != *target).then(|| ((bound - self.x[*j]) / (target - self.x[*j]), place, bound))
        });
        met.min_by(|p, q| p.0.total_cmp(&q.0))
    }

    fn minimum_over_free(&self) -> Result<Vec<f64>, usize> {
        let mut held = self.x.clone();
        for j in &self.free {
            held[*j] = 0.0;
        }
        self.sum.minimum_over(&self.free, &held)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    const NON_NEGATIVE: (f64, f64) = (0.0, f64::INFINITY);

    fn matrix(rows: usize, values: &[f64]) -> Mat<f64> {
        Mat::from_fn(rows, values.len() / rows, |i, j| values[j * rows + i])
    }

    /// The best of all ways to hold each unknown at one of its bounds or leave it free.
    fn brute_force(a: &Mat<f64>, b: &[f64], bounds: &[(f64, f64)]) -> f64 {
        let n = bounds.len();
        let mut best = f64::INFINITY;
        for code in 0..3_usize.pow(u32::try_from(n).unwrap()) {
            let sides: Vec<usize> = (0..n).map(|j| code / 3_usize.pow(u32::try_from(j).unwrap()) % 3).collect();
            if (0..n).any(|j| sides[j] == 2 && bounds[j].1.is_infinite()) {
                continue;
            }
            let problem = LeastSquares::new(a.as_ref(), b);
            let held = |j: usize| [0.0, bounds[j].0, bounds[j].1][sides[j]];
            let mut x: Vec<f64> = (0..n).map(held).collect();
            let free: Vec<usize> = (0..n).filter(|j| sides[*j] == 0).collect();
            let Ok(found) = problem.minimum_over(&free, &x) else { continue };
            for (j, found) in free.iter().zip(found) {
                x[*j] = found;
            }
            if (0..n).all(|j| x[j] >= bounds[j].0 && x[j] <= bounds[j].1) {
                best = best.min(problem.squares(&x));
            }
        }
        best
    }

    fn check_conditions(
        a: &Mat<f64>,
        b: &[f64],
        bounds: &[(f64, f64)],
        solution: &Solution,
    ) -> Result<(), TestCaseError> {
        let problem = LeastSquares::new(a.as_ref(), b);
        let gradient = problem.downhill(&solution.x);
        for (j, (lower, upper)) in bounds.iter().enumerate() {
            let (x, downhill) = (solution.x[j], gradient(j));
            let rounding = 1e-9 * problem.norms[j] * problem.b_norm;
            prop_assert!((*lower..=*upper).contains(&x), "x[{}] = {} outside", j, x);
            prop_assert!(x == *upper || downhill <= rounding, "x[{}] wants up: {}", j, downhill);
            prop_assert!(x == *lower || downhill >= -rounding, "x[{}] wants down: {}", j, downhill);
        }
        prop_assert!(solution.kkt_residual <= 1e-9, "{}", solution.kkt_residual);
        // What is called a residual is one: an answer that is not the best has it.
        let wrong: Vec<f64> = bounds.iter().map(|(lower, _)| lower.max(-1e3)).collect();
        let best = solution.squares >= problem.squares(&wrong) * (1.0 - 1e-9);
        prop_assert!(best || problem.kkt_residual(bounds, &wrong) > 1e-9);
        Ok(())
    }

    proptest! {
        #[test]
        fn non_negative_equals_brute_force(
            values in prop::collection::vec(-1.0..1.0_f64, 6 * 5),
            b in prop::collection::vec(-1.0..1.0_f64, 6),
            guess in prop::sample::subsequence(vec![0, 1, 2, 3, 4], 0..=5),
        ) {
            let (a, bounds) = (matrix(6, &values), [NON_NEGATIVE; 5]);
            let solution = solve(a.as_ref(), &b, &bounds, &guess);
            check_conditions(&a, &b, &bounds, &solution)?;
            prop_assert!(solution.squares <= brute_force(&a, &b, &bounds) * (1.0 + 1e-9) + 1e-20);
        }

        #[test]
        fn boxed_equals_brute_force(
            values in prop::collection::vec(-1.0..1.0_f64, 6 * 4),
            b in prop::collection::vec(-1.0..1.0_f64, 6),
            lower in prop::collection::vec(-0.5..0.0_f64, 4),
            width in prop::collection::vec(0.0..1.0_f64, 4),
            guess in prop::sample::subsequence(vec![0, 1, 2, 3], 0..=4),
        ) {
            let a = matrix(6, &values);
            let bounds: Vec<_> = lower.iter().zip(&width).map(|(l, w)| (*l, l + w)).collect();
            let solution = solve(a.as_ref(), &b, &bounds, &guess);
            check_conditions(&a, &b, &bounds, &solution)?;
            prop_assert!(solution.squares <= brute_force(&a, &b, &bounds) * (1.0 + 1e-9) + 1e-20);
        }

        /// Unknowns of any sign beside others.
        #[test]
        fn free_equals_brute_force(
            values in prop::collection::vec(-1.0..1.0_f64, 6 * 4),
            b in prop::collection::vec(-1.0..1.0_f64, 6),
            guess in prop::sample::subsequence(vec![0, 1, 2, 3], 0..=4),
        ) {
            let a = matrix(6, &values);
            let free = (f64::NEG_INFINITY, f64::INFINITY);
            let bounds = [NON_NEGATIVE, free, NON_NEGATIVE, free];
            let solution = solve(a.as_ref(), &b, &bounds, &guess);
            check_conditions(&a, &b, &bounds, &solution)?;
            // Of two signs the same column has, one is that of the free unknown.
            let both = Mat::from_fn(6, 6, |i, j| if j < 4 { a[(i, j)] } else { -a[(i, 2 * j - 7)] });
            let best = brute_force(&both, &b, &[NON_NEGATIVE; 6]);
            prop_assert!(solution.squares <= best * (1.0 + 1e-9) + 1e-20);
        }

        /// Columns that repeat or vanish, as those of plays that never move do.
        #[test]
        fn dependent_columns(
            values in prop::collection::vec(-1.0..1.0_f64, 5 * 3),
            b in prop::collection::vec(-1.0..1.0_f64, 5),
            guess in prop::sample::subsequence((0..7).collect::<Vec<_>>(), 0..=7),
        ) {
            let few = matrix(5, &values);
            let a = Mat::from_fn(5, 7, |i, j| if j < 6 { few[(i, j % 3)] } else { 0.0 });
            let solution = solve(a.as_ref(), &b, &[NON_NEGATIVE; 7], &guess);
            check_conditions(&a, &b, &[NON_NEGATIVE; 7], &solution)?;
            let best = brute_force(&few, &b, &[NON_NEGATIVE; 3]);
            prop_assert!((solution.squares - best).abs() <= 1e-9 * best + 1e-20);
        }
    }
}
