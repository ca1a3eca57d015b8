//! What makes the estimates doubtful.

use core::f64::consts::PI;

use hysteresis_control::linear::{self, Dynamics};

use super::options::Order;
use super::response::{LinearParameter, ResponseFit, ResponseProblem};
use super::search::SearchDomain;
use super::uncertainty::Uncertainty;
use crate::colour::Colour;
use crate::finding::{Finding, FindingCode};
use crate::numeric::as_f64;

/// Relative standard deviations beyond which a parameter counts as undetermined; of the dead time, in samples.
const MAX_FREQUENCY_STD: f64 = 0.05;
const MAX_DAMPING_STD: f64 = 0.25;
const MAX_DEAD_TIME_STD: f64 = 0.25;

/// Dynamics must lower the sum of squares by this many noise variances per e-fold of samples: the strongest resonance
/// that white noise feigns somewhere among N / 2 frequencies takes about 2 log(N / 2), and this is twice as much.
const MIN_EVIDENCE: f64 = 4.0;

/// How far the gain may be from 1.
const MAX_GAIN_ERROR: f64 = 0.05;

/// Everything that makes the estimates doubtful; `range` is that of the fitted output.
pub(super) fn findings(
    problem: &ResponseProblem<'_>,
    domain: &SearchDomain,
    fit: &ResponseFit,
    uncertainty: &Uncertainty,
    residuals: &[f64],
    range: f64,
) -> Result<Vec<Finding>, linear::Error> {
    let colour = Colour::new(residuals, range);
    let (point, gain) = (&fit.point, fit.coefficients[1]);
    let doubtful = |doubt: Doubt| {
        let at_bound = domain.at_bound(point, doubt.axis)
            && !(doubt.axis == LinearParameter::Delay && point.get(doubt.axis) == 0.0);
        // Correlated residuals make the standard deviations too small; here they may not hide that nothing is known.
        let std = uncertainty.std(doubt.name) * colour.correlation_time.sqrt() / doubt.unit;
        let raised = problem.axes.contains(&doubt.axis) && (at_bound || std.is_nan() || std > doubt.limit);
        raised.then(|| doubt.finding(std, at_bound))
    };
    let (frequency, damping) =
        (point.get(LinearParameter::LogFrequency).exp(), point.get(LinearParameter::LogDamping).exp());
    let frequency_doubt = doubtful(Doubt {
        code: FindingCode::ResonanceNotExcited,
        axis: LinearParameter::LogFrequency,
        name: "frequency",
        unit: frequency,
        limit: MAX_FREQUENCY_STD,
    });
    let evidence = evidence(problem, fit, uncertainty.noise)? / colour.correlation_time;
    let needed = MIN_EVIDENCE * as_f64(residuals.len()).ln();
    let raised = [
        frequency_doubt.or_else(|| no_evidence(evidence, needed)),
        doubtful(Doubt {
            code: FindingCode::DampingUndetermined,
            axis: LinearParameter::LogDamping,
            name: "damping",
            unit: damping,
            limit: MAX_DAMPING_STD,
        }),
        doubtful(Doubt {
            code: FindingCode::DeadTimeUndetermined,
            axis: LinearParameter::Delay,
            name: "delay",
            unit: 1.0,
            limit: MAX_DEAD_TIME_STD,
        }),
        gain_not_one(gain),
        colour.finding(),
    ];
    Ok(raised.into_iter().flatten().collect())
}

/// A parameter that may be undetermined, and when it is.
struct Doubt {
    code: FindingCode,
    axis: LinearParameter,
    name: &'static str,
    /// What its standard deviation is divided by.
    unit: f64,
    limit: f64,
}

impl Doubt {
    fn finding(&self, std: f64, at_bound: bool) -> Finding {
        let Self { code, name, limit, .. } = *self;
        let unit = if self.axis == LinearParameter::Delay { "samples" } else { "of its value" };
        let message = if at_bound {
            format!("the search for the {name} ended at the edge of its domain")
        } else {
            format!("the standard error of the {name} is {std:.2} {unit}")
        };
        Finding::new(code, std, limit, message)
    }
}

fn no_evidence(evidence: f64, needed: f64) -> Option<Finding> {
    let message = format!(
        "a plain dead time fits as well: the dynamics lower the sum of squares by {evidence:.1} noise variances, and \
         noise alone may pretend {needed:.1}"
    );
    (evidence < needed).then(|| Finding::new(FindingCode::ResonanceNotExcited, evidence, needed, message))
}

fn gain_not_one(gain: f64) -> Option<Finding> {
    let value = (gain - 1.0).abs();
    let message = format!("the output is {gain:.3} times what the hysteresis model predicts");
    (value > MAX_GAIN_ERROR).then(|| Finding::new(FindingCode::GainNotOne, value, MAX_GAIN_ERROR, message))
}

/// By how many noise variances the dynamics lower the sum of squares below that of a delay as long as their own lag.
///
/// A lag alone with a known delay needs no such proof: that the output lags is all it has to say.
fn evidence(problem: &ResponseProblem<'_>, fit: &ResponseFit, noise: f64) -> Result<f64, linear::Error> {
    if problem.order == Order::First && !problem.axes.contains(&LinearParameter::Delay) {
        return Ok(f64::INFINITY);
    }
    let lag = match fit.point.dynamics(problem.order)? {
        Dynamics::FirstOrder(lag) => lag.time_constant(),
        Dynamics::SecondOrder(resonance) => resonance.damping() / (PI * resonance.frequency()),
    };
    let without = problem.squares_without_dynamics(fit.point.get(LinearParameter::Delay) + lag / problem.dt)?;
    Ok((without - fit.squares) / (noise * noise))
}
