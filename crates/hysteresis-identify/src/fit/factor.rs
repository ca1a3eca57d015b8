//! The triangular factor of a matrix that is never held: its rows stream in, blocks of them are folded by QR.

mod echelon;
mod fold;

pub(crate) use echelon::{DEPENDS, Echelon, echelon_of, make_echelon};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut, MatRef, Par, Spec};
use fold::Fold;

use super::eight::{LANES, Lanes, dispatch};

/// Rows folded at a time: enough that the work on the triangle costs little, few enough for the cache.
const BLOCK_ROWS: usize = 128;

/// A column of no larger values has squares that lose digits; times this power of two, 2^600, it has not.
const TINY: f64 = 1e-120;
const UP: f64 = f64::from_bits((1023 + 600) << 52);

/// Upper-triangular R with R'R = A'A, for A of any number of rows, by Householder reflections.
///
/// Unlike the Gram matrix A'A it loses no digits to squaring: the last diagonal element of the factor of \[A | y\] is
/// the exact norm of the residual of y, if no column of A depends on those before it. See [`Echelon`] where one may.
pub(crate) struct TriangularFactor {
    columns: usize,
    /// The factor of all folded rows, row by row.
    triangle: Vec<Lanes>,
    /// Rows that are not folded yet: the first eight columns of all, then the next.
    block: Vec<Lanes>,
    fresh: usize,
    /// By what columns are multiplied whose squares would be too small: powers of two, which round nothing. None until rows were folded.
    scales: Option<Vec<f64>>,
}

impl TriangularFactor {
    pub(crate) fn new(columns: usize) -> Self {
        let eights = columns.div_ceil(LANES);
        let (triangle, block) = (vec![[0.0; LANES]; columns * eights], vec![[0.0; LANES]; BLOCK_ROWS * eights]);
        Self { columns, triangle, block, fresh: 0, scales: None }
    }

    /// Appends one row of A.
    pub(crate) fn push(&mut self, row: &[f64]) {
        debug_assert_eq!(row.len(), self.columns);
        let (eights, rest) = row.as_chunks::<LANES>();
        let mut blocks = self.block.chunks_exact_mut(BLOCK_ROWS);
        for (eight, block) in eights.iter().zip(&mut blocks) {
            block[self.fresh] = *eight;
        }
        if let Some(block) = blocks.next() {
            block[self.fresh].iter_mut().zip(rest).for_each(|(place, value)| *place = *value);
        }
        self.fresh += 1;
        if self.fresh == BLOCK_ROWS {
            self.fold();
        }
    }

    /// R of all rows so far; rows of zeros where A had fewer rows than columns. It is in [echelon form](Echelon): a column that depends on
    /// those before it takes no row, and all that stand behind it begin one row further up.
    pub(crate) fn finish(mut self) -> Mat<f64> {
        self.fold();
        let eights = self.columns.div_ceil(LANES);
        let mut triangle = Mat::from_fn(self.columns, self.columns, |i, j| {
            let scale = self.scales.as_ref().and_then(|scales| scales.get(j)).copied().unwrap_or(1.0);
            if i <= j { self.triangle[i * eights + j / LANES][j % LANES] / scale } else { 0.0 }
        });
        make_echelon(&mut triangle, self.columns);
        triangle
    }

    /// Scales the fresh rows: by what the first ones need, or by nothing once a column is as large as others.
    fn scale(&mut self) {
        let Self { columns, triangle, block, fresh, scales, .. } = self;
        if scales.as_ref().is_some_and(Vec::is_empty) {
            return;
        }
        let eights = columns.div_ceil(LANES);
        let mut next = vec![1.0; *columns];
        for (j, scale) in next.iter_mut().enumerate() {
            let rows = &mut block[j / LANES * BLOCK_ROWS..][..*fresh];
            let largest = rows.iter().fold(0.0, |largest, row| f64::max(largest, row[j % LANES].abs()));
            let before = scales.as_ref().map_or(1.0, |scales| scales[j]);
            *scale = match scales {
                Some(_) if largest <= TINY => before,
                None if largest > 0.0 && largest <= TINY => UP,
                _ => 1.0,
            };
            for row in rows {
                row[j % LANES] *= *scale;
            }
            for row in triangle.chunks_exact_mut(eights) {
                row[j / LANES][j % LANES] *= *scale / before;
            }
        }
        let is_scaled = next.iter().any(|scale| *scale != 1.0);
        *scales = Some(if is_scaled { next } else { Vec::new() });
    }

    fn fold(&mut self) {
        self.scale();
        let Self { columns, triangle, block, fresh, .. } = self;
        dispatch(Fold { columns: *columns, triangle, fresh: block, capacity: BLOCK_ROWS, rows: *fresh });
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

    /// What rounding leaves of a dependent column is no direction to turn rows by: the others keep their products, and such a column takes
    /// no row. One that is no number leaves the others alone.
    #[test]
    fn a_dependent_column_takes_no_row() {
        let columns = 21;
        let noise = |i: usize, j: usize| {
            crate::numeric::as_f64((i * 7919 + j * j * 104_729 + i * j * 31) % 1009) / 1009.0 - 0.5
        };
        let row = |i: usize| -> Vec<f64> {
            let mut row: Vec<f64> = (0..columns).map(|j| noise(i, j)).collect();
            (row[5], row[12], row[17]) = (row[1] - 2.0 * row[3], 0.3 * row[1] + row[8], 0.0);
            row
        };
        let factor = |broken: Option<(usize, f64)>| {
            let mut factor = TriangularFactor::new(columns);
            for i in 0..20 * BLOCK_ROWS + 7 {
                let mut row = row(i);
                if let Some((column, value)) = broken {
                    row[column] = value;
                }
                factor.push(&row);
            }
            factor.finish()
        };
        let r = factor(None);
        // The first and other columns of the eights.
        let broken = [0, 8, 16, 17, 20].map(|column| (column, factor(Some((column, f64::NAN)))));
        let rows: Vec<_> = (0..20 * BLOCK_ROWS + 7).map(row).collect();
        for j in 0..columns {
            for k in 0..=j {
                let product: f64 = rows.iter().map(|row| row[j] * row[k]).sum();
                let of = |r: &Mat<f64>| (0..=k).map(|i| r[(i, j)] * r[(i, k)]).sum::<f64>();
                assert!((of(&r) - product).abs() < 1e-10, "{j} {k}: {} {product}", of(&r));
                for (column, r) in broken.iter().filter(|(column, _)| j != *column && k != *column) {
                    assert!((of(r) - product).abs() < 1e-10, "{column} broken, {j} {k}: {}", of(r));
                }
            }
        }
        assert!((columns - 3..columns).all(|i| (i..columns).all(|j| r[(i, j)].abs() < 1e-10)));
    }

    #[test]
    fn back_substitution_by_hand() {
        let r = faer::mat![[2.0, 1.0], [9.0, 4.0]]; // the 9 lies below the diagonal and must not matter
        let mut b = [4.0, 8.0];
        back_substitute(r.as_ref(), &mut b);
        assert_eq!(b, [1.0, 2.0]);
    }
}
