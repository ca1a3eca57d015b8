//! What makes the linear part of a joint fit doubtful.

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::dead_time::MIN_NEGATIVE_SAMPLES;
use crate::fit::gradients::{log_damping, log_frequency};
use crate::fit::linear_part::Mode;
use crate::fit::point::Parameter;
use crate::fit::projection::ProjectedFit;
use crate::fit::space::Space;
use crate::joint_search::{LinearEvidence, UntoldModes};
use crate::result::standard_errors::StandardErrors;

/// Relative standard errors beyond which a parameter counts as undetermined; of the dead time, in samples.
const MAX_FREQUENCY_ERROR: f64 = 0.05;
const MAX_DAMPING_ERROR: f64 = 0.25;
const MAX_CREEP_ERROR: f64 = 0.5;
const MAX_DEAD_TIME_ERROR: f64 = 0.1;

/// A lag of the amplifier that is shorter, in samples, is told from a dead time by the fastest motion alone, which errors of
/// the model blur first.
const MIN_AMPLIFIER_LAG: f64 = 3.0;

/// A dead time below this, in samples, belongs to rows that pair a drive with a later position.
const NEGATIVE_SAMPLES: f64 = -MIN_NEGATIVE_SAMPLES;

/// What the records do not tell of dynamics, dead time and creep.
pub(crate) fn joint_findings(
    space: &Space,
    fit: &ProjectedFit,
    errors: &StandardErrors,
    evidence: &LinearEvidence,
) -> Vec<Finding> {
    let doubtful = |code, what: &str, parameter, value: f64, error: f64, limit: f64| {
        let relative = error / value;
        let message = match space.axis(parameter) {
            Some(axis) if !(axis.lower < fit.point.get(parameter) && fit.point.get(parameter) < axis.upper) => {
                format!("the search for the {what} ended at {value:.4}, the edge of its domain")
            }
            _ if relative.is_nan() => format!("the records do not tell the {what}"),
            _ => format!("the standard error of the {what} is {:.0} % of its value, {value:.4}", 100.0 * relative),
        };
        // A relative error that is not a number is past any limit.
        (space.axis(parameter).is_some() && (relative.is_nan() || relative > limit))
            .then(|| Finding::new(code, relative, limit, message))
    };
    let mut found = vec![
        evidence.untold_modes.map(|untold| untold_modes(space, untold)),
        evidence.too_little.map(|evidence| too_little(space, evidence)),
    ];
    let has_told_dynamics = evidence.too_little.is_none();
    for one in dynamics_of(space, fit, errors) {
        let (code, [frequency, damping]) = (FindingCode::ResonanceNotExcited, one.parameters);
        let (what, value, error) = (format!("frequency{}", one.of), fit.point.get(frequency).exp(), one.errors[0]);
        found.push(doubtful(code, &what, frequency, value, error, MAX_FREQUENCY_ERROR).filter(|_| has_told_dynamics));
        let code = FindingCode::DampingUndetermined;
        let (what, value, error) = (format!("damping{}", one.of), fit.point.get(damping).exp(), one.errors[1]);
        found.push(doubtful(code, &what, damping, value, error, MAX_DAMPING_ERROR));
    }
    found.extend([
        confounded(space, fit, errors, evidence.dead_time_error)
            .or_else(|| with_amplifier(space, fit, errors, evidence)),
        negative(space, fit),
    ]);
    for (number, error) in errors.creep.iter().enumerate() {
        let amplitude = fit.point.get(Parameter::Creep(number));
        let code = FindingCode::CreepUndetermined;
        let what = space.name_of_creep(number);
        found.push(doubtful(code, &what, Parameter::Creep(number), amplitude, *error, MAX_CREEP_ERROR));
    }
    found.push(evidence.colour.finding());
    found.into_iter().flatten().collect()
}

/// A mode or a lag: which one it is, where frequency and damping are searched, and their standard errors.
struct Doubted {
    of: String,
    parameters: [Parameter; 2],
    errors: [f64; 2],
}

/// The modes, from the lowest frequency up, or the lag.
fn dynamics_of(space: &Space, fit: &ProjectedFit, errors: &StandardErrors) -> Vec<Doubted> {
    let modes = space.linear_part(&fit.point).in_order();
    if modes.len() < 2 {
        let parameters = [Parameter::LogFrequency, Parameter::LogDamping];
        return vec![Doubted { of: String::new(), parameters, errors: [errors.frequency, errors.damping] }];
    }
    let doubted = |((number, mode), errors): (&(usize, Mode), &[f64; 3])| Doubted {
        of: format!(" of the mode at {:.4} Hz", mode.frequency),
        parameters: [log_frequency(*number), log_damping(*number)],
        errors: [errors[0], errors[1]],
    };
    modes.iter().zip(&errors.modes).map(doubted).collect()
}

/// Modes that were asked for and are not there.
fn untold_modes(space: &Space, UntoldModes { asked, evidence, needed }: UntoldModes) -> Finding {
    let message = format!(
        "of {asked} modes that were asked for the records tell {}: another one lowers the sum of squares by {evidence:.1} noise \
         variances, and noise alone may pretend {needed:.1}",
        space.modes()
    );
    Finding::new(FindingCode::ModeNotTold, evidence, needed, message)
}

/// A dead time that is not told from the lag of the dynamics; `error` is its standard error, in samples, when it was settled.
fn confounded(space: &Space, fit: &ProjectedFit, errors: &StandardErrors, error: Option<f64>) -> Option<Finding> {
    // The one of the result knows what the model lacks, but is not a number where the dead time settled at 0.
    let (settled, of_result) = (error?, errors.dead_time / space.intervals().smallest());
    let error = if settled.is_nan() { settled } else { settled.max(of_result) };
    let sum = with_error_of_lag(space.linear_part(&fit.point).lag(), errors.lag);
    let alone = if error.is_nan() { "not at all".to_owned() } else { format!("to {error:.2} samples") };
    let message = format!(
        "dead time is confounded with the lag of the dynamics: the records tell their sum, {sum}, and the dead time alone {alone}"
    );
    let code = FindingCode::DeadTimeConfounded;
    (error.is_nan() || error > MAX_DEAD_TIME_ERROR).then(|| Finding::new(code, error, MAX_DEAD_TIME_ERROR, message))
}

/// A sum of lags, and to how much it is told: that is not a number where a part of it lies at the edge of its domain or is not told.
fn with_error_of_lag(lag: f64, error: f64) -> String {
    if error.is_nan() {
        return format!(
            "{:.4} ms but not how exactly, as a part of it ended at the edge of its domain or is not told",
            1e3 * lag
        );
    }
    format!("{:.4} ms to {:.4} ms", 1e3 * lag, 1e3 * error)
}

/// A dead time that an amplifier may have a part of.
fn with_amplifier(
    space: &Space,
    fit: &ProjectedFit,
    errors: &StandardErrors,
    evidence: &LinearEvidence,
) -> Option<Finding> {
    space.axis(Parameter::DeadTime)?;
    let part = space.linear_part(&fit.point);
    let lag = part.amplifier_lag() / space.intervals().smallest();
    let (value, limit, is_doubtful) = match part.bandwidth {
        Some(_) if space.axis(Parameter::LogBandwidth).is_some() => (lag, MIN_AMPLIFIER_LAG, lag < MIN_AMPLIFIER_LAG),
        Some(_) => return None,
        None => {
            let instead = evidence.amplifier_instead;
            (instead, MAX_DEAD_TIME_ERROR, instead > MAX_DEAD_TIME_ERROR)
        }
    };
    let message = format!(
        "dead time is confounded with the lag of an amplifier: the records tell the sum of all lags, {}, and hardly a lag of \
         {value:.2} samples in front of the hysteresis from a dead time",
        with_error_of_lag(part.lag(), errors.lag)
    );
    is_doubtful.then(|| Finding::new(FindingCode::DeadTimeConfounded, value, limit, message))
}

/// A dead time without dynamics that the records do not tell.
pub(crate) fn untold_dead_time(space: &Space, fit: &ProjectedFit, errors: &StandardErrors) -> Option<Finding> {
    /// A dead time counts from so many samples on.
    const MIN_SAMPLES: f64 = 0.5;
    let axis = space.axis(Parameter::DeadTime)?;
    let (value, dt) = (fit.point.get(Parameter::DeadTime), space.intervals().smallest());
    let (samples, error) = (value / dt, errors.dead_time / dt);
    let message = if error.is_nan() {
        format!("the records do not tell the dead time, {samples:.2} samples")
    } else {
        format!("the standard error of the dead time, {samples:.2} samples, is {error:.2} samples")
    };
    let inside = axis.lower < value && value < axis.upper;
    let untold = samples > MIN_SAMPLES && (error > samples || (error.is_nan() && inside));
    untold.then(|| Finding::new(FindingCode::DeadTimeConfounded, error, samples, message))
}

/// The evidence for dynamics, and what noise alone may pretend.
fn too_little(space: &Space, (evidence, needed): (f64, f64)) -> Finding {
    let instead = if space.order().is_some() { "critically damped ones" } else { "a dead time alone" };
    let message = format!(
        "the dynamics lower the sum of squares by {evidence:.1} noise variances, and noise alone may pretend {needed:.1}: the \
         result has {instead} with the same lag"
    );
    Finding::new(FindingCode::ResonanceNotExcited, evidence, needed, message)
}

fn negative(space: &Space, fit: &ProjectedFit) -> Option<Finding> {
    let value = fit.point.get(Parameter::DeadTime);
    let samples = value / space.intervals().smallest();
    let is_edge = space.axis(Parameter::DeadTime).is_some_and(|axis| value <= axis.lower);
    let or_more = if is_edge { " or more: the search for it ended at the edge of its domain" } else { "" };
    let message = format!("the position leads the drive by {:.2} samples{or_more}", -samples);
    let code = FindingCode::NegativeDeadTime;
    (samples < NEGATIVE_SAMPLES).then(|| Finding::new(code, samples, NEGATIVE_SAMPLES, message))
}
