//! The gain of an optimal regulator.

use nalgebra::{DMatrix, DVector};

/// Each doubling squares what is left of the start: this many reach any state that fades within 2^60 samples.
const DOUBLINGS: usize = 60;

/// The solution has settled when a doubling adds no more than this share of its largest entry.
const SETTLED: f64 = 1e-16;

/// The stabilising solution of P = A'P A - A'P b (rho + b'P b)^-1 b'P A + Q, by doubling (Chu, Fan, Lin and Wang, Int.
/// J. Control 77(8), 767-788, 2004); nothing where it is not found.
pub(super) fn riccati(a: &DMatrix<f64>, b: &DVector<f64>, q: DMatrix<f64>, rho: f64) -> Option<DMatrix<f64>> {
    let identity = DMatrix::identity(b.len(), b.len());
    let (mut a, mut g, mut p) = (a.clone(), b * b.transpose() / rho, q);
    for _ in 0..DOUBLINGS {
        let lu = (&identity + &g * &p).lu();
        let (next_a, next_g) = (lu.solve(&a)?, lu.solve(&g)?);
        let added = symmetric(&(a.transpose() * &p * &next_a));
        p += &added;
        g += symmetric(&(&a * next_g * a.transpose()));
        a *= next_a;
        if added.amax() <= SETTLED * p.amax() {
            return Some(p);
        }
    }
    None
}

fn symmetric(matrix: &DMatrix<f64>) -> DMatrix<f64> {
    (matrix + matrix.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A scalar case has a closed form: p^2 + p (rho - q - a^2 rho) - q rho = 0 for b = 1.
    #[test]
    fn the_scalar_solution_is_that_of_the_quadratic_equation() {
        for (a, q, rho) in [(0.5, 1.0, 0.1), (1.0, 2.0, 1e-6), (1.5, 1.0, 10.0)] {
            let half: f64 = 0.5 * (rho - q - a * a * rho);
            let exact = -half + (half * half + q * rho).sqrt();
            let (a, b) = (DMatrix::from_element(1, 1, a), DVector::from_element(1, 1.0));
            let found = riccati(&a, &b, DMatrix::from_element(1, 1, q), rho).unwrap()[0];
            assert!((found - exact).abs() < 1e-14 * exact.max(1.0), "{found} {exact}");
        }
        // What is not seen and does not decay has no solution that settles.
        let (a, b) = (DMatrix::from_element(1, 1, f64::NAN), DVector::from_element(1, 1.0));
        assert_eq!(riccati(&a, &b, DMatrix::zeros(1, 1), 1.0), None);
    }
}
