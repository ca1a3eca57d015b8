//! Signals that stand still while the other one moves, between their ends: a frozen sensor or monitor.

use std::ops::Range;

use super::hints::leave_out;
use super::named_sample;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::record::Record;
use crate::signal;

/// Where the position stands still while the drive moves on: at its ends, and between them.
pub(super) struct Stays {
    /// At the highest or lowest value, with how far the drive moves meanwhile over its range, the longest way first.
    at_the_ends: Vec<(f64, Range<usize>)>,
    between: Vec<(f64, Range<usize>)>,
}

impl Stays {
    /// The stays of the fitted samples that are unusually long: a coarse or slow sensor stays at every value.
    pub(super) fn of(record: &Record<'_>) -> Self {
        const UNUSUAL: f64 = 3.0;
        /// Stays that may be unusual ones, and the share of all stays that may.
        const FEW: usize = 4;
        const SHARE: usize = 10;
        /// Two readings are equal by chance, or as the position turns between them.
        const SHORTEST: usize = 3;
        let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
        let ((low, high), ends) = (signal::bounds(input), <[f64; 2]>::from(signal::bounds(output)));
        let (at_the_ends, between): (Vec<_>, Vec<_>) =
            stays(output, input, high - low).into_iter().partition(|(_, stay)| ends.contains(&output[stay.start]));
        let usual = UNUSUAL * between.get(FEW + between.len() / SHARE).map_or(0.0, |(travel, _)| *travel);
        let unusual = |stays: Vec<(f64, Range<usize>)>| {
            let longer = stays.into_iter().filter(|(travel, _)| *travel > usual);
            longer.map(|(travel, stay)| (travel, record.skip() + stay.start..record.skip() + stay.end)).collect()
        };
        let mut between: Vec<_> = unusual(between);
        between.retain(|(_, stay)| stay.len() >= SHORTEST);
        Self { at_the_ends: unusual(at_the_ends), between }
    }

    /// The position stands still between its ends: a frozen sensor.
    pub(super) fn stuck(&self, record: &Record<'_>) -> Option<Finding> {
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
    pub(super) fn clipped(&self, record: &Record<'_>) -> Option<Finding> {
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

/// The stays with more travel than that, in the order of the record.
fn past(stays: &[(f64, Range<usize>)], limit: f64) -> Vec<Range<usize>> {
    let mut found: Vec<_> = stays.iter().filter(|(travel, _)| *travel > limit).map(|(_, stay)| stay.clone()).collect();
    found.sort_by_key(|stay| stay.start);
    found
}

/// The recorded drive stands still while the position moves on, and then catches up.
///
/// `unexplained` is what moves of the position: all of it, or with dynamics and creep the residual.
pub(super) fn input(record: &Record<'_>, unexplained: &[f64], residual: &[f64]) -> Option<Finding> {
    const HELD: f64 = 0.03;
    const NOISE: f64 = 8.0;
    /// The drive catches up by so many usual steps.
    const JUMP: f64 = 5.0;
    let (input, range) = (&record.input()[record.skip()..], record.output_range());
    let steps: Vec<f64> = input.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect();
    let jump = JUMP * signal::median(&steps);
    let catches_up = |stretch: &Range<usize>| {
        input.get(stretch.end).is_some_and(|next| (next - input[stretch.end - 1]).abs() > jump)
            || stretch.start > 0 && (input[stretch.start] - input[stretch.start - 1]).abs() > jump
    };
    let found = stays(input, unexplained, range);
    let (value, stretch) = found.into_iter().find(|(_, stretch)| catches_up(stretch))?;
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
