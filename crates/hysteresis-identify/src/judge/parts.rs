//! Records of several parts: another gain from some sample on, counters that wrap, gaps, another rate, and jitter.

use faer::Mat;

use crate::algebra::bounded;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::sample_ranges::{named_sample, one_part};
use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::{Line, as_f64};

/// A constant, the drive, and plays of these widths over the range of the drive: enough hysteresis to tell a gain.
const WIDTHS: [f64; 3] = [0.05, 0.15, 0.3];
const COLUMNS: usize = 2 + WIDTHS.len();

/// The position moves by another factor of the drive from some sample on: another unit, gain or range.
///
/// A model that was fitted to both parts has the shape of neither. So plays are fitted to the part with the wider
/// drive, and a factor and a zero to what they make of the other one.
pub(crate) fn gain_change(record: &Record<'_>, residual: &[f64]) -> Option<Finding> {
    const LIMIT: f64 = 1.25;
    /// The model leaves more than this share of the range, or there is nothing to explain.
    const POOR: f64 = 0.01;
    /// Another gain leaves at most this share of the squares that one gain leaves: a beginning that settles leaves
    /// more.
    const LEFT: f64 = 0.1;
    /// The plays explain all but this share of the squares of either part: nothing explains a sensor that has failed.
    const UNEXPLAINED: f64 = 0.03;
    /// A swing of the drive, which goes from -1 to 1.
    const SWING: f64 = 0.1;
    /// So many places are looked at, and then every sample about the best.
    const PLACES: usize = 100;
    if signal::rms(residual) < POOR * record.output_range() {
        return None;
    }
    let rows = rows(record);
    let every = (rows.len() / PLACES).max(1);
    let whole = split(&rows, rows.len())?;
    let left = |k: &usize| split(&rows, *k).map_or(f64::INFINITY, |parts| parts.left());
    let best = |places: &mut dyn Iterator<Item = usize>| places.min_by(|a, b| left(a).total_cmp(&left(b)));
    let coarse = best(&mut (1..PLACES).map(|place| place * every))?;
    let finer = (every / 20).max(1);
    let fine = best(&mut (coarse.saturating_sub(every)..coarse + every).step_by(finer))?;
    let place = best(&mut (fine.saturating_sub(finer)..=fine + finer))?;
    let parts = split(&rows, place)?;
    let value = parts.gain.max(parts.gain.recip());
    let is_explained = parts.unexplained.iter().all(|share| *share < UNEXPLAINED);
    // A part without a turn may as well begin with a transient.
    let turns = |part: &[[f64; COLUMNS + 1]]| {
        !signal::turns(&part.iter().map(|row| row[1]).collect::<Vec<_>>(), SWING).is_empty()
    };
    if !is_explained || !turns(&rows[..place]) || !turns(&rows[place..]) || parts.left() > LEFT * whole.left() {
        return None;
    }
    let sample = record.skip() + place;
    let message = format!(
        "from {} on the position moves by another factor of the drive, {value:.3} times larger or smaller",
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::GainChange, value, LIMIT, message).at(sample);
    Some(finding.try_next(one_part("the change", sample..sample, record)))
}

/// The columns and the position of every sample, the latter over its range.
fn rows(record: &Record<'_>) -> Vec<[f64; COLUMNS + 1]> {
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let ((low, high), middle) = (signal::bounds(input), signal::median(output));
    let drive = |u: &f64| (2.0 * u - low - high) / (high - low);
    let mut plays = [drive(&input[0]); WIDTHS.len()];
    let row = |(u, y): (&f64, &f64)| {
        let mut row = [1.0; COLUMNS + 1];
        row[1] = drive(u);
        for ((play, width), place) in plays.iter_mut().zip(WIDTHS).zip(&mut row[2..]) {
            *play = play.clamp(drive(u) - width, drive(u) + width);
            *place = *play;
        }
        row[COLUMNS] = (y - middle) / record.output_range();
        row
    };
    input.iter().zip(output).map(row).collect()
}

/// What a fit to the wider of two parts makes of both.
struct Parts {
    /// The squares that are left of either part.
    squares: [f64; 2],
    /// The same over the squares of the part about its mean.
    unexplained: [f64; 2],
    /// The factor by which the other part moves as far as the wider one.
    gain: f64,
}

impl Parts {
    fn left(&self) -> f64 {
        self.squares.iter().sum()
    }
}

/// The fit to the wider of the two parts before and from a sample, and a straight line over it for the other.
fn split(rows: &[[f64; COLUMNS + 1]], place: usize) -> Option<Parts> {
    let (before, after) = rows.split_at_checked(place)?;
    let width = |part: &[[f64; COLUMNS + 1]]| {
        let (low, high) = signal::bounds(&part.iter().map(|row| row[1]).collect::<Vec<f64>>());
        high - low
    };
    let (wider, other) = if width(before) >= width(after) { (before, after) } else { (after, before) };
    let weights = weights(wider);
    let fitted = |row: &[f64; COLUMNS + 1]| row.iter().zip(&weights).map(|(x, w)| x * w).sum::<f64>();
    let squares = |part: &[[f64; COLUMNS + 1]], model: &dyn Fn(&[f64; COLUMNS + 1]) -> f64| {
        let mean = part.iter().map(|row| row[COLUMNS]).sum::<f64>() / as_f64(part.len());
        let left: f64 = part.iter().map(|row| (row[COLUMNS] - model(row)).powi(2)).sum();
        (left, left / part.iter().map(|row| (row[COLUMNS] - mean).powi(2)).sum::<f64>())
    };
    let (left, share) = squares(wider, &fitted);
    if other.is_empty() {
        return Some(Parts { squares: [left, 0.0], unexplained: [share, 0.0], gain: 1.0 });
    }
    let [x, y]: [Vec<f64>; 2] = [other.iter().map(fitted).collect(), other.iter().map(|row| row[COLUMNS]).collect()];
    let line = Line::through(&x, &y);
    let (others, others_share) = squares(other, &|row| line.at(fitted(row)));
    Some(Parts {
        squares: [left, others],
        unexplained: [share, others_share],
        gain: (line.at(1.0) - line.at(0.0)).abs(),
    })
}

/// Least squares; where columns make up each other, one answer of several.
fn weights(rows: &[[f64; COLUMNS + 1]]) -> Vec<f64> {
    // A hundred parts are fitted: the sums of products cost least, and a gain needs few digits.
    let mut products = Mat::<f64>::zeros(COLUMNS, COLUMNS + 1);
    for row in rows {
        for i in 0..COLUMNS {
            for j in 0..=COLUMNS {
                products[(i, j)] += row[i] * row[j];
            }
        }
    }
    let with_position: Vec<f64> = (0..COLUMNS).map(|i| products[(i, COLUMNS)]).collect();
    let all: Vec<usize> = (0..COLUMNS).collect();
    let unbounded = [(f64::NEG_INFINITY, f64::INFINITY); COLUMNS];
    bounded::solve(products.get(.., ..COLUMNS), &with_position, &unbounded, &all).x
}

/// The position jumps from one of its ends to the other, always by the same height: a counter that wraps.
pub(crate) fn wraps(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.0;
    /// A jump, as a share of the range, and how near to the ends it begins and lands.
    const JUMP: f64 = 0.5;
    const END: f64 = 0.25;
    /// The heights of all jumps are alike within this share.
    const ALIKE: f64 = 0.1;
    /// Without the jumps the drive leaves at most this share of the squares unexplained, and half of what it leaves
    /// with them.
    const LEFT: f64 = 0.1;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let ((low, high), range) = (signal::bounds(output), record.output_range());
    let step = |k: usize| output[k] - output[k - 1];
    let jumps: Vec<usize> = (1..output.len()).filter(|k| step(*k).abs() > JUMP * range).collect();
    let is_at_the_ends = |k: &usize| {
        let (lower, upper) = (output[*k].min(output[k - 1]), output[*k].max(output[k - 1]));
        lower < low + END * range && upper > high - END * range
    };
    // The position moves on while it jumps, about as it did just before and will just after.
    let usual = |k: usize| {
        let near = [k.checked_sub(1), Some(k + 1)].into_iter().flatten().filter(|k| (1..output.len()).contains(k));
        let steps: Vec<f64> = near.map(step).filter(|step| step.abs() <= JUMP * range).collect();
        steps.iter().sum::<f64>() / as_f64(steps.len().max(1))
    };
    let heights: Vec<f64> = jumps.iter().map(|k| (step(*k) - usual(*k)).abs()).collect();
    let period = nearest_power_of_two(signal::median(&heights));
    let are_alike = heights.iter().all(|height| (height - period).abs() < ALIKE * period);
    if jumps.is_empty() || !jumps.iter().all(is_at_the_ends) || !are_alike || only_readings_failed(output, &jumps) {
        return None;
    }
    let mut turns = 0.0;
    let unwrapped: Vec<f64> = (0..output.len())
        .map(|k| {
            if k > 0 && step(k).abs() > JUMP * range {
                turns -= step(k).signum();
            }
            output[k] + turns * period
        })
        .collect();
    let unexplained = |values: &[f64]| signal::correlation(input, values).map_or(1.0, |r| 1.0 - r * r);
    if unexplained(&unwrapped) > LEFT.min(0.5 * unexplained(output)) {
        return None;
    }
    let sample = record.skip() + jumps[0];
    let message = format!(
        "the position jumps {} times between its ends by {period} though the drive does not, first before {}: a counter that \
         wraps",
        jumps.len(),
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::OutputWraps, as_f64(jumps.len()), LIMIT, message).at(sample);
    Some(finding.try_next(format!(
        "add {period} from every jump down on and subtract it from every jump up on: numpy.unwrap(y, period={period})"
    )))
}

/// Whether before or after each of these jumps the position stands still until the next one: a counter counts on.
fn only_readings_failed(output: &[f64], jumps: &[usize]) -> bool {
    let ends = [&[0], jumps, &[output.len()]].concat();
    let stand_still: Vec<bool> =
        ends.windows(2).map(|part| output[part[0]..part[1]].iter().all(|y| *y == output[part[0]])).collect();
    stand_still.windows(2).all(|parts| parts[0] || parts[1])
}

/// A counter has a power of two of values; a height that is near to none stays.
fn nearest_power_of_two(height: f64) -> f64 {
    const NEAR: f64 = 0.02;
    let power = height.log2().round().exp2();
    if (power / height - 1.0).abs() < NEAR { power } else { height }
}

/// Samples on either side that tell where the grid of times is.
const AROUND: usize = 5;

/// Missing samples: the longest of all steps by which the times leave their grid for good.
pub(crate) fn gap(record: &Record<'_>) -> Option<Finding> {
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
pub(crate) fn rate_change(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 1.2;
    /// Steps whose mean is an interval: rounded times do not move it.
    const STEPS: usize = 25;
    let times = &record.times()?[record.skip()..];
    let steps: Vec<f64> = times.windows(2).map(|pair| pair[1] - pair[0]).collect();
    // A gap makes one step long, and is no other rate.
    let is_even = |part: &&[f64]| signal::bounds(part).1 < 2.0 * signal::mean(part);
    let means: Vec<f64> = steps.chunks_exact(STEPS).filter(is_even).map(signal::mean).collect();
    let (short, long) = means.iter().fold((f64::INFINITY, 0.0_f64), |(a, b), step| (a.min(*step), b.max(*step)));
    let first = *means.first()?;
    let ratio = |step: f64| (step / first).max(first / step);
    let other = (0..steps.len().saturating_sub(STEPS)).find(|k| ratio(signal::mean(&steps[*k..k + STEPS])) > LIMIT)?;
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
pub(crate) fn jitter(record: &Record<'_>) -> Option<Finding> {
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
    let interval = signal::usual_step(times, most).step;
    let offset = |(k, time): (usize, &f64)| (time - times[0]) / interval - as_f64(k);
    (interval > 0.0).then(|| (times.iter().enumerate().map(offset).collect(), interval))
}
