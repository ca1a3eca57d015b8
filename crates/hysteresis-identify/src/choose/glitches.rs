//! A fit without glitches: they are looked for in what a fit leaves, left out, and the fit goes on from where it was.
//!
//! Glitches are single wrong samples of the position and short runs of them, told from errors of the model. A sample is
//! far if its residual is further from the median of those about it than so many standard deviations: of the whole
//! residual; of the samples before it or behind it, where dynamics may ring that the model lacks; and of those before
//! which the drive turned or jumped alike, where a model may be far off as a matter of course. Far samples that are
//! near to each other are a glitch if there are few of them and the residual jumps where they begin and where they end:
//! what a model misses comes and goes smoothly, or lasts.

use std::collections::VecDeque;
use std::ops::Range;

use crate::choose::found::Found;
use crate::choose::search::{anew, search_again, search_all};
use crate::error::Error;
use crate::fit::progress::SearchMonitor;
use crate::fit::response::Chain;
use crate::options::Options;
use crate::records::record::{Record, leaving_out};
use crate::records::signal;
use crate::records::signal::as_f64;

/// So many fits go on from where they were: the fewer glitches are left, the smaller ones are seen.
const ROUNDS: usize = 5;

/// So often everything is chosen anew without them, if that may change a choice: if they have this share of the sum of
/// squares that is left.
const CHOICES: usize = 2;
const MATTERS: f64 = 0.01;

/// What is left out of every record.
pub(crate) type LeftOut = Vec<Vec<usize>>;

/// The best of everything that was asked for, and what was left out of every record for it: what the records leave out
/// already, and glitches if the loss of `asked` leaves them out and there are any.
///
/// What was chosen while there were glitches that matter is chosen anew without them. A search that was stopped is left
/// as it is.
pub(crate) fn search_without_glitches(
    records: &[Record<'_>],
    asked: &Options,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Found, LeftOut), Error> {
    let plain = search_all(records, asked, monitor)?;
    let given: LeftOut = records.iter().map(|record| record.left_out().to_vec()).collect();
    let Some(limit) = asked.loss.limit() else { return Ok((plain, given)) };
    monitor.hold();
    let (mut found, mut left_out) = settled(records, plain.clone(), given.clone(), limit, monitor)?;
    let mut chosen_without = given.clone();
    for _ in 0..CHOICES {
        let differ = squares_between(records, &found, &left_out, &chosen_without);
        if found.partial || differ <= MATTERS * found.fit.fit.squares {
            break;
        }
        let without = leaving_out(records, &left_out)?;
        found = anew(found, Vec::new(), monitor, |monitor| search_all(&without, asked, monitor))?;
        chosen_without.clone_from(&left_out);
        (found, left_out) = settled(records, found, left_out, limit, monitor)?;
    }
    // What is no glitch for a better fit was none.
    Ok(if left_out == given { (Found { partial: found.partial, ..plain }, given) } else { (found, left_out) })
}

/// Goes on until what is left out stays the same.
fn settled(
    records: &[Record<'_>],
    mut found: Found,
    mut left_out: LeftOut,
    limit: f64,
    monitor: &mut SearchMonitor<'_>,
) -> Result<(Found, LeftOut), Error> {
    for _ in 0..ROUNDS {
        if found.partial {
            break;
        }
        let seen = seen(records, &leaving_out(records, &left_out)?, &found, limit);
        if seen == left_out {
            break;
        }
        left_out = seen;
        found = search_again(&leaving_out(records, &left_out)?, found, monitor)?;
    }
    Ok((found, left_out))
}

/// The sum of squared errors of a fit at the samples that one of both leaves out.
fn squares_between(records: &[Record<'_>], found: &Found, one: &LeftOut, other: &LeftOut) -> f64 {
    let problem = found.problem(records);
    let residuals = records.iter().zip(problem.residuals(&found.fit));
    let mut squares = 0.0;
    for ((record, left), (one, other)) in residuals.zip(one.iter().zip(other)) {
        let differs = |k: &usize| one.binary_search(k).is_ok() != other.binary_search(k).is_ok();
        let errors = record.fitted().zip(left).filter(|(k, _)| differs(k));
        squares += errors.map(|(_, error)| error * error).sum::<f64>();
    }
    squares
}

/// What these records leave out, and the glitches of every record in what a fit to the `fitted` ones leaves.
fn seen(records: &[Record<'_>], fitted: &[Record<'_>], found: &Found, limit: f64) -> LeftOut {
    let chain = found.fit.chain(found.interval(records));
    let offsets = &found.fit.fit.output_offsets;
    let of_record = |(place, (record, given)): (usize, (&Record<'_>, &Record<'_>))| {
        let mut samples = glitches(record, &chain, place, offsets[place], limit);
        samples.extend(given.left_out());
        samples.sort_unstable();
        samples.dedup();
        samples
    };
    fitted.iter().zip(records).enumerate().map(of_record).collect()
}

/// Samples on either side whose median tells a glitch from the residual: a glitch of no more samples is less than half
/// of all.
const AROUND: usize = 25;

/// Samples on one side whose distances tell whether a model is far off there: dynamics ring on, and less than half of
/// so many are glitches.
const NEARBY: usize = 50;

/// Far samples with at most so many others between them are one glitch.
const GAP: usize = 5;

/// What lasts longer is no glitch. A fit that follows one is far off beside it, too.
const LONGEST: usize = 30;

/// The residual jumps by this share of the height of a glitch at least, where it begins and where it ends. Half a
/// period of a ringing that lasts eight samples or more jumps by less.
const ABRUPT: f64 = 0.4;

/// Where a record begins, no jump is seen before a glitch: there the residual comes back by this share of its height
/// from one sample to the next, which a transient does not.
const AT_ONCE: f64 = 0.8;

/// The deviation of samples is that share of all below which there are this many standard deviations of normal noise:
/// with a tenth of them wrong it still is that of the good ones.
const MOST: f64 = 0.9;
const DEVIATIONS_OF_MOST: f64 = 1.645;

/// The median distance of normal noise is one standard deviation over this.
const DEVIATIONS_OF_HALF: f64 = 1.4826;

/// Turns are alike within a factor of two, down to this power of two below the range of the drive.
const POWERS: usize = 12;

/// The samples about so many turns tell what is usual after such a turn.
const TURNS: usize = 2;

/// A turn of the drive counts for so many samples and the lag of the model: those in which a wrong dead time shows, and
/// those in which damped dynamics do.
const AFTER_TURN: [usize; 2] = [3, 25];

/// Samples before a turn that its error may reach.
const BEFORE_TURN: usize = 1;

/// Below this share of the range of the prediction a deviation is rounding.
const ROUNDING: f64 = 1e-5;

/// The glitches of a record: samples of it, in order. `place` is its number, `offset` its output offset, `limit` the
/// standard deviations from which on a sample is far. What the record leaves out already does not count for what is
/// usual.
pub(crate) fn glitches(record: &Record<'_>, chain: &Chain, place: usize, offset: f64, limit: f64) -> Vec<usize> {
    let dt = record.dt().unwrap_or(chain.dt);
    let predicted = chain.response_in(place, record.input(), dt);
    let (low, high) = signal::bounds(&predicted[record.skip()..]);
    let left = |k: usize| record.output()[k] - predicted[k] - offset;
    let residual: Vec<f64> = (record.skip()..record.input().len()).map(left).collect();
    let kept: Vec<f64> = record.fitted().map(left).collect();
    let middle = signal::median(&kept);
    let centred: Vec<f64> = kept.iter().map(|e| e - middle).collect();
    let usual = signal::robust_deviation(&centred).max(ROUNDING * (high - low)).max(resolution(record));
    // Most records have no jump that is high enough.
    if residual.windows(2).all(|pair| (pair[1] - pair[0]).abs() < ABRUPT * limit * usual) {
        return Vec::new();
    }
    let is_kept = is_kept(record);
    let levels = medians(&residual, &is_kept, AROUND, AROUND);
    let distances: Vec<f64> = residual.iter().zip(&levels).map(|(e, level)| (e - level).abs()).collect();
    let [shortly, later] =
        AFTER_TURN.map(|after| Turns::new(record, chain.linear.lag() / dt, after).deviations(&distances, &is_kept));
    let [before, after] = [(NEARBY, 0), (0, NEARBY)].map(|(p, q)| medians(&distances, &is_kept, p, q));
    let last = distances.len() - 1;
    let nearby = |k: usize| {
        // Near an end there is one side only.
        let [before, after] = [(k >= NEARBY, before[k]), (k + NEARBY <= last, after[k])];
        [before, after]
            .into_iter()
            .filter(|(is_whole, _)| *is_whole)
            .fold(0.0, |most: f64, (_, median)| most.max(median))
    };
    let is_far = |k: &usize| {
        // No turn explains more than the range of what is predicted.
        let unusual = (limit * shortly[*k].max(later[*k])).min(high - low);
        distances[*k] > unusual.max(limit * usual).max(limit * DEVIATIONS_OF_HALF * nearby(*k))
    };
    let far: Vec<usize> = (0..distances.len()).filter(is_far).collect();
    let mut wrong = vec![false; distances.len()];
    for run in together(&far).into_iter().filter(|run| is_abrupt(&residual, &levels, &distances, &far[run.clone()])) {
        far[run].iter().for_each(|k| wrong[*k] = true);
    }
    // A glitch that lasts into a turn is one there as well.
    for k in 1..wrong.len() {
        wrong[k] |= wrong[k - 1] && distances[k] > limit * usual;
    }
    for k in (1..wrong.len()).rev() {
        wrong[k - 1] |= wrong[k] && distances[k - 1] > limit * usual;
    }
    (0..wrong.len()).filter(|k| wrong[*k]).map(|k| record.skip() + k).collect()
}

/// The smallest step of the output: that of a converter, if it is seen.
fn resolution(record: &Record<'_>) -> f64 {
    let steps = signal::steps(&record.fitted_of(record.output()));
    steps.into_iter().reduce(f64::min).unwrap_or(0.0)
}

/// Whether each sample behind the skipped ones is not left out.
fn is_kept(record: &Record<'_>) -> Vec<bool> {
    let mut kept = vec![true; record.input().len() - record.skip()];
    record.left_out().iter().for_each(|k| kept[k - record.skip()] = false);
    kept
}

/// The median of what is kept of these values from so many samples before to so many after each.
fn medians(values: &[f64], is_kept: &[bool], before: usize, after: usize) -> Vec<f64> {
    let mut about = Vec::with_capacity(before + 1 + after);
    let level = |k: usize| {
        let range = k.saturating_sub(before)..(k + after + 1).min(values.len());
        about.clear();
        about.extend(range.filter(|j| is_kept[*j]).map(|j| values[j]));
        let middle = about.len() / 2;
        if about.is_empty() { 0.0 } else { *about.select_nth_unstable_by(middle, f64::total_cmp).1 }
    };
    (0..values.len()).map(level).collect()
}

/// The far samples that belong together, as ranges of their places.
fn together(far: &[usize]) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for place in 0..far.len() {
        match runs.last_mut() {
            Some(last) if far[place] <= far[place - 1] + GAP + 1 => last.end = place + 1,
            _ => runs.push(place..place + 1),
        }
    }
    runs
}

/// Whether far samples are few, and the residual jumps before and after the furthest of them. What a record begins with
/// may be a transient of what was before, unless it comes back at once. Beyond the end of a record the residual is as
/// usual.
fn is_abrupt(residual: &[f64], levels: &[f64], distances: &[f64], far: &[usize]) -> bool {
    let (Some(first), Some(last)) = (far.first(), far.last()) else { return false };
    let Some(furthest) = (*first..=*last).max_by(|p, q| distances[*p].total_cmp(&distances[*q])) else { return false };
    let before = |k: usize| residual[k.saturating_sub(1)];
    let after = |k: usize| residual.get(k + 1).copied().unwrap_or(levels[k]);
    let begins = (*first..=furthest).any(|k| (residual[k] - before(k)).abs() >= ABRUPT * distances[furthest]);
    let comes_back =
        |share: f64| (furthest..=*last).any(|k| (residual[k] - after(k)).abs() >= share * distances[furthest]);
    last - first < LONGEST && (begins && comes_back(ABRUPT) || *first == 0 && comes_back(AT_ONCE))
}

/// How far the drive left a straight line shortly before every sample, in powers of two below its range: where it turns
/// round, and where it jumps.
struct Turns {
    powers: Vec<usize>,
    enough: usize,
}

impl Turns {
    fn new(record: &Record<'_>, lag: f64, after: usize) -> Self {
        let (low, high) = record.input_bounds();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a number of samples")]
        let before = after + lag.max(0.0).ceil() as usize;
        let input = record.input();
        let at = |k: usize| input[k.min(input.len() - 1)];
        let bend = |k: usize| (at(k + 1) - 2.0 * at(k) + at(k.saturating_sub(1))).abs();
        let bends: Vec<f64> = (0..input.len()).map(bend).collect();
        let most = highest_about(&bends, before, BEFORE_TURN);
        #[expect(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "between 0 and the number of powers"
        )]
        let power = |bend: &f64| -((bend / (high - low)).log2().clamp(-as_f64(POWERS), 0.0).floor()) as usize;
        let powers = most[record.skip()..].iter().map(power).collect();
        Self { powers, enough: TURNS * (before + 1 + BEFORE_TURN) }
    }

    /// The deviation of all samples with a turn alike or next to it, for every sample; infinite where these are too
    /// few.
    fn deviations(&self, distances: &[f64], is_kept: &[bool]) -> Vec<f64> {
        let mut of_power: Vec<Vec<f64>> = vec![Vec::new(); POWERS + 3];
        let kept = self.powers.iter().zip(distances).zip(is_kept).filter(|(_, is_kept)| **is_kept);
        for ((power, distance), _) in kept {
            (0..3).for_each(|next| of_power[power + next].push(*distance));
        }
        let deviation = |distances: &Vec<f64>| {
            let is_told = distances.len() >= self.enough;
            if is_told { signal::quantile(distances, MOST) / DEVIATIONS_OF_MOST } else { f64::INFINITY }
        };
        let deviations: Vec<f64> = of_power.iter().map(deviation).collect();
        self.powers.iter().map(|power| deviations[power + 1]).collect()
    }
}

/// The highest value from `before` samples before to `after` samples after each.
fn highest_about(values: &[f64], before: usize, after: usize) -> Vec<f64> {
    // Places of values that may still be the highest, each higher than those behind it.
    let mut candidates: VecDeque<usize> = VecDeque::new();
    let mut next = 0;
    let highest = |k: usize| {
        while next < values.len() && next <= k + after {
            while candidates.back().is_some_and(|last| values[*last] <= values[next]) {
                candidates.pop_back();
            }
            candidates.push_back(next);
            next += 1;
        }
        while candidates.front().is_some_and(|first| first + before < k) {
            candidates.pop_front();
        }
        candidates.front().map_or(0.0, |first| values[*first])
    };
    (0..values.len()).map(highest).collect()
}
