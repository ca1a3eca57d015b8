//! What makes a result from places doubtful: findings.

use hysteresis_control::stage::TemperatureTerm;

use crate::error::Error;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::places::beside::moved_by;
use crate::places::given::Given;
use crate::places::rows::{Rows, between, kept};
use crate::places::weighing::Weighed;
use crate::records::course::turns;
use crate::records::signal;
use crate::records::signal::{as_f64, rms};

/// A turn of the drive by less than this share of its range is none of a loop.
const LOOP: f64 = 0.02;

/// The strokes of loops are of one size if the smallest is more than this share of the largest.
const ONE_SIZE: f64 = 0.8;

const MOST_WRONG: f64 = 0.02;
const MOST_UNINFORMATIVE: f64 = 0.5;
const MOST_DISTANCE: f64 = 0.01;

/// A temperature is not told where its sensitivity, or what it adds, is uncertain by more than this share: of all lags
/// the one is taken that suits what is left best, and by chance one of them comes to three standard errors.
const LEAST_TOLD: f64 = 0.25;

/// A lag above this share of the longest that is searched is at its bound.
const LONGEST_LAG: f64 = 0.99;

/// An equation in which no operator differs by more than this share of the drive range says nothing.
pub(crate) const SAYS_NOTHING: f64 = 1e-3;

/// Where no operator goes back, and one goes this share of the drive range, a length of this share of the longest does
/// not go back.
const CLEAR_WAY: f64 = 0.1;

/// Lengths alone are missed if they are by more than this share of what a straight line misses.
const MOST_MISSED: f64 = 0.25;

/// Positions are not told where their uncertainty, rms, is more than this share of their range.
const MOST_UNTOLD: f64 = 0.01;

/// The beginning is this share of the time from the first instant to the last; it lies on no loop if mismatches there
/// are so many times as large as later on.
const BEGINNING: f64 = 0.1;
const MOST_AT_THE_BEGINNING: f64 = 3.0;

/// What one of them does, and what several do.
const CONTRADICT: (&str, &str) = ("contradicts the others and was left out", "contradict the others and were left out");

/// So many pairs are named; of more, the first.
const NAMED: usize = 20;

/// The pairs that say nothing: those whose row is all but zero in the columns of the operators, so many.
pub(crate) fn uninformative(given: &Given<'_>, rows: &Rows, columns: usize) -> Vec<usize> {
    let (low, high) = given.drive_bounds();
    let says_nothing = |row: &[f64]| row.iter().all(|value| value.abs() <= SAYS_NOTHING * (high - low));
    let pairs = rows.iter().take(given.pairs.len()).enumerate();
    pairs.filter(|(_, row)| says_nothing(&row[..columns])).map(|(place, _)| place).collect()
}

/// The findings, for the pairs and the lengths that were left out, and the pairs that say nothing.
pub(crate) fn findings(
    given: &Given<'_>,
    weighed: &Weighed,
    range: f64,
    (wrong, wrong_lengths): (&[usize], &[usize]),
    uninformative: &[usize],
) -> Vec<Finding> {
    let pairs = given.pairs.len();
    let of = |code, (name, all): (&str, usize), places: &[usize], limit: f64, what: (&str, &str)| {
        let value = if all == 0 { 0.0 } else { as_f64(places.len()) / as_f64(all) };
        let what = if places.len() == 1 { what.0 } else { what.1 };
        let message = format!("{} of {all} {name} {what}: {}", places.len(), named(places));
        (value > limit).then(|| Finding::new(code, value, limit, message))
    };
    let of_pairs = |code, places: &[usize], limit, what| of(code, ("pairs", pairs), places, limit, what);
    let differ = |distance: f64, message: String| {
        (distance > MOST_DISTANCE).then(|| Finding::new(FindingCode::PlacesDiffer, distance, MOST_DISTANCE, message))
    };
    let distance = if pairs > 0 { weighed.shares.scales.pairs / range } else { 0.0 };
    let message = format!("the two instants of a pair are {:.2} % of the range apart in the model", 100.0 * distance);
    let apart = differ(distance, message);
    let missed = rms_of_kept(&weighed.length_errors, wrong_lengths) / range;
    let message = format!("known lengths are missed by {:.2} % of the range, rms", 100.0 * missed);
    let found = [
        of_pairs(FindingCode::WrongPairs, wrong, MOST_WRONG, CONTRADICT),
        of(FindingCode::WrongLengths, ("lengths", given.lengths.len()), wrong_lengths, 0.0, CONTRADICT),
        one_loop_size(given, uninformative),
        of_pairs(FindingCode::UninformativePairs, uninformative, MOST_UNINFORMATIVE, ("says nothing", "say nothing")),
        apart,
        differ(missed, message),
        beginning(given, weighed),
    ];
    found.into_iter().flatten().collect()
}

/// Refuses a length that clearly goes the other way than all operators: no weights that are not negative can have it.
pub(crate) fn check_signs(given: &Given<'_>, rows: &Rows, columns: usize) -> Result<(), Error> {
    let (low, high) = given.drive_bounds();
    let of_lengths = rows.iter().skip(given.pairs.len());
    for (place, (row, known)) in of_lengths.zip(given.lengths).enumerate() {
        let sign = known.length.signum();
        let (least, most) = signal::bounds(&row[..columns].iter().map(|value| -sign * value).collect::<Vec<_>>());
        let all_go_back = least > -SAYS_NOTHING * (high - low) && most > CLEAR_WAY * (high - low);
        if all_go_back && known.length.abs() > CLEAR_WAY * given.longest() {
            let expected = "a distance that rises with the drive: turn its sign, or all signs if your positions fall";
            return Err(Error::domain("lengths", Some(place), expected, known.length));
        }
    }
    Ok(())
}

/// The finding about known lengths without pairs that the model hardly misses by less than a straight line does: one of
/// them is wrong, or the stage did not begin virgin.
pub(crate) fn missed_lengths(given: &Given<'_>, errors: &[f64], left_out: &[usize]) -> Option<Finding> {
    let steps = given.drive_steps().skip(given.pairs.len());
    let all = steps.zip(given.lengths).zip(errors).enumerate();
    let kept: Vec<_> = all.filter(|(place, _)| left_out.binary_search(place).is_err()).collect();
    let (both, square) = kept
        .iter()
        .fold((0.0, 0.0), |(both, square), (_, ((step, known), _))| (both + step * known.length, square + step * step));
    let slope = if square > 0.0 { both / square } else { 0.0 };
    let of_line: Vec<f64> = kept.iter().map(|(_, ((step, known), _))| slope * step - known.length).collect();
    let (missed, by_line) = (rms_of_kept(errors, left_out), rms(&of_line));
    let value = missed / by_line;
    let (worst, (_, error)) = kept.iter().max_by(|(_, (_, p)), (_, (_, q))| p.abs().total_cmp(&q.abs()))?;
    let message = format!(
        "known lengths are missed by {missed:.3e} rms, a straight line misses them by {by_line:.3e}; the worst, row {worst}, by {error:.3e}"
    );
    let is_missed = given.pairs.is_empty() && value > MOST_MISSED;
    is_missed.then(|| Finding::new(FindingCode::LengthsMissed, value, MOST_MISSED, message))
}

/// The rms of those that were not left out.
pub(crate) fn rms_of_kept(errors: &[f64], left_out: &[usize]) -> f64 {
    rms(&kept(errors, left_out).collect::<Vec<_>>())
}

/// The finding about positions that pairs and lengths leave open, for their uncertainty over the range: standard error
/// and distance of rivals.
pub(crate) fn untold_positions(value: f64) -> Option<Finding> {
    let message = format!("positions along the drives are uncertain by {:.2} % of the range, rms", 100.0 * value);
    (value > MOST_UNTOLD).then(|| Finding::new(FindingCode::PositionsNotTold, value, MOST_UNTOLD, message))
}

/// The finding about pairs at the beginning that the model does not explain, though it explains later ones.
fn beginning(given: &Given<'_>, weighed: &Weighed) -> Option<Finding> {
    let of_drive = |number: usize| {
        let pairs = given.pairs.iter().zip(&weighed.mismatches).filter(|(pair, _)| pair.drive == number);
        let pairs: Vec<(f64, f64, f64)> =
            pairs.map(|(pair, e)| (pair.earlier(), pair.first.max(pair.second), *e)).collect();
        let first = pairs.iter().fold(f64::INFINITY, |first, pair| first.min(pair.0));
        let last = pairs.iter().fold(0.0, |last: f64, pair| last.max(pair.1));
        let end = first + BEGINNING * (last - first);
        let of = |is_early: bool| {
            let some = pairs.iter().filter(|pair| (pair.0 < end) == is_early).map(|pair| pair.2);
            rms(&some.collect::<Vec<_>>())
        };
        let (early, late) = (of(true), of(false));
        let message = format!(
            "pairs of drive {number} with an instant before sample {end:.0} are missed by {early:.3e} rms, later ones by {late:.3e}"
        );
        let hint = format!(
            "leave out pairs and lengths before sample {end:.0}, or give the drive before its first sample, too"
        );
        let finding = Finding::new(FindingCode::StartUpTransient, early / late, MOST_AT_THE_BEGINNING, message);
        finding.try_next(hint)
    };
    let all = (0..given.drives.len()).map(of_drive).filter(|finding| finding.value > finding.limit);
    all.max_by(|p, q| p.value.total_cmp(&q.value))
}

/// The finding about a temperature whose sensitivity or lag is not told, with their standard errors and the longest lag
/// that was searched. One as long stands for another slow change. The error of a lag counts by what it changes: a lag
/// of a few samples need not be told.
pub(crate) fn untold_temperature(
    given: &Given<'_>,
    term: &TemperatureTerm,
    (of_sensitivity, of_lag): (f64, f64),
    longest: f64,
) -> Option<Finding> {
    let (kappa, tau) = (term.sensitivity(), term.time_constant());
    let relative = if of_sensitivity > 0.0 { of_sensitivity / kappa.abs() } else { 0.0 };
    let of_bound = if tau >= LONGEST_LAG * longest { 1.0 } else { 0.0 };
    let value = relative.max(moved_by(given, tau, of_lag)).max(of_bound);
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
    let (low, high) = given.drive_bounds();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::places::given::KnownLength;

    /// Row 2 was left out: it neither is the worst nor bends the line.
    #[test]
    fn a_length_that_was_left_out_says_nothing_of_those_that_were_missed() {
        let drive = [0.0, 1.0, 2.0, 3.0, 4.0];
        let drives = [&drive[..]];
        let lengths: Vec<KnownLength> = [(1.0, 1.1), (2.0, 1.9), (3.0, 300.0), (4.0, 4.1)]
            .map(|(second, length)| KnownLength::new(0, 0.0, second, length))
            .to_vec();
        let given = Given::new(&drives, &[], &lengths, 1.0).unwrap();
        let errors = [-0.05, 0.09, -297.0, -0.05];
        let missed = missed_lengths(&given, &errors, &[2]).unwrap();
        assert!(missed.value > 0.5 && missed.message.contains("the worst, row 1, by 9.000e-2"), "{missed:?}");
    }

    /// A lag of two seconds need not be told where the temperature takes 60 for a wave; where it takes 12, it must.
    #[test]
    fn the_error_of_a_lag_counts_by_what_it_changes() {
        let drive: Vec<f64> = (0..1200_u32).map(|k| (f64::from(k) / 17.0).sin()).collect();
        let drives = [&drive[..]];
        let lengths = [KnownLength::new(0, 0.0, 9.0, 1.0)];
        let term = TemperatureTerm::new(0.05, 2.0, 20.0).unwrap();
        let told = |seconds: f64, std: (f64, f64)| {
            let wave = |k: u32| 20.0 + (0.1 * f64::from(k) * std::f64::consts::TAU / seconds).sin();
            let temperatures = [(0..1200).map(wave).collect::<Vec<f64>>()];
            let given = Given::new(&drives, &[], &lengths, 0.1).unwrap().with_temperatures(&temperatures).unwrap();
            untold_temperature(&given, &term, std, 1200.0).map(|finding| finding.value)
        };
        assert_eq!(told(60.0, (0.005, 2.0)), None);
        let changed = told(12.0, (0.005, 2.0)).unwrap();
        // The derivative of 1 / (1 + j w tau) by tau, as a share of it: w / sqrt(1 + (w tau)^2).
        let turned = std::f64::consts::TAU / 12.0;
        let expected = 2.0 * turned / (1.0 + (2.0 * turned).powi(2)).sqrt();
        assert!((changed / expected - 1.0).abs() < 0.05, "{changed} for {expected}");
        assert!((told(60.0, (0.04, 2.0)).unwrap() - 0.8).abs() < 1e-12);
    }
}
