//! How far the estimates can be trusted.

use core::f64::consts::PI;
use core::fmt;

use faer::Mat;
use hysteresis_simulate::linear::{self, Dynamics};

use super::options::Order;
use super::response::{Fit, Parameter, Problem, is_independent};
use super::search::Domain;
use crate::quality::as_f64;

/// Autocorrelations that the test for white residuals looks at (Ljung and Box), and the statistic that white noise
/// exceeds once in ten thousand records: 20 + 5 sqrt(40), five standard deviations beyond its mean.
const TESTED_LAGS: usize = 20;
const WHITE_LIMIT: f64 = 51.6;

/// The longest correlation time that is looked for, in samples.
const MAX_LAGS: usize = 200;

/// Residuals below this share of the output's range are rounding: neither white nor coloured.
const ROUNDING: f64 = 1e-10;

/// Relative standard deviations beyond which a parameter counts as undetermined; of the delay, in samples.
const MAX_FREQUENCY_STD: f64 = 0.05;
const MAX_DAMPING_STD: f64 = 0.25;
const MAX_DELAY_STD: f64 = 0.25;

/// Dynamics must lower the sum of squares by this many noise variances per e-fold of samples: the strongest resonance
/// that white noise feigns somewhere among N / 2 frequencies takes about 2 log(N / 2), and this is twice as much.
const MIN_EVIDENCE: f64 = 4.0;

/// How far the gain may be from 1.
const MAX_GAIN_ERROR: f64 = 0.05;

/// What to know before the numbers are used; its name is its [`Display`](fmt::Display).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum Warning {
    /// `resonance_not_excited`: the record does not tell the frequency. Its standard deviation exceeds 5 %, the search
    /// ended at the edge of its domain, or a plain delay fits as well as the dynamics do, up to what noise may pretend.
    /// Drive with a chirp or step that reaches the resonance.
    ResonanceNotExcited,
    /// `damping_undetermined`: its standard deviation exceeds 25 %, or the search ended at the edge of its domain.
    DampingUndetermined,
    /// `delay_undetermined`: its standard deviation exceeds a quarter of a sample, or it is the longest searched.
    DelayUndetermined,
    /// `gain_not_one`: the gain differs from 1 by more than 5 %: the hysteresis model is not that of this record, or
    /// the two were measured in other units.
    GainNotOne,
    /// `residual_coloured`: the residuals are correlated in time, so something is not modelled, and the standard
    /// deviations, which assume white noise, are too small.
    ResidualColoured,
}

impl Warning {
    /// The warning's name.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::ResonanceNotExcited => "resonance_not_excited",
            Self::DampingUndetermined => "damping_undetermined",
            Self::DelayUndetermined => "delay_undetermined",
            Self::GainNotOne => "gain_not_one",
            Self::ResidualColoured => "residual_coloured",
        }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

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
    pub(super) fn new(problem: &Problem<'_>, fit: &Fit, triangle: &Mat<f64>, first_input: f64) -> Self {
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
fn natural(problem: &Problem<'_>, fit: &Fit, first_input: f64) -> (Vec<String>, Vec<Vec<f64>>) {
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
            Parameter::LogFrequency => ("frequency", fit.point.get(*axis).exp()),
            Parameter::LogDamping => ("damping", fit.point.get(*axis).exp()),
            Parameter::Delay => ("delay", 1.0),
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

/// Everything that makes the estimates doubtful.
pub(super) fn warnings(
    problem: &Problem<'_>,
    domain: &Domain,
    fit: &Fit,
    uncertainty: &Uncertainty,
    residuals: &[f64],
    range: f64,
) -> Result<Vec<Warning>, linear::Error> {
    let colour = Colour::new(residuals, range);
    let point = &fit.point;
    // Correlated residuals make the standard deviations too small; here they may not hide that nothing is known.
    let doubtful = |axis, name: &str, limit: f64| {
        let at_bound = domain.at_bound(point, axis) && !(axis == Parameter::Delay && point.get(axis) == 0.0);
        let std = uncertainty.std(name) * colour.correlation_time.sqrt();
        problem.axes.contains(&axis) && (at_bound || std.is_nan() || std > limit)
    };
    let (frequency, damping) = (point.get(Parameter::LogFrequency).exp(), point.get(Parameter::LogDamping).exp());
    let gain = fit.coefficients[1];
    let unexcited = doubtful(Parameter::LogFrequency, "frequency", MAX_FREQUENCY_STD * frequency)
        || evidence(problem, fit, uncertainty.noise)? / colour.correlation_time
            < MIN_EVIDENCE * as_f64(residuals.len()).ln();
    let raised = [
        (Warning::ResonanceNotExcited, unexcited),
        (Warning::DampingUndetermined, doubtful(Parameter::LogDamping, "damping", MAX_DAMPING_STD * damping)),
        (Warning::DelayUndetermined, doubtful(Parameter::Delay, "delay", MAX_DELAY_STD)),
        (Warning::GainNotOne, (gain - 1.0).abs() > MAX_GAIN_ERROR),
        (Warning::ResidualColoured, colour.is_coloured),
    ];
    Ok(raised.into_iter().filter_map(|(warning, raised)| raised.then_some(warning)).collect())
}

/// By how many noise variances the dynamics lower the sum of squares below that of a delay as long as their own lag.
///
/// A lag alone with a known delay needs no such proof: that the output lags is all it has to say.
fn evidence(problem: &Problem<'_>, fit: &Fit, noise: f64) -> Result<f64, linear::Error> {
    if problem.order == Order::First && !problem.axes.contains(&Parameter::Delay) {
        return Ok(f64::INFINITY);
    }
    let lag = match fit.point.dynamics(problem.order)? {
        Dynamics::FirstOrder(lag) => lag.time_constant(),
        Dynamics::SecondOrder(resonance) => resonance.damping() / (PI * resonance.frequency()),
    };
    let without = problem.squares_without_dynamics(fit.point.get(Parameter::Delay) + lag / problem.dt)?;
    Ok((without - fit.squares) / (noise * noise))
}

/// How the residuals follow from each other.
struct Colour {
    is_coloured: bool,
    /// 1 + 2 sum of the autocorrelations up to the first that is not positive: by how much the variance of a slow mean
    /// exceeds that for white noise.
    correlation_time: f64,
}

impl Colour {
    fn new(residuals: &[f64], range: f64) -> Self {
        let n = as_f64(residuals.len());
        let variance = residuals.iter().map(|e| e * e).sum::<f64>() / n;
        if variance.sqrt() <= ROUNDING * range {
            return Self { is_coloured: false, correlation_time: 1.0 };
        }
        let lags = MAX_LAGS.min(residuals.len() / 4);
        let correlation =
            |lag: usize| residuals.iter().zip(&residuals[lag..]).map(|(a, b)| a * b).sum::<f64>() / (n * variance);
        let correlations: Vec<f64> = (1..=lags).map(correlation).collect();
        let tested = correlations.iter().take(TESTED_LAGS);
        let statistic: f64 = tested.zip(1_u32..).map(|(r, lag)| n * (n + 2.0) * r * r / (n - f64::from(lag))).sum();
        let positive: f64 = correlations.iter().take_while(|r| **r > 0.0).sum();
        Self { is_coloured: statistic > WHITE_LIMIT, correlation_time: 1.0 + 2.0 * positive }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in -1..1 without correlation, from a linear congruential generator.
    fn white(samples: usize) -> Vec<f64> {
        let states = std::iter::successors(Some(1_u64), |s| {
            Some(s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407))
        });
        let fraction = |s: u64| f64::from(u32::try_from(s >> 32).unwrap()) / f64::from(u32::MAX);
        states.skip(10).map(|s| 2.0 * fraction(s) - 1.0).take(samples).collect()
    }

    #[test]
    fn white_noise_is_white_and_its_running_mean_is_not() {
        let noise = white(20_000);
        let colour = Colour::new(&noise, 2.0);
        assert!(!colour.is_coloured && colour.correlation_time < 1.3);
        let mean: Vec<f64> = noise.windows(8).map(|w| w.iter().sum::<f64>() / 8.0).collect();
        let colour = Colour::new(&mean, 2.0);
        // Autocorrelations 7/8, 6/8, ..., 1/8 sum to 3.5.
        assert!(colour.is_coloured && (colour.correlation_time - 8.0).abs() < 1.0);
        let tiny: Vec<f64> = mean.iter().map(|e| 1e-12 * e).collect();
        assert!(!Colour::new(&tiny, 2.0).is_coloured);
    }
}
