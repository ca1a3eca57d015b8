//! How places in a record are named, and what to try about stretches of samples.

use std::ops::Range;

use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::as_f64;

/// So many stretches are named; of more, the first.
const NAMED: usize = 20;

/// The options that leave stretches of samples out of the fit.
pub(crate) fn leave_out(stretches: &[Range<usize>]) -> String {
    format!("leave these samples out of the fit:{}", options("--leave-out", stretches))
}

/// The options that put straight lines in the place of stretches of the drive.
pub(crate) fn mend(stretches: &[Range<usize>]) -> String {
    format!("put straight lines in the place of these samples of the drive:{}", options("--mend", stretches))
}

/// What to do about something between two samples that parts a record in two: fit the longer part.
pub(crate) fn one_part(what: &str, place: Range<usize>, record: &Record<'_>) -> String {
    let before = format!("the part before {what}: --rows {}", place.start);
    let after = format!("the part after it: --skip {}", place.end);
    let is_late = 2 * place.start > record.input().len();
    let (first, second) = if is_late { (before, after) } else { (after, before) };
    format!("fit {first}; or {second}")
}

/// Stretches as ` 7 12-15`: the first and the last sample of each.
pub(crate) fn named(stretches: &[Range<usize>]) -> String {
    let name = |one: &Range<usize>| match one.len() {
        1 => format!(" {}", one.start),
        _ => format!(" {}-{}", one.start, one.end - 1),
    };
    let more = if stretches.len() > NAMED { " and more" } else { "" };
    stretches.iter().take(NAMED).map(name).collect::<String>() + more
}

fn options(name: &str, stretches: &[Range<usize>]) -> String {
    let named = stretches.iter().take(NAMED).map(|one| format!(" {name} {}:{}", one.start, one.end));
    let more = if stretches.len() > NAMED { ", then look for more" } else { "" };
    named.collect::<String>() + more
}

/// Samples in order as stretches; those with at most `gap` others between them are one.
pub(crate) fn stretches(samples: &[usize], gap: usize) -> Vec<Range<usize>> {
    let mut found: Vec<Range<usize>> = Vec::new();
    for sample in samples {
        match found.last_mut() {
            Some(last) if *sample <= last.end + gap => last.end = sample + 1,
            _ => found.push(*sample..sample + 1),
        }
    }
    found
}

/// A sample as people say it: its number, and its time if that is known.
pub(crate) fn named_sample(record: &Record<'_>, sample: usize) -> String {
    match (record.times(), record.dt()) {
        (Some(times), _) => format!("sample {sample} ({:.6} s)", times[sample]),
        (None, Some(dt)) => format!("sample {sample} ({:.6} s)", dt * as_f64(sample)),
        (None, None) => format!("sample {sample}"),
    }
}

/// Lowest and highest input of all fitted samples.
pub(crate) fn input_bounds(records: &[Record<'_>]) -> (f64, f64) {
    signal::bounds_of(records.iter().map(|record| signal::bounds(&record.input()[record.skip()..])))
}
