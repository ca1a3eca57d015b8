//! What makes a result from places doubtful: findings.

use hysteresis_control::stage::TemperatureTerm;

use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::places::given::Given;
use crate::places::rows::{Rows, between};
use crate::places::weighing::Weighed;
use crate::records::course::turns;
use crate::records::signal;
use crate::records::signal::as_f64;

/// A turn of the drive by less than this share of its range is none of a loop.
const LOOP: f64 = 0.02;

/// The strokes of loops are of one size if the smallest is more than this share of the largest.
const ONE_SIZE: f64 = 0.8;

const MOST_WRONG: f64 = 0.02;
const MOST_UNINFORMATIVE: f64 = 0.5;
const MOST_DISTANCE: f64 = 0.01;
const LEAST_TOLD: f64 = 0.5;

/// A lag above this share of the longest that is searched is at its bound.
const LONGEST_LAG: f64 = 0.99;

/// An equation in which no operator differs by more than this share of the drive range says nothing.
const SAYS_NOTHING: f64 = 1e-3;

/// So many pairs are named; of more, the first.
const NAMED: usize = 20;

/// The pairs that say nothing: those whose row is all but zero in the columns of the operators, so many.
pub(crate) fn uninformative(given: &Given<'_>, rows: &Rows, columns: usize) -> Vec<usize> {
    let (low, high) = signal::bounds_of(given.drives.iter().map(|drive| signal::bounds(drive)));
    let says_nothing = |row: &[f64]| row.iter().all(|value| value.abs() <= SAYS_NOTHING * (high - low));
    let pairs = rows.iter().take(given.pairs.len()).enumerate();
    pairs.filter(|(_, row)| says_nothing(&row[..columns])).map(|(place, _)| place).collect()
}

/// The findings, for the pairs that were left out and those that say nothing.
pub(crate) fn findings(
    given: &Given<'_>,
    weighed: &Weighed,
    range: f64,
    wrong: &[usize],
    uninformative: &[usize],
) -> Vec<Finding> {
    let pairs = given.pairs.len();
    let share = |of: &[usize]| if pairs == 0 { 0.0 } else { as_f64(of.len()) / as_f64(pairs) };
    let of_pairs = |code, places: &[usize], limit: f64, what: &str| {
        let value = share(places);
        let message = format!("{} of {pairs} pairs {what}: {}", places.len(), named(places));
        (value > limit).then(|| Finding::new(code, value, limit, message))
    };
    let differ = |distance: f64, message: String| {
        (distance > MOST_DISTANCE).then(|| Finding::new(FindingCode::PlacesDiffer, distance, MOST_DISTANCE, message))
    };
    let distance = if pairs > 0 { weighed.shares.scale / range } else { 0.0 };
    let message = format!("the two instants of a pair are {:.2} % of the range apart in the model", 100.0 * distance);
    let apart = differ(distance, message);
    let missed = signal::rms(&weighed.length_errors) / range;
    let message = format!("known lengths are missed by {:.2} % of the range, rms", 100.0 * missed);
    let found = [
        of_pairs(FindingCode::WrongPairs, wrong, MOST_WRONG, "contradict the others and were left out"),
        one_loop_size(given, uninformative),
        of_pairs(FindingCode::UninformativePairs, uninformative, MOST_UNINFORMATIVE, "say nothing"),
        apart,
        differ(missed, message),
    ];
    found.into_iter().flatten().collect()
}

/// The finding about a temperature whose sensitivity or lag is not told, with their standard errors and the longest lag that was searched. One
/// as long stands for another slow change.
pub(crate) fn untold_temperature(
    term: &TemperatureTerm,
    (of_sensitivity, of_lag): (f64, f64),
    longest: f64,
) -> Option<Finding> {
    let (kappa, tau) = (term.sensitivity(), term.time_constant());
    let relative = |error: f64, value: f64| if error > 0.0 { error / value.abs() } else { 0.0 };
    let of_bound = if tau >= LONGEST_LAG * longest { 1.0 } else { 0.0 };
    let value = relative(of_sensitivity, kappa).max(relative(of_lag, tau)).max(of_bound);
    let message = format!(
        "the sensitivity to temperature is {kappa:.3e} with a standard error of {of_sensitivity:.1e}, its lag {tau:.3e} s with one of {of_lag:.1e} s"
    );
    // Where even no rows tell it, there is no error either.
    let is_untold = value > LEAST_TOLD || of_sensitivity == 0.0;
    is_untold.then(|| Finding::new(FindingCode::TemperatureNotTold, value, LEAST_TOLD, message))
}

fn named(places: &[usize]) -> String {
    let names: Vec<String> = places.iter().take(NAMED).map(ToString::to_string).collect();
    let more = if places.len() > NAMED { ", ..." } else { "" };
    names.join(", ") + more
}

/// Whether all strokes on which informative pairs and lengths lie are of one size.
fn one_loop_size(given: &Given<'_>, uninformative: &[usize]) -> Option<Finding> {
    let (low, high) = signal::bounds_of(given.drives.iter().map(|drive| signal::bounds(drive)));
    let turns: Vec<Vec<usize>> = given.drives.iter().map(|drive| turns(drive, LOOP * (high - low))).collect();
    let mut smallest = f64::INFINITY;
    let mut largest: f64 = 0.0;
    for (equation, (drive, instants)) in given.equations().enumerate() {
        if uninformative.binary_search(&equation).is_ok() {
            continue;
        }
        for stroke in instants.iter().filter_map(|at| stroke(given.drives[drive], &turns[drive], *at)) {
            (smallest, largest) = (smallest.min(stroke), largest.max(stroke));
        }
    }
    // On no whole stroke there is any: then nothing tells one size from another.
    let value = if largest > 0.0 { smallest / largest } else { 1.0 };
    let smallest = smallest.min(largest);
    let message = format!(
        "the strokes on which pairs and lengths lie are from {smallest:.4} to {largest:.4} in the unit of the drive: loops of one size"
    );
    (value > ONE_SIZE).then(|| Finding::new(FindingCode::OneLoopSize, value, ONE_SIZE, message))
}

/// How far the drive goes between the turns about an instant, the start among them; none after the last.
fn stroke(drive: &[f64], turns: &[usize], instant: f64) -> Option<f64> {
    let next = turns.partition_point(|turn| *turn <= between(instant).0);
    let (before, after) = (turns.get(next.checked_sub(1)?)?, turns.get(next)?);
    Some((drive[*after] - drive[*before]).abs())
}
