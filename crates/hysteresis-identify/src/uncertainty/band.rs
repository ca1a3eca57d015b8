//! The error band of a stage, out of what held-out loops leave.
//!
//! Standard errors say how far noise moves the parameters of a model that is true. What decides the error on the next
//! record is what the model lacks. So every stretch of loops is predicted with the weights of all others, and the
//! squares of what is left go into a table by the drive of the last reversal and that of now.
//!
//! Records that are all alike hold no loop out that differs from those that stay: their table promises too much. So
//! does that of loops of any size at one speed, without rests: time and distance grow together there, and no record
//! tells them apart. So does that of loops about one middle, as of a decay. So the table gets a share of the width of
//! the loop: little where loops were recorded, more where none were, less where the fit speaks for the model, and less
//! as the records become various and the fit stays good. How large, other stages say: see
//! docs/explanation/uncertainty.md.

use hysteresis_control::stage::{Branches, CELLS, ErrorBand, Place};

use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::judge::loops::{mean_speed, tells_middles, tells_speeds};
use crate::records::record::Record;
use crate::records::signal::{as_f64, median};
use crate::result::identification::Identification;
use crate::result::quality::loop_width;

/// What a stage may lack beside what the table says, as a share of its loop width: where loops were recorded, and two
/// cells from any.
const UNTOLD: (f64, f64) = (0.025, 0.07);

/// 95 % of a normal distribution lie within so many standard deviations.
const NORMAL_95: f64 = 1.96;

/// From how many cells on nothing is told of a place.
const FAR: usize = 2;

/// The share of cells without records in various records, and in records that are all alike.
const UNSEEN: (f64, f64) = (0.5, 0.8);

/// Various records whose errors are below this share of the loop width tell that the model lacks less.
const USUAL: f64 = 0.03;

/// A fit that leaves less than this share of the loop width beside noise is no coincidence: the stage lacks less, in
/// proportion, down to this part.
const COINCIDENCE: f64 = 0.002;
const LEAST_UNTRUTH: f64 = 0.06;

/// Below this share of the noise what a fit leaves is not told from it.
const TOLD_FROM_NOISE: f64 = 0.03;

/// A model without hysteresis lacks a loop of this share of the range of positions. Below the second share a width is
/// rounding.
const USUAL_WIDTH: f64 = 0.1;
const ROUNDING: f64 = 1e-9;

/// Up to which shares of the largest rate and of the longest time a factor counts.
const SHARES: [f64; 4] = [0.01, 0.1, 0.3, 1.0];

/// No factor is larger, and none rests on fewer samples.
const MOST: f64 = 4.0;
const FEWEST: usize = 50;

impl Identification {
    /// The error band out of the records that were fitted; none for numbers that no band can have.
    pub(crate) fn band_of(&self, records: &[Record<'_>]) -> Option<ErrorBand> {
        // One loop alone, or records shorter than the dead time: what they leave themselves.
        let left = self.held_out_residuals(records).unwrap_or_else(|_| self.own_residuals(records));
        let intervals = records.iter().map(|record| self.interval_of(record));
        let samples = Samples::new(records, &left, intervals, self.drive_range);
        let width = self.width(records);
        let noise = self.sensor_noise();
        let table = Table::of(&samples, noise);
        let errors = table.errors(width, self.untruth(width), are_alike(records));
        let mut expected = samples.expected(&errors);
        let rates = samples.take_factors(&mut expected, noise, |sample| sample.rate);
        let times = samples.take_factors(&mut expected, noise, |sample| sample.seconds);
        ErrorBand::new(noise, self.drive_range, width, errors, rates, times).ok()
    }

    /// The same with a finding, where there is no other, if the model has several curves that follow any loop, the
    /// records are alike, and the band says that it is open what these curves do in other motions.
    pub(crate) fn with_wide_band_named(mut self, records: &[Record<'_>]) -> Self {
        /// Half of the samples have a wider band. A stage that missed other motions by 1.4 % of the range had 0.005.
        const LIMIT: f64 = 0.0045;
        const SEVERAL: usize = 3;
        let curves = self.curves();
        if !self.warnings.is_empty() || curves < SEVERAL || !are_alike(records) {
            return self;
        }
        let Some(band) = &self.error_band else { return self };
        let of_record =
            |record: &Record<'_>| band.deviations(record.input(), &[], self.interval_of(record)).unwrap_or_default();
        let deviations: Vec<f64> = records.iter().flat_map(of_record).collect();
        let value = NORMAL_95 * median(&deviations) / self.fit.range;
        if value > LIMIT {
            let message = format!(
                "{curves} curves together (maps, relaxing plays, a Duhem operator) follow any loop, and the records leave \
                 open what other motions do: the error band of 95 % is {:.1} % of the range to either side",
                100.0 * value
            );
            self.warnings.push(Finding::new(FindingCode::WideErrorBand, value, LIMIT, message));
        }
        self
    }

    /// How many parts it has that bend freely.
    fn curves(&self) -> usize {
        let maps = usize::from(self.input_map().is_some()) + usize::from(self.output_map().is_some());
        maps + usize::from(self.relaxing_plays.is_some()) + usize::from(self.duhem().is_some())
    }

    /// The width of the model's loop over the whole range, at the mean speed of the records: few of them have such a
    /// loop.
    fn width(&self, records: &[Record<'_>]) -> f64 {
        const STROKE: u16 = 1000;
        let (low, high) = self.drive_range;
        let of_loop = |speed: f64| {
            let to = |k: u16| low + (high - low) * f64::from(k) / f64::from(STROKE);
            let drive: Vec<f64> =
                (0..STROKE).map(to).chain((1..=STROKE).rev().map(to)).chain((0..=STROKE).map(to)).collect();
            let output = self.chain.response(&drive, (high - low) / (speed * f64::from(STROKE)));
            // The first stroke is the way from rest.
            let first = usize::from(STROKE);
            loop_width(&drive[first..], &output[first..]).ok().flatten()
        };
        let width = mean_speed(records, self.chain.dt).and_then(of_loop);
        width.filter(|width| *width > ROUNDING * self.fit.range).unwrap_or(USUAL_WIDTH * self.fit.range)
    }

    /// How far what stages of other physics lack is to be expected of this one, from little to 1: a fit that leaves
    /// nothing but noise is true, while two curves and more follow any loop that they are fitted to.
    fn untruth(&self, width: f64) -> f64 {
        if self.curves() > 1 {
            return 1.0;
        }
        let noise = self.sensor_noise();
        let left = (self.fit.rmse.powi(2) - noise.powi(2)).max(0.0).sqrt().hypot(TOLD_FROM_NOISE * noise);
        (left / (COINCIDENCE * width)).clamp(LEAST_UNTRUTH, 1.0)
    }

    /// What the fit itself leaves; NaN where nothing is fitted.
    fn own_residuals(&self, records: &[Record<'_>]) -> Vec<Vec<f64>> {
        let of_record = |(place, record): (usize, &Record<'_>)| {
            let mut left = vec![f64::NAN; record.input().len()];
            let all = self.residuals(record, Some(place));
            record.fitted().for_each(|k| left[k] = all[k]);
            left
        };
        records.iter().enumerate().map(of_record).collect()
    }
}

/// Whether loops have one speed or one middle.
fn are_alike(records: &[Record<'_>]) -> bool {
    !(tells_speeds(records) && tells_middles(records))
}

/// A held-out sample.
struct Sample {
    place: Place,
    rate: f64,
    seconds: f64,
    square: f64,
    /// The time that it stands for.
    weight: f64,
}

struct Samples(Vec<Sample>);

impl Samples {
    fn new(records: &[Record<'_>], left: &[Vec<f64>], intervals: impl Iterator<Item = f64>, range: (f64, f64)) -> Self {
        let mut samples = Vec::new();
        for ((record, left), dt) in records.iter().zip(left).zip(intervals) {
            let mut branches = Branches::new(record.input()[0], range);
            for (drive, left) in record.input().iter().zip(left) {
                let place = branches.step(*drive);
                let (rate, seconds) = (place.rate(dt), place.samples * dt);
                if left.is_finite() {
                    samples.push(Sample { place, rate, seconds, square: left * left, weight: dt });
                }
            }
        }
        Self(samples)
    }

    /// What a table expects the square of every sample to be, without noise.
    fn expected(&self, errors: &[Vec<f64>]) -> Vec<f64> {
        self.0.iter().map(|Sample { place, .. }| errors[place.row()][place.column()].powi(2)).collect()
    }

    /// By which factors squares exceed what is expected, both without noise, up to shares of the largest value of `of`;
    /// what is expected has them from here on, so that nothing counts twice. None is below 1: a few quiet samples
    /// promise nothing.
    fn take_factors(&self, expected: &mut [f64], noise: f64, of: impl Fn(&Sample) -> f64) -> Vec<(f64, f64)> {
        let largest = self.0.iter().map(&of).fold(f64::MIN_POSITIVE, f64::max);
        let mut from = f64::NEG_INFINITY;
        let factor = |share: f64| {
            let to = share * largest;
            let is_within = |k: &usize| from < of(&self.0[*k]) && of(&self.0[*k]) <= to;
            let within: Vec<usize> = (0..self.0.len()).filter(is_within).collect();
            let known: f64 = within.iter().map(|k| self.0[*k].weight * expected[*k]).sum();
            let found: f64 = within.iter().map(|k| self.0[*k].weight * (self.0[*k].square - noise * noise)).sum();
            let factor = if within.len() >= FEWEST && known > 0.0 { (found / known).clamp(1.0, MOST) } else { 1.0 };
            for k in within {
                expected[k] *= factor;
            }
            from = to;
            (to, factor)
        };
        SHARES.map(factor).to_vec()
    }
}

/// The squares by cell, and the time that they stand for.
struct Table {
    sums: Vec<Vec<(f64, f64)>>,
    noise: f64,
}

impl Table {
    fn of(samples: &Samples, noise: f64) -> Self {
        let mut sums = vec![vec![(0.0, 0.0); CELLS]; CELLS];
        for Sample { place, square, weight, .. } in &samples.0 {
            let (sum, time) = &mut sums[place.row()][place.column()];
            *sum += weight * square;
            *time += weight;
        }
        Self { sums, noise }
    }

    /// The mean square error of the model in a cell, without noise; none where nothing was recorded.
    fn square(&self, row: usize, column: usize) -> Option<f64> {
        let (sum, time) = self.sums[row][column];
        (time > 0.0).then(|| (sum / time - self.noise * self.noise).max(0.0))
    }

    fn all(&self) -> impl Iterator<Item = (usize, usize, f64)> + Clone {
        let cells = (0..CELLS).flat_map(|row| (0..CELLS).map(move |column| (row, column)));
        cells.filter_map(|(row, column)| Some((row, column, self.square(row, column)?)))
    }

    /// The whole table, rms: of every cell the mean square around it, and what stages of this loop width lack besides.
    fn errors(&self, width: f64, untruth: f64, are_alike: bool) -> Vec<Vec<f64>> {
        let seen = self.all().count();
        if seen == 0 {
            return vec![vec![UNTOLD.1 * untruth * width; CELLS]; CELLS];
        }
        let unseen = 1.0 - as_f64(seen) / as_f64(CELLS * CELLS);
        let unlike_cells = ((unseen - UNSEEN.0) / (UNSEEN.1 - UNSEEN.0)).clamp(0.0, 1.0);
        let alike = if are_alike { 1.0 } else { unlike_cells };
        let error = (self.all().map(|(.., square)| square).sum::<f64>() / as_f64(seen)).sqrt();
        let open = alike * untruth + (1.0 - alike) * (error / (USUAL * width)).min(1.0);
        let of_cell = |row: usize, column: usize| {
            let distance = |r: usize, c: usize| r.abs_diff(row).max(c.abs_diff(column));
            let nearest = self.all().map(|(r, c, _)| distance(r, c)).min().unwrap_or(FAR);
            let around = self.all().filter(|(r, c, _)| distance(*r, *c) <= nearest.max(1));
            let (sum, count) = around.fold((0.0, 0), |(sum, count), (.., square)| (sum + square, count + 1));
            let far = (as_f64(nearest) / as_f64(FAR)).min(1.0);
            let untold = open * (UNTOLD.0 + (UNTOLD.1 - UNTOLD.0) * far);
            (sum / as_f64(count)).sqrt().hypot(width * untold)
        };
        (0..CELLS).map(|row| (0..CELLS).map(|column| of_cell(row, column)).collect()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::records::signal::{way, white};

    fn samples(of: impl Fn(f64, f64) -> f64, drive: &[f64], range: (f64, f64)) -> Samples {
        let mut branches = Branches::new(drive[0], range);
        let left = drive.iter().map(|u| {
            let place = branches.step(*u);
            of(place.reversal, *u)
        });
        let left = vec![left.collect::<Vec<_>>()];
        let record = Record::new(drive, drive, 0).unwrap();
        Samples::new(&[record], &left, [0.01].into_iter(), range)
    }

    /// Where nothing was recorded the band is that of other stages, not that of the fit.
    #[test]
    fn loops_that_are_all_alike_promise_nothing_of_others() {
        let drive = way(&[0.0, 12.0, 0.0, 12.0, 0.0, 12.0, 0.0]);
        let errors = Table::of(&samples(|_, _| 1e-3, &drive, (0.0, 12.0)), 0.0).errors(1.0, 1.0, false);
        assert!((errors[6][6] - 1e-3_f64.hypot(UNTOLD.1)).abs() < 1e-9, "{}", errors[6][6]);
        assert!((errors[0][6] - 1e-3_f64.hypot(UNTOLD.0)).abs() < 1e-9, "{}", errors[0][6]);
    }

    /// Loops of one speed are alike, and a fit that speaks for its model makes little of both.
    #[test]
    fn one_speed_promises_nothing_unless_the_fit_speaks_for_the_model() {
        let drive = way(&white(400).into_iter().map(|share| 6.0 + 6.0 * share).collect::<Vec<_>>());
        let table = Table::of(&samples(|_, _| 1e-5, &drive, (0.0, 12.0)), 0.0);
        let [various, one_speed, true_one] =
            [(1.0, false), (1.0, true), (0.1, true)].map(|(untruth, one)| table.errors(1.0, untruth, one)[6][6]);
        assert!(various < 1e-3 && one_speed >= UNTOLD.0, "{various} {one_speed}");
        assert!((true_one / one_speed - 0.1).abs() < 1e-3, "{true_one} {one_speed}");
    }

    /// Various records with a good fit tell that the model lacks little anywhere, and where it lacks more.
    #[test]
    fn the_table_follows_the_held_out_errors_of_various_loops() {
        let peaks: Vec<f64> = white(400).into_iter().map(|share| 6.0 + 6.0 * share).collect();
        let drive = way(&peaks);
        let of = |reversal: f64, _| if reversal > 9.0 { 1e-2 } else { 1e-4 };
        let errors = Table::of(&samples(of, &drive, (0.0, 12.0)), 0.0).errors(1.0, 1.0, false);
        assert!(errors[11][3] > 1e-2, "{}", errors[11][3]);
        assert!(errors[2][8] < 5e-3, "{}", errors[2][8]);
    }

    /// One cell that a few samples behind a reversal spoil is not that of all around it.
    #[test]
    fn a_cell_has_the_mean_square_around_it() {
        let mut sums = vec![vec![(0.0, 0.0); CELLS]; CELLS];
        (4..7).for_each(|row| (4..7).for_each(|column| sums[row][column] = (0.0, 1.0)));
        sums[5][5] = (1e-4, 1.0);
        let errors = Table { sums, noise: 0.0 }.errors(1.0, 0.0, true);
        assert!((errors[5][5] - 1e-2 / 3.0).abs() < 1e-9, "{}", errors[5][5]);
        assert!((errors[4][4] - 1e-2 / 2.0).abs() < 1e-9, "{}", errors[4][4]);
    }

    /// Short ways are fast ones, but for some samples behind a turn. What noise adds to both sides makes no factor
    /// smaller.
    #[test]
    fn what_the_rate_explains_is_not_counted_for_the_time_again() {
        let way = |k: u32| if k < 500 { f64::from(k) / 500.0 } else { f64::from(600 - k) / 100.0 };
        let drive: Vec<f64> = (0..6000).map(|k| 12.0 * way(k % 600)).collect();
        let noise = 5e-3_f64;
        let left: Vec<f64> = (0..6000).map(|k| if k % 600 < 500 { 1e-2 } else { 1.5e-2 }).collect();
        let record = Record::new(&drive, &drive, 0).unwrap();
        let samples = Samples::new(&[record], &[left], [0.01].into_iter(), (0.0, 12.0));
        let mut expected = vec![1e-4 - noise * noise; samples.0.len()];
        let rates = samples.take_factors(&mut expected, noise, |sample| sample.rate);
        let times = samples.take_factors(&mut expected, noise, |sample| sample.seconds);
        let largest = |factors: &[(f64, f64)]| factors.iter().map(|(_, factor)| *factor).fold(0.0, f64::max);
        let right = (2.25 - 0.25) / (1.0 - 0.25);
        assert!((largest(&rates) / right - 1.0).abs() < 0.08 && largest(&times) < 1.1, "{rates:?} {times:?}");
    }
}
