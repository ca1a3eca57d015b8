//! Derivatives of samples by local polynomial least squares (Savitzky and Golay, Analytical Chemistry 36(8), 1964).

use nalgebra::{DMatrix, DVector};

/// The functional sum_m `terms`\[m\] p^(m)(x), p the polynomial of the given degree that fits y at 0, 1, .. best, as
/// weights of y: exact for polynomials up to the degree.
///
/// `terms` count per sample: a_m / T^m. There are more points than the degree, which has been checked.
pub(super) fn stencil(points: usize, degree: usize, terms: &[f64], x: f64) -> Vec<f64> {
    // In this coordinate, from -1 to 1, powers stay apart.
    #[expect(clippy::cast_precision_loss, reason = "windows are short")]
    let half = 0.5 * (points.max(2) - 1) as f64;
    let scaled = |x: f64| (x - half) / half;
    #[expect(clippy::cast_precision_loss, reason = "windows are short")]
    let basis = DMatrix::from_fn(points, degree + 1, |i, n| power(scaled(i as f64), n));
    let wanted = DVector::from_fn(degree + 1, |n, _| {
        let per_sample = terms.iter().enumerate().take(n + 1);
        per_sample.map(|(m, a)| a * falling(n, m) * power(scaled(x), n - m) / power(half, m)).sum()
    });
    let qr = basis.qr();
    // Of full rank: more distinct points than the degree. Weights q r^-T wanted are the shortest that are exact.
    let inner = qr.r().transpose().solve_lower_triangular(&wanted).unwrap_or_else(|| DVector::zeros(degree + 1));
    (qr.q() * inner).as_slice().to_vec()
}

/// x^n, also for 0^0.
fn power(x: f64, n: usize) -> f64 {
    (0..n).map(|_| x).product()
}

/// n (n - 1) .. (n - m + 1): what m derivatives leave in front of x^(n - m).
fn falling(n: usize, m: usize) -> f64 {
    #[expect(clippy::cast_precision_loss, reason = "degrees are small")]
    (0..m).map(|i| (n - i) as f64).product()
}
