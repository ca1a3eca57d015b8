//! The echelon form of a triangle: a column that depends on those before it takes no row.

use faer::{Mat, MatRef};

use super::{back_substitute, triangle_of};

/// A column of which less than this share is left beside those before it depends on them: what rounding leaves in the largest blocks
/// that faer is given, 16 epsilon for each row.
pub(crate) const DEPENDS: f64 = 16.0 * f64::EPSILON * 512.0;

/// A triangle in echelon form, as [`TriangularFactor::finish`](super::TriangularFactor::finish) and [`echelon_of`] make it: the k-th of the
/// columns that take a row has its first element in row k. The others depend on those before them, and so does a column of zeros: below
/// the rows of those they have nothing but rounding.
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
    /// Those whose column depends on others are held at zero, as bounded least squares holds them: what the columns make together is the
    /// same for every such choice, and this one takes nothing away from the meaning of the others.
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

/// The factor of a small matrix, of no fewer rows than columns. Its first columns are in echelon form by the same measure as those of
/// [`TriangularFactor::finish`](super::TriangularFactor::finish); that of faer hangs on the number of rows.
pub(crate) fn echelon_of(matrix: Mat<f64>, columns: usize) -> Mat<f64> {
    let mut triangle = triangle_of(matrix);
    make_echelon(&mut triangle, columns);
    triangle
}

/// Turns rows so that those from the first dependent column on begin further to the right, as far as the first columns go. A triangle
/// without such a column stays as it is.
pub(crate) fn make_echelon(r: &mut Mat<f64>, columns: usize) {
    let mut row = 0;
    for column in 0..columns {
        if !stands_alone(r.as_ref(), row, column) {
            continue;
        }
        if row < column {
            let left = r.col(column).get(row..column + 1).norm_l2();
            reflect(r, row, column, left);
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
fn reflect(r: &mut Mat<f64>, row: usize, column: usize, norm: f64) {
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
mod tests {
    use super::*;
    use crate::fit::factor::TriangularFactor;
    use crate::white_noise::white;

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

    /// Where faer takes what is left of a column for one of its own, by the few rows it has, rows are turned as those of many are.
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
