//! What a record cannot tell, and what a model left in it: findings by name, each with its number and its limit.
//!
//! One pass over the records with all operators (`survey`) gives the residuals. Then every record is looked at: its
//! loops, its samples, where signals stand still, whether it has several parts; and every residual: how large it is,
//! where, and what it follows.

pub(crate) mod finding;
pub(crate) mod finding_code;
pub(crate) mod loops;
pub(crate) mod parts;
pub(crate) mod residual;
pub(crate) mod sample_ranges;
pub(crate) mod samples;
pub(crate) mod still;
pub(crate) mod survey;

use hysteresis_core::Model;

use crate::error::Error;
use crate::fit::response::{Chain, OperatorsAt};
use crate::judge::finding::{Finding, Severity, causes};
use crate::judge::finding_code::FindingCode;
use crate::judge::still::Stays;
use crate::judge::survey::Survey;
use crate::options::{Options, Setting};
use crate::records::record::{Record, check_times, largest_range};
use crate::records::signal;
use crate::records::signal::as_f64;
use crate::terms::dynamics::LinearPart;
use crate::terms::operators::{OperatorBank, Thresholds};

/// Looks for what records cannot tell and what a model left in them, in their fitted samples, given the model and dead
/// time fitted to them; `dead_time` in seconds, or in samples for records without a sampling interval.
///
/// Each record has an output offset of its own, the one that its residuals have no mean with. One pass over the records
/// with all operators, and a QR of their outputs: the work of one step of an identification. Where the sign of the
/// position is wrong, what the model left is only measured: what it follows says nothing then.
///
/// ```
/// use hysteresis_core::Process;
/// use hysteresis_identify::{FindingCode, Record, Verdict, diagnose};
/// use hysteresis_simulate::paper;
///
/// let actuator = paper::table_1_recovered();
/// let mut stream = actuator.forward();
/// // Full strokes alone, between -500 and 500 V.
/// let input: Vec<f64> = (0..4000).map(|k| 500.0 * (k as f64 / 100.0).sin()).collect();
/// let output: Vec<f64> = input.iter().map(|u| stream.step(*u)).collect();
/// let findings = diagnose(&[Record::new(&input, &output, 0)?], &actuator.into(), 0.0)?;
/// let codes: Vec<FindingCode> = findings.iter().map(|found| found.code).collect();
/// assert_eq!(codes, [FindingCode::NoMinorLoops, FindingCode::RateDependenceNotTold]);
/// assert_eq!(Verdict::of(&findings), Verdict::Amber);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
///
/// # Errors
/// [`Error::NoRecords`], [`Error::NoInterval`] if some records have a sampling interval and others not,
/// [`Error::Record`] for times that contradict it, and [`Error::Core`] for a dead time that is negative or not below
/// the length of every record.
pub fn diagnose(records: &[Record<'_>], model: &Model, dead_time: f64) -> Result<Vec<Finding>, Error> {
    let Some(first) = records.first() else {
        return Err(Error::NoRecords);
    };
    check_times(records, None)?;
    Options { dead_time: Setting::Fixed(dead_time), ..Options::default() }.intervals(records)?;
    let (bank, weights, offsets) = OperatorBank::of_model(model);
    let (operators, linear) = (OperatorsAt::alone(bank, offsets.input), LinearPart::delay(dead_time));
    let found = findings(records, &Chain::from_rest(operators, weights, linear, first.dt().unwrap_or(1.0)));
    let is_there = |code| found.iter().any(|finding: &Finding| finding.code == code);
    let explains_all = is_there(FindingCode::WrongSign) && is_there(FindingCode::PoorFit);
    Ok(if explains_all { causes(found) } else { found })
}

/// The findings about a fitted chain whose operators have these thresholds.
pub(crate) fn findings_of_fit(records: &[Record<'_>], chain: &Chain, thresholds: &Thresholds) -> Vec<Finding> {
    let mut found = findings(records, chain);
    // Thresholds that the fit places follow the input: where ratios carry one beyond, no number is missing.
    let are_given = matches!(thresholds, Thresholds::Given(_));
    found.retain(|finding| are_given || finding.code != FindingCode::UnreachedThreshold);
    found
}

/// Whether a fit is of no use, or leaves more than noise.
pub(crate) fn is_poor(warnings: &[Finding]) -> bool {
    warnings.iter().any(|finding| finding.severity == Severity::Red || finding.code == FindingCode::PoorFit)
}

/// The findings about a whole chain. What records leave out says nothing but how much it is.
fn findings(records: &[Record<'_>], chain: &Chain) -> Vec<Finding> {
    let failed = worst(records, |_, record| samples::failed_rows(record));
    let mut found = if records.iter().all(|record| record.left_out().is_empty()) {
        of_complete(records, chain)
    } else {
        let positions = mended_positions(records, chain);
        let mut found = of_complete(&leaving_none_out(records, &positions), chain);
        found.extend(worst(records, |_, record| Some(samples::left_out(record))));
        found
    };
    found.extend(failed);
    let spoils = |finding: &Finding| finding.code.spoils_a_fit();
    if found.iter().any(spoils) { causes(found) } else { found }
}

/// The findings about records of which nothing is left out.
fn of_complete(records: &[Record<'_>], chain: &Chain) -> Vec<Finding> {
    let survey = Survey::of(records, chain);
    let mut found = of_records(records, chain, &survey);
    let all = Whole::of(records);
    found.extend(worst(records, |place, _| Some(residual::poor_fit(&survey.residuals[place], all.range))));
    found.extend([survey.unreached(), survey.collinear(), loops::implausible(records, chain)].into_iter().flatten());
    found.extend(survey.leakage());
    found.extend(of_residuals(records, chain, &survey));
    let is_clipped =
        |finding: &Finding| finding.code == FindingCode::ClippedOutput && finding.severity == Severity::Red;
    if found.iter().any(is_clipped) {
        // The beginning is what goes to the end.
        found.retain(|finding| finding.code != FindingCode::StartUpTransient);
    }
    let is_there = |code| found.iter().any(|finding: &Finding| finding.code == code);
    let begins_wrong = is_there(FindingCode::StartUpTransient);
    let drift = survey.slow_change(records, begins_wrong).filter(|_| !is_there(FindingCode::Drift));
    if let Some(drift) = drift {
        found.retain(|finding| finding.code != FindingCode::StartUpTransient);
        found.push(drift);
    }
    found
}

/// Whether the position leads the drive in all records.
pub(crate) fn are_backwards(records: &[Record<'_>]) -> bool {
    records.iter().all(|record| loops::backwards(record).is_some_and(|found| found.value > found.limit))
}

/// Whether the position of some record falls where its drive rises.
pub(crate) fn is_falling(records: &[Record<'_>]) -> bool {
    wrong_sign(records).is_some()
}

fn wrong_sign(records: &[Record<'_>]) -> Option<Finding> {
    let found = worst(records, |_, record| loops::wrong_sign(record))?;
    Some(if loops::fall_one_by_one(records) {
        found.try_next(
            "turn the sign of the position in this record alone, in its file: --negate-output, or -y, turns all".into(),
        )
    } else {
        found
    })
}

/// What a model explains leaves less than that share of the range.
const EXPLAINED: f64 = 2e-3;

/// A model that leaves more than that share of the range has no lag that means something.
const TELLS_A_LAG: f64 = 0.1;

/// What the records show by themselves.
fn of_records(records: &[Record<'_>], chain: &Chain, survey: &Survey) -> Vec<Finding> {
    let minor_loops = loops::no_minor_loops(records);
    let identical = if minor_loops.is_none() { loops::identical(records) } else { None };
    // Dynamics make a position turn elsewhere and move by another factor, too: what the model explains is no defect.
    let unexplained =
        |place: usize, record: &Record<'_>| signal::rms(&survey.residuals[place]) > EXPLAINED * record.output_range();
    let doubted = |measure: fn(&Record<'_>) -> Option<Finding>| {
        worst(records, |place, record| measure(record).filter(|_| unexplained(place, record)))
    };
    let gain_change = worst(records, |place, record| parts::gain_change(record, &survey.residuals[place]));
    // The turns of a noisy drive are anywhere.
    let noisy = worst(records, |_, record| samples::noisy_input(record));
    let checks = [
        wrong_sign(records),
        loops::records_differ(records),
        worst(records, |_, record| loops::backwards(record)),
        loops::no_hysteresis(records),
        if chain.linear.is_dead_time_alone() && noisy.is_none() { doubted(loops::early) } else { None },
        if gain_change.is_none() { doubted(parts::wraps) } else { None },
        gain_change,
        noisy,
        doubted(samples::input_outliers),
        doubted(|record| Stays::of(record, 0).stuck(record)),
        worst(records, |_, record| parts::gap(record)),
        worst(records, |_, record| parts::rate_change(record)),
        worst(records, |_, record| parts::jitter(record)),
        too_few_samples(records, survey),
        minor_loops,
        identical,
        loops::one_rate(records),
    ];
    checks.into_iter().flatten().collect()
}

/// What the position does in the records together. A small record beside others tells what a small signal tells; what
/// the model leaves there is judged by what the stage does as a whole.
struct Whole {
    /// The largest peak-to-peak.
    range: f64,
    /// The largest standard deviation.
    deviation: f64,
}

impl Whole {
    fn of(records: &[Record<'_>]) -> Self {
        let deviation = |record: &Record<'_>| signal::rms(&signal::centred(&record.output()[record.skip()..]));
        Self { range: largest_range(records), deviation: records.iter().map(deviation).fold(0.0, f64::max) }
    }
}

/// What the model left.
fn of_residuals(records: &[Record<'_>], chain: &Chain, survey: &Survey) -> Vec<Finding> {
    let of = |place: usize| &survey.residuals[place][..];
    let lag = |record: &Record<'_>| chain.linear.lag().max(0.0) / record.dt().unwrap_or(chain.dt);
    let all = Whole::of(records);
    let start_up = |place: usize, record: &Record<'_>| residual::start_up(record, of(place), all.range);
    let mut found: Vec<_> = worst(records, start_up).into_iter().collect();
    let followed = |(place, record)| residual::followed(record, of(place), lag(record), all.range);
    let followed: Vec<Vec<Finding>> = records.iter().enumerate().map(followed).collect();
    for code in residual::CODES {
        found.extend(worst(records, |place, _| followed[place].iter().find(|found| found.code == code).cloned()));
    }
    let unexplained = |place: usize| {
        let explains_motion = !chain.linear.is_dead_time_alone() || chain.linear.bandwidth.is_some();
        if explains_motion { of(place) } else { &records[place].output()[records[place].skip()..] }
    };
    let bursts: Vec<_> = records.iter().enumerate().map(|(place, record)| samples::bursts(record, of(place))).collect();
    let last = [
        worst(records, |place, _| Some(samples::unrelated(of(place), all.deviation))),
        worst(records, |place, record| samples::outliers(record, of(place))),
        worst(records, |place, record| samples::bad_stretch(record, of(place), &bursts[place])),
        worst(records, |place, record| samples::jump(record, of(place), &bursts[place])),
        worst(records, |place, record| still::input(record, unexplained(place), of(place))),
        worst(records, |place, record| {
            let left = signal::rms(of(place)) / record.output_range();
            let lag = if left < TELLS_A_LAG { whole(lag(record)) } else { 0 };
            let noisy = || still::clipped(record).filter(|_| left > EXPLAINED);
            Stays::of(record, lag).clipped(record).filter(is_past).or_else(noisy)
        }),
        worst(records, |place, record| Some(residual::clipped_input(record, unexplained(place), of(place)))),
    ];
    found.extend(last.into_iter().flatten());
    found
}

/// The finding of the record that is furthest past its limit, if one is.
fn worst(records: &[Record<'_>], measure: impl Fn(usize, &Record<'_>) -> Option<Finding>) -> Option<Finding> {
    let measured = records.iter().enumerate().filter_map(|(i, record)| Some((i, measure(i, record)?)));
    let past = measured.filter(|(_, m)| is_past(m));
    let (place, most) = past.max_by(|(_, a), (_, b)| (a.value / a.limit).total_cmp(&(b.value / b.limit)))?;
    Some(Finding { record: (records.len() > 1).then_some(place), ..most })
}

/// So many whole samples; none of what is not finite.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, from 0 on")]
fn whole(samples: f64) -> usize {
    samples.floor() as usize
}

fn is_past(finding: &Finding) -> bool {
    finding.value / finding.limit > 1.0
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

/// The position of every record, left-out samples replaced by the prediction and a straight line between the residuals
/// about them: what they were says nothing about the stage.
fn mended_positions(records: &[Record<'_>], chain: &Chain) -> Vec<Vec<f64>> {
    let mend = |(place, record): (usize, &Record<'_>)| {
        let mut output = record.output().to_vec();
        let predicted = chain.response_in(place, record.input(), record.dt().unwrap_or(chain.dt));
        let left = |k: usize| record.output()[k] - predicted[k];
        let fitted: Vec<usize> = record.fitted().collect();
        for k in record.left_out() {
            let next = fitted.partition_point(|other| other < k);
            let (before, after) = (next.checked_sub(1).map(|place| fitted[place]), fitted.get(next).copied());
            let residual = match (before, after) {
                (Some(p), Some(q)) => left(p) + (left(q) - left(p)) * as_f64(k - p) / as_f64(q - p),
                (one, other) => one.or(other).map_or(0.0, left),
            };
            output[*k] = predicted[*k] + residual;
        }
        output
    };
    records.iter().enumerate().map(mend).collect()
}

/// The same records with these positions, of which nothing is left out.
pub(crate) fn leaving_none_out<'a>(records: &[Record<'a>], positions: &'a [Vec<f64>]) -> Vec<Record<'a>> {
    // What is fitted varies and what is predicted is finite: no position is refused.
    records.iter().zip(positions).map(|(record, position)| record.with_output(position).unwrap_or(*record)).collect()
}

/// The findings about records without a sampling interval, for a dead time in samples: whatever has a time cannot be
/// fitted, so where something has one the interval is what to try first.
pub(crate) fn without_interval(mut findings: Vec<Finding>, dead_time: f64) -> Vec<Finding> {
    const LIMIT: f64 = 0.5;
    let hint = FindingCode::NoInterval.hint();
    for finding in &mut findings {
        if matches!(finding.code, FindingCode::Drift | FindingCode::RateEffects | FindingCode::DeadTimeConfounded) {
            finding.hint = format!("{hint}; or {}", finding.hint);
        }
    }
    let message = format!(
        "the position is {dead_time:.2} samples late, and how long a sample is is not known: the stage has no dead time, and \
         neither dynamics nor creep can be fitted"
    );
    if dead_time > LIMIT {
        findings.push(Finding::new(FindingCode::NoInterval, dead_time, LIMIT, message));
    }
    findings
}
