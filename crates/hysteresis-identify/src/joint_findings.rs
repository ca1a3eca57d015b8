//! What makes the linear part of a joint fit doubtful.

use crate::finding::{Finding, FindingCode};
use crate::fit::projection::ProjectedFit;
use crate::fit::space::{Parameter, Space};
use crate::result::standard_errors::StandardErrors;

/// Relative standard errors beyond which a parameter counts as undetermined; of the dead time, in samples.
const MAX_FREQUENCY_ERROR: f64 = 0.05;
const MAX_DAMPING_ERROR: f64 = 0.25;
const MAX_CREEP_ERROR: f64 = 0.5;
const MAX_DEAD_TIME_ERROR: f64 = 0.25;

/// A dead time below this, in samples, belongs to rows that pair a drive with a later position.
const NEGATIVE_SAMPLES: f64 = -0.5;

/// What the records do not tell of dynamics, dead time and creep. `dead_time_error` is the standard error of a dead time
/// searched beside dynamics, in samples; correlated residuals widen the others by the root of `correlation_time`.
pub(crate) fn joint_findings(
    space: &Space,
    fit: &ProjectedFit,
    errors: &StandardErrors,
    dead_time_error: Option<f64>,
    correlation_time: f64,
) -> Vec<Finding> {
    let widen = correlation_time.sqrt();
    let doubtful = |code, what: &str, parameter, value: f64, error: f64, limit: f64| {
        let relative = widen * error / value;
        let message = match space.axis(parameter) {
            Some(axis) if !(axis.lower < fit.point.get(parameter) && fit.point.get(parameter) < axis.upper) => {
                format!("the search for the {what} ended at {value:.4}, the edge of its domain")
            }
            _ if relative.is_nan() => format!("the records do not tell the {what}"),
            _ => format!("the standard error of the {what} is {:.0} % of its value, {value:.4}", 100.0 * relative),
        };
        // A relative error that is not a number is past any limit.
        (space.axis(parameter).is_some() && !(relative <= limit)).then(|| Finding::new(code, relative, limit, message))
    };
    let (frequency, damping) =
        (fit.point.get(Parameter::LogFrequency).exp(), fit.point.get(Parameter::LogDamping).exp());
    let mut found = vec![
        doubtful(
            FindingCode::ResonanceNotExcited,
            "frequency",
            Parameter::LogFrequency,
            frequency,
            errors.frequency,
            MAX_FREQUENCY_ERROR,
        ),
        doubtful(
            FindingCode::DampingUndetermined,
            "damping",
            Parameter::LogDamping,
            damping,
            errors.damping,
            MAX_DAMPING_ERROR,
        ),
        confounded(space, fit, errors, dead_time_error),
        negative(space, fit),
    ];
    for (number, error) in errors.creep.iter().enumerate() {
        let amplitude = fit.point.get(Parameter::Creep(number));
        let code = FindingCode::CreepUndetermined;
        found.push(doubtful(code, "creep", Parameter::Creep(number), amplitude, *error, MAX_CREEP_ERROR));
    }
    found.into_iter().flatten().collect()
}

fn confounded(space: &Space, fit: &ProjectedFit, errors: &StandardErrors, error: Option<f64>) -> Option<Finding> {
    let (error, lag) = (error?, space.linear_part(&fit.point).lag());
    let message = format!(
        "dead time is confounded with the lag of the dynamics: the records tell their sum, {:.4} ms to {:.4} ms, and the dead \
         time alone to {error:.2} samples",
        1e3 * lag,
        1e3 * errors.lag
    );
    let code = FindingCode::DeadTimeConfounded;
    (!(error <= MAX_DEAD_TIME_ERROR)).then(|| Finding::new(code, error, MAX_DEAD_TIME_ERROR, message))
}

fn negative(space: &Space, fit: &ProjectedFit) -> Option<Finding> {
    let samples = fit.point.get(Parameter::DeadTime) / space.intervals().smallest();
    let message = format!("the position leads the drive by {:.2} samples", -samples);
    let code = FindingCode::NegativeDeadTime;
    (samples < NEGATIVE_SAMPLES).then(|| Finding::new(code, samples, NEGATIVE_SAMPLES, message))
}
