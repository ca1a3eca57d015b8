//! The normal equations of one pass about a residual: small, fast, and as exact as a QR where they are used.
//!
//! Squaring a matrix loses half of the digits of what is solved for. Here that is a correction: the residual of the last
//! weights is computed sample by sample, so the digits lost are those of a small step and not those of the fit.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use crate::fit::factor::triangle_of;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;

/// Rows multiplied at a time: few enough for the cache.
const BLOCK_ROWS: usize = 128;

/// A column whose square varies by less than this share of its size is constant.
const MIN_VARYING_SHARE: f64 = 1e-14;

/// A column of which, squared, less than this share is left beside those before it depends on them.
const MIN_INDEPENDENT_SHARE: f64 = 1e-13;

/// X'X of rows that stream in.
pub(super) struct Gram {
    /// Fresh rows, one after the other.
    block: Vec<f64>,
    columns: usize,
    sums: Mat<f64>,
    rows: usize,
}

impl Gram {
    pub(super) fn new(columns: usize) -> Self {
        let block = Vec::with_capacity(BLOCK_ROWS * columns);
        Self { block, columns, sums: Mat::zeros(columns, columns), rows: 0 }
    }

    pub(super) fn push(&mut self, row: &[f64]) {
        self.block.extend_from_slice(row);
        if self.block.len() == BLOCK_ROWS * self.columns {
            self.fold();
        }
    }

    fn fold(&mut self) {
        let rows = self.block.len() / self.columns;
        let block = MatRef::from_row_major_slice(&self.block, rows, self.columns);
        // One after the other: the same bits on every run.
        matmul(&mut self.sums, Accum::Add, block.transpose(), block, 1.0, Par::Seq);
        self.rows += rows;
        self.block.clear();
    }

    /// The problem of rows \[1 | columns of the weights | derivatives | residual\].
    pub(super) fn finish(mut self, basis: &WeightBasis, penalty: &Mat<f64>, unknowns: &[f64]) -> Normal {
        self.fold();
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
        Normal::new(&all, means, self.rows)
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

/// The upper triangle R with R'R = G for a positive semidefinite G; a column that depends on those before it has zero on the
/// diagonal.
fn root(gram: &Mat<f64>) -> Mat<f64> {
    let n = gram.nrows();
    let mut r = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        for i in 0..j {
            let above: f64 = (0..i).map(|k| r[(k, i)] * r[(k, j)]).sum();
            r[(i, j)] = if r[(i, i)] > 0.0 { (gram[(i, j)] - above) / r[(i, i)] } else { 0.0 };
        }
        let left = gram[(j, j)] - (0..j).map(|k| r[(k, j)] * r[(k, j)]).sum::<f64>();
        // The last column is the residual: whatever is left of it is left.
        let least = if j + 1 < n { MIN_INDEPENDENT_SHARE * gram[(j, j)] } else { 0.0 };
        r[(j, j)] = if left > least { left.sqrt() } else { 0.0 };
    }
    r
}

/// min |X d - e| over steps d of the unknowns and then of the searched parameters, as a triangle; the output offset is
/// eliminated.
pub(super) struct Normal {
    columns: usize,
    /// Of the columns, and of the residual.
    means: Vec<f64>,
    /// R of \[columns | residual\].
    triangle: Mat<f64>,
    pub(super) rows: usize,
}

impl Normal {
    /// From X'X of \[columns | residual\] about their means.
    pub(super) fn new(gram: &Mat<f64>, means: Vec<f64>, rows: usize) -> Self {
        Self { columns: means.len() - 1, means, triangle: root(gram), rows }
    }

    /// The triangle of the first `count` columns, with the right-hand side, and what no step of these takes away.
    pub(super) fn first(&self, count: usize) -> (Mat<f64>, Vec<f64>, f64) {
        let target = |i: usize| self.triangle[(i, self.columns)];
        let rest = (count..=self.columns).map(|i| target(i) * target(i)).sum();
        (self.triangle.get(..count, ..count).to_owned(), (0..count).map(target).collect(), rest)
    }

    /// How many columns there are.
    pub(super) fn columns(&self) -> usize {
        self.columns
    }

    /// What the output offset grows by with a step.
    pub(super) fn offset(&self, step: &[f64]) -> f64 {
        self.means[self.columns] - step.iter().zip(&self.means).map(|(d, mean)| d * mean).sum::<f64>()
    }

    /// The standard error of the parameter of a column, for errors of deviation 1, with those of `others` estimated too; not a
    /// number if it is not told beside them.
    pub(super) fn error_of(&self, column: usize, others: &[usize]) -> f64 {
        /// A column whose part beside the others is below this share of its norm tells nothing.
        const LEAST: f64 = 1e-7;
        let places: Vec<usize> = others.iter().copied().chain([column]).collect();
        let size = places.len();
        let r = triangle_of(Mat::from_fn(self.columns.max(size), size, |i, j| {
            if i < self.columns { self.triangle[(i, places[j])] } else { 0.0 }
        }));
        let (alone, whole) = (r[(size - 1, size - 1)].abs(), self.triangle.col(column).norm_l2());
        if alone > LEAST * whole { 1.0 / alone } else { f64::NAN }
    }
}
