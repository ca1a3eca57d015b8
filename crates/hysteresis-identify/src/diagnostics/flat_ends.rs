//! Positions that stand still within their noise where the drive goes on to its end.

use std::ops::Range;

use super::hints::{leave_out, stretches};
use super::named_sample;
use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::record::Record;
use crate::signal;

/// A swing of the drive counts from this share of its range on.
const SWING: f64 = 0.05;

/// What is within so many standard deviations of the noise of a level is at that level.
const NOISE: f64 = 5.0;

/// Where the position stands still about a turn of the drive.
struct FlatEnd {
    stretch: Range<usize>,
    /// How far the drive goes on meanwhile until it turns, over its range.
    travel: f64,
    level: f64,
}

/// The position is at its end, but for noise: a sensor whose range is too small, or an amplifier.
pub(super) fn clipped(record: &Record<'_>) -> Option<Finding> {
    const HELD: f64 = 0.02;
    /// Where nothing is clipped the position moves by a fifth of its mean gain at least.
    const SLOPE: f64 = 0.2;
    const UNUSUAL: f64 = 3.0;
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
            flat.iter().filter(|end| is_top(end, *top) && end.travel > usual).map(move |end| (end, position))
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
    let (low, high) = signal::bounds(drive);
    let of_turn = |turn: &usize| {
        let is_near = |k: &usize| drive[*turn] - drive[*k] <= NEAR * (high - low);
        let first = (0..=*turn).rev().take_while(is_near).last().unwrap_or(*turn);
        let last = (*turn..drive.len()).take_while(is_near).last().unwrap_or(*turn);
        let level = signal::median(&position[first..=last]);
        let is_flat = |k: &usize| (position[*k] - level).abs() <= NOISE * noise;
        let from = (0..=*turn).rev().take_while(is_flat).last().unwrap_or(*turn);
        let to = (*turn..drive.len()).take_while(is_flat).last().unwrap_or(*turn);
        FlatEnd { stretch: from..to, travel: (drive[*turn] - drive[from]) / (high - low), level }
    };
    let turns = signal::turns(drive, SWING * (high - low));
    let tops = turns.iter().filter(|turn| drive[**turn] > drive[turn.saturating_sub(1)]);
    tops.map(of_turn).filter(|end| end.stretch.len() >= SHORTEST).collect()
}
