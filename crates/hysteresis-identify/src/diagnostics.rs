//! What a record cannot tell, and what a model left in it: findings by name, each with its number and its limit.

pub(crate) mod signal;
mod survey;

use std::fmt;

use hysteresis_core::Model;

use crate::error::Error;
use crate::quality::as_f64;
use crate::record::Record;
use survey::Survey;

/// What may be wrong with records, or with a model fitted to them.
///
/// A name is a contract: it stays, and the number behind it may be compared with its limit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Defect {
    /// Operators whose output never changes in the fitted samples: the input reaches no threshold of theirs, so their
    /// weights are not determined. Value: how many, limit 0.
    UnreachedThreshold,
    /// Fewer reversals inside the input range than the limit 2: delay, ratios and loop width are weakly determined,
    /// for on full strokes alone each makes up for the others. Value: the number of such reversals, at least a
    /// twentieth of the range high and a tenth of it away from both ends.
    NoMinorLoops,
    /// Operators that this record does not tell apart. Value: the standard error of the least determined combination
    /// of operators over the mean contribution of one operator to the output, limit 1. The error is that of least
    /// squares, sigma / s, with sigma the rms residual, widened where residuals are correlated, and s the smallest
    /// singular value of the operator outputs scaled to unit length (as Belsley, Kuh and Welsch scale them,
    /// "Regression Diagnostics", Wiley 1980).
    CollinearOperators,
    /// The residual follows the speed of the input: a lag, another rate effect, or loop width that the model lacks.
    /// Value and limit as for [`Drift`](Self::Drift).
    RateEffects,
    /// The residual follows time or its logarithm: creep, temperature. Value: the magnitude of the correlation
    /// coefficient; limit: 0.3, about a tenth of the variance of the residual, or what chance gives once in 10^4
    /// records, 4 / sqrt(m), if that is more. m is the number of independent samples, N (1 - a b) / (1 + a b) with a
    /// and b the correlations of neighbouring samples of either signal (Bartlett, J. Roy. Stat. Soc. 98, 536, 1935).
    /// What moves the output by less than 1e-4 of its range rms is not told.
    Drift,
    /// Samples far from their neighbours. Value: the largest distance of a residual from the median of the five
    /// around it, in robust standard deviations of all residuals (1.4826 times the median of magnitudes); limit 7,
    /// which noise of normal distribution passes less than once in 10^8 samples. A deviation below 1e-5 of the range
    /// counts as that. A model without the lag of its actuator may leave such peaks at fast reversals too.
    Outliers,
    /// The output stays at its highest or lowest value while the input moves on. Value: how far the input moves
    /// meanwhile, over its range; limit 0.02, above what eight bits make of a turn.
    ClippedOutput,
    /// The recorded input stays at its highest or lowest value while the output moves on. Value: how far the output
    /// moves meanwhile, over its range; limit: 0.05 and eight standard deviations of its noise, above what creep and
    /// noise do while an input is held.
    ClippedInput,
    /// Fewer fitted samples for each unknown (weights, output offsets, and up to three ratios, input offset, delay)
    /// than the limit 10, a common rule of thumb. Value: samples for each unknown.
    TooFewSamples,
}

impl Defect {
    /// The name, in snake case.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::UnreachedThreshold => "unreached_threshold",
            Self::NoMinorLoops => "no_minor_loops",
            Self::CollinearOperators => "collinear_operators",
            Self::RateEffects => "rate_effects",
            Self::Drift => "drift",
            Self::Outliers => "outliers",
            Self::ClippedOutput => "clipped_output",
            Self::ClippedInput => "clipped_input",
            Self::TooFewSamples => "too_few_samples",
        }
    }
}

impl fmt::Display for Defect {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Something found: which defect, what it means here, and how far its number is past its limit.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Finding {
    /// Which.
    pub defect: Defect,
    /// One sentence with the numbers in it.
    pub message: String,
    /// The number that was compared; what it is says [`Defect`].
    pub value: f64,
    /// What it was compared with.
    pub limit: f64,
    /// The record that shows it most, where records are looked at one by one.
    pub record: Option<usize>,
}

/// Looks for every [`Defect`] in the fitted samples of `records`, given the model and delay fitted to them.
///
/// Each record has an output offset of its own, the one that its residuals have no mean with. One pass over the
/// records with all operators, and a QR of their outputs: the work of one step of an identification.
///
/// ```
/// use hysteresis_core::{Process, paper};
/// use hysteresis_identify::{Defect, Record, diagnose};
///
/// let actuator = paper::table_1_recovered();
/// let mut stream = actuator.forward();
/// // Full strokes alone, between -500 and 500 V.
/// let input: Vec<f64> = (0..4000).map(|k| 500.0 * (k as f64 / 100.0).sin()).collect();
/// let output: Vec<f64> = input.iter().map(|u| stream.step(*u)).collect();
/// let findings = diagnose(&[Record::new(&input, &output, 0)?], &actuator.into(), 0.0)?;
/// assert_eq!(findings.iter().map(|found| found.defect).collect::<Vec<_>>(), [Defect::NoMinorLoops]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::NoRecords`], and [`Error::Domain`] for a delay that is negative or not below the length of every record.
pub fn diagnose(records: &[Record<'_>], model: &Model, delay: f64) -> Result<Vec<Finding>, Error> {
    let Some(shortest) = records.iter().map(|record| record.input().len()).min() else {
        return Err(Error::NoRecords);
    };
    if !(delay >= 0.0 && delay < as_f64(shortest)) {
        let expected = "a number >= 0 below the length of the shortest record";
        return Err(Error::Domain { parameter: "delay", index: None, expected, got: delay });
    }
    let survey = Survey::of(records, model, delay);
    let checks = [
        too_few_samples(records, &survey),
        survey.unreached(),
        no_minor_loops(records),
        survey.collinear(),
        worst(records, |place, record| rate_effects(record, &survey.residuals[place], delay)),
        worst(records, |place, record| drift(record, &survey.residuals[place])),
        worst(records, |place, record| outliers(record, &survey.residuals[place])),
        worst(records, |_, record| Some(clipped_output(record))),
        worst(records, |place, record| Some(clipped_input(record, &survey.residuals[place]))),
    ];
    Ok(checks.into_iter().flatten().collect())
}

/// A number before it is known whether it is past its limit.
struct Measured {
    defect: Defect,
    value: f64,
    limit: f64,
    message: String,
}

impl Measured {
    fn into_finding(self, record: Option<usize>) -> Finding {
        let Self { defect, value, limit, message } = self;
        Finding { defect, message, value, limit, record }
    }
}

/// The finding of the record that is furthest past its limit, if one is.
fn worst(records: &[Record<'_>], measure: impl Fn(usize, &Record<'_>) -> Option<Measured>) -> Option<Finding> {
    let measured = records.iter().enumerate().filter_map(|(i, record)| Some((i, measure(i, record)?)));
    let past = measured.filter(|(_, m)| m.value > m.limit);
    let (place, most) = past.max_by(|(_, a), (_, b)| (a.value / a.limit).total_cmp(&(b.value / b.limit)))?;
    Some(most.into_finding((records.len() > 1).then_some(place)))
}

fn too_few_samples(records: &[Record<'_>], survey: &Survey) -> Option<Finding> {
    const LIMIT: f64 = 10.0;
    const SEARCHED: usize = 5;
    let samples: usize = records.iter().map(Record::fitted_samples).sum();
    let unknowns = survey.operators() + records.len() + SEARCHED;
    let value = as_f64(samples) / as_f64(unknowns);
    let message =
        format!("{samples} fitted samples for up to {unknowns} unknowns: record longer, or fit fewer operators");
    let measured = Measured { defect: Defect::TooFewSamples, value, limit: LIMIT, message };
    (value < LIMIT).then(|| measured.into_finding(None))
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
        "{value} reversals of the input inside its range from {low:.4} to {high:.4}: delay, ratios and loop width are \
         weakly determined, add a decaying sweep"
    );
    let measured = Measured { defect: Defect::NoMinorLoops, value, limit: LIMIT, message };
    (value < LIMIT).then(|| measured.into_finding(None))
}

fn rate_effects(record: &Record<'_>, residual: &[f64], delay: f64) -> Option<Measured> {
    let speed = signal::speed(record.input(), record.skip(), delay);
    let (value, limit) = correlation(record, residual, &speed)?;
    let message = format!(
        "the residual follows the speed of the input, correlation {value:.2}: a lag, another rate effect, or loop \
         width that the model lacks"
    );
    Some(Measured { defect: Defect::RateEffects, value: value.abs(), limit, message })
}

fn drift(record: &Record<'_>, residual: &[f64]) -> Option<Measured> {
    let time: Vec<f64> = (0..residual.len()).map(as_f64).collect();
    let logarithm: Vec<f64> = time.iter().map(|t| t.ln_1p()).collect();
    let measure = |clock: &[f64], name: &str| {
        let (value, limit) = correlation(record, residual, clock)?;
        let message =
            format!("the residual follows {name}, correlation {value:.2}: creep, temperature or another slow change");
        Some(Measured { defect: Defect::Drift, value: value.abs(), limit, message })
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

fn outliers(record: &Record<'_>, residual: &[f64]) -> Option<Measured> {
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
    Some(Measured { defect: Defect::Outliers, value, limit: LIMIT, message })
}

fn clipped_output(record: &Record<'_>) -> Measured {
    const LIMIT: f64 = 0.02;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (value, level) = signal::travel_at_the_ends(output, input);
    let message = format!(
        "the output stays at {level:.6} while the input moves by {:.1} % of its range: a sensor or converter at its end",
        100.0 * value
    );
    Measured { defect: Defect::ClippedOutput, value, limit: LIMIT, message }
}

fn clipped_input(record: &Record<'_>, residual: &[f64]) -> Measured {
    const HELD: f64 = 0.05;
    const NOISE: f64 = 8.0;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (value, level) = signal::travel_at_the_ends(input, output);
    let limit = HELD + NOISE * signal::noise(residual) / record.output_range();
    let message = format!(
        "the recorded input stays at {level:.6} while the output moves by {:.1} % of its range: a monitor at its end",
        100.0 * value
    );
    Measured { defect: Defect::ClippedInput, value, limit, message }
}
