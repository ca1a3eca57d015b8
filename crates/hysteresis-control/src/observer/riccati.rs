//! The covariance in which a Kalman filter settles.

use nalgebra::{DMatrix, DVector};

/// The covariance is found when a doubling changes no entry by more than this share of the largest.
const FOUND: f64 = 1e-13;

/// Every doubling stands for twice as many samples: 2^64 of them.
const DOUBLINGS: usize = 64;

/// The P before the measurement that solves P = F (P - P h (1 + h'P h)^-1 h'P) F' + q v v'; nothing if there is none.
///
/// By the structure-preserving doubling algorithm (Chu, Fan, Lin and Wang, Int. J. Control 77(8), 767-788, 2004): k
/// doublings are 2^k steps of the recursion from zero.
pub(super) fn stationary(
    transition: &DMatrix<f64>,
    output: &DVector<f64>,
    input: &DVector<f64>,
    growth: f64,
) -> Option<DMatrix<f64>> {
    let identity = DMatrix::identity(output.len(), output.len());
    let mut a = transition.transpose();
    let mut g = output * output.transpose();
    let mut h = input * input.transpose() * growth;
    for _ in 0..DOUBLINGS {
        let solve = (&identity + &g * &h).lu();
        let (next_a, next_g) = (solve.solve(&a)?, solve.solve(&g)?);
        let step = a.transpose() * &h * &next_a;
        g += &a * next_g * a.transpose();
        a = &a * next_a;
        h += &step;
        // Rounding must not make it lean to one side.
        h = (&h + h.transpose()) * 0.5;
        if !h.iter().all(|entry| entry.is_finite()) {
            return None;
        }
        if step.amax() <= FOUND * h.amax() {
            return Some(h);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A random walk that is measured: P = q / 2 + sqrt(q^2 / 4 + q).
    #[test]
    fn of_a_random_walk_it_is_known() {
        let one = DVector::from_element(1, 1.0);
        for q in [1e-12, 1e-4, 1.0, 1e6] {
            let p = stationary(&DMatrix::identity(1, 1), &one, &one, q).unwrap()[0];
            let exact = 0.5 * q + (0.25 * q * q + q).sqrt();
            assert!((p / exact - 1.0).abs() < 1e-9, "{q}: {p} {exact}");
        }
    }

    #[test]
    fn what_the_output_does_not_show_has_none() {
        let one = DVector::from_element(1, 1.0);
        assert!(stationary(&DMatrix::identity(1, 1), &DVector::zeros(1), &one, 1.0).is_none());
    }
}
