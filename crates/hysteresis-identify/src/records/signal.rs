//! Statistics of single signals and pairs of them.

use std::ops::Range;

pub(crate) fn bounds(values: &[f64]) -> (f64, f64) {
    values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(*value), high.max(*value)))
}

/// The lowest and the highest of several bounds.
pub(crate) fn bounds_of(all: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    all.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (from, to)| (low.min(from), high.max(to)))
}

pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / as_f64(values.len())
}

/// Values about their mean.
pub(crate) fn centred(values: &[f64]) -> Vec<f64> {
    let mean = mean(values);
    values.iter().map(|value| value - mean).collect()
}

/// How far a signal moves from sample to sample, where it does.
pub(crate) fn steps(values: &[f64]) -> Vec<f64> {
    values.windows(2).map(|pair| (pair[1] - pair[0]).abs()).filter(|step| *step > 0.0).collect()
}

/// The root of the mean of the squares, scaled so that no square under- or overflows.
pub(crate) fn rms(values: &[f64]) -> f64 {
    let largest = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    if largest == 0.0 {
        return 0.0;
    }
    let squares: f64 = values.iter().map(|value| (value / largest) * (value / largest)).sum();
    largest * (squares / as_f64(values.len())).sqrt()
}

/// The correlation coefficient of two equally long signals; none if either is constant.
pub(crate) fn correlation(a: &[f64], b: &[f64]) -> Option<f64> {
    let (a, b) = (standardised(a)?, standardised(b)?);
    let products: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
    Some(products / as_f64(a.len()))
}

/// The correlation of a signal with itself one sample later; 0 for a constant.
pub(crate) fn neighbours(values: &[f64]) -> f64 {
    if values.len() < 3 {
        return 0.0;
    }
    correlation(&values[1..], &values[..values.len() - 1]).unwrap_or(0.0)
}

/// Without its mean and over its standard deviation.
fn standardised(values: &[f64]) -> Option<Vec<f64>> {
    let centred = centred(values);
    let deviation = rms(&centred);
    // What a constant leaves by rounding is no variation.
    let size = values.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
    (deviation > 1e-13 * size).then(|| centred.iter().map(|value| value / deviation).collect())
}

/// The standard deviation of white noise on a smooth signal: of the differences between neighbours, over sqrt 2.
pub(crate) fn noise(values: &[f64]) -> f64 {
    let differences: Vec<f64> = values.windows(2).map(|pair| pair[1] - pair[0]).collect();
    rms(&differences) * core::f64::consts::FRAC_1_SQRT_2
}

/// The standard deviation of normal noise that has this median of magnitudes; of no values, 0.
pub(crate) fn robust_deviation(values: &[f64]) -> f64 {
    let mut magnitudes: Vec<f64> = values.iter().map(|value| value.abs()).collect();
    let middle = magnitudes.len() / 2;
    if magnitudes.is_empty() {
        return 0.0;
    }
    1.4826 * *magnitudes.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// How far every sample is from the median of the five around it; at the ends, of the five nearest to the end.
pub(crate) fn distances_from_neighbours(values: &[f64]) -> Vec<f64> {
    let distance = |k: usize| {
        let first = k.saturating_sub(2).min(values.len().saturating_sub(5));
        let around = &values[first..(first + 5).min(values.len())];
        let mut sorted = [0.0; 5];
        let sorted = &mut sorted[..around.len()];
        sorted.copy_from_slice(around);
        sorted.sort_unstable_by(f64::total_cmp);
        (values[k] - sorted[around.len() / 2]).abs()
    };
    (0..values.len()).map(distance).collect()
}

/// The middle value; of an even number, the higher of the two in the middle. Of no values, 0.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() { 0.0 } else { *sorted.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The value that this share of all is at most; of no values, 0.
pub(crate) fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a share of a length is one")]
    let place = (share * as_f64(sorted.len().saturating_sub(1))) as usize;
    if sorted.is_empty() { 0.0 } else { *sorted.select_nth_unstable_by(place, f64::total_cmp).1 }
}

/// The usual step of times, and how far jitter may have moved it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct UsualStep {
    pub(crate) step: f64,
    pub(crate) jitter: f64,
}

/// The usual step of times: the median of mean steps over 50 samples, or over `most` if these are fewer. Gaps do not
/// move it, jitter and rounded times hardly.
pub(crate) fn usual_step(times: &[f64], most: usize) -> UsualStep {
    const SAMPLES: usize = 50;
    /// The times at both ends of a mean may be off by so many usual distances of a step from the usual one.
    const ENDS: f64 = 3.0;
    let over = SAMPLES.min(most);
    let means: Vec<f64> = times.windows(over + 1).map(|part| (part[over] - part[0]) / as_f64(over)).collect();
    let step = median(&means);
    // A gap is one step long, not many: it counts as a step missed.
    let distances: Vec<f64> = times.windows(2).map(|pair| (pair[1] - pair[0] - step).abs().min(step)).collect();
    let spread = robust_deviation(&means.iter().map(|mean| mean - step).collect::<Vec<_>>());
    UsualStep { step, jitter: spread + ENDS * mean(&distances) / as_f64(over) }
}

/// The median of every sample and so many on either side, as far as there are such.
pub(crate) fn medians(values: &[f64], around: usize) -> Vec<f64> {
    // The values about a sample, in order; it changes by two from one sample to the next.
    let mut window: Vec<f64> = Vec::with_capacity(2 * around + 1);
    let place = |window: &[f64], value: f64| window.partition_point(|other| other.total_cmp(&value).is_lt());
    let add = |window: &mut Vec<f64>, value: f64| window.insert(place(window, value), value);
    values[..around.min(values.len())].iter().for_each(|value| add(&mut window, *value));
    let of = |k: usize| {
        if let Some(gone) = k.checked_sub(around + 1) {
            window.remove(place(&window, values[gone]));
        }
        if let Some(value) = values.get(k + around) {
            add(&mut window, *value);
        }
        window[window.len() / 2]
    };
    (0..values.len()).map(of).collect()
}

/// How far a drive goes on from its first value upwards, or downwards for a `direction` below 0.
pub(crate) fn goes_on(drive: &[f64], direction: f64) -> f64 {
    let Some(first) = drive.first() else { return 0.0 };
    drive.iter().map(|u| direction.signum() * (u - first)).fold(0.0, f64::max)
}

/// The stretches of two and more equal values.
pub(crate) fn stays(values: &[f64]) -> impl Iterator<Item = Range<usize>> {
    let mut from = 0;
    (1..=values.len()).filter_map(move |k| {
        let ends = k == values.len() || values[k] != values[k - 1];
        let stay = from..k;
        if ends {
            from = k;
        }
        (ends && stay.len() > 1).then_some(stay)
    })
}

/// Where the largest magnitude is.
pub(crate) fn largest(values: &[f64]) -> Option<usize> {
    (0..values.len()).max_by(|a, b| values[*a].abs().total_cmp(&values[*b].abs()))
}

/// The straight line of least squares through points; through their mean if `x` is constant.
pub(crate) struct Line {
    /// The means of x and y.
    center: (f64, f64),
    pub(crate) slope: f64,
}

impl Line {
    pub(crate) fn through(x: &[f64], y: &[f64]) -> Self {
        let (at, mean) = (mean(x), mean(y));
        let squares: f64 = x.iter().map(|x| (x - at) * (x - at)).sum();
        let products: f64 = x.iter().zip(y).map(|(x, y)| (x - at) * (y - mean)).sum();
        Self { center: (at, mean), slope: if squares > 0.0 { products / squares } else { 0.0 } }
    }

    pub(crate) fn at(&self, x: f64) -> f64 {
        self.center.1 + self.slope * (x - self.center.0)
    }
}

/// What least squares makes of a signal with a mean and these columns, without the mean; a column that the others make
/// up is left out.
pub(crate) fn projection(values: &[f64], columns: &[Vec<f64>]) -> Vec<f64> {
    /// What is left of a column of unit deviation if the others make it up.
    const DEPENDENT: f64 = 1e-6;
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / as_f64(a.len());
    let mut orthogonal: Vec<Vec<f64>> = Vec::new();
    let mut made = vec![0.0; values.len()];
    for column in columns.iter().filter_map(|column| standardised(column)) {
        let mut rest = column;
        for known in &orthogonal {
            let share = dot(&rest, known);
            rest.iter_mut().zip(known).for_each(|(rest, known)| *rest -= share * known);
        }
        if rms(&rest) < DEPENDENT {
            continue;
        }
        let Some(rest) = standardised(&rest) else { continue };
        let share = dot(values, &rest);
        made.iter_mut().zip(&rest).for_each(|(made, rest)| *made += share * rest);
        orthogonal.push(rest);
    }
    made
}

/// Half the height of the newest finished swing at every sample; before there is one, that of the first.
pub(crate) fn last_swings(values: &[f64], swing: f64) -> Vec<f64> {
    let turns = turns(values, swing);
    let mut swings = turns.windows(2).map(|pair| (pair[1], 0.5 * (values[pair[1]] - values[pair[0]]).abs())).peekable();
    let mut height = swings.peek().map_or(0.0, |(_, height)| *height);
    let mut heights = Vec::with_capacity(values.len());
    for k in 0..values.len() {
        while let Some((_, next)) = swings.next_if(|(turn, _)| *turn <= k) {
            height = next;
        }
        heights.push(height);
    }
    heights
}

/// Half the difference of the samples after and before, `delay` (rounded) samples ago, from sample `skip` on.
pub(crate) fn speed(input: &[f64], skip: usize, delay: f64) -> Vec<f64> {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay is not negative")]
    let delay = delay.round() as usize;
    let last = input.len() - 1;
    (skip..input.len())
        .map(|k| {
            let k = k.saturating_sub(delay);
            0.5 * (input[(k + 1).min(last)] - input[k.saturating_sub(1)])
        })
        .collect()
}

/// From how many samples to the next the signal changes: the others rest.
pub(crate) fn moves(values: &[f64]) -> usize {
    values.windows(2).filter(|pair| pair[0] != pair[1]).count()
}

/// A swing counts from this share of the range of the drive on: what turns back by less may be noise.
pub(crate) const SWING: f64 = 0.05;

/// The samples where the signal turns, counting only swings of at least so much; its ends are no turns.
pub(crate) fn turns(values: &[f64], swing: f64) -> Vec<usize> {
    let mut found = Vec::new();
    let (mut lowest, mut highest) = (0, 0);
    let mut direction = 0;
    for (k, value) in values.iter().enumerate() {
        if *value < values[lowest] {
            lowest = k;
        }
        if *value > values[highest] {
            highest = k;
        }
        if direction >= 0 && values[highest] - value >= swing {
            if direction > 0 {
                found.push(highest);
            }
            (direction, lowest) = (-1, k);
        } else if direction <= 0 && value - values[lowest] >= swing {
            if direction < 0 {
                found.push(lowest);
            }
            (direction, highest) = (1, k);
        }
    }
    found
}

/// How far `other` moves, over `range`, while `values` stays at its highest or lowest value; the most of all stays,
/// with the sample where it begins. What goes one way and does not come back is no such move: it relaxes.
pub(crate) fn travel_at_the_ends(values: &[f64], other: &[f64], range: f64) -> (f64, usize) {
    /// It comes back by so much of its way at least: loops have a width, so not by all of it.
    const BACK: f64 = 0.2;
    let ends = bounds(values);
    let travel = |stay: Range<usize>| {
        let (low, high) = bounds(&other[stay.clone()]);
        let (first, last) = (other[stay.start], other[stay.end - 1]);
        let back = (high - first.max(last)).max(first.min(last) - low);
        (if back > BACK * (high - low) { (high - low) / range } else { 0.0 }, stay.start)
    };
    let at_an_end = |stay: &Range<usize>| [ends.0, ends.1].contains(&values[stay.start]);
    let longest = stays(values).filter(at_an_end).map(travel).max_by(|p, q| p.0.total_cmp(&q.0));
    longest.unwrap_or((0.0, 0))
}

/// A count as a number; exact up to 2^53.
#[expect(clippy::cast_precision_loss, reason = "no record has 2^53 samples")]
pub(crate) fn as_f64(count: usize) -> f64 {
    count as f64
}

/// The noise of the sensor: the white part of what is left, from second differences, of the record that has least of
/// it.
///
/// What the model lacks changes slowly from sample to sample. Records below fifty samples count only if no record is
/// longer.
pub(crate) fn sensor_noise(left: &[Vec<f64>]) -> f64 {
    const FEWEST: usize = 50;
    let white = |values: &Vec<f64>| {
        let second: Vec<f64> = values.windows(3).map(|w| w[0] - 2.0 * w[1] + w[2]).collect();
        // A second difference of white noise has the variance 1 + 4 + 1.
        rms(&second) / 6.0_f64.sqrt()
    };
    let least = |fewest: usize| {
        let long = left.iter().filter(|values| values.len() >= fewest);
        long.map(white).reduce(f64::min)
    };
    least(FEWEST).or_else(|| least(3)).unwrap_or(0.0)
}

/// Numbers in -1..1 without correlation, from a linear congruential generator.
#[cfg(test)]
pub(crate) fn white(samples: usize) -> Vec<f64> {
    let states = std::iter::successors(Some(1_u64), |s| {
        Some(s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407))
    });
    let fraction = |s: u64| f64::from(u32::try_from(s >> 32).unwrap()) / f64::from(u32::MAX);
    states.skip(10).map(|s| 2.0 * fraction(s) - 1.0).take(samples).collect()
}

/// Straight ways of 100 samples from corner to corner.
#[cfg(test)]
pub(crate) fn way(corners: &[f64]) -> Vec<f64> {
    let leg = |ends: &[f64]| (0..100).map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / 100.0).collect::<Vec<_>>();
    corners.windows(2).flat_map(leg).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise is told from what the model lacks, however large that is.
    #[test]
    fn noise_is_what_neighbours_do_not_share() {
        let slow = (0..4000).map(|k| 3.0 * (f64::from(k) * 1e-3).sin());
        let left: Vec<f64> = slow.zip(white(4000)).map(|(slow, noise)| slow + 0.01 * noise).collect();
        let scale = rms(&white(4000));
        let noise = sensor_noise(&[left]);
        assert!((noise / (0.01 * scale) - 1.0).abs() < 0.1, "{noise} {scale}");
    }

    #[test]
    fn correlations_by_hand() {
        let up = [1.0, 2.0, 3.0, 4.0];
        assert!((correlation(&up, &[10.0, 30.0, 50.0, 70.0]).unwrap() - 1.0).abs() < 1e-15);
        assert!((correlation(&up, &[1e-200, 0.0, -1e-200, -2e-200]).unwrap() + 1.0).abs() < 1e-15);
        assert!(correlation(&up, &[1.0, -1.0, -1.0, 1.0]).unwrap().abs() < 1e-15);
        assert_eq!(correlation(&up, &[0.1; 4]), None);
        assert!((neighbours(&[1.0, -1.0, 1.0, -1.0, 1.0]) + 1.0).abs() < 1e-15);
    }

    #[test]
    fn turns_by_hand() {
        let walk = [0.0, 5.0, 9.0, 8.5, 10.0, 4.0, 4.4, 3.0, 7.0, 0.0];
        assert_eq!(turns(&walk, 1.0), [4, 7, 8]);
        assert_eq!(turns(&walk, 0.5), [2, 3, 4, 7, 8]);
        assert_eq!(turns(&walk, 4.5), [4]);
        let down: Vec<f64> = walk.iter().map(|x| -x).collect();
        assert_eq!(turns(&down, 1.0), [4, 7, 8]);
        assert!(turns(&[1.0, 2.0, 3.0], 0.1).is_empty());
    }

    #[test]
    fn a_stay_at_an_end_is_measured_by_what_the_other_does() {
        let clipped = [0.0, 1.0, 2.0, 2.0, 2.0, 1.0, 2.0];
        let other = [0.0, 1.0, 2.0, 3.0, 2.5, 1.0, 4.0];
        assert_eq!(travel_at_the_ends(&clipped, &other, 4.0), (0.25, 2));
        let mirrored: Vec<f64> = clipped.iter().map(|x| -x).collect();
        assert_eq!(travel_at_the_ends(&mirrored, &other, 4.0), (0.25, 2));
        let relaxes = [0.0, 1.0, 2.0, 3.0, 3.5, 1.0, 4.0];
        assert_eq!(travel_at_the_ends(&clipped, &relaxes, 4.0).0, 0.0);
    }

    #[test]
    fn stays_medians_and_quantiles_by_hand() {
        let walk = [1.0, 1.0, 2.0, 3.0, 3.0, 3.0, 1.0];
        assert_eq!(stays(&walk).collect::<Vec<_>>(), [0..2, 3..6]);
        assert!(stays(&[5.0; 3]).eq(std::iter::once(0..3)));
        assert_eq!(medians(&[0.0, 9.0, 0.0, 1.0], 1), [9.0, 0.0, 1.0, 1.0]);
        assert_eq!((quantile(&[3.0, 1.0, 2.0, 4.0], 0.5), quantile(&[], 0.5)), (2.0, 0.0));
    }

    #[test]
    fn deviations_by_hand() {
        assert_eq!((robust_deviation(&[1.0, -1.0, 1.0, -1.0, 100.0]), robust_deviation(&[])), (1.4826, 0.0));
        assert_eq!(distances_from_neighbours(&[0.0, 0.0, 7.0, 0.0, 0.0, 1.0]), [0.0, 0.0, 7.0, 0.0, 0.0, 1.0]);
        assert_eq!(rms(&[3e-200, 4e-200]), 12.5_f64.sqrt() * 1e-200);
        assert!((noise(&[1.0, -1.0, 1.0]) - 2.0_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn lines_projections_and_swings_by_hand() {
        let x = [0.0, 1.0, 2.0, 3.0];
        assert!((Line::through(&x, &[1.0, 3.0, 5.0, 7.0]).at(10.0) - 21.0).abs() < 1e-12);
        assert_eq!(Line::through(&[2.0, 2.0], &[1.0, 3.0]).at(9.0), 2.0);
        // x and x^2 make up a parabola but for its mean, whatever else repeats them.
        let columns = [x.to_vec(), x.map(|x| x * x).to_vec(), x.map(|x| 3.0 - x).to_vec(), vec![5.0; 4]];
        let parabola = x.map(|x| 2.0 + 3.0 * x - x * x);
        let mean = parabola.iter().sum::<f64>() / 4.0;
        let made = projection(&parabola, &columns);
        assert!(parabola.iter().zip(&made).all(|(y, made)| (y - mean - made).abs() < 1e-12), "{made:?}");
        assert_eq!(last_swings(&[0.0, 4.0, 2.0, 6.0, 0.0], 1.0), [1.0, 1.0, 1.0, 2.0, 2.0]);
        assert_eq!((median(&[3.0, 1.0, 2.0]), median(&[])), (2.0, 0.0));
        assert_eq!((largest(&[1.0, -3.0, 2.0]), largest(&[])), (Some(1), None));
    }

    #[test]
    fn speed_lags_with_the_output() {
        let input = [0.0, 1.0, 4.0, 9.0, 16.0];
        assert_eq!(speed(&input, 1, 0.0), [2.0, 4.0, 6.0, 3.5]);
        assert_eq!(speed(&input, 1, 1.3), [0.5, 2.0, 4.0, 6.0]);
    }
}
