//! Signals that stand still while the other one moves: frozen between their ends, or clipped at one of them.

use std::ops::Range;

use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::sample_ranges::{leave_out, named_sample, stretches};
use crate::records::record::Record;
use crate::records::signal;
use crate::records::signal::SWING;

/// Where the position stands still while the drive moves on: at its ends, and between them.
pub(crate) struct Stays {
    /// At the highest or lowest value, with how far the drive moves meanwhile over its range, the longest way first.
    at_the_ends: Vec<(f64, Range<usize>)>,
    between: Vec<(f64, Range<usize>)>,
}

/// What is longer than so many usual stays is unusual.
const UNUSUAL: f64 = 3.0;

impl Stays {
    /// The stays of the fitted samples that are unusually long: a coarse or slow sensor stays at every value. The
    /// position follows the drive so many samples later.
    pub(crate) fn of(record: &Record<'_>, lag: usize) -> Self {
        /// Two readings are equal by chance, or as the position turns between them.
        const SHORTEST: usize = 3;
        /// A sensor at its end is there while the drive goes on by this share of its range at least, and not only
        /// turns.
        const GOES_ON: f64 = 0.005;
        /// A stage that begins at rest stays there for so many lags and samples, too.
        const LAGS: usize = 3;
        const AT_REST: usize = 5;
        let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
        let ((low, high), ends) = (signal::bounds(input), <[f64; 2]>::from(signal::bounds(output)));
        let is_end = |stay: &Range<usize>| ends.contains(&output[stay.start]);
        let sign = signal::correlation(input, output).map_or(1.0, f64::signum);
        let driven = |stay: &Range<usize>| &input[stay.start.saturating_sub(lag)..stay.end.saturating_sub(lag)];
        let goes_on = |stay: &Range<usize>| {
            let level = output[stay.start];
            let came_from = if is_end(stay) { ends[0] + ends[1] - level } else { output[stay.start.max(1) - 1] };
            signal::goes_on(driven(stay), sign * (level - came_from)) / (high - low)
        };
        let (mut at_the_ends, mut between): (Vec<_>, Vec<_>) =
            stays(output, input, high - low).into_iter().partition(|(_, stay)| is_end(stay));
        let least = usual(&between, |(_, stay)| goes_on(stay)).max(GOES_ON);
        // A record that begins there shows the way back alone, which hysteresis has behind every turn.
        let longest = at_the_ends.iter().chain(&between).filter(|(_, stay)| stay.start > 0);
        let longest = longest.map(|(travel, _)| *travel).fold(least / UNUSUAL, f64::max);
        let comes_back = |stay: &Range<usize>| {
            let back: Vec<f64> = driven(stay).iter().rev().copied().collect();
            signal::goes_on(&back, sign * (output[stay.start] - 0.5 * (ends[0] + ends[1]))) / (high - low)
        };
        let begins_there = |stay: &Range<usize>| {
            stay.start == 0 && stay.len() > LAGS * lag + AT_REST && comes_back(stay) > UNUSUAL * longest
        };
        at_the_ends.retain(|(_, stay)| goes_on(stay) > least || begins_there(stay));
        let usual = usual(&between, |(travel, _)| *travel);
        between.retain(|(travel, stay)| *travel > usual && stay.len() >= SHORTEST);
        let in_record = |stays: Vec<(f64, Range<usize>)>| {
            let later = |stay: Range<usize>| record.skip() + stay.start..record.skip() + stay.end;
            stays.into_iter().map(|(travel, stay)| (travel, later(stay))).collect()
        };
        Self { at_the_ends: in_record(at_the_ends), between: in_record(between) }
    }

    /// The position stands still between its ends: a frozen sensor.
    pub(crate) fn stuck(&self, record: &Record<'_>) -> Option<Finding> {
        const LIMIT: f64 = 0.03;
        let (value, stay) = self.between.first()?;
        let message = format!(
            "the position stands still from {} to sample {} while the drive moves by {:.1} % of its range",
            named_sample(record, stay.start),
            stay.end - 1,
            100.0 * value
        );
        let finding = Finding::new(FindingCode::StuckOutput, *value, LIMIT, message).at(stay.start);
        Some(finding.try_next(leave_out(&past(&self.between, LIMIT))))
    }

    /// The position stays at an end: a sensor or converter whose range is too small.
    pub(crate) fn clipped(&self, record: &Record<'_>) -> Option<Finding> {
        const LIMIT: f64 = 0.02;
        let (value, stay) = self.at_the_ends.first()?;
        let message = format!(
            "the output stays at {:.6} from {} on while the input moves by {:.1} % of its range: a sensor or converter at its \
             end",
            record.output()[stay.start],
            named_sample(record, stay.start),
            100.0 * value
        );
        let finding = Finding::new(FindingCode::ClippedOutput, *value, LIMIT, message).at(stay.start);
        let hint = leave_out(&past(&self.at_the_ends, 0.5 * LIMIT));
        Some(finding.try_next(format!("drive less far, or widen the range of the sensor or its converter; or {hint}")))
    }
}

/// What of a measure of stays is not yet unusual: some may be.
fn usual(stays: &[(f64, Range<usize>)], measure: impl Fn(&(f64, Range<usize>)) -> f64) -> f64 {
    /// Stays that may be unusual ones, and the share of all stays that may.
    const FEW: usize = 4;
    const SHARE: usize = 10;
    let mut measured: Vec<f64> = stays.iter().map(measure).collect();
    measured.sort_unstable_by(|a, b| b.total_cmp(a));
    UNUSUAL * measured.get(FEW + stays.len() / SHARE).copied().unwrap_or(0.0)
}

/// The stays with more travel than that, in the order of the record.
fn past(stays: &[(f64, Range<usize>)], limit: f64) -> Vec<Range<usize>> {
    let mut found: Vec<_> = stays.iter().filter(|(travel, _)| *travel > limit).map(|(_, stay)| stay.clone()).collect();
    found.sort_by_key(|stay| stay.start);
    found
}

/// The recorded drive stands still while the position moves on, and then catches up: the recorder froze, and not the
/// drive.
///
/// A drive that rests comes to its rest and leaves it with the steps that it makes before and after, and a step of a
/// staircase is answered by the position. What froze jumps, and the position does not follow the jump: it has gone that
/// way meanwhile.
///
/// `unexplained` is what moves of the position: all of it, or with dynamics and creep the residual.
pub(crate) fn input(record: &Record<'_>, unexplained: &[f64], residual: &[f64]) -> Option<Finding> {
    const HELD: f64 = 0.03;
    const NOISE: f64 = 8.0;
    let (input, range) = (&record.input()[record.skip()..], record.output_range());
    let recorder = Recorder::of(input, &record.output()[record.skip()..]);
    let found = stays(input, unexplained, range);
    let (value, stretch) = found.into_iter().find(|(_, stretch)| recorder.froze(stretch))?;
    let limit = HELD + NOISE * signal::noise(residual) / range;
    let (from, to) = (record.skip() + stretch.start, record.skip() + stretch.end);
    let message = format!(
        "the recorded drive stands still from {} to sample {} while the position moves by {:.1} % of its range",
        named_sample(record, from),
        to - 1,
        100.0 * value
    );
    let finding = Finding::new(FindingCode::StuckInput, value, limit, message).at(from);
    Some(finding.try_next(format!("put a straight line in the place of this part of the drive: --mend {from}:{to}")))
}

/// What is recorded of drive and position, to tell a rest from a recorder that froze.
struct Recorder<'a> {
    input: &'a [f64],
    output: &'a [f64],
    /// The position over the drive, about.
    slope: f64,
    usual_step: f64,
}

impl<'a> Recorder<'a> {
    fn of(input: &'a [f64], output: &'a [f64]) -> Self {
        let ((low, high), (lowest, highest)) = (signal::bounds(input), signal::bounds(output));
        let sign = signal::correlation(input, output).map_or(1.0, f64::signum);
        let usual_step = signal::median(&signal::steps(input));
        Self { input, output, slope: sign * (highest - lowest) / (high - low), usual_step }
    }

    /// Whether the drive jumps to this stay or from it, and the position does not answer.
    fn froze(&self, stay: &Range<usize>) -> bool {
        [self.jump(stay.start, stay), self.jump(stay.end, stay)]
            .into_iter()
            .flatten()
            .any(|(at, jump)| !self.is_answered(at, jump) && !self.is_answered_late(stay, at, jump))
    }

    /// The step of the drive to a sample at an end of a stay, if it is no step of a ramp: far larger than usual, and
    /// than those next to it on the other side of it.
    fn jump(&self, at: usize, stay: &Range<usize>) -> Option<(usize, f64)> {
        const USUAL: f64 = 5.0;
        const NEAR: usize = 3;
        const NEXT_TO_IT: f64 = 3.0;
        let step = |k: usize| self.input.get(k).zip(self.input.get(k.wrapping_sub(1))).map(|(to, from)| to - from);
        let jump = step(at)?;
        let ramp = if at == stay.start { at.saturating_sub(NEAR)..at } else { at + 1..at + 1 + NEAR };
        let next_to_it = ramp.filter_map(step).fold(0.0, |most: f64, step| most.max(step.abs()));
        (jump.abs() > (USUAL * self.usual_step).max(NEXT_TO_IT * next_to_it)).then_some((at, jump))
    }

    /// Whether the position makes half of a jump of the drive within a few samples, beyond what it did just before.
    fn is_answered(&self, at: usize, jump: f64) -> bool {
        const WITHIN: usize = 8;
        let (from, to) = (at - 1, (at + WITHIN).min(self.output.len() - 1));
        let went_on = match from.checked_sub(to - from) {
            Some(before) => self.output[from] - self.output[before],
            None => 0.0,
        };
        self.share(self.output[to] - self.output[from] - went_on, jump) > 0.5
    }

    /// Whether the position makes half of the jump to a stay in the course of it: a slow stage.
    fn is_answered_late(&self, stay: &Range<usize>, at: usize, jump: f64) -> bool {
        at == stay.start && self.share(self.output[stay.end - 1] - self.output[stay.start], jump) > 0.5
    }

    /// Which share of what the position makes of a jump it went.
    fn share(&self, way: f64, jump: f64) -> f64 {
        way / (self.slope * jump)
    }
}

/// The stretches of equal values, those first in which `other` moves furthest, with that travel over `range`.
fn stays(values: &[f64], other: &[f64], range: f64) -> Vec<(f64, Range<usize>)> {
    let travel = |stretch: Range<usize>| {
        let (low, high) = signal::bounds(&other[stretch.clone()]);
        ((high - low) / range, stretch)
    };
    let mut stays: Vec<_> = signal::stays(values).map(travel).collect();
    stays.sort_by(|a, b| b.0.total_cmp(&a.0));
    stays
}

/// What is within so many standard deviations of the noise of a level is at that level.
const NOISE: f64 = 5.0;

/// Where the position stands still about a turn of the drive.
struct FlatEnd {
    stretch: Range<usize>,
    /// How far the drive goes on meanwhile until it turns, over its range.
    travel: f64,
    level: f64,
    /// How far below the level the position was at twice that distance from the turn.
    below: f64,
}

/// The position is at its end, but for noise: a sensor whose range is too small, or an amplifier.
pub(crate) fn clipped(record: &Record<'_>) -> Option<Finding> {
    const HELD: f64 = 0.02;
    /// Where nothing is clipped the position moves by a fifth of its mean gain at least.
    const SLOPE: f64 = 0.2;
    const UNUSUAL: f64 = 3.0;
    /// A sensor is left with the slope that the stage has there. A curve that is flat at its end, as that of a squared
    /// drive, has moved by only four times what is flat of it at twice the distance, and a cubic one by eight.
    const KINK: f64 = 8.0;
    /// Or it has such a share of its mean gain there.
    const STEEP: f64 = 0.75;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let sign = signal::correlation(input, output)?.signum();
    let curvature: Vec<f64> = output.windows(3).map(|three| three[2] - 2.0 * three[1] + three[0]).collect();
    let noise = signal::robust_deviation(&curvature) / 6.0_f64.sqrt();
    let limit = HELD + NOISE * noise / record.output_range() / SLOPE;
    let ends = [1.0, -1.0].map(|side| {
        let position: Vec<f64> = output.iter().map(|y| side * sign * y).collect();
        let drive: Vec<f64> = input.iter().map(|u| side * u).collect();
        let flat = flat_ends(&drive, &position, noise);
        // A sensor at its end is there at one level, which nothing exceeds.
        let top = signal::bounds(&position).1;
        (flat, top, position)
    });
    // A noisy or humming drive goes on at every turn without the position.
    let is_top = |end: &FlatEnd, top: f64| end.level > top - 2.0 * NOISE * noise;
    let elsewhere = ends.iter().flat_map(|(flat, top, _)| flat.iter().filter(|end| !is_top(end, *top)));
    let usual = UNUSUAL * signal::median(&elsewhere.map(|end| end.travel).collect::<Vec<f64>>());
    let (worst, position) = ends
        .iter()
        .flat_map(|(flat, top, position)| {
            let has_kink = move |end: &FlatEnd| {
                end.below > KINK * NOISE * noise || end.below > STEEP * end.travel * record.output_range()
            };
            let is_end = move |end: &&FlatEnd| is_top(end, *top) && end.travel > usual && has_kink(end);
            flat.iter().filter(is_end).map(move |end| (end, position))
        })
        .max_by(|(a, _), (b, _)| a.travel.total_cmp(&b.travel))?;
    let at = |k: usize| input[k.min(input.len() - 1)];
    let (low, high) = signal::bounds(input);
    let (enters, leaves) = (at(worst.stretch.start), at(worst.stretch.end));
    let sample = record.skip() + worst.stretch.start;
    let message = format!(
        "the output stays at {:.6} within its noise from {} on while the input moves by {:.1} % of its range",
        output[worst.stretch.start],
        named_sample(record, sample),
        100.0 * worst.travel
    );
    let finding = Finding::new(FindingCode::ClippedOutput, worst.travel, limit, message).at(sample);
    // Loops have a width, so a sensor at its end is left at another drive than it was reached at.
    if (enters - leaves).abs() < 0.5 * limit * (high - low) {
        return Some(finding.try_next(format!(
            "the position stays between the same two drives of {enters:.4}: an amplifier at its end; drive less far than that, \
             or put no more than that into the column of the drive"
        )));
    }
    let samples: Vec<usize> = (0..position.len()).filter(|k| position[*k] > worst.level - NOISE * noise).collect();
    let places = stretches(&samples, 1).into_iter().filter(|one| one.len() > 2);
    let places: Vec<_> = places.map(|one| record.skip() + one.start..record.skip() + one.end).collect();
    Some(finding.try_next(format!(
        "drive less far, or widen the range of the sensor or its converter; or {}",
        leave_out(&places)
    )))
}

/// The flat stretches about the upper turns of the drive.
fn flat_ends(drive: &[f64], position: &[f64], noise: f64) -> Vec<FlatEnd> {
    /// The level is that of samples so near to the turn, as a share of the range of the drive.
    const NEAR: f64 = 0.01;
    /// What stands still for fewer samples may do so by chance.
    const SHORTEST: usize = 5;
    /// Twice the way, and a little: rounding decides nothing.
    const TWICE: f64 = 2.01;
    let (low, high) = signal::bounds(drive);
    let of_turn = |turn: &usize| {
        let is_near = |k: &usize| drive[*turn] - drive[*k] <= NEAR * (high - low);
        let first = (0..=*turn).rev().take_while(is_near).last().unwrap_or(*turn);
        let last = (*turn..drive.len()).take_while(is_near).last().unwrap_or(*turn);
        let level = signal::median(&position[first..=last]);
        let is_flat = |k: &usize| (position[*k] - level).abs() <= NOISE * noise;
        let from = (0..=*turn).rev().take_while(is_flat).last().unwrap_or(*turn);
        let to = (*turn..drive.len()).take_while(is_flat).last().unwrap_or(*turn);
        let travel = drive[*turn] - drive[from];
        let twice = (0..=from).rev().take_while(|k| (0.0..=TWICE * travel).contains(&(drive[*turn] - drive[*k])));
        let below = level - twice.map(|k| position[k]).fold(level, f64::min);
        FlatEnd { stretch: from..to, travel: travel / (high - low), level, below }
    };
    let turns = signal::turns(drive, SWING * (high - low));
    let tops = turns.iter().filter(|turn| drive[**turn] > drive[turn.saturating_sub(1)]);
    tops.map(of_turn).filter(|end| end.stretch.len() >= SHORTEST).collect()
}

#[cfg(test)]
mod tests {
    use crate::records::signal::as_f64;

    use super::*;

    /// Loops of 80 samples that shrink to a third.
    fn drive() -> Vec<f64> {
        let loops = |k: usize| (1.0 - as_f64(k) / 1200.0) * (1.0 - (as_f64((k + 20) % 80) / 20.0 - 2.0).abs());
        (0..800).map(loops).collect()
    }

    /// A backlash of half the range: flat behind every turn.
    fn backlash(drive: &[f64]) -> Vec<f64> {
        let mut play = 0.0_f64;
        let follow = |u: &f64| {
            play = play.clamp(u - 0.25, u + 0.25);
            play
        };
        drive.iter().map(follow).collect()
    }

    fn clipped(output: &[f64], lag: usize) -> Option<Finding> {
        clipped_of(&drive(), output, lag)
    }

    fn clipped_of(drive: &[f64], output: &[f64], lag: usize) -> Option<Finding> {
        let record = Record::new(drive, output, 0).unwrap();
        Stays::of(&record, lag).clipped(&record).filter(|finding| finding.value > finding.limit)
    }

    /// A flat that begins at the turn is hysteresis; one that begins before it is a sensor at its end.
    #[test]
    fn a_backlash_is_not_clipped_unless_the_drive_goes_on() {
        let flat = backlash(&drive());
        let late = [&[0.0; 6], &flat[..794]].concat();
        for (output, lag) in [(&flat, 0), (&late, 0), (&late, 6)] {
            for sign in [1.0, -1.0] {
                let signed: Vec<f64> = output.iter().map(|y| sign * y).collect();
                assert_eq!(clipped(&signed, lag), None, "{sign} {lag}");
                // Unless its lag is known, a position comes late to its end: with the drive at the turn.
                let is_told = lag > 0 || output == &flat;
                for (low, high) in [(-0.5, 0.5), (-0.5, 2.0), (-2.0, 0.5), (-2.0, 0.6)] {
                    let ends: Vec<f64> = signed.iter().map(|y| y.clamp(low, high)).collect();
                    assert_eq!(clipped(&ends, lag).is_some(), is_told, "{sign} {lag} {low} {high}");
                }
            }
        }
    }

    /// A record that begins at its only such end is told, one that begins behind a turn of a backlash is not.
    #[test]
    fn a_record_that_begins_within_its_clip_is_told() {
        let loops = |k: usize| (1.0 - as_f64(k) / 3200.0) * ((as_f64(k % 400) / 100.0 - 2.0).abs() - 1.0);
        let drive: Vec<f64> = (0..1600).map(loops).collect();
        let late = |samples: usize| [&vec![drive[0]; samples], &drive[..1600 - samples]].concat();
        for sign in [1.0, -1.0] {
            let told = |output: &[f64], end: f64, lag: usize| {
                let signed: Vec<f64> = output.iter().map(|y| sign * y.min(end)).collect();
                clipped_of(&drive, &signed, lag).filter(|finding| finding.value > finding.limit)
            };
            assert_eq!(told(&drive, 0.88, 0).map(|found| found.sample), Some(Some(0)));
            assert!(told(&late(3), 0.88, 3).is_some());
            // At rest, until it follows; and behind a turn.
            assert_eq!(told(&late(20), 1.0, 12), None);
            assert_eq!(told(&late(4), 1.0, 0), None);
            assert_eq!(told(&backlash(&drive), 1.0, 0), None);
            assert_eq!(told(&drive, 1.0, 0), None);
        }
    }

    /// A curve that is flat at its end, as u^2 at rest, is no sensor at its end.
    #[test]
    fn a_curve_that_is_flat_at_its_end_is_not_clipped() {
        let drive: Vec<f64> = (0..4000).map(|k| 1.0 - (as_f64(k % 1000) / 500.0 - 1.0).abs()).collect();
        let noisy = |(k, y): (usize, f64)| y + 1e-3 * ((as_f64(k) * 12.9898).sin() * 43758.5453).fract();
        let told = |curve: fn(f64) -> f64| {
            let output: Vec<f64> = drive.iter().map(|u| curve(*u)).enumerate().map(noisy).collect();
            let found = super::clipped(&Record::new(&drive, &output, 0).unwrap());
            found.is_some_and(|finding| finding.value > finding.limit)
        };
        assert!(!told(|u| u * u) && !told(|u| u.powi(3)) && !told(|u| 1.0 - (1.0 - u).powi(2)));
        assert!(told(|u| u.max(0.1)) && told(|u| u.min(0.9)) && told(|u| (u * u).max(0.05)));
    }

    /// A coarse sensor stays at its last value as at all others; a wide one at the end of its range stays longer.
    #[test]
    fn a_coarse_sensor_is_not_clipped() {
        for bits in [32.0, 256.0, 4096.0] {
            let coarse: Vec<f64> = backlash(&drive()).iter().map(|y| (y * bits).round() / bits).collect();
            assert_eq!(clipped(&coarse, 0), None, "{bits}");
            let ends: Vec<f64> = coarse.iter().map(|y| y.min(0.5)).collect();
            assert!(clipped(&ends, 0).is_some(), "{bits}");
        }
    }
}
