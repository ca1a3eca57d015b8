//! The normal equations of one pass about a residual: small, fast, and as exact as a QR where they are used.
//!
//! Squaring a matrix loses half of the digits of what is solved for. Here that is a correction: the residual of the last
//! weights is computed sample by sample, so the digits lost are those of a small step and not those of the fit.

use faer::linalg::matmul::matmul;
use faer::{Accum, Mat, MatRef, Par};

use super::boxed;
use crate::fit::weight_basis::WeightBasis;
use crate::numeric::as_f64;

/// Rows multiplied at a time: few enough for the cache.
const BLOCK_ROWS: usize = 128;

/// A column whose square varies by less than this share of its size is constant.
const MIN_VARYING_SHARE: f64 = 1e-14;

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

    /// Appends a row.
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
pub(super) struct Normal {
    columns: usize,
    /// Of the columns, and of the residual.
    means: Vec<f64>,
    /// X'X of \[columns | residual\], about their means.
    gram: Mat<f64>,
    pub(super) rows: usize,
}

impl Normal {
    pub(super) fn new(gram: Mat<f64>, means: Vec<f64>, rows: usize) -> Self {
        Self { columns: means.len() - 1, means, gram, rows }
    }

    /// The best step of the first columns, one for each of the bounds, and the sum of squares that it leaves; `free` as for
    /// [`boxed::solve`].
    pub(super) fn solve(&self, bounds: &[(f64, f64)], free: &[usize]) -> (Vec<f64>, f64) {
        boxed::solve(&self.gram, bounds, free)
    }

    /// What the output offset grows by with a step.
    pub(super) fn offset(&self, step: &[f64]) -> f64 {
        self.means[self.columns] - step.iter().zip(&self.means).map(|(d, mean)| d * mean).sum::<f64>()
    }

    /// The standard error of the parameter of a column, for errors of deviation 1, with those of `others` estimated too; not a
    /// number if it is not told beside them.
    pub(super) fn error_of(&self, column: usize, others: &[usize]) -> f64 {
        let mut places = others.to_vec();
        loop {
            let all: Vec<usize> = places.iter().copied().chain([column]).collect();
            match boxed::factor(all.len(), |i, j| self.gram[(all[i], all[j])]) {
                Ok(r) => return 1.0 / r[r.len() - 1],
                Err(place) if place < places.len() => places.remove(place),
                Err(_) => return f64::NAN,
            };
        }
    }
}
