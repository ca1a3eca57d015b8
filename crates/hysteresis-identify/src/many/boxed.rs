//! Least squares with bounds, from the normal equations.
//!
//! The active-set method of [`bounded`](crate::fit::bounded) with a Cholesky factor of X'X in place of a QR of X: several times as
//! fast for a few dozen unknowns, and exact enough for a correction.

use faer::Mat;

/// A column of which, squared, less than this share is left beside those before it depends on them.
const MIN_INDEPENDENT_SHARE: f64 = 1e-13;

/// A gradient below this share of |x_j| |e| is rounding.
const GRADIENT_TOLERANCE: f64 = 1e-12;

/// The minimiser of |X d - e|^2 over lower <= d <= upper, and that minimum; of `gram`, X'X of \[X | e\], the first `bounds.len()`
/// columns and the last one count. Lower bounds are finite, zero lies within all bounds, and `free` names the unknowns that are
/// expected between theirs.
pub(super) fn solve(gram: &Mat<f64>, bounds: &[(f64, f64)], free: &[usize]) -> (Vec<f64>, f64) {
    let mut problem = ActiveSet { gram, bounds, d: bounds.iter().map(|(lower, _)| *lower).collect(), free: Vec::new() };
    problem.start(free);
    // Every round lowers the sum of squares; the limit only guards against rounding.
    for _ in 0..10 * (bounds.len() + 1) {
        if !problem.improve() {
            break;
        }
    }
    let squares = problem.squares();
    (problem.d, squares)
}

/// Solves R'R x = b for the factor of a positive definite matrix in place of b, or says which column depends on those before it.
pub(super) fn factor(size: usize, entry: impl Fn(usize, usize) -> f64) -> Result<Vec<f64>, usize> {
    let mut r = vec![0.0; size * size];
    for j in 0..size {
        // Column j of R lies in row j of this array.
        let (before, column) = r.split_at_mut(j * size);
        for i in 0..j {
            let other = &before[i * size..=i * size + i];
            let above: f64 = other[..i].iter().zip(&column[..i]).map(|(p, q)| p * q).sum();
            column[i] = (entry(i, j) - above) / other[i];
        }
        let whole = entry(j, j);
        let left = whole - column[..j].iter().map(|value| value * value).sum::<f64>();
        if left.is_nan() || left <= MIN_INDEPENDENT_SHARE * whole {
            return Err(j);
        }
        column[j] = left.sqrt();
    }
    Ok(r)
}

fn substitute(r: &[f64], x: &mut [f64]) {
    let size = x.len();
    for j in 0..size {
        let above: f64 = r[j * size..j * size + j].iter().zip(&x[..j]).map(|(p, q)| p * q).sum();
        x[j] = (x[j] - above) / r[j * size + j];
    }
    for j in (0..size).rev() {
        x[j] /= r[j * size + j];
        let value = x[j];
        for (x, r) in x[..j].iter_mut().zip(&r[j * size..j * size + j]) {
            *x -= r * value;
        }
    }
}

struct ActiveSet<'a> {
    gram: &'a Mat<f64>,
    bounds: &'a [(f64, f64)],
    d: Vec<f64>,
    /// The unknowns between their bounds, in the order of their release.
    free: Vec<usize>,
}

impl ActiveSet<'_> {
    fn residual(&self) -> usize {
        self.gram.ncols() - 1
    }

    /// X'(e - X d), column by column.
    fn downhill(&self, j: usize, d: &[f64]) -> f64 {
        let column = self.gram.col(j);
        column[self.residual()] - d.iter().enumerate().map(|(i, d)| column[i] * d).sum::<f64>()
    }

    fn squares(&self) -> f64 {
        let last = self.residual();
        let taken: f64 =
            self.d.iter().enumerate().map(|(j, d)| d * (self.gram[(j, last)] + self.downhill(j, &self.d))).sum();
        (self.gram[(last, last)] - taken).max(0.0)
    }

    /// Frees the guessed unknowns, and binds again those that depend on others or would leave their bounds.
    fn start(&mut self, guess: &[usize]) {
        self.free = guess.to_vec();
        loop {
            match self.minimum_over_free() {
                Err(place) => {
                    self.free.remove(place);
                }
                Ok(target) => {
                    let before = self.free.len();
                    for (j, d) in std::mem::take(&mut self.free).into_iter().zip(target) {
                        let (lower, upper) = self.bounds[j];
                        self.d[j] = d.clamp(lower, upper);
                        if self.d[j] == d {
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
        let last = self.residual();
        let size = self.gram[(last, last)].sqrt();
        let mut candidates: Vec<(f64, f64, usize)> = Vec::new();
        for j in (0..self.d.len()).filter(|j| !self.free.contains(j)) {
            let (downhill, norm) = (self.downhill(j, &self.d), self.gram[(j, j)].sqrt());
            let (lower, upper) = self.bounds[j];
            let admissible = if downhill > 0.0 { self.d[j] < upper } else { self.d[j] > lower };
            if admissible && downhill.abs() > GRADIENT_TOLERANCE * norm * size {
                candidates.push((downhill.abs() / norm, downhill, j));
            }
        }
        candidates.sort_by(|(p, ..), (q, ..)| q.total_cmp(p));
        for (_, downhill, j) in candidates {
            self.free.push(j);
            // Rounding alone made the gradient if the column depends on free ones, or if the unknown would at once move out of
            // its domain: Lawson and Hanson's guard against cycling.
            match self.minimum_over_free() {
                Ok(target) if (target[target.len() - 1] - self.d[j]) * downhill > 0.0 => {
                    self.descend(target);
                    return true;
                }
                _ => self.free.pop(),
            };
        }
        false
    }

    /// Moves towards the minimum over the free unknowns, binding what meets its bound on the way.
    fn descend(&mut self, mut target: Vec<f64>) {
        while let Some((step, place, bound)) = self.first_bound_met(&target) {
            for (j, target) in self.free.iter().zip(&target) {
                let (lower, upper) = self.bounds[*j];
                self.d[*j] = (self.d[*j] + step * (target - self.d[*j])).clamp(lower, upper);
            }
            self.d[self.free.remove(place)] = bound;
            // Fewer columns of an independent set are independent.
            let Ok(next) = self.minimum_over_free() else { return };
            target = next;
        }
        for (j, target) in self.free.iter().zip(target) {
            self.d[*j] = target;
        }
    }

    /// The share of the way to the target at which the first free unknown meets a bound, its place, and the bound.
    fn first_bound_met(&self, target: &[f64]) -> Option<(f64, usize, f64)> {
        let met = self.free.iter().zip(target).enumerate().filter_map(|(place, (j, target))| {
            let (lower, upper) = self.bounds[*j];
            let bound = target.clamp(lower, upper);
            (bound != *target).then(|| ((bound - self.d[*j]) / (target - self.d[*j]), place, bound))
        });
        met.min_by(|p, q| p.0.total_cmp(&q.0))
    }

    /// The values of the free unknowns at the minimum with the bound ones held, or the place of the first free one whose column
    /// depends on those before it.
    fn minimum_over_free(&self) -> Result<Vec<f64>, usize> {
        let free = &self.free;
        let r = factor(free.len(), |i, j| self.gram[(free[i], free[j])])?;
        let mut held = self.d.clone();
        for j in free {
            held[*j] = 0.0;
        }
        let mut x: Vec<f64> = free.iter().map(|j| self.downhill(*j, &held)).collect();
        substitute(&r, &mut x);
        Ok(x)
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::fit::bounded;

    proptest! {
        /// The same minimum as by QR, with columns that repeat or vanish too.
        #[test]
        fn equals_the_solution_by_qr(
            values in prop::collection::vec(-1.0..1.0_f64, 8 * 5),
            e in prop::collection::vec(-1.0..1.0_f64, 8),
            lower in prop::collection::vec(-0.5..0.0_f64, 7),
            upper in prop::collection::vec(prop_oneof![0.0..0.5_f64, Just(f64::INFINITY)], 7),
            guess in prop::sample::subsequence((0..7).collect::<Vec<_>>(), 0..=7),
        ) {
            let x = Mat::from_fn(8, 8, |i, j| match j {
                7 => e[i],
                6 => 0.0,
                5 => values[i],
                _ => values[8 * j + i],
            });
            let bounds: Vec<_> = lower.into_iter().zip(upper).collect();
            let gram = x.transpose() * &x;
            let (d, squares) = solve(&gram, &bounds, &guess);
            let exact = bounded::solve(x.get(.., ..7), &e, &bounds, &[]);
            prop_assert!((squares - exact.squares).abs() < 1e-9, "{} {}", squares, exact.squares);
            prop_assert!(d.iter().zip(&bounds).all(|(d, (lower, upper))| (*lower..=*upper).contains(d)));
        }
    }
}
