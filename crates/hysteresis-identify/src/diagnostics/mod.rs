//! What a record cannot tell, and what a model left in it: findings by name, each with its number and its limit.

mod survey;

use hysteresis_core::Model;

use crate::error::Error;
use crate::finding::{Finding, FindingCode};
use crate::fit::chain::Chain;
use crate::fit::intervals::Intervals;
use crate::fit::linear_part::LinearPart;
use crate::fit::regressor::OperatorBank;
use crate::fit::tangent::OperatorsAt;
use crate::numeric::as_f64;
use crate::options::{Options, Setting};
use crate::record::Record;
use crate::signal;
use survey::Survey;

/// Looks for what records cannot tell and what a model left in them, in their fitted samples, given the model and dead time
/// fitted to them; `dead_time` in seconds, or in samples for records without a sampling interval.
///
/// Each record has an output offset of its own, the one that its residuals have no mean with. One pass over the
/// records with all operators, and a QR of their outputs: the work of one step of an identification.
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_identify::{FindingCode, Record, diagnose};
/// use hysteresis_simulate::paper;
///
/// let actuator = paper::table_1_recovered();
/// let mut stream = actuator.forward();
/// // Full strokes alone, between -500 and 500 V.
/// let input: Vec<f64> = (0..4000).map(|k| 500.0 * (k as f64 / 100.0).sin()).collect();
/// let output: Vec<f64> = input.iter().map(|u| stream.step(*u)).collect();
/// let findings = diagnose(&[Record::new(&input, &output, 0)?], &actuator.into(), 0.0)?;
/// assert_eq!(findings.iter().map(|found| found.code).collect::<Vec<_>>(), [FindingCode::NoMinorLoops]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::NoRecords`], [`Error::NoInterval`] if some records have a sampling interval and others not, and
/// [`Error::Core`] for a dead time that is negative or not below the length of every record.
pub fn diagnose(records: &[Record<'_>], model: &Model, dead_time: f64) -> Result<Vec<Finding>, Error> {
    let Some(first) = records.first() else {
        return Err(Error::NoRecords);
    };
    Intervals::of(records, &Options { dead_time: Setting::Fixed(dead_time), ..Options::default() })?;
    let (bank, weights, offsets) = OperatorBank::of_model(model);
    let operators = OperatorsAt { bank, input_offset: offsets.input };
    let linear = LinearPart::delay(dead_time);
    Ok(findings(records, &Chain { operators, weights, linear, dt: first.dt().unwrap_or(1.0) }))
}

/// The findings about a whole chain.
pub(crate) fn findings(records: &[Record<'_>], chain: &Chain) -> Vec<Finding> {
    let survey = Survey::of(records, chain);
    let lag = |record: &Record<'_>| chain.linear.lag().max(0.0) / record.dt().unwrap_or(chain.dt);
    let checks = [
        too_few_samples(records, &survey),
        survey.unreached(),
        no_minor_loops(records),
        survey.collinear(),
        worst(records, |place, record| rate_effects(record, &survey.residuals[place], lag(record))),
        worst(records, |place, record| drift(record, &survey.residuals[place])),
        worst(records, |place, record| outliers(record, &survey.residuals[place])),
        worst(records, |_, record| Some(clipped_output(record))),
        worst(records, |place, record| {
            let residual = &survey.residuals[place];
            let output = &record.output()[record.skip()..];
            let explains_motion = !chain.linear.is_dead_time_alone();
            Some(clipped_input(record, if explains_motion { residual } else { output }, residual))
        }),
    ];
    checks.into_iter().flatten().collect()
}

/// The finding of the record that is furthest past its limit, if one is.
fn worst(records: &[Record<'_>], measure: impl Fn(usize, &Record<'_>) -> Option<Finding>) -> Option<Finding> {
    let measured = records.iter().enumerate().filter_map(|(i, record)| Some((i, measure(i, record)?)));
    let past = measured.filter(|(_, m)| m.value > m.limit);
    let (place, most) = past.max_by(|(_, a), (_, b)| (a.value / a.limit).total_cmp(&(b.value / b.limit)))?;
    Some(Finding { record: (records.len() > 1).then_some(place), ..most })
}

fn too_few_samples(records: &[Record<'_>], survey: &Survey) -> Option<Finding> {
    const LIMIT: f64 = 10.0;
    const SEARCHED: usize = 5;
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    let unknowns = survey.operators() + records.len() + SEARCHED;
    let value = as_f64(samples) / as_f64(unknowns);
    let message = format!("{samples} fitted samples for up to {unknowns} unknowns");
    let measured = Finding::new(FindingCode::TooFewSamples, value, LIMIT, message);
    (value < LIMIT).then_some(measured)
}

fn no_minor_loops(records: &[Record<'_>]) -> Option<Finding> {
    const LIMIT: f64 = 2.0;
    let fitted = || records.iter().map(|record| &record.input()[record.skip()..]);
    let (low, high) = fitted()
        .map(signal::bounds)
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (l, h)| (low.min(l), high.max(h)));
    let (swing, margin) = (0.05 * (high - low), 0.1 * (high - low));
    let inside = |x: &f64| low + margin < *x && *x < high - margin;
    let value = as_f64(
        fitted().map(|input| signal::turns(input, swing).into_iter().filter(|k| inside(&input[*k])).count()).sum(),
    );
    let message = format!(
        "{value} reversals of the input inside its range from {low:.4} to {high:.4}: dead time, ratios and loop width are \
         weakly determined"
    );
    let measured = Finding::new(FindingCode::NoMinorLoops, value, LIMIT, message);
    (value < LIMIT).then_some(measured)
}

fn rate_effects(record: &Record<'_>, residual: &[f64], delay: f64) -> Option<Finding> {
    let speed = signal::speed(record.input(), record.skip(), delay);
    let (value, limit) = correlation(record, residual, &speed)?;
    let message = format!(
        "the residual follows the speed of the input, correlation {value:.2}: a lag, another rate effect, or loop \
         width that the model lacks"
    );
    Some(Finding::new(FindingCode::RateEffects, value.abs(), limit, message))
}

fn drift(record: &Record<'_>, residual: &[f64]) -> Option<Finding> {
    let time: Vec<f64> = (0..residual.len()).map(as_f64).collect();
    let logarithm: Vec<f64> = time.iter().map(|t| t.ln_1p()).collect();
    let measure = |clock: &[f64], name: &str| {
        let (value, limit) = correlation(record, residual, clock)?;
        let message =
            format!("the residual follows {name}, correlation {value:.2}: creep, temperature or another slow change");
        Some(Finding::new(FindingCode::Drift, value.abs(), limit, message))
    };
    let linear = measure(&time, "time")?;
    let creep = measure(&logarithm, "the logarithm of time")?;
    Some(if creep.value / creep.limit > linear.value / linear.limit { creep } else { linear })
}

/// The correlation of the residual with a signal, and the limit of its magnitude; nothing if what they share is too
/// small to matter.
fn correlation(record: &Record<'_>, residual: &[f64], other: &[f64]) -> Option<(f64, f64)> {
    const STRONG: f64 = 0.3;
    const CHANCE: f64 = 4.0;
    const MATTERS: f64 = 1e-4;
    let value = signal::correlation(residual, other)?;
    if value.abs() * signal::rms(residual) < MATTERS * record.output_range() {
        return None;
    }
    let both = (signal::neighbours(residual) * signal::neighbours(other)).max(0.0);
    let independent = as_f64(residual.len()) * (1.0 - both) / (1.0 + both);
    Some((value, STRONG.max(CHANCE / independent.sqrt())))
}

fn outliers(record: &Record<'_>, residual: &[f64]) -> Option<Finding> {
    const LIMIT: f64 = 7.0;
    const SMALLEST: f64 = 1e-5;
    let deviation = signal::robust_deviation(residual).max(SMALLEST * record.output_range());
    let distances = signal::distances_from_neighbours(residual);
    let far = distances.iter().filter(|distance| **distance > LIMIT * deviation).count();
    let (first, largest) = distances.iter().enumerate().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let value = largest / deviation;
    let message = format!(
        "{far} samples lie far from their neighbours, the furthest sample {} by {value:.1} standard deviations",
        record.skip() + first
    );
    Some(Finding::new(FindingCode::Outliers, value, LIMIT, message))
}

fn clipped_output(record: &Record<'_>) -> Finding {
    const LIMIT: f64 = 0.02;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    let (value, level) = signal::travel_at_the_ends(output, input, high - low);
    let message = format!(
        "the output stays at {level:.6} while the input moves by {:.1} % of its range: a sensor or converter at its end",
        100.0 * value
    );
    Finding::new(FindingCode::ClippedOutput, value, LIMIT, message)
}

/// `unexplained` is what moves while the input stays at its end: the output, or with dynamics and creep the residual.
fn clipped_input(record: &Record<'_>, unexplained: &[f64], residual: &[f64]) -> Finding {
    const HELD: f64 = 0.05;
    const NOISE: f64 = 8.0;
    let (input, range) = (&record.input()[record.skip()..], record.output_range());
    let (value, level) = signal::travel_at_the_ends(input, unexplained, range);
    let limit = HELD + NOISE * signal::noise(residual) / range;
    let message = format!(
        "the recorded input stays at {level:.6} while the output moves by {:.1} % of its range: a monitor at its end",
        100.0 * value
    );
    Finding::new(FindingCode::ClippedInput, value, limit, message)
}
