//! Defects of samples: glitches, bursts, jumps and failed rows, and noise of the drive that the position does not
//! follow.

use std::ops::Range;

use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::sample_ranges::{leave_out, mend, named, named_sample, stretches};
use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::{SWING, as_f64};

/// Samples to either side of one whose median tells a glitch from the signal.
const AROUND: usize = 5;

/// Samples of the position far from their neighbours.
pub(crate) fn outliers(record: &Record<'_>, residual: &[f64]) -> Option<Finding> {
    const LIMIT: f64 = 7.0;
    const SMALLEST: f64 = 1e-5;
    let deviation = signal::robust_deviation(residual).max(SMALLEST * record.output_range());
    let distances = signal::distances_from_neighbours(residual);
    let near = near_turns(&record.input()[record.skip()..]);
    // What every model lacks, it lacks at the turns: there only what is unusual at turns is a glitch.
    let at_turns: Vec<f64> = distances.iter().zip(&near).filter(|(_, near)| **near).map(|(one, _)| *one).collect();
    let deviation_at_turns = deviation.max(signal::robust_deviation(&at_turns));
    let share = |k: usize| distances[k] / if near[k] { deviation_at_turns } else { deviation };
    let lacking = lacking_behind_turns(&record.input()[record.skip()..], share, LIMIT);
    let far: Vec<usize> = (0..distances.len()).filter(|k| share(*k) > LIMIT && !lacking[*k]).collect();
    let first = (0..distances.len()).filter(|k| !lacking[*k]).max_by(|a, b| share(*a).total_cmp(&share(*b)))?;
    let (value, sample) = (share(first), record.skip() + first);
    let message = format!(
        "{} samples lie far from their neighbours, the furthest {} by {value:.1} standard deviations",
        far.len(),
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::Outliers, value, LIMIT, message).at(sample);
    Some(finding.try_next(leave_out(&in_record(record, stretches(&far, AROUND)))))
}

/// Whether the drive turns at a sample or next to it.
fn near_turns(input: &[f64]) -> Vec<bool> {
    let mut near = vec![false; input.len()];
    for (first, three) in input.windows(3).enumerate() {
        if (three[1] - three[0]) * (three[2] - three[1]) < 0.0 {
            near[first..first + 3].fill(true);
        }
    }
    near
}

/// The samples soon behind the turns of a drive that lie no further than usual there, if far ones lie there as nowhere
/// else and behind several turns: a mode or a lag lets what a model lacks at the turns come later.
fn lacking_behind_turns(input: &[f64], share: impl Fn(usize) -> f64, limit: f64) -> Vec<bool> {
    const TURNS: usize = 3;
    /// By how much denser far samples are there.
    const DENSER: f64 = 8.0;
    /// What lies further than so many times the usual of these is a glitch there, too.
    const USUAL: f64 = 3.0;
    let (low, high) = signal::bounds(input);
    let mut soon = vec![false; input.len()];
    let mut turns_with_far = 0;
    for turn in signal::turns(input, SWING * (high - low)) {
        let behind = turn..input.len().min(turn + 2 * AROUND);
        turns_with_far += usize::from(behind.clone().any(|k| share(k) > limit));
        soon[behind].fill(true);
    }
    let (inside, outside): (Vec<usize>, Vec<usize>) = (0..input.len()).partition(|k| soon[*k]);
    let far =
        |samples: &[usize]| samples.iter().map(|k| share(*k)).filter(|share| *share > limit).collect::<Vec<f64>>();
    let (far_inside, far_outside) = (far(&inside), far(&outside));
    // At least one is expected elsewhere.
    let is_denser = as_f64(far_inside.len() * outside.len()) > DENSER * as_f64((far_outside.len() + 1) * inside.len());
    if turns_with_far < TURNS || !is_denser {
        return vec![false; input.len()];
    }
    let most = USUAL * signal::median(&far_inside);
    (0..input.len()).map(|k| soon[k] && share(k) <= most).collect()
}

/// Many samples that were taken for glitches and left out of the fit.
pub(crate) fn left_out(record: &Record<'_>) -> Finding {
    // What is usual among samples is told with up to a tenth of them wrong: half of that is no rare glitch any more.
    const LIMIT: f64 = 0.05;
    let (samples, all) = (record.left_out(), record.input().len() - record.skip());
    let value = as_f64(samples.len()) / as_f64(all);
    let message = format!(
        "{} samples, {:.1} % of all, were taken for glitches and left out of the fit:{}",
        samples.len(),
        100.0 * value,
        named(&stretches(samples, 0))
    );
    let finding = Finding::new(FindingCode::Outliers, value, LIMIT, message);
    let finding =
        finding.try_next("look at these samples and at the sensor, its cable and its power; record again".into());
    samples.iter().take(1).fold(finding, |finding, first| finding.at(*first))
}

/// A stretch of samples far from the model, with the samples about it near: a burst, a moved cable.
pub(crate) fn bursts(record: &Record<'_>, residual: &[f64]) -> Vec<Range<usize>> {
    const DEVIATIONS: f64 = 10.0;
    const SMALLEST: f64 = 0.02;
    /// A glitch of fewer samples is an outlier.
    const SHORTEST: usize = 3;
    /// The share of the record that a burst may last at most.
    const LONGEST: usize = 10;
    let middle = signal::median(residual);
    let centred: Vec<f64> = residual.iter().map(|e| e - middle).collect();
    let far = (DEVIATIONS * signal::robust_deviation(&centred)).max(SMALLEST * record.output_range());
    let samples: Vec<usize> = (0..centred.len()).filter(|k| centred[*k].abs() > far).collect();
    let is_burst = |one: &Range<usize>| {
        let begins = one.start == 0 || (centred[one.start] - centred[one.start - 1]).abs() > 0.5 * far;
        let ends = one.end == centred.len() || (centred[one.end] - centred[one.end - 1]).abs() > 0.5 * far;
        one.len() >= SHORTEST && one.len() * LONGEST <= centred.len() && begins && ends
    };
    stretches(&samples, AROUND).into_iter().filter(is_burst).collect()
}

/// The finding about bursts.
pub(crate) fn bad_stretch(record: &Record<'_>, residual: &[f64], bursts: &[Range<usize>]) -> Option<Finding> {
    const LIMIT: f64 = 0.02;
    let height = |one: &Range<usize>| residual[one.clone()].iter().fold(0.0_f64, |most, e| most.max(e.abs()));
    let worst = bursts.iter().max_by(|a, b| height(a).total_cmp(&height(b)))?;
    let value = height(worst) / record.output_range();
    let sample = record.skip() + worst.start;
    let message = format!(
        "{} stretches lie far from the model and all that is about them, the furthest {} samples from {} on by {:.1} % of \
         the range",
        bursts.len(),
        worst.len(),
        named_sample(record, sample),
        100.0 * value
    );
    let finding = Finding::new(FindingCode::BadStretch, value, LIMIT, message).at(sample);
    Some(finding.try_next(leave_out(&in_record(record, bursts.to_vec()))))
}

/// The position goes on at another level, though the drive did not jump.
pub(crate) fn jump(record: &Record<'_>, residual: &[f64], bursts: &[Range<usize>]) -> Option<Finding> {
    const LIMIT: f64 = 0.01;
    /// Samples on either side that tell the level.
    const LEVEL: usize = 10;
    const DEVIATIONS: f64 = 7.0;
    /// What of the jump happens between two samples, and how far the drive may move there.
    const ABRUPT: f64 = 0.7;
    const DRIVE: f64 = 0.02;
    /// The position itself moves by so many times the steps of almost all samples.
    const STEPS: f64 = 3.0;
    const ALMOST_ALL: f64 = 0.98;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    let steps: Vec<f64> = residual.windows(2).map(|pair| pair[1] - pair[0]).collect();
    let least = (DEVIATIONS * signal::robust_deviation(&steps)).max(0.5 * LIMIT * record.output_range());
    let moves: Vec<f64> = output.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    let unusual = STEPS * signal::quantile(&moves, ALMOST_ALL);
    let outside = |k: &usize| bursts.iter().all(|one| *k + LEVEL < one.start || one.end + LEVEL < *k);
    let height = |k: usize| signal::median(&residual[k..k + LEVEL]) - signal::median(&residual[k - LEVEL..k]);
    let is_jump = |k: &usize| {
        let step = steps[k - 1].abs();
        // The drive moves by less of its range than the position.
        let drive = (input[*k] - input[k - 1]).abs() / (high - low);
        let is_still = drive < DRIVE.min(step / record.output_range());
        is_still && step > least && step > ABRUPT * height(*k).abs() && moves[k - 1] > unusual
    };
    let last = residual.len().checked_sub(LEVEL)?;
    let (first, most) = (LEVEL..last)
        .filter(is_jump)
        .filter(outside)
        .map(|k| (k, height(k).abs()))
        .max_by(|a, b| a.1.total_cmp(&b.1))
        .filter(|(_, height)| *height > least)?;
    let (value, sample) = (most / record.output_range(), record.skip() + first);
    let message = format!(
        "the position jumps by {:.1} % of its range before {}, though the drive does not",
        100.0 * value,
        named_sample(record, sample)
    );
    let finding = Finding::new(FindingCode::OutputJump, value, LIMIT, message).at(sample);
    Some(finding.try_next(format!(
        "give the part from there on a zero of its own: --leave-out {}:{sample}; if its gain or unit is another one too, fit \
         one part: --rows {sample} or --skip {sample}",
        sample - 1
    )))
}

/// How far every value is from the median of those about it, over the range of the medians; and that range.
fn from_medians(values: &[f64]) -> (Vec<f64>, f64) {
    let medians = signal::medians(values, AROUND);
    let (low, high) = signal::bounds(&medians);
    (values.iter().zip(&medians).map(|(x, median)| (x - median).abs() / (high - low)).collect(), high - low)
}

/// Samples of the drive far from their neighbours that the position does not follow.
pub(crate) fn input_outliers(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.03;
    /// A drive of few bits moves by so much at least.
    const STEPS: f64 = 3.0;
    let steps = signal::steps(record.input());
    let (distances, range) = from_medians(record.input());
    let least = LIMIT.max(STEPS * signal::median(&steps) / range);
    let mut far = single_outliers(record, &distances, least);
    far.extend(drop_outs(record, range, least));
    far.sort_by_key(|(k, _)| *k);
    far.dedup_by_key(|(k, _)| *k);
    let (worst, value) = far.iter().copied().max_by(|(_, a), (_, b)| a.total_cmp(b))?;
    let message = format!(
        "{} samples of the drive lie far from their neighbours and the position does not follow, the furthest {} by {:.0} % \
         of the range",
        far.len(),
        named_sample(record, worst),
        100.0 * value
    );
    let far: Vec<usize> = far.into_iter().map(|(k, _)| k).collect();
    Some(Finding::new(FindingCode::InputOutliers, value, LIMIT, message).at(worst).try_next(mend(&stretches(&far, 1))))
}

/// The position follows a wrong drive if it moves by this share of what it should.
const FOLLOWED: f64 = 0.2;

/// Samples of the drive that are unusually far from the median of those about them, and by `least`, while the position
/// is not; each with how far, over the range.
fn single_outliers(record: &Record<'_>, distances: &[f64], least: f64) -> Vec<(usize, f64)> {
    /// So many samples after the drive.
    const LATER: usize = 3;
    /// What lies this many times further from its neighbours than almost all samples.
    const ALMOST_ALL: f64 = 0.95;
    const FURTHER: f64 = 5.0;
    let output = from_medians(record.output()).0;
    let usual = least.max(FURTHER * signal::quantile(distances, ALMOST_ALL));
    let answer = |k: usize| signal::bounds(&output[k..(k + LATER).min(output.len())]).1;
    let unanswered = |k: &usize| distances[*k] > usual && answer(*k) < FOLLOWED * distances[*k];
    let far: Vec<usize> = (0..distances.len()).filter(unanswered).collect();
    let sudden = stretches(&far, 0).into_iter().filter(|one| is_sudden(record.input(), one));
    sudden.flatten().map(|k| (k, distances[k])).collect()
}

/// Whether values leave those about them by a jump and come back by another, each several times as large as the steps
/// of those: the tip of a fast or small loop moves as they do.
fn is_sudden(values: &[f64], part: &Range<usize>) -> bool {
    const JUMPS: f64 = 3.0;
    const NEAR: usize = 3;
    let step = |k: usize| (values[k] - values[k - 1]).abs();
    let largest = |steps: Range<usize>| steps.map(step).fold(0.0, f64::max);
    let before = largest(part.start.saturating_sub(NEAR).max(1)..part.start.max(1));
    let after = largest((part.end + 1).min(values.len())..(part.end + 1 + NEAR).min(values.len()));
    let jumps_in = part.start == 0 || step(part.start) > JUMPS * before;
    let jumps_out = part.end == values.len() || step(part.end) > JUMPS * after;
    jumps_in && jumps_out
}

/// Runs of one value that the drive jumps to and back from, by `least` of the range, while the position goes straight
/// on; each sample with how far it is.
fn drop_outs(record: &Record<'_>, range: f64, least: f64) -> Vec<(usize, f64)> {
    /// While longer runs last, the position moves on: see `still`.
    const LONGEST: usize = 25;
    /// So many samples later the position of a slow stage has followed a pulse of the drive.
    const LATER: usize = 10;
    let (input, output) = (record.input(), record.output());
    let height = |run: &Range<usize>| {
        let (before, after) = (run.start.checked_sub(1)?, input.get(run.end)?);
        let [to, back] = [input[before], *after].map(|other| (input[run.start] - other).abs() / range);
        Some(to.min(back)).filter(|height| run.len() <= LONGEST && *height > least && is_spike(input, run.start))
    };
    let answer = |run: &Range<usize>| {
        let (from, to) = (run.start - 1, (run.end + LATER).min(output.len() - 1));
        let slope = (output[to] - output[from]) / as_f64(to - from);
        let off = |k: usize| (output[k] - output[from] - slope * as_f64(k - from)).abs();
        (from..to).map(off).fold(0.0, f64::max) / record.output_range()
    };
    let of_run = |run: Range<usize>| {
        let height = height(&run).filter(|height| answer(&run) < FOLLOWED * height);
        height.into_iter().flat_map(move |height| run.clone().map(move |k| (k, height)))
    };
    signal::stays(input).flat_map(of_run).collect()
}

/// Whether a value, or the run of equal ones that it belongs to, jumps away from those about it and back, by several
/// times what those move: the tip of a fast loop moves as they do.
fn is_spike(values: &[f64], k: usize) -> bool {
    const JUMPS: f64 = 3.0;
    let is_other = |j: &usize| values[*j] != values[k];
    let before = (0..k).rev().find(is_other);
    let after = (k + 1..values.len()).find(is_other);
    let (Some(before), Some(after)) = (before, after) else { return before.is_some() || after.is_some() };
    let (to, back) = (values[k] - values[before], values[after] - values[k]);
    let step = |a: usize, b: Option<usize>| b.and_then(|b| values.get(b)).map_or(0.0, |b| (values[a] - b).abs());
    let usual = step(before, before.checked_sub(1)).max(step(after, Some(after + 1)));
    to * back < 0.0 && to.abs().min(back.abs()) > JUMPS * usual
}

/// Rows of one and the same drive and position, far from the rows about them: zeros, or what stands for no reading.
///
/// No sensor reads the same number to the last digit after jumps of the drive from different places.
pub(crate) fn failed_rows(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 1.0;
    /// How far such rows are from their neighbours, over the range of the medians.
    const FAR: f64 = 0.03;
    let (drive, position) = (from_medians(record.input()).0, from_medians(record.output()).0);
    let far = |k: &usize| drive[*k] > FAR && position[*k] > FAR && is_spike(record.input(), *k);
    let far: Vec<usize> = (0..drive.len()).filter(far).collect();
    let row = |k: &usize| (record.input()[*k].to_bits(), record.output()[*k].to_bits());
    let same = |k: &usize| far.iter().filter(|other| row(other) == row(k)).count();
    let common = far.iter().copied().max_by_key(same)?;
    let failed: Vec<usize> = far.iter().copied().filter(|k| row(k) == row(&common)).collect();
    let places = stretches(&failed, 0);
    let message = format!(
        "{} rows have the drive {} and the position {}, far from the rows about them: a reading that failed, first {}",
        failed.len(),
        record.input()[common],
        record.output()[common],
        named_sample(record, failed[0])
    );
    let finding = Finding::new(FindingCode::FailedRows, as_f64(places.len()), LIMIT, message).at(failed[0]);
    Some(finding.try_next(mend(&places)))
}

/// The position does what the drive does not tell, beside what it does in all: its `deviation` from the mean.
pub(crate) fn unrelated(residual: &[f64], deviation: f64) -> Finding {
    const LIMIT: f64 = 0.6;
    let value = signal::rms(residual) / deviation;
    let message = format!("the drive explains only {:.0} % of what the position does", 100.0 * (1.0 - value).max(0.0));
    Finding::new(FindingCode::Unrelated, value, LIMIT, message)
}

fn in_record(record: &Record<'_>, stretches: Vec<Range<usize>>) -> Vec<Range<usize>> {
    stretches.into_iter().map(|one| record.skip() + one.start..record.skip() + one.end).collect()
}

/// So many samples later the position may still answer the drive.
const ANSWER: usize = 8;

/// White noise of unit deviation has second differences of this variance.
const SECOND_DIFFERENCES: f64 = 6.0;

/// The recorded drive is that of a noisy monitor.
pub(crate) fn noisy_input(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.003;
    /// The position follows if what it does on that account is this share of what its gain makes of the noise.
    const FOLLOWED: f64 = 0.1;
    /// Neighbouring second differences of white noise have a correlation of -2/3, and those of any motion more.
    const WHITE: f64 = -0.5;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    let (drive, position) = (curvature(input), curvature(output));
    let value = signal::robust_deviation(&drive) / SECOND_DIFFERENCES.sqrt() / (high - low);
    if drive.len() <= 2 * ANSWER || signal::neighbours(&drive) > WHITE {
        return None;
    }
    let later: Vec<Vec<f64>> = (0..ANSWER).map(|lag| drive[ANSWER - lag..drive.len() - lag].to_vec()).collect();
    let answered = &position[ANSWER..];
    let chance = as_f64(ANSWER) / as_f64(answered.len()) * signal::rms(answered).powi(2);
    let answer = signal::rms(&signal::projection(answered, &later)).powi(2) - chance;
    let expected = FOLLOWED * record.output_range() / (high - low) * signal::rms(&drive);
    let message = format!(
        "the recorded drive has noise of {:.2} % of its range, and the position does not follow it: a monitor's, which biases \
         thresholds and weights",
        100.0 * value
    );
    (answer < expected * expected).then(|| Finding::new(FindingCode::NoisyInput, value, LIMIT, message))
}

/// The second differences, those at turns and jumps cut off.
fn curvature(values: &[f64]) -> Vec<f64> {
    const USUAL: f64 = 4.0;
    let all: Vec<f64> = values.windows(3).map(|three| three[2] - 2.0 * three[1] + three[0]).collect();
    if all.is_empty() {
        return all;
    }
    let most = USUAL * signal::robust_deviation(&all);
    all.into_iter().map(|one| one.clamp(-most, most)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As good as white, below 1e-3.
    fn noise(k: usize) -> f64 {
        1e-3 * ((as_f64(k) * 12.9898).sin() * 43758.5453).fract()
    }

    /// What a model lacks behind every fast turn is no glitch, and one elsewhere still is.
    #[test]
    fn what_is_lacking_behind_turns_is_no_glitch() {
        let drive: Vec<f64> = (0..1000).map(|k| (as_f64(k % 100) / 50.0 - 1.0).abs()).collect();
        let mut residual: Vec<f64> = (0..1000).map(noise).collect();
        let told = |residual: &[f64]| {
            let found = outliers(&Record::new(&drive, &drive, 0).unwrap(), residual).unwrap();
            (found.value > found.limit).then_some(found.sample)
        };
        for turn in [150, 250, 350, 450] {
            residual[turn + 3] = 0.05;
        }
        assert_eq!(told(&residual), None);
        residual[777] = 0.04;
        assert_eq!(told(&residual), Some(Some(777)));
        residual[777] = 0.0;
        residual[553] = 0.5;
        assert_eq!(told(&residual), Some(Some(553)));
        residual[553] = 0.0;
        // Behind one turn it is a glitch.
        residual[250 + 3] = 0.0;
        residual[350 + 3] = 0.0;
        residual[450 + 3] = 0.0;
        assert_eq!(told(&residual), Some(Some(153)));
    }

    /// Loops of few samples: every sample is soon behind a turn, and that says nothing of glitches.
    #[test]
    fn glitches_of_short_loops_are_told() {
        let drive: Vec<f64> = (0..1000).map(|k| (as_f64(k % 20) / 10.0 - 1.0).abs()).collect();
        let mut residual: Vec<f64> = (0..1000).map(noise).collect();
        for k in [113, 316, 544, 789, 901] {
            residual[k] = 0.1;
        }
        let found = outliers(&Record::new(&drive, &drive, 0).unwrap(), &residual).unwrap();
        assert!(found.value > found.limit && found.message.starts_with("5 samples"), "{}", found.message);
    }

    /// A step of what is left is a jump where the drive moves by less than that.
    #[test]
    fn a_jump_is_more_than_the_drive_moves() {
        let told = |fast: f64| {
            let at = |k: usize| if k < 500 { 5e-4 * as_f64(k) } else { 0.25 + fast + 5e-4 * as_f64(k - 500) };
            let drive: Vec<f64> = (0..1000).map(at).collect();
            let residual: Vec<f64> = (0..1000).map(|k| if k < 500 { 0.0 } else { 0.008 }).collect();
            let position: Vec<f64> = drive.iter().zip(&residual).map(|(u, e)| u + e).collect();
            jump(&Record::new(&drive, &position, 0).unwrap(), &residual, &[]).is_some()
        };
        assert!(told(1e-3) && !told(0.0095));
    }
}
