//! The triangular factor of a matrix that is never held: its rows stream in, blocks of them are folded by QR.
//!
//! A block is folded by Householder reflections, eight columns at once. The reflection of a column has one element in
//! the triangle, its head, and one in every fresh row. Vectors are not scaled: with u = (head, a), H = I - scale u u'.
//! The heads of different columns lie in different rows, so products of vectors are those of fresh rows.
//!
//! The finished triangle has echelon form: a column that depends on those before it takes no row.

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::qr::no_pivoting::factor;
use faer::reborrow::ReborrowMut;
use faer::{Mat, MatMut, MatRef, Par, Spec};
use fearless_simd::{Simd, SimdFloat, f64x8};

use crate::algebra::eight::{LANES, Lanes, SimdLoop, dispatch, load, splat};

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
    /// By what columns are multiplied whose squares would be too small: powers of two, which round nothing. None until
    /// rows were folded.
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

    /// R of all rows so far; rows of zeros where A had fewer rows than columns. It is in [echelon form](Echelon): a
    /// column that depends on those before it takes no row, and all that stand behind it begin one row further up.
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

/// So many columns of a panel are applied at a time: what they need stays in registers.
const HALF: usize = LANES / 2;

/// A column of a smaller sum of squares is zero: products of such numbers would lose their digits.
const NOTHING: f64 = 1e-280;

/// Folds fresh rows: eights of columns, one eight of all rows after the other, `capacity` rows each, of which the first
/// `rows` count. The triangle has the eights of a row side by side.
struct Fold<'a> {
    columns: usize,
    triangle: &'a mut [Lanes],
    fresh: &'a mut [Lanes],
    capacity: usize,
    rows: usize,
}

/// The reflections of the columns of a panel, whose vectors lie where its fresh rows were.
#[derive(Default)]
struct Reflections {
    heads: Lanes,
    scales: Lanes,
    /// Of the vector of each column with those before it.
    products: [Lanes; LANES],
}

impl SimdLoop for Fold<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let Self { columns, triangle, fresh, capacity, rows } = self;
        let eights = columns.div_ceil(LANES);
        for number in 0..eights {
            let (panel, behind) = fresh[number * capacity..].split_at_mut(capacity);
            let panel = &mut panel[..rows];
            let first = number * LANES;
            let heads = &mut triangle[first * eights..columns.min(first + LANES) * eights];
            let reflections = reflect(simd, panel, heads, eights, number);
            for (block, place) in behind.chunks_exact_mut(capacity).zip(number + 1..) {
                apply(simd, &reflections, panel, &mut block[..rows], heads, eights, place);
            }
        }
    }
}

/// Makes the columns of a panel zero below the triangle, of which `heads` are the rows of these columns.
#[inline(always)]
fn reflect<S: Simd>(simd: S, panel: &mut [Lanes], heads: &mut [Lanes], eights: usize, place: usize) -> Reflections {
    let mut reflections = Reflections::default();
    let mut products = products(simd, panel, 0, None);
    let width = heads.len() / eights;
    for (j, row) in heads.chunks_exact_mut(eights).enumerate() {
        let row = &mut row[place];
        let (squares, head) = (products[j], row[j]);
        let mut moved = [0.0; LANES];
        if squares > NOTHING {
            let after = -(head * head + squares).sqrt().copysign(head);
            let head = head - after;
            let scale = -1.0 / (after * head);
            for k in j + 1..LANES {
                moved[k] = (head * row[k] + products[k]) * scale;
                row[k] -= head * moved[k];
            }
            row[j] = after;
            (reflections.heads[j], reflections.scales[j]) = (head, scale);
        } else {
            // What is no number is no column either.
            for row in panel.iter_mut() {
                row[j] = 0.0;
            }
        }
        reflections.products[j] = products;
        if j + 1 < width {
            products = self::products(simd, panel, j + 1, Some(moved));
        }
    }
    reflections
}

/// Subtracts from every row what the column before this one moves, if there is one, and returns the products of this
/// column with all.
#[inline(always)]
fn products<S: Simd>(simd: S, panel: &mut [Lanes], column: usize, moved: Option<Lanes>) -> Lanes {
    let before = column.saturating_sub(1);
    let moves = moved.map(|moved| -load(simd, &moved));
    let mut sums = [splat(simd, 0.0); 2];
    let (pairs, rest) = panel.as_chunks_mut::<2>();
    for pair in pairs {
        for i in 0..2 {
            sums[i] = product(simd, &mut pair[i], (before, column), moves, sums[i]);
        }
    }
    for row in rest {
        sums[0] = product(simd, row, (before, column), moves, sums[0]);
    }
    (sums[0] + sums[1]).into()
}

/// The same of one row.
#[inline(always)]
fn product<S: Simd>(
    simd: S,
    row: &mut Lanes,
    (before, column): (usize, usize),
    moves: Option<f64x8<S>>,
    sum: f64x8<S>,
) -> f64x8<S> {
    let here = load(simd, row);
    // Without a column before, nothing times one that is no number would make every column such a one.
    let moved = match moves {
        Some(moves) => splat(simd, row[before]).mul_add(moves, here),
        None => here,
    };
    *row = moved.into();
    // As it was stored, to the last bit: of a column that depends on others rounding is all that is left.
    splat(simd, row[column]).mul_add(moved, sum)
}

/// Applies the reflections of a panel to eight columns behind it.
#[inline(always)]
fn apply<S: Simd>(
    simd: S,
    reflections: &Reflections,
    panel: &[Lanes],
    block: &mut [Lanes],
    heads: &mut [Lanes],
    eights: usize,
    place: usize,
) {
    let width = heads.len() / eights;
    let mut moves = [[0.0; LANES]; LANES];
    for first in (0..width).step_by(HALF) {
        let mut sums = [splat(simd, 0.0); HALF];
        for (vectors, row) in panel.iter().zip(&*block) {
            let row = load(simd, row);
            for j in 0..HALF {
                sums[j] = splat(simd, vectors[first + j]).mul_add(row, sums[j]);
            }
        }
        for j in 0..HALF {
            moves[first + j] = sums[j].into();
        }
    }
    for (j, row) in heads.chunks_exact_mut(eights).enumerate() {
        let (head, scale) = (reflections.heads[j], reflections.scales[j]);
        let row = &mut row[place];
        let mut sum = splat(simd, head).mul_add(load(simd, row), load(simd, &moves[j]));
        for (product, moved) in reflections.products[j].iter().zip(&moves[..j]) {
            sum = splat(simd, *product).mul_add(load(simd, moved), sum);
        }
        let moved = splat(simd, -scale) * sum;
        moves[j] = moved.into();
        *row = splat(simd, head).mul_add(moved, load(simd, row)).into();
    }
    for first in (0..width).step_by(HALF) {
        let mut moved = [splat(simd, 0.0); HALF];
        for j in 0..HALF {
            moved[j] = load(simd, &moves[first + j]);
        }
        for (vectors, row) in panel.iter().zip(&mut *block) {
            let mut sum = load(simd, row);
            for j in 0..HALF {
                sum = splat(simd, vectors[first + j]).mul_add(moved[j], sum);
            }
            *row = sum.into();
        }
    }
}

/// A column of which less than this share is left beside those before it depends on them: what rounding leaves in the
/// largest blocks that faer is given, 16 epsilon for each row.
pub(crate) const DEPENDS: f64 = 16.0 * f64::EPSILON * 512.0;

/// A triangle in echelon form, as [`TriangularFactor::finish`] and [`echelon_of`] make it: the k-th of the columns that
/// take a row has its first element in row k. The others depend on those before them, and so does a column of zeros:
/// below the rows of those they have nothing but rounding.
///
/// So what is left behind some columns begins in the row of their rank, which is not their number where one depends.
pub(crate) struct Echelon<'a> {
    r: MatRef<'a, f64>,
    /// The columns that take a row, in order.
    pub(crate) pivots: Vec<usize>,
}

impl<'a> Echelon<'a> {
    pub(crate) fn of(r: MatRef<'a, f64>) -> Self {
        let mut pivots = Vec::with_capacity(r.ncols());
        for column in 0..r.ncols() {
            if pivots.len() < r.nrows() && stands_alone(r, pivots.len(), column) {
                pivots.push(column);
            }
        }
        Self { r, pivots }
    }

    /// The rank of the first columns: how many rows they take.
    pub(crate) fn rank(&self, columns: usize) -> usize {
        self.pivots.partition_point(|pivot| *pivot < columns)
    }

    /// The least-squares values of the first `columns` unknowns, for a right-hand side in the rows that they take.
    ///
    /// Those whose column depends on others are held at zero, as bounded least squares holds them: what the columns
    /// make together is the same for every such choice, and this one takes nothing away from the meaning of the others.
    pub(crate) fn solve(&self, columns: usize, mut right: Vec<f64>) -> Vec<f64> {
        let pivots = &self.pivots[..self.rank(columns)];
        let square = Mat::from_fn(pivots.len(), pivots.len(), |i, j| self.r[(i, pivots[j])]);
        right.truncate(pivots.len());
        back_substitute(square.as_ref(), &mut right);
        let mut values = vec![0.0; columns];
        for (pivot, value) in pivots.iter().zip(right) {
            values[*pivot] = value;
        }
        values
    }
}

/// The factor of a small matrix, of no fewer rows than columns. Its first columns are in echelon form by the same
/// measure as those of [`TriangularFactor::finish`]; that of faer hangs on the number of rows.
pub(crate) fn echelon_of(matrix: Mat<f64>, columns: usize) -> Mat<f64> {
    let mut triangle = triangle_of(matrix);
    make_echelon(&mut triangle, columns);
    triangle
}

/// Turns rows so that those from the first dependent column on begin further to the right, as far as the first columns
/// go. A triangle without such a column stays as it is.
pub(crate) fn make_echelon(r: &mut Mat<f64>, columns: usize) {
    let mut row = 0;
    for column in 0..columns {
        if !stands_alone(r.as_ref(), row, column) {
            continue;
        }
        if row < column {
            let left = r.col(column).get(row..column + 1).norm_l2();
            clear_below(r, row, column, left);
        }
        row += 1;
    }
}

/// Whether more than rounding is left of a column from a row on; not of one that is no number.
fn stands_alone(r: MatRef<'_, f64>, row: usize, column: usize) -> bool {
    let left = r.col(column).get(row..(column + 1).min(r.nrows())).norm_l2();
    left > DEPENDS * r.col(column).norm_l2()
}

/// Makes a column zero below `row`. Over its norm the column has squares that neither overflow nor vanish.
fn clear_below(r: &mut Mat<f64>, row: usize, column: usize, norm: f64) {
    let sign = 1.0_f64.copysign(r[(row, column)]);
    let mut vector: Vec<f64> = (row..=column).map(|i| r[(i, column)] / norm).collect();
    vector[0] += sign;
    let scale = sign / vector[0];
    for j in column..r.ncols() {
        let product: f64 = vector.iter().zip(row..).map(|(v, i)| v * r[(i, j)]).sum();
        for (v, i) in vector.iter().zip(row..) {
            r[(i, j)] -= scale * product * v;
        }
    }
    r[(row, column)] = -sign * norm;
    for i in row + 1..=column {
        r[(i, column)] = 0.0;
    }
}

#[cfg(test)]
mod tests_of_factor {
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

    /// What rounding leaves of a dependent column is no direction to turn rows by: the others keep their products, and
    /// such a column takes no row. One that is no number leaves the others alone.
    #[test]
    fn a_dependent_column_takes_no_row() {
        let columns = 21;
        let noise = |i: usize, j: usize| {
            crate::records::signal::as_f64((i * 7919 + j * j * 104_729 + i * j * 31) % 1009) / 1009.0 - 0.5
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

#[cfg(test)]
mod tests_of_echelon {
    use crate::records::signal::white;

    use super::*;

    /// [a | 0 | 2 a | b | a - b | 3 a + b | noise]: of 300 rows, at once or as they come.
    fn rows() -> Mat<f64> {
        let numbers = white(900);
        Mat::from_fn(300, 7, |i, j| {
            let [a, b, noise] = [numbers[3 * i], numbers[3 * i + 1] + 5.0, 0.1 * numbers[3 * i + 2]];
            [a, 0.0, 2.0 * a, b, a - b, 3.0 * a + b, noise][j]
        })
    }

    #[test]
    fn a_column_that_depends_takes_no_row_and_is_held_at_zero() {
        let rows = rows();
        let mut factor = TriangularFactor::new(7);
        (0..300).for_each(|i| factor.push(&(0..7).map(|j| rows[(i, j)]).collect::<Vec<_>>()));
        for r in [factor.finish(), echelon_of(rows, 7)] {
            let echelon = Echelon::of(r.as_ref());
            assert_eq!(echelon.pivots, [0, 3, 6]);
            assert_eq!([0, 1, 3, 4, 6, 7].map(|columns| echelon.rank(columns)), [0, 1, 1, 2, 2, 3]);
            let values = echelon.solve(5, (0..2).map(|i| r[(i, 5)]).collect());
            let expected = [3.0, 0.0, 0.0, 1.0, 0.0];
            assert!(
                values.iter().zip(expected).all(|(value, expected)| (value - expected).abs() < 1e-12),
                "{values:?}"
            );
        }
    }

    /// Where faer takes what is left of a column for one of its own, by the few rows it has, rows are turned as those
    /// of many are.
    #[test]
    fn what_depends_does_not_hang_on_the_number_of_rows() {
        let matrix = faer::mat![[1.0, 1.0, 2.0], [0.0, 1e-12, 3.0], [0.0, 0.0, 4.0]];
        let r = echelon_of(matrix, 3);
        assert_eq!(Echelon::of(r.as_ref()).pivots, [0, 2]);
        assert!((r[(1, 2)].abs() - 5.0).abs() < 1e-12 && r[(2, 2)] == 0.0, "{r:?}");
    }

    /// Squares of such columns are no numbers, or nothing.
    #[test]
    fn rows_are_turned_whatever_the_unit() {
        for unit in [1e-300, 1e-160, 1.0, 1e160, 1e300] {
            let rows = [[1.0, 1.0, 2.0, 5.0], [0.0, 0.0, 3.0, 1.0], [0.0, 0.0, 4.0, 2.0], [0.0; 4]];
            let mut r = Mat::from_fn(4, 4, |i, j| unit * rows[i][j]);
            make_echelon(&mut r, 4);
            // (3, 4) becomes (-5, 0), and (1, 2) what it is along it and across.
            let expected = [[1.0, 1.0, 2.0, 5.0], [0.0, 0.0, -5.0, -2.2], [0.0, 0.0, 0.0, 0.4], [0.0; 4]];
            let error = |(i, j): (usize, usize)| (r[(i, j)].abs() / unit - f64::abs(expected[i][j])).abs();
            assert!((0..16).map(|k| error((k / 4, k % 4))).all(|error| error < 1e-12), "{r:?}");
        }
    }

    #[test]
    fn what_is_no_number_takes_no_row() {
        let r = faer::mat![[f64::NAN, 1.0], [0.0, 1.0]];
        assert_eq!(Echelon::of(echelon_of(r, 2).as_ref()).pivots, [1]);
    }
}
