//! When samples were taken: gaps and jitter.

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
    Some(Finding::new(FindingCode::TimeGap, value, LIMIT, message).at(sample))
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

/// How many sampling intervals the times of the fitted samples are from an even grid, and the interval: the median of mean
/// intervals over so many samples that neither rounded times nor gaps move it.
fn grid(record: &Record<'_>) -> Option<(Vec<f64>, f64)> {
    const SAMPLES: usize = 50;
    let times = &record.times()?[record.skip()..];
    let over = SAMPLES.min(times.len() / 4);
    if over < AROUND {
        return None;
    }
    let means: Vec<f64> = times.windows(over + 1).map(|part| (part[over] - part[0]) / as_f64(over)).collect();
    let interval = signal::median(&means);
    let offset = |(k, time): (usize, &f64)| (time - times[0]) / interval - as_f64(k);
    (interval > 0.0).then(|| (times.iter().enumerate().map(offset).collect(), interval))
}
