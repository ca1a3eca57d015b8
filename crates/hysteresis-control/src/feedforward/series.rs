//! Dynamics at low frequencies.

use nalgebra::{DMatrix, DVector};

use crate::linear::Discrete;

/// The first coefficients, q(0) to q(degree), of exp(s lead) / P(exp(s)) = sum_m q(m) s^m, with s in radians per sample
/// and P of the rows of a record without the whole samples of dead time.
///
/// P(z) = G/z + c (z - Phi)^-1 g (1/z - 1) + d (1-f) (1 - 1/z), see [`Discrete`]. A record of samples of a polynomial is
/// answered by one: these numbers say by which.
pub(super) fn inverse_series(sampled: &Discrete, degree: usize, lead: f64) -> Vec<f64> {
    let later = exponential(-1.0, degree);
    let through = sampled.d * (1.0 - sampled.dead_time.share);
    let states = state_series(sampled, &later, degree);
    let transfer: Vec<f64> = (0..=degree)
        .map(|m| {
            let change = later[m] - if m == 0 { 1.0 } else { 0.0 };
            sampled.gain * later[m] + sampled.c.dot(&states[m]) - through * change
        })
        .collect();
    // The quotient of two series.
    let mut quotient = exponential(lead, degree);
    for m in 0..=degree {
        let known: f64 = (1..=m).map(|i| transfer[i] * quotient[m - i]).sum();
        quotient[m] = (quotient[m] - known) / transfer[0];
    }
    quotient
}

/// x of (exp(s) - Phi) x = g (exp(-s) - 1).
fn state_series(sampled: &Discrete, later: &[f64], degree: usize) -> Vec<DVector<f64>> {
    let n = sampled.g.len();
    if n == 0 {
        return vec![DVector::zeros(0); degree + 1];
    }
    let rest = (DMatrix::identity(n, n) - &sampled.phi).lu();
    let sooner = exponential(1.0, degree);
    let mut states: Vec<DVector<f64>> = vec![DVector::zeros(n)];
    for m in 1..=degree {
        let before: DVector<f64> = (1..=m).map(|i| &states[m - i] * sooner[i]).sum();
        let driven = &sampled.g * later[m] - before;
        states.push(rest.solve(&driven).unwrap_or_else(|| DVector::from_element(n, f64::NAN)));
    }
    states
}

/// x^m / m!
fn exponential(x: f64, degree: usize) -> Vec<f64> {
    let mut series = vec![1.0];
    for m in 1..=degree {
        #[expect(clippy::cast_precision_loss, reason = "degrees are small")]
        series.push(series[m - 1] * x / m as f64);
    }
    series
}
