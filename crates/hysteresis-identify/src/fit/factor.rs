//! The triangular factor of a matrix that is never held: its rows stream in, blocks of them are folded by QR.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut, MatRef, Par, Spec};

/// Rows folded at a time: enough that the triangle on top of them costs little, few enough for the cache.
const BLOCK_ROWS: usize = 512;

/// Upper-triangular R with R'R = A'A, for A of any number of rows, by Householder reflections.
///
/// Unlike the Gram matrix A'A it loses no digits to squaring: the last diagonal element of the factor of \[A | y\] is
/// the exact norm of the residual of y.
pub(crate) struct TriangularFactor {
    /// The factor of all folded rows on top, fresh rows below.
    block: Mat<f64>,
    fresh: usize,
    workspace: Workspace,
}

impl TriangularFactor {
    pub(crate) fn new(columns: usize) -> Self {
        let rows = columns + BLOCK_ROWS;
        Self { block: Mat::zeros(rows, columns), fresh: 0, workspace: Workspace::new(rows, columns) }
    }

    /// Appends one row of A.
    pub(crate) fn push(&mut self, row: &[f64]) {
        let columns = self.block.ncols();
        debug_assert_eq!(row.len(), columns);
        let place = self.block.as_mut().row_mut(columns + self.fresh);
        place.iter_mut().zip(row).for_each(|(place, value)| *place = *value);
        self.fresh += 1;
        if self.fresh == BLOCK_ROWS {
            self.fold();
        }
    }

    /// R of all rows so far; rows of zeros where A had fewer rows than columns.
    pub(crate) fn finish(mut self) -> Mat<f64> {
        if self.fresh > 0 {
            self.fold();
        }
        let columns = self.block.ncols();
        self.block.get(..columns, ..).to_owned()
    }

    fn fold(&mut self) {
        // Rows that are not fresh are zero: every fold leaves zeros below its triangle.
        let rows = self.block.ncols() + self.fresh;
        self.workspace.triangularise(self.block.get_mut(..rows, ..));
        self.fresh = 0;
    }
}

/// The factor of a small matrix, all of it at hand.
pub(crate) fn triangle_of(mut matrix: Mat<f64>) -> Mat<f64> {
    Workspace::new(matrix.nrows(), matrix.ncols()).triangularise(matrix.as_mut());
    matrix
}

/// Solves R x = b for the upper triangle of the square `r` in place of b.
pub(crate) fn back_substitute(r: MatRef<'_, f64>, b: &mut [f64]) {
    for i in (0..b.len()).rev() {
        let tail: f64 = (i + 1..b.len()).map(|j| r[(i, j)] * b[j]).sum();
        b[i] = (b[i] - tail) / r[(i, i)];
    }
}

/// What faer needs besides the matrix, kept between blocks.
struct Workspace {
    coefficients: Mat<f64>,
    memory: MemBuffer,
}

impl Workspace {
    fn new(rows: usize, columns: usize) -> Self {
        let width = factor::recommended_block_size::<f64>(rows, columns);
        let scratch = factor::qr_in_place_scratch::<f64>(rows, columns, width, Par::Seq, Spec::default());
        Self { coefficients: Mat::zeros(width, rows.min(columns)), memory: MemBuffer::new(scratch) }
    }

    /// Overwrites the matrix by its factor, with zeros below the diagonal.
    fn triangularise(&mut self, mut matrix: MatMut<'_, f64>) {
        factor::qr_in_place(
            matrix.rb_mut(),
            self.coefficients.as_mut(),
            Par::Seq, // the same bits on every run
            MemStack::new(&mut self.memory),
            Spec::default(),
        );
        let rows = matrix.nrows();
        for (j, column) in matrix.col_iter_mut().enumerate() {
            column.subrows_mut(j + 1, rows - j - 1).fill(0.0);
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(32))]

        /// Folded block by block or factored at once: the same triangle up to the signs of its rows.
        #[test]
        fn streaming_equals_one_shot(
            (rows, columns) in (1..3 * BLOCK_ROWS, 1..7_usize),
            seed in prop::collection::vec(-1.0..1.0_f64, 97),
        ) {
            let a = Mat::from_fn(rows.max(columns), columns, |i, j| {
                if i < rows { seed[(i * columns + j) % 97] + seed[(i * i + 7 * j) % 89] } else { 0.0 }
            });
            let mut factor = TriangularFactor::new(columns);
            for i in 0..rows {
                factor.push(&(0..columns).map(|j| a[(i, j)]).collect::<Vec<_>>());
            }
            let (streamed, at_once) = (factor.finish(), triangle_of(a.clone()));
            let gram = a.transpose() * &a;
            let difference = streamed.transpose() * &streamed - &gram;
            prop_assert!(difference.norm_max() <= 1e-13 * gram.norm_max().max(1.0) * 100.0);
            if rows > 10 * columns {
                for j in 0..columns {
                    for i in 0..columns {
                        prop_assert!((streamed[(i, j)].abs() - at_once[(i, j)].abs()).abs() < 1e-10 * gram.norm_max().sqrt());
                    }
                }
            }
            for j in 0..columns {
                for i in j + 1..columns {
                    prop_assert_eq!(streamed[(i, j)], 0.0);
                }
            }
        }
    }

    #[test]
    fn back_substitution_by_hand() {
        let r = faer::mat![[2.0, 1.0], [9.0, 4.0]]; // the 9 lies below the diagonal and must not matter
        let mut b = [4.0, 8.0];
        back_substitute(r.as_ref(), &mut b);
        assert_eq!(b, [1.0, 2.0]);
    }
}
