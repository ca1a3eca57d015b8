//! Riccati equations in the steady state: the value of an optimal regulator, and the covariance of a Kalman filter.

use nalgebra::{DMatrix, DVector};

/// The value has settled when a doubling adds no more than this share of its largest entry.
const VALUE_SETTLED: f64 = 1e-16;

/// The covariance is found when a doubling changes no entry by more than this share of the largest.
const COVARIANCE_SETTLED: f64 = 1e-13;

/// The value of an optimal regulator: the stabilising solution of P = A'P A - A'P b (rho + b'P b)^-1 b'P A + Q; nothing
/// where it is not found.
pub(crate) fn regulator_value(a: &DMatrix<f64>, b: &DVector<f64>, q: DMatrix<f64>, rho: f64) -> Option<DMatrix<f64>> {
    value(a.clone(), b * b.transpose() / rho, q)
}

/// The same for several inputs: P = A'P A - A'P B (R + B'P B)^-1 B'P A + Q. With A', C', the covariance of the states'
/// noise and that of the measurements it is the covariance of a Kalman filter, before a measurement.
pub(crate) fn value_of_several(
    a: &DMatrix<f64>,
    b: &DMatrix<f64>,
    q: DMatrix<f64>,
    r: &DMatrix<f64>,
) -> Option<DMatrix<f64>> {
    let weighed = r.clone().cholesky()?.solve(&b.transpose());
    value(a.clone(), b * weighed, q)
}

/// The solution of P = A'P (1 + G P)^-1 A + Q that stabilises.
fn value(mut a: DMatrix<f64>, mut g: DMatrix<f64>, mut p: DMatrix<f64>) -> Option<DMatrix<f64>> {
    // This many reach any state that fades within 2^60 samples.
    for _ in 0..60 {
        let [next, of_g, of_p] = doubled(&a, &g, &p)?;
        let added = symmetric(&of_p);
        p += &added;
        g += symmetric(&of_g);
        a = next;
        if added.amax() <= VALUE_SETTLED * p.amax() {
            return Some(p);
        }
    }
    None
}

/// The covariance in which a Kalman filter settles: the P before the measurement that solves
/// P = F (P - P h (1 + h'P h)^-1 h'P) F' + q v v'; nothing if there is none.
pub(crate) fn filter_covariance(
    transition: &DMatrix<f64>,
    output: &DVector<f64>,
    input: &DVector<f64>,
    growth: f64,
) -> Option<DMatrix<f64>> {
    let mut a = transition.transpose();
    let mut g = output * output.transpose();
    let mut p = input * input.transpose() * growth;
    // 2^64 samples.
    for _ in 0..64 {
        let [next, of_g, of_p] = doubled(&a, &g, &p)?;
        p += &of_p;
        // Rounding must not make it lean to one side.
        p = symmetric(&p);
        g += of_g;
        a = next;
        if !p.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        if of_p.amax() <= COVARIANCE_SETTLED * p.amax() {
            return Some(p);
        }
    }
    None
}

/// One doubling of the structure-preserving algorithm (Chu, Fan, Lin and Wang, Int. J. Control 77(8), 767-788, 2004):
/// the next A, and what G and P gain. k doublings are 2^k steps of the recursion.
fn doubled(a: &DMatrix<f64>, g: &DMatrix<f64>, p: &DMatrix<f64>) -> Option<[DMatrix<f64>; 3]> {
    let lu = (DMatrix::identity(a.nrows(), a.nrows()) + g * p).lu();
    let (next_a, next_g) = (lu.solve(a)?, lu.solve(g)?);
    let gained = a.transpose() * p * &next_a;
    Some([a * next_a, a * next_g * a.transpose(), gained])
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
            let found = regulator_value(&a, &b, DMatrix::from_element(1, 1, q), rho).unwrap()[0];
            assert!((found - exact).abs() < 1e-14 * exact.max(1.0), "{found} {exact}");
        }
        // What is not seen and does not decay has no solution that settles.
        let (a, b) = (DMatrix::from_element(1, 1, f64::NAN), DVector::from_element(1, 1.0));
        assert_eq!(regulator_value(&a, &b, DMatrix::zeros(1, 1), 1.0), None);
    }

    /// Two inputs that do not meet are two scalar cases.
    #[test]
    fn several_inputs_are_those_of_each() {
        let a = DMatrix::from_diagonal(&DVector::from_vec(vec![0.5, 1.5]));
        let b = DMatrix::from_diagonal(&DVector::from_vec(vec![1.0, 2.0]));
        let r = DMatrix::from_diagonal(&DVector::from_vec(vec![0.1, 3.0]));
        let both = value_of_several(&a, &b, DMatrix::identity(2, 2), &r).unwrap();
        for i in 0..2 {
            let (a, b) = (DMatrix::from_element(1, 1, a[(i, i)]), DVector::from_element(1, b[(i, i)]));
            let one = regulator_value(&a, &b, DMatrix::identity(1, 1), r[(i, i)]).unwrap()[0];
            assert!((both[(i, i)] - one).abs() < 1e-14 * one, "{both} {one}");
        }
    }

    /// A random walk that is measured: P = q / 2 + sqrt(q^2 / 4 + q).
    #[test]
    fn of_a_random_walk_it_is_known() {
        let one = DVector::from_element(1, 1.0);
        for q in [1e-12, 1e-4, 1.0, 1e6] {
            let p = filter_covariance(&DMatrix::identity(1, 1), &one, &one, q).unwrap()[0];
            let exact = 0.5 * q + (0.25 * q * q + q).sqrt();
            assert!((p / exact - 1.0).abs() < 1e-9, "{q}: {p} {exact}");
        }
    }

    #[test]
    fn what_the_output_does_not_show_has_none() {
        let one = DVector::from_element(1, 1.0);
        assert!(filter_covariance(&DMatrix::identity(1, 1), &DVector::zeros(1), &one, 1.0).is_none());
    }
}
