//! Least squares with bounds, from the normal equations.
//!
//! As [`bounded`](crate::fit::bounded), with a Cholesky factor of X'X in place of a QR of X: several times as
//! fast for a few dozen unknowns, and exact enough for a correction.

use faer::Mat;

use crate::fit::active_set::{SumOfSquares, minimise};

/// A column of which, squared, less than this share is left beside those before it depends on them.
const MIN_INDEPENDENT_SHARE: f64 = 1e-13;

/// The minimiser of |X d - e|^2 over lower <= d <= upper, and that minimum; of `gram`, X'X of \[X | e\], the first `bounds.len()`
/// columns and the last one count. Lower bounds are finite, zero lies within all bounds, and `free` names the unknowns that are
/// expected between theirs.
pub(super) fn solve(gram: &Mat<f64>, bounds: &[(f64, f64)], free: &[usize]) -> (Vec<f64>, f64) {
    let problem = NormalEquations { gram };
    let d = minimise(&problem, bounds, bounds.iter().map(|(lower, _)| *lower).collect(), free);
    let squares = problem.squares(&d);
    (d, squares)
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

struct NormalEquations<'a> {
    gram: &'a Mat<f64>,
}

impl NormalEquations<'_> {
    fn residual(&self) -> usize {
        self.gram.ncols() - 1
    }

    fn squares(&self, d: &[f64]) -> f64 {
        let (last, gradient) = (self.residual(), self.downhill(d));
        let taken: f64 = d.iter().enumerate().map(|(j, d)| d * (self.gram[(j, last)] + gradient(j))).sum();
        (self.gram[(last, last)] - taken).max(0.0)
    }
}

impl SumOfSquares for NormalEquations<'_> {
    const GRADIENT_TOLERANCE: f64 = 1e-12;

    fn column_norm(&self, j: usize) -> f64 {
        self.gram[(j, j)].sqrt()
    }

    fn size(&self) -> f64 {
        let last = self.residual();
        self.gram[(last, last)].sqrt()
    }

    fn downhill(&self, d: &[f64]) -> impl Fn(usize) -> f64 {
        move |j| {
            let column = self.gram.col(j);
            column[self.residual()] - d.iter().enumerate().map(|(i, d)| column[i] * d).sum::<f64>()
        }
    }

    fn minimum_over(&self, free: &[usize], held: &[f64]) -> Result<Vec<f64>, usize> {
        let r = factor(free.len(), |i, j| self.gram[(free[i], free[j])])?;
        let gradient = self.downhill(held);
        let mut x: Vec<f64> = free.iter().map(|j| gradient(*j)).collect();
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
