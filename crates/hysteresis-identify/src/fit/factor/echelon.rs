//! The echelon form of a triangle: a column that depends on those before it takes no row.

use faer::Mat;

/// A column of which less than this share is left beside those before it depends on them: what rounding leaves in the largest blocks
/// that faer is given, 16 epsilon for each row.
const DEPENDS: f64 = 16.0 * f64::EPSILON * 512.0;

/// Turns rows so that those from the first dependent column on begin further to the right, as [`triangle_of`](super::triangle_of) makes
/// them. A triangle without such a column stays as it is.
pub(super) fn make_echelon(r: &mut Mat<f64>) {
    let mut row = 0;
    for column in 0..r.ncols() {
        let left = r.col(column).get(row..column + 1).norm_l2();
        let stands_alone = left > DEPENDS * r.col(column).norm_l2(); // not one that is no number
        if !stands_alone {
            continue;
        }
        if row < column {
            reflect(r, row, column, left);
        }
        row += 1;
    }
}

/// Makes a column zero below `row`.
fn reflect(r: &mut Mat<f64>, row: usize, column: usize, norm: f64) {
    let after = -norm.copysign(r[(row, column)]);
    let mut vector: Vec<f64> = (row..=column).map(|i| r[(i, column)]).collect();
    vector[0] -= after;
    let scale = -1.0 / (after * vector[0]);
    for j in column..r.ncols() {
        let product: f64 = vector.iter().zip(row..).map(|(v, i)| v * r[(i, j)]).sum();
        for (v, i) in vector.iter().zip(row..) {
            r[(i, j)] -= scale * product * v;
        }
    }
    r[(row, column)] = after;
    for i in row + 1..=column {
        r[(i, column)] = 0.0;
    }
}
