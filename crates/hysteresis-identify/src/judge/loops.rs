//! The loops of records: their sign, their direction, how late they turn, and which there are.

use crate::error::Error;
use crate::fit::response::Chain;
use crate::judge::finding::{Finding, causes};
use crate::judge::finding_code::FindingCode;
use crate::judge::sample_ranges::{input_bounds, named_sample};
use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::{Line, SWING, as_f64};

/// The position falls where the drive rises.
pub(crate) fn wrong_sign(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = -0.5;
    let value = correlation(record)?;
    let message = format!("the position falls where the drive rises, correlation {value:.2}");
    Some(Finding::new(FindingCode::WrongSign, value, LIMIT, message))
}

/// The correlation of drive and position.
fn correlation(record: &Record<'_>) -> Option<f64> {
    signal::correlation(&record.input()[record.skip()..], &record.output()[record.skip()..])
}

/// The same where a loop has a direction.
fn clear_correlation(record: &Record<'_>) -> Option<f64> {
    correlation(record).filter(|r| r.abs() > MIN_CORRELATION)
}

/// Some records fall where their drive rises, and others do not: an option that turns them all does not help.
pub(crate) fn fall_one_by_one(records: &[Record<'_>]) -> bool {
    let signs: Vec<f64> = records.iter().filter_map(clear_correlation).map(f64::signum).collect();
    signs.contains(&1.0) && signs.contains(&-1.0)
}

/// The positions of some records move by other factors of their drives than those of others: other units, or another
/// stage.
///
/// Hysteresis makes the slope of a small loop smaller, dynamics and creep change it too, all by less than a factor of 3.
pub(crate) fn records_differ(records: &[Record<'_>]) -> Option<Finding> {
    const LIMIT: f64 = 3.0;
    let slope = |record: &Record<'_>| {
        clear_correlation(record)?;
        let line = Line::through(&record.input()[record.skip()..], &record.output()[record.skip()..]);
        Some((line.at(1.0) - line.at(0.0)).abs())
    };
    let slopes: Vec<(usize, f64)> =
        records.iter().enumerate().filter_map(|(place, record)| Some((place, slope(record)?))).collect();
    let usual = signal::median(&slopes.iter().map(|(_, slope)| *slope).collect::<Vec<_>>());
    let factor = |slope: f64| (slope / usual).max(usual / slope);
    let (place, furthest) = slopes.iter().copied().max_by(|(_, a), (_, b)| factor(*a).total_cmp(&factor(*b)))?;
    let value = factor(furthest);
    let message = format!(
        "the position of this record moves by {furthest:.4} for a unit of the drive, and that of most by {usual:.4}: another unit, or \
         another stage"
    );
    (value > LIMIT)
        .then(|| Finding { record: Some(place), ..Finding::new(FindingCode::RecordsDiffer, value, LIMIT, message) })
}

/// Below this correlation a loop has no direction: a position a quarter of a period late neither rises nor falls with
/// it.
const MIN_CORRELATION: f64 = 0.7;

/// The position leads the drive.
pub(crate) fn backwards(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.01;
    let value = mean_lead(record)?;
    let message = format!(
        "the loops are traversed backwards: the position leads the drive, by {:.1} % of its range on average",
        100.0 * value
    );
    Some(Finding::new(FindingCode::LoopBackwards, value, LIMIT, message))
}

/// No record has loops that are open.
pub(crate) fn no_hysteresis(records: &[Record<'_>]) -> Option<Finding> {
    const LIMIT: f64 = 0.001;
    /// The drive explains all but this share of the squares: rows in any order have no area either.
    const EXPLAINED: f64 = 0.998;
    let follows = |record: &Record<'_>| correlation(record).is_some_and(|r| r * r > EXPLAINED);
    if !records.iter().all(follows) {
        return None;
    }
    let widths: Option<Vec<f64>> = records.iter().map(|record| mean_lead(record).map(f64::abs)).collect();
    let value = widths?.into_iter().reduce(f64::max)?;
    let message = format!(
        "the position follows the drive without hysteresis: loops are {:.3} % of its range wide on average",
        100.0 * value
    );
    (value < LIMIT).then(|| Finding::new(FindingCode::NoHysteresis, value, LIMIT, message))
}

/// By how much of its range the position leads the drive on average; negative where it lags. Nothing if the drive does
/// not turn and come back step by step, or the position does not go with it.
///
/// About every turn the drive passes a stretch of its range there and back. The sum of y du over both ways is the area
/// between them: negative if the position lags, and nothing for any function of the drive, however bent. Over the
/// lengths of these stretches it is the mean width of the loops.
fn mean_lead(record: &Record<'_>) -> Option<f64> {
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    // The way to the first turn may be a transient; that from the last one is as good as any.
    let turns = [signal::turns(input, SWING * (high - low)), vec![input.len() - 1]].concat();
    // The sign of the position counts: turned round, loops change their direction too.
    let sign = clear_correlation(record)?.signum();
    let ways = turns.windows(3).filter_map(|three| there_and_back(input, output, three, high - low));
    let (area, length) = ways.fold((0.0, 0.0), |sum, way| (sum.0 + way.0, sum.1 + way.1));
    (length > 0.0).then(|| sign * area / length / record.output_range())
}

/// The sum of y du over what the drive passes both before and after a turn, and the length of that; nothing where it
/// jumps. Given are the turn before, the turn and the one after.
fn there_and_back(input: &[f64], output: &[f64], turns: &[usize], range: f64) -> Option<(f64, f64)> {
    /// A straight line over a step of this share of the range is no more than 0.4 % of the range off, if the position
    /// is the square of the drive.
    const JUMP: f64 = 0.15;
    let [from, turn, to] = [0, 1, 2].map(|place| input[turns[place]]);
    let length = (turn - from).abs().min((to - turn).abs());
    let far = turn + length.copysign(from - turn);
    let (low, high) = (turn.min(far), turn.max(far));
    let mut area = 0.0;
    for k in turns[0] + 1..=turns[2] {
        let (before, after) = (input[k - 1].clamp(low, high), input[k].clamp(low, high));
        let step = input[k] - input[k - 1];
        if before == after {
            continue;
        }
        if step.abs() > JUMP * range {
            return None;
        }
        let middle = (0.5 * (before + after) - input[k - 1]) / step;
        area += (after - before) * (output[k - 1] + middle * (output[k] - output[k - 1]));
    }
    Some((area, length))
}

/// How many samples the position turns after the drive does, where it does so alike all over the record, and the
/// standard error of that.
///
/// A position without dynamics turns with the drive, whatever the hysteresis: loops may hide a lead, turns cannot.
fn turns_late(record: &Record<'_>) -> Option<(f64, f64)> {
    const FEWEST: usize = 5;
    /// The turns of most are alike within so many samples, or this share of the delay.
    const ALIKE: f64 = 1.0;
    const SHARE: f64 = 0.5;
    /// Of normal values: 1.2533 standard deviations over sqrt n, one being 1.4826 median distances.
    const ERROR_OF_MEDIAN: f64 = 1.858;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    let turns = signal::turns(input, SWING * (high - low));
    let sign = signal::correlation(input, output)?.signum();
    let position: Vec<f64> = output.iter().map(|y| sign * y).collect();
    let later = |three: &[usize]| {
        let (from, to) = (usize::midpoint(three[0], three[1]), usize::midpoint(three[1], three[2]));
        let is_peak = input[three[1]] > input[three[0]];
        let top = |values: &[f64]| middle_of_the_top(&values[from..to], is_peak);
        Some(top(&position)? - top(input)?)
    };
    let delays: Vec<f64> = turns.windows(3).filter_map(later).collect();
    let delay = signal::median(&delays);
    let spread = signal::median(&delays.iter().map(|one| (one - delay).abs()).collect::<Vec<f64>>());
    let error = ERROR_OF_MEDIAN * spread / as_f64(delays.len()).sqrt();
    (delays.len() >= FEWEST && spread <= ALIKE.max(SHARE * delay.abs())).then_some((delay, error))
}

/// Where a peak or a valley is: the middle of the samples at its very end, none if it lies at an edge of the part.
fn middle_of_the_top(values: &[f64], is_peak: bool) -> Option<f64> {
    let (low, high) = signal::bounds(values);
    let end = if is_peak { high } else { low };
    let (first, last) = (values.iter().position(|x| *x == end)?, values.iter().rposition(|x| *x == end)?);
    (first > 0 && last + 1 < values.len()).then(|| 0.5 * (as_f64(first) + as_f64(last)))
}

/// The position turns before the drive does.
pub(crate) fn early(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = -0.5;
    /// Noise on round tops makes turns early by chance: so many standard errors are none.
    const CHANCE: f64 = 2.0;
    let (value, error) = turns_late(record)?;
    if value + CHANCE * error > LIMIT {
        return None;
    }
    let message = format!("the position turns {:.1} samples before the drive does", -value);
    let hint = format!(
        "rows seem to hold a position that was read later: shift the position column down by {:.0} rows",
        -value
    );
    Some(Finding::new(FindingCode::NegativeDeadTime, value, LIMIT, message).try_next(hint))
}

/// The input hardly ever turns inside its range.
pub(crate) fn no_minor_loops(records: &[Record<'_>]) -> Option<Finding> {
    const LIMIT: f64 = 2.0;
    let (low, high) = input_bounds(records);
    let (swing, margin) = (SWING * (high - low), 0.1 * (high - low));
    let inside = |x: &f64| low + margin < *x && *x < high - margin;
    let turns = |input: &[f64]| signal::turns(input, swing).into_iter().filter(|k| inside(&input[*k])).count();
    let value = as_f64(records.iter().map(|record| turns(&record.input()[record.skip()..])).sum());
    let message = format!(
        "{value} reversals of the input inside its range from {low:.4} to {high:.4}: dead time, ratios and loop width are \
         weakly determined"
    );
    (value < LIMIT).then(|| Finding::new(FindingCode::NoMinorLoops, value, LIMIT, message))
}

/// The drive goes from turn to turn at one speed and in one time.
pub(crate) fn one_rate(records: &[Record<'_>]) -> Option<Finding> {
    let Rates { of_speed, speed, of_frequency, frequency } = rates(records)?;
    let value = of_speed.max(of_frequency);
    let time = if records.iter().all(|record| record.dt().is_some()) { "second" } else { "sample" };
    let message = format!(
        "the drive moves at one speed and over one range, at about {speed:.4} per {time} and {frequency:.4} loops per {time}: the records do \
         not tell how hysteresis and gain depend on the rate, and no error that is given here holds at another one"
    );
    (value < ONE_RATE).then(|| Finding::new(FindingCode::RateDependenceNotTold, value, ONE_RATE, message))
}

/// Below this ratio of the largest to the smallest, speeds or frequencies are one.
const ONE_RATE: f64 = 1.5;

/// Whether the drive moves at several speeds, or rests: then what follows within a time of its own is told from what a
/// longer way does.
pub(crate) fn tells_speeds(records: &[Record<'_>]) -> bool {
    rates(records).is_none_or(|rates| rates.of_speed >= ONE_RATE)
}

/// Whether loops lie about several middles. Those of a decay do not, nor equal ones, nor where there are none: what they
/// leave says nothing of loops of the same size elsewhere.
pub(crate) fn tells_middles(records: &[Record<'_>]) -> bool {
    /// Of the range. Each loop of a decay by a constant factor lies a little beside the one before.
    const APART: f64 = 0.1;
    let (low, high) = input_bounds(records);
    let loops = loops(records, SWING * (high - low));
    let middles = loops.iter().map(|one| (0.5 * (one.ends.0 + one.ends.1), as_f64(one.samples)));
    let (lowest, highest) = usual_extremes(middles.collect());
    highest - lowest > APART * (high - low)
}

/// The smallest and the largest of values that each stand for a time, but for the share of the time at either end that
/// may be anything: a beginning, an end, one odd loop.
fn usual_extremes(mut values: Vec<(f64, f64)>) -> (f64, f64) {
    const ODD: f64 = 0.05;
    let whole: f64 = values.iter().map(|(_, time)| time).sum();
    let mut least = |direction: f64| {
        values.sort_by(|a, b| (direction * a.0).total_cmp(&(direction * b.0)));
        let mut left = ODD * whole;
        let beyond = |(_, time): &&(f64, f64)| {
            left -= time;
            left < 0.0
        };
        values.iter().find(beyond).map_or(0.0, |(value, _)| *value)
    };
    (least(1.0), least(-1.0))
}

/// Speeds and frequencies of the drive from turn to turn: the largest, and its ratio to the smallest.
struct Rates {
    of_speed: f64,
    speed: f64,
    of_frequency: f64,
    frequency: f64,
}

/// None where the drive rests for long, or nowhere turns round.
fn rates(records: &[Record<'_>]) -> Option<Rates> {
    /// So much of the time at rest tells what relaxes.
    const RESTS: f64 = 0.05;
    let (low, high) = input_bounds(records);
    let swings: Vec<Swing> = records.iter().flat_map(|record| swings(record, SWING * (high - low), 1.0)).collect();
    let whole: f64 = swings.iter().map(|swing| swing.duration).sum();
    let rests: f64 = swings.iter().map(|swing| swing.duration - swing.moving).sum();
    if swings.is_empty() || rests > RESTS * whole {
        return None;
    }
    let spread = |measure: fn(&Swing) -> f64| {
        let (smallest, largest) = usual_extremes(swings.iter().map(|swing| (measure(swing), swing.duration)).collect());
        (largest / smallest, largest)
    };
    let ((of_speed, speed), (of_frequency, frequency)) =
        (spread(|swing| swing.travel / swing.moving), spread(Swing::frequency));
    Some(Rates { of_speed, speed, of_frequency, frequency })
}

/// The way of the drive from one turn to the next.
struct Swing {
    travel: f64,
    duration: f64,
    /// Of the duration, how long the drive moves.
    moving: f64,
}

impl Swing {
    fn of(way: &[f64], dt: f64) -> Self {
        Self {
            travel: (way[way.len() - 1] - way[0]).abs(),
            duration: dt * as_f64(way.len() - 1),
            moving: dt * as_f64(signal::moves(way)),
        }
    }

    fn frequency(&self) -> f64 {
        0.5 / self.moving
    }
}

/// The swings between the turns of the fitted samples, from the first turn to the last; of a record that turns once,
/// its two parts. A record without a sampling interval has this one.
fn swings(record: &Record<'_>, swing: f64, dt: f64) -> Vec<Swing> {
    let input = &record.input()[record.skip()..];
    let of_turns = |turns: &[usize]| Swing::of(&input[turns[0]..=turns[1]], record.dt().unwrap_or(dt));
    let mut turns = signal::turns(input, swing);
    if let [only] = turns[..] {
        turns = vec![0, only, input.len() - 1];
    }
    turns.windows(2).map(of_turns).collect()
}

/// At which speed records move from turn to turn, on average, but so that the whole range takes a hundred samples. One
/// that does not turn counts from end to end; none for records that do not move. Records without a sampling interval
/// have this one.
pub(crate) fn mean_speed(records: &[Record<'_>], dt: f64) -> Option<f64> {
    const FEWEST: f64 = 100.0;
    let (low, high) = input_bounds(records);
    let of_record = |record: &Record<'_>| {
        let swings = swings(record, SWING * (high - low), dt);
        let whole = || vec![Swing::of(&record.input()[record.skip()..], record.dt().unwrap_or(dt))];
        if swings.is_empty() { whole() } else { swings }
    };
    let swings: Vec<Swing> = records.iter().flat_map(of_record).collect();
    let way: f64 = swings.iter().map(|swing| swing.travel).sum();
    let time: f64 = swings.iter().map(|swing| swing.moving).sum();
    let interval = records.iter().map(|record| record.dt().unwrap_or(dt)).fold(f64::INFINITY, f64::min);
    (way > 0.0).then(|| (way / time).min((high - low) / (FEWEST * interval)))
}

/// One loop: between which inputs, in how many samples, and where it begins.
struct Loop {
    ends: (f64, f64),
    samples: usize,
    record: usize,
    first: usize,
}

/// One and the same loop again and again.
pub(crate) fn identical(records: &[Record<'_>]) -> Option<Finding> {
    const LIMIT: f64 = 0.6;
    const MIN_LOOPS: usize = 10;
    /// Loops that may be the common one: enough to meet it, few enough to compare all with them.
    const CANDIDATES: usize = 200;
    let (low, high) = input_bounds(records);
    let range = high - low;
    let loops = loops(records, SWING * range);
    let same = |one: &Loop, other: &Loop| {
        let apart = (one.ends.0 - other.ends.0).abs().max((one.ends.1 - other.ends.1).abs());
        apart < 0.5 * SWING * range
    };
    let alike = |candidate: &Loop| loops.iter().filter(|one| same(one, candidate)).collect::<Vec<_>>();
    let samples = |loops: &[&Loop]| loops.iter().map(|one| one.samples).sum::<usize>();
    let every = loops.len().div_ceil(CANDIDATES).max(1);
    let common = loops.iter().step_by(every).map(alike).max_by_key(|alike| samples(alike))?;
    let all: usize = records.iter().map(Record::fitted_samples).sum();
    let value = as_f64(samples(&common)) / as_f64(all);
    if common.len() < MIN_LOOPS || value <= LIMIT {
        return None;
    }
    let Loop { ends: (from, to), record, first, .. } = *common[0];
    let message = format!(
        "{} loops are the same, between {from:.4} and {to:.4}, the first from {} on: they are {:.0} % of all samples and \
         weigh down all others",
        common.len(),
        named_sample(&records[record], first),
        100.0 * value
    );
    let found = Finding::new(FindingCode::IdenticalLoops, value, LIMIT, message).at(first);
    Some(Finding { record: (records.len() > 1).then_some(record), ..found })
}

fn loops(records: &[Record<'_>], swing: f64) -> Vec<Loop> {
    let of_record = |(place, record): (usize, &Record<'_>)| {
        let input = &record.input()[record.skip()..];
        let turns = signal::turns(input, swing);
        let of_turns = |turns: &[usize]| {
            let (a, b) = (input[turns[0]], input[turns[1]]);
            let first = record.skip() + turns[0];
            Loop { ends: (a.min(b), a.max(b)), samples: turns[2] - turns[0], record: place, first }
        };
        turns.windows(3).step_by(2).map(of_turns).collect::<Vec<_>>()
    };
    records.iter().enumerate().flat_map(of_record).collect()
}

/// A dead time that is long beside the slowest motion.
pub(crate) fn implausible(records: &[Record<'_>], chain: &Chain) -> Option<Finding> {
    const LIMIT: f64 = 0.1;
    let slowest = |record: &Record<'_>| {
        let input = &record.input()[record.skip()..];
        let (low, high) = signal::bounds(input);
        let turns = signal::turns(input, SWING * (high - low));
        let longest = turns.windows(2).map(|pair| pair[1] - pair[0]).max()?;
        Some(2.0 * as_f64(longest) * record.dt().unwrap_or(chain.dt))
    };
    let period = records.iter().filter_map(slowest).reduce(f64::max)?;
    let value = chain.linear.dead_time / period;
    let message = format!(
        "the dead time is {:.0} % of the period of the drive: creep, loop width or shifted columns may look like it",
        100.0 * value
    );
    let late =
        records.iter().filter_map(turns_late).map(|(late, _)| late).reduce(f64::max).filter(|samples| *samples > 1.0);
    let finding = Finding::new(FindingCode::ImplausibleDeadTime, value, LIMIT, message);
    let finding = match late {
        Some(samples) => finding.try_next(format!(
            "if the two were not recorded from the same moment on, shift the position column up by {samples:.0} rows; else add \
             minor loops or a faster record"
        )),
        None => finding,
    };
    (value > LIMIT).then_some(finding)
}

/// The turned fit must leave less than this share of the error.
const MAX_SHARE: f64 = 0.5;

/// The positions of all records, those that fall where their drive rises turned round.
pub(crate) fn turned_positions(records: &[Record<'_>]) -> Vec<Vec<f64>> {
    let turned = |record: &Record<'_>| {
        let [input, output] = [record.input(), record.output()].map(|signal| record.fitted_of(signal));
        let correlation = signal::correlation(&input, &output);
        let sign = if correlation.is_some_and(|correlation| correlation < 0.0) { -1.0 } else { 1.0 };
        record.output().iter().map(|y| sign * y).collect()
    };
    records.iter().map(turned).collect()
}

/// The same records with other positions.
///
/// # Errors
/// None for positions that are those of the records but for their sign.
pub(crate) fn with_positions<'a>(records: &[Record<'a>], positions: &'a [Vec<f64>]) -> Result<Vec<Record<'a>>, Error> {
    let exchange = |(place, (record, position)): (usize, (&Record<'a>, &'a Vec<f64>))| {
        let turned = record.with_output(position).and_then(|turned| turned.leaving_out(record.left_out()));
        turned.map_err(|error| error.in_record(place))
    };
    records.iter().zip(positions).enumerate().map(exchange).collect()
}

/// The findings when the turned fit leaves `turned` of the range rms and the fit as it is `plain`: what follows from a
/// wrong sign is left out, or the sign is not what is wrong.
pub(crate) fn judged(findings: Vec<Finding>, plain: f64, turned: f64) -> Vec<Finding> {
    if turned >= MAX_SHARE * plain {
        return findings.into_iter().filter(|finding| finding.code != FindingCode::WrongSign).collect();
    }
    let mut findings = causes(findings);
    findings.retain(|finding| !finding.code.compares_drive_and_position());
    for finding in findings.iter_mut().filter(|finding| finding.code == FindingCode::WrongSign) {
        finding.message = format!(
            "{}; the fit leaves {:.3} % of the range rms, and one with the sign of the position turned {:.3} %",
            finding.message,
            100.0 * plain,
            100.0 * turned
        );
    }
    findings
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::signal::way;

    fn tells(corners: &[f64]) -> bool {
        let drive = way(corners);
        tells_middles(&[Record::new(&drive, &drive, 0).unwrap()])
    }

    #[test]
    fn loops_about_one_middle_tell_no_other() {
        let decay: Vec<f64> = (0..30_i32).map(|k| 50.0 + (-1.0_f64).powi(k) * (50.0 - 1.5 * f64::from(k))).collect();
        assert!(!tells(&decay) && !tells(&[0.0, 100.0, 0.0, 100.0, 0.0]) && !tells(&[0.0, 100.0]));
        assert!(tells(&[0.0, 100.0, 0.0, 40.0, 10.0, 90.0, 60.0, 80.0, 0.0]));
        // One odd loop behind a decay is none of several.
        let odd = [decay.as_slice(), &[0.0, 5.0, 0.0]].concat();
        assert!(!tells(&odd));
    }
}
