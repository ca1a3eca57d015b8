//! The normal equations of one pass about a residual: small, fast, and as exact as a QR where they are used.
//!
//! Squaring a matrix loses half of the digits of what is solved for. Here that is a correction: the residual of the
//! last weights is computed sample by sample, so the digits lost are those of a small step and not those of the fit.
//!
//! Bounded least squares by a Cholesky factor of X'X are several times as fast as by a QR of X for a few dozen
//! unknowns, and exact enough for a correction.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use crate::algebra::bounded::{SumOfSquares, minimise};
use crate::records::signal::as_f64;
use crate::terms::weights::WeightBasis;

/// Rows multiplied at a time: few enough for the cache.
const BLOCK_ROWS: usize = 128;

/// A column whose square varies by less than this share of its size is constant.
const MIN_VARYING_SHARE: f64 = 1e-14;

/// X'X.
pub(crate) struct Gram {
    sums: Mat<f64>,
    rows: usize,
}

impl Gram {
    /// Of so many rows; `write` fills a block of them, one row after the other, from a row on.
    pub(crate) fn of(rows: usize, columns: usize, mut write: impl FnMut(usize, &mut [f64])) -> Self {
        let mut sums = Mat::zeros(columns, columns);
        let mut block = vec![0.0; BLOCK_ROWS * columns];
        for first in (0..rows).step_by(BLOCK_ROWS) {
            let count = BLOCK_ROWS.min(rows - first);
            let block = &mut block[..count * columns];
            write(first, block);
            let block = MatRef::from_row_major_slice(block, count, columns);
            // One after the other: the same bits on every run.
            matmul(&mut sums, Accum::Add, block.transpose(), block, 1.0, Par::Seq);
        }
        Self { sums, rows }
    }

    /// The problem of rows \[1 | columns of the weights | derivatives | residual\].
    pub(crate) fn finish(self, basis: &WeightBasis, penalty: &Mat<f64>, unknowns: &[f64]) -> Normal {
        let half = basis.in_unknowns(self.sums.as_ref(), 1);
        let gram = basis.in_unknowns(half.transpose(), 1);
        let rows = as_f64(self.rows);
        let columns = gram.nrows() - 2;
        let means: Vec<f64> = (0..=columns).map(|j| gram[(0, 1 + j)] / rows).collect();
        let centred = |i: usize, j: usize| {
            let value = gram[(1 + i, 1 + j)] - rows * means[i] * means[j];
            if i == j && value <= MIN_VARYING_SHARE * gram[(1 + i, 1 + j)] { 0.0 } else { value }
        };
        let mut all = Mat::from_fn(columns + 1, columns + 1, centred);
        add_penalty(&mut all, penalty, unknowns);
        Normal::new(all, means, self.rows)
    }
}

/// Adds the rows of a penalty, of which the unknowns leave a residual.
fn add_penalty(gram: &mut Mat<f64>, penalty: &Mat<f64>, unknowns: &[f64]) {
    let last = gram.nrows() - 1;
    for row in 0..penalty.nrows() {
        let left: f64 = -unknowns.iter().enumerate().map(|(j, c)| penalty[(row, j)] * c).sum::<f64>();
        let value = |j: usize| if j == last { left } else { penalty[(row, j)] };
        let places: Vec<usize> = (0..penalty.ncols()).chain([last]).collect();
        for i in &places {
            for j in &places {
                gram[(*i, *j)] += value(*i) * value(*j);
            }
        }
    }
}

/// min |X d - e| over steps d of the unknowns and then of the searched parameters; the output offset is eliminated.
pub(crate) struct Normal {
    columns: usize,
    /// Of the columns, and of the residual.
    means: Vec<f64>,
    /// X'X of \[columns | residual\], about their means.
    gram: Mat<f64>,
    pub(crate) rows: usize,
}

impl Normal {
    pub(crate) fn new(gram: Mat<f64>, means: Vec<f64>, rows: usize) -> Self {
        Self { columns: means.len() - 1, means, gram, rows }
    }

    /// The best step of the first columns, one for each of the bounds, and the sum of squares that it leaves; `free` as
    /// for [`solve`].
    pub(crate) fn solve(&self, bounds: &[(f64, f64)], free: &[usize]) -> (Vec<f64>, f64) {
        solve(&self.gram, bounds, free)
    }

    /// What the output offset grows by with a step.
    pub(crate) fn offset(&self, step: &[f64]) -> f64 {
        self.means[self.columns] - step.iter().zip(&self.means).map(|(d, mean)| d * mean).sum::<f64>()
    }

    /// The standard error of the parameter of a column, for errors of deviation 1, with those of `others` estimated
    /// too; not a number if it is not told beside them.
    pub(crate) fn error_of(&self, column: usize, others: &[usize]) -> f64 {
        let mut places = others.to_vec();
        loop {
            let all: Vec<usize> = places.iter().copied().chain([column]).collect();
            match factor(all.len(), |i, j| self.gram[(all[i], all[j])]) {
                Ok(r) => return 1.0 / r[r.len() - 1],
                Err(place) if place < places.len() => places.remove(place),
                Err(_) => return f64::NAN,
            };
        }
    }
}

/// A column of which, squared, less than this share is left beside those before it depends on them.
const MIN_INDEPENDENT_SHARE: f64 = 1e-13;

/// The minimiser of |X d - e|^2 over lower <= d <= upper, and that minimum; of `gram`, X'X of \[X | e\], the first
/// `bounds.len()` columns and the last one count. Lower bounds are finite, zero lies within all bounds, and `free`
/// names the unknowns that are expected between theirs.
pub(crate) fn solve(gram: &Mat<f64>, bounds: &[(f64, f64)], free: &[usize]) -> (Vec<f64>, f64) {
    let problem = NormalEquations { gram };
    let d = minimise(&problem, bounds, bounds.iter().map(|(lower, _)| *lower).collect(), free);
    let squares = problem.squares(&d);
    (d, squares)
}

/// Solves R'R x = b for the factor of a positive definite matrix in place of b, or says which column depends on those
/// before it.
pub(crate) fn factor(size: usize, entry: impl Fn(usize, usize) -> f64) -> Result<Vec<f64>, usize> {
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

    use crate::algebra::bounded;

    use super::*;

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
