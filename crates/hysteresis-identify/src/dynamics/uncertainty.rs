//! How far the estimates can be trusted.

use faer::Mat;

use super::response::{LinearParameter, ResponseFit, ResponseProblem, is_independent};
use crate::numeric::as_f64;

/// Standard deviations of the estimates, for white measurement noise.
///
/// From the Jacobian J of the prediction at the estimate and the residual variance s^2 = sum e^2 / (samples -
/// unknowns): the covariance is s^2 (J'J)^-1, the usual one of nonlinear least squares. It is infinite where the record
/// says nothing. A frequency, damping or delay at the edge of its domain (a delay of 0, for instance) is treated as if
/// there were no edge.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Uncertainty {
    /// The names of the estimates in the order of the covariance: frequency, damping, delay (those that were searched),
    /// gain, output_offset, creep of each term.
    pub parameters: Vec<String>,
    /// The covariance, row by row.
    pub covariance: Vec<Vec<f64>>,
    /// The standard deviation of the noise, estimated from the residuals, in the unit of the output.
    pub noise: f64,
}

impl Uncertainty {
    /// The standard deviation of a parameter; 0 for one that was given.
    #[must_use]
    pub fn std(&self, parameter: &str) -> f64 {
        let place = self.parameters.iter().position(|name| name == parameter);
        place.map_or(0.0, |i| self.covariance[i][i].sqrt())
    }

    /// From the triangle at the estimate. `first_input` is the value that the problem's input counts from.
    pub(super) fn new(problem: &ResponseProblem<'_>, fit: &ResponseFit, triangle: &Mat<f64>, first_input: f64) -> Self {
        let samples = problem.input.len() - problem.skip;
        let noise = (fit.squares / as_f64(samples - problem.unknowns())).sqrt();
        let (parameters, gradients) = natural(problem, fit, first_input);
        let unknowns = problem.unknowns();
        let independent = (0..unknowns).all(|j| is_independent(triangle, j));
        let covariance = if independent {
            // With x = R^-1' g for the gradient g of each parameter, the covariance of two of them is s^2 x'x.
            let roots: Vec<_> = gradients.iter().map(|gradient| forward_substitute(triangle, gradient)).collect();
            let product = |a: &[f64], b: &[f64]| noise * noise * a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            roots.iter().map(|a| roots.iter().map(|b| product(a, b)).collect()).collect()
        } else {
            vec![vec![f64::INFINITY; unknowns]; unknowns]
        };
        Self { parameters, covariance, noise }
    }
}

/// The names of the parameters, and the gradient of each by the unknowns of the least-squares problem.
fn natural(problem: &ResponseProblem<'_>, fit: &ResponseFit, first_input: f64) -> (Vec<String>, Vec<Vec<f64>>) {
    let (coefficients, unknowns) = (problem.coefficients(), problem.unknowns());
    let along = |places: &[(usize, f64)]| {
        let mut gradient = vec![0.0; unknowns];
        for (place, slope) in places {
            gradient[*place] = *slope;
        }
        gradient
    };
    let (mut names, mut gradients) = (Vec::new(), Vec::new());
    for (i, axis) in problem.axes.iter().enumerate() {
        let (name, slope) = match axis {
            LinearParameter::LogFrequency => ("frequency", fit.point.get(*axis).exp()),
            LinearParameter::LogDamping => ("damping", fit.point.get(*axis).exp()),
            LinearParameter::Delay => ("delay", 1.0),
        };
        names.push(name.to_owned());
        gradients.push(along(&[(coefficients + i, slope)]));
    }
    let gain = fit.coefficients[1];
    names.push("gain".to_owned());
    gradients.push(along(&[(1, 1.0)]));
    names.push("output_offset".to_owned());
    let levels: Vec<_> = (1..coefficients).map(|place| (place, -first_input)).chain([(0, 1.0)]).collect();
    gradients.push(along(&levels));
    for (k, product) in fit.coefficients[2..].iter().enumerate() {
        names.push(format!("creep[{k}]"));
        gradients.push(along(&[(2 + k, 1.0 / gain), (1, -product / (gain * gain))]));
    }
    (names, gradients)
}

/// Solves R' x = g.
fn forward_substitute(r: &Mat<f64>, g: &[f64]) -> Vec<f64> {
    let mut x = g.to_vec();
    for i in 0..x.len() {
        let before: f64 = (0..i).map(|j| r[(j, i)] * x[j]).sum();
        x[i] = (x[i] - before) / r[(i, i)];
    }
    x
}
