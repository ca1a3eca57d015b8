//! When samples were taken: gaps and jitter.

use super::hints::one_part;
use super::named_sample;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::numeric::as_f64;
use crate::record::Record;
use crate::signal;

/// Samples on either side that tell where the grid of times is.
const AROUND: usize = 5;

/// Missing samples: the longest of all steps by which the times leave their grid for good.
pub(super) fn gap(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 1.9;
    let (offsets, interval) = grid(record)?;
    let step = |k: &usize| {
        let (before, after) = (&offsets[k - AROUND..*k], &offsets[*k..k + AROUND]);
        signal::median(after) - signal::median(before)
    };
    // Of the samples about a gap, which all see it, the one where the times jump.
    let jump = |k: usize| offsets[k] - offsets[k - 1];
    let last = offsets.len() - AROUND;
    let longest = (AROUND..=last).filter(|k| jump(*k) > 0.5).max_by(|a, b| step(a).total_cmp(&step(b)))?;
    let (value, sample) = (1.0 + step(&longest), record.skip() + longest);
    let message = format!(
        "no sample for {value:.1} sampling intervals of {interval:.6} s before {}",
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::TimeGap, value, LIMIT, message).at(sample);
    Some(finding.try_next(one_part("the gap", sample..sample, record)))
}

/// Another sampling interval from some sample on: a record of two rates.
pub(super) fn rate_change(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 1.2;
    /// Steps whose mean is an interval: rounded times do not move it.
    const STEPS: usize = 25;
    let times = &record.times()?[record.skip()..];
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let mean = |part: &[f64]| part.iter().sum::<f64>() / as_f64(part.len());
    // A gap makes one step long, and is no other rate.
    let is_even = |part: &&[f64]| signal::bounds(part).1 < 2.0 * mean(part);
    let means: Vec<f64> = steps.chunks_exact(STEPS).filter(is_even).map(mean).collect();
    let (short, long) = means.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), step| (a.min(*step), b.max(*step)));
    let first = *means.first()?;
    let ratio = |step: f64| (step / first).max(first / step);
    let other = (0..steps.len().saturating_sub(STEPS)).find(|k| ratio(mean(&steps[*k..k + STEPS])) > LIMIT)?;
    let around = other..(other + STEPS).min(steps.len());
    let (value, sample) = (long / short, record.skip() + 1 + first_other(&steps[around], first) + other);
    let message = format!(
        "the sampling interval changes by a factor of {value:.2}: it is {first:.6} s at first, and another one from {} on",
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::RateChange, value, LIMIT, message).at(sample);
    Some(finding.try_next(one_part("the change", sample..sample, record)))
}

/// Where in these steps the interval leaves the usual one.
fn first_other(steps: &[f64], usual: f64) -> usize {
    const FAR: f64 = 0.1;
    steps.iter().position(|step| (step / usual - 1.0).abs() > FAR).unwrap_or(0)
}

/// Uneven intervals: how far times are from their grid, gaps left out.
pub(super) fn jitter(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.1;
    let (offsets, interval) = grid(record)?;
    let distance = |k: usize| offsets[k] - signal::median(&offsets[k - AROUND..=k + AROUND]);
    let distances: Vec<f64> = (AROUND..offsets.len() - AROUND).map(distance).collect();
    let (value, worst) = (signal::rms(&distances), signal::largest(&distances)?);
    let sample = record.skip() + AROUND + worst;
    let message = format!(
        "samples are {:.0} % of the sampling interval of {interval:.6} s from an even grid, rms, most {}",
        100.0 * value,
        named_sample(record, sample)
    );
    Some(Finding::new(FindingCode::TimeJitter, value, LIMIT, message).at(sample))
}

/// How many sampling intervals the times of the fitted samples are from an even grid, and the interval.
fn grid(record: &Record<'_>) -> Option<(Vec<f64>, f64)> {
    let times = &record.times()?[record.skip()..];
    let most = times.len() / 4;
    if most < AROUND {
        return None;
    }
    let interval = signal::usual_step(times, most);
    let offset = |(k, time): (usize, &f64)| (time - times[0]) / interval - as_f64(k);
    (interval > 0.0).then(|| (times.iter().enumerate().map(offset).collect(), interval))
}
