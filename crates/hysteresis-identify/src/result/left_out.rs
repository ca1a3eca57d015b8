//! Leave-one-loop-out: how well the weights that the other loops ask for predict a loop.

use std::ops::Range;

use faer::Mat;

use crate::algebra::bounded;
use crate::algebra::factor::{TriangularFactor, make_echelon, triangle_of};
use crate::error::Error;
use crate::fit::own_columns::{OwnColumns, below_own, own_values};
use crate::fit::tangent::Tangent;
use crate::records::record::{Record, leaving_out};
use crate::records::signal::{SWING, as_f64, bounds, bounds_of, moves, turns};
use crate::result::identification::Identification;
use crate::result::quality::Quality;
use crate::terms::weights::{WeightBasis, penalised};

/// With more loops than this, neighbours are left out together.
const MOST: usize = 200;

/// Into about how many stretches of loops records are cut for their error band.
const STRETCHES: f64 = 20.0;

/// One loop, predicted with and without its own share in the weights.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct LeftOutLoop {
    /// Its record.
    pub record: usize,
    /// Its samples in that record.
    pub samples: Range<usize>,
    /// Half the peak-to-peak of the input in it, in the unit of the input.
    pub amplitude: f64,
    /// The errors with the weights that all loops ask for. Percentages are of the range of the whole record.
    pub fitted: Quality,
    /// The errors with the weights that all other loops ask for.
    pub left_out: Quality,
}

/// The best weights, and what the records have of their own: nothing where no sample tells it.
struct LeftOutSolution {
    unknowns: Vec<f64>,
    weights: Vec<f64>,
    own: Vec<Option<f64>>,
}

impl LeftOutSolution {
    /// The output but for its offset, at these columns of the records' own and of the weights.
    fn output(&self, own: &[f64], columns: &[f64], records: usize) -> f64 {
        let underway = own[records..].iter().zip(&self.own[records..]);
        let weighed: f64 = columns.iter().zip(&self.weights).map(|(z, w)| z * w).sum();
        weighed + underway.map(|(column, amplitude)| column * amplitude.unwrap_or(0.0)).sum::<f64>()
    }
}

impl Identification {
    /// Fits the weights and output offsets anew without each loop, at the thresholds, input offset, maps, dead time,
    /// dynamics and creep found, and predicts the loop that was left out: a model that only remembers its records does
    /// worse there. An output map is linearised at the weights found.
    ///
    /// A loop leads from one maximum of the input to the next. Maxima are those from which the input comes down, and to
    /// which it went up, by a twentieth of its range at least. What comes before the first maximum of a record belongs
    /// to its first loop, what comes after the last to its last. Of more than 200 loops, neighbours are left out
    /// together. A record of one loop has, while that is left out, the output offset that suits it best.
    ///
    /// `records` are those that were fitted, and what was left out of them counts for no loop; others, of another
    /// number or other lengths, are judged likewise. One pass with a QR, and a small problem for every loop.
    ///
    /// # Errors
    /// [`Error::TooFewLoops`] for fewer than two, [`Error::Core`] if the dead time is not below the length of every
    /// record.
    pub fn leave_one_loop_out(&self, records: &[Record<'_>]) -> Result<Vec<LeftOutLoop>, Error> {
        let records = &self.as_fitted(records)[..];
        let loops = loops(records, MOST);
        self.left_out(records, &loops, |pass, solutions| Ok(pass.judge(solutions)))
    }

    /// What every stretch of loops leaves with the weights that all other stretches ask for, for every sample of every
    /// record; NaN where nothing is fitted.
    ///
    /// Stretches are long, so that what is held out differs from what stays.
    pub(crate) fn held_out_residuals(&self, records: &[Record<'_>]) -> Result<Vec<Vec<f64>>, Error> {
        self.left_out(records, &self.stretches(records), |pass, solutions| Ok(pass.held_out(solutions)))
    }

    /// The loops, those whose middles lie in the same of [`STRETCHES`] parts of the time together. By number, the many
    /// small loops of a chirp would leave all the large ones in one stretch, and the others tell nothing of that.
    fn stretches(&self, records: &[Record<'_>]) -> Vec<(usize, Range<usize>)> {
        let loops = loops(records, usize::MAX);
        // A long rest is no reason to put all that moves into one stretch.
        let moving = |(place, samples): &(usize, Range<usize>)| {
            let (record, before) = (&records[*place], samples.start.saturating_sub(1));
            as_f64(moves(&record.input()[before..samples.end])) * self.interval_of(record)
        };
        together(loops.iter().map(moving).zip(&loops))
    }

    /// Fits the weights without every loop, and takes what that makes of the loops.
    fn left_out<T>(
        &self,
        records: &[Record<'_>],
        loops: &[(usize, Range<usize>)],
        take: impl FnOnce(&Pass<'_>, &[LeftOutSolution]) -> Result<T, Error>,
    ) -> Result<T, Error> {
        let length = |record: &Record<'_>| as_f64(record.input().len()) * self.interval_of(record);
        let shortest = records.iter().map(length).reduce(f64::min).ok_or(Error::NoRecords)?;
        let dead_time = self.chain.linear.dead_time;
        if dead_time >= shortest {
            let expected = "records that are longer than the dead time";
            return Err(Error::domain("dead_time", None, expected, dead_time));
        }
        if loops.len() < 2 {
            return Err(Error::TooFewLoops { got: loops.len() });
        }
        let basis = self.options.weight_basis(self.chain.operators.sides());
        let tangent = Tangent {
            operators: self.chain.operators.clone(),
            linear: self.chain.linear.clone(),
            columns: basis.columns(),
            weights: self.chain.weights.clone(),
            slopes: Vec::new(),
        };
        let intervals: Vec<f64> = records.iter().map(|record| self.interval_of(record)).collect();
        let own = OwnColumns::new(records, |place| intervals[place], &self.chain.creep_underway);
        let pass = Pass { records, loops, tangent, intervals, own: &own };
        let problem = LeaveOneOut { own: &own, basis: &basis, penalty: &self.penalty, noise: self.noise };
        let solutions = problem.solutions(&pass.triangles(&basis), |loop_| loops[loop_].0);
        take(&pass, &solutions)
    }

    /// Records as long as those that were fitted without what was left out of these; other records as they are.
    fn as_fitted<'a>(&'a self, records: &[Record<'a>]) -> Vec<Record<'a>> {
        let fitted = self.left_out_samples.iter().zip(&self.record_fits);
        let is_fitted = |(record, (left_out, fit)): (&Record<'_>, (&Vec<usize>, &Quality))| {
            record.left_out().is_empty() && record.fitted_samples() == fit.samples + left_out.len()
        };
        if records.len() != fitted.len() || !records.iter().zip(fitted).all(is_fitted) {
            return records.to_vec();
        }
        leaving_out(records, &self.left_out_samples).unwrap_or_else(|_| records.to_vec())
    }
}

/// Loops of these durations, those of a record whose middles lie in the same of a few parts of the whole time as one.
/// Of two loops and more there are two and more: the first and the last middle are half of the time apart.
fn together<'a>(loops: impl Iterator<Item = (f64, &'a (usize, Range<usize>))> + Clone) -> Vec<(usize, Range<usize>)> {
    let whole: f64 = loops.clone().map(|(duration, _)| duration).sum();
    let (mut found, mut last_part, mut begin) = (Vec::<(usize, Range<usize>)>::new(), f64::NAN, 0.0);
    for (duration, (place, samples)) in loops {
        let part = (STRETCHES * (begin + 0.5 * duration) / whole).floor();
        begin += duration;
        match found.last_mut() {
            Some((record, last)) if record == place && part == last_part => last.end = samples.end,
            _ => found.push((*place, samples.clone())),
        }
        last_part = part;
    }
    found
}

/// Every loop of every record: the record and the samples.
fn loops(records: &[Record<'_>], most: usize) -> Vec<(usize, Range<usize>)> {
    let fitted = || records.iter().map(|record| &record.input()[record.skip()..]);
    let (low, high) = bounds_of(fitted().map(bounds));
    let swing = SWING * (high - low);
    let maxima = |input: &[f64]| {
        let turns = turns(input, swing);
        // Turns alternate: the first is a maximum if what it comes to is higher than where it came from.
        let first = usize::from(turns.first().is_some_and(|turn| input[*turn] < input[0]));
        turns.into_iter().skip(first).step_by(2).collect::<Vec<_>>()
    };
    let maxima: Vec<Vec<usize>> = fitted().map(maxima).collect();
    let count: usize = maxima.iter().map(|maxima| maxima.len().saturating_sub(1).max(1)).sum();
    let together = count.div_ceil(most);
    let mut loops = Vec::with_capacity(count);
    for (place, (record, maxima)) in records.iter().zip(maxima).enumerate() {
        let inner = maxima.get(1..maxima.len().saturating_sub(1)).unwrap_or(&[]);
        let mut begin = record.skip();
        for cut in inner.iter().skip(together - 1).step_by(together) {
            loops.push((place, begin..record.skip() + cut));
            begin = record.skip() + cut;
        }
        loops.push((place, begin..record.input().len()));
    }
    loops.retain(|(place, samples)| records[*place].fitted().any(|k| samples.contains(&k)));
    loops
}

/// The way through the records, loop by loop.
struct Pass<'a> {
    records: &'a [Record<'a>],
    loops: &'a [(usize, Range<usize>)],
    tangent: Tangent,
    intervals: Vec<f64>,
    own: &'a OwnColumns,
}

impl Pass<'_> {
    /// The samples of a loop that are fitted.
    fn fitted(&self, place: usize, samples: &Range<usize>) -> impl Iterator<Item = usize> {
        let left_out = self.records[place].left_out();
        samples.clone().filter(|k| left_out.binary_search(k).is_err())
    }

    /// Goes to the fitted samples of every loop, in order; `take` gets the loop, the sample, what of the output is
    /// known there beside the columns (that of an output map, linearised at the fit) and the columns.
    fn walk(&self, mut take: impl FnMut(usize, usize, f64, &[f64])) {
        let start = |place: usize| self.tangent.rows(self.records[place].input(), self.intervals[place], None);
        let (mut last, mut rows) = (0, start(0));
        let mut row = vec![0.0; self.tangent.columns];
        for (number, (place, samples)) in self.loops.iter().enumerate() {
            if last != *place {
                (last, rows) = (*place, start(*place));
            }
            for k in self.fitted(*place, samples) {
                let known = rows.write(k, &mut row);
                take(number, k, known, &row);
            }
        }
    }

    /// R of [output offsets | unknowns | y] of every loop.
    fn triangles(&self, basis: &WeightBasis) -> Vec<Mat<f64>> {
        let (own, n) = (self.own.len(), basis.columns());
        let columns = own + n + 1;
        let mut row = vec![0.0; columns];
        let mut factor = TriangularFactor::new(columns);
        let mut triangles = Vec::with_capacity(self.loops.len());
        let in_unknowns = |factor: TriangularFactor| basis.in_unknowns(factor.finish().as_ref(), own);
        self.walk(|number, k, known, columns_here| {
            let place = self.loops[number].0;
            if triangles.len() < number {
                triangles.push(in_unknowns(std::mem::replace(&mut factor, TriangularFactor::new(columns))));
            }
            self.own.write(place, k, &mut row[..own]);
            row[own..own + n].copy_from_slice(columns_here);
            row[columns - 1] = self.records[place].output()[k] - known;
            factor.push(&row);
        });
        triangles.push(in_unknowns(factor));
        triangles
    }

    /// What every loop leaves with the weights of the others, and the offset of its record where others tell it.
    fn held_out(&self, solutions: &[LeftOutSolution]) -> Vec<Vec<f64>> {
        let (records, mut own) = (self.records.len(), vec![0.0; self.own.len()]);
        let mut left: Vec<_> = self.records.iter().map(|record| vec![f64::NAN; record.input().len()]).collect();
        self.walk(|number, k, known, columns| {
            let place = self.loops[number].0;
            self.own.write(place, k, &mut own);
            let solution = &solutions[number + 1];
            let predicted = known + solution.output(&own, columns, records) + solution.own[place].unwrap_or(0.0);
            left[place][k] = self.records[place].output()[k] - predicted;
        });
        for (number, (place, samples)) in self.loops.iter().enumerate() {
            if solutions[number + 1].own[*place].is_none() {
                let fitted: Vec<usize> = self.fitted(*place, samples).collect();
                let mean = fitted.iter().map(|k| left[*place][*k]).sum::<f64>() / as_f64(fitted.len());
                for k in fitted {
                    left[*place][k] -= mean;
                }
            }
        }
        left
    }

    /// The errors of every loop, with the weights of all loops, which come first, and those of the others.
    fn judge(&self, solutions: &[LeftOutSolution]) -> Vec<LeftOutLoop> {
        let all = &solutions[0];
        let mut outputs: Vec<[Vec<f64>; 2]> = self.loops.iter().map(|_| [Vec::new(), Vec::new()]).collect();
        let (records, mut own) = (self.records.len(), vec![0.0; self.own.len()]);
        self.walk(|number, k, known, columns| {
            let [fitted, left_out] = &mut outputs[number];
            self.own.write(self.loops[number].0, k, &mut own);
            fitted.push(known + all.output(&own, columns, records));
            left_out.push(known + solutions[number + 1].output(&own, columns, records));
        });
        let judged = outputs.into_iter().enumerate().map(|(number, outputs)| {
            let (place, samples) = self.loops[number].clone();
            let record = &self.records[place];
            let (low, high) = bounds(&record.input()[samples.clone()]);
            let measured: Vec<f64> = self.fitted(place, &samples).map(|k| record.output()[k]).collect();
            let quality = |mut predicted: Vec<f64>, offset: Option<f64>| {
                let offset = offset.unwrap_or_else(|| {
                    let share = 1.0 / as_f64(measured.len());
                    measured.iter().zip(&predicted).map(|(y, p)| (y - p) * share).sum()
                });
                for p in &mut predicted {
                    *p += offset;
                }
                Quality::of(&measured, &predicted, record.output_range())
            };
            let [fitted, left_out] = outputs;
            LeftOutLoop {
                record: place,
                samples,
                amplitude: 0.5 * (high - low),
                fitted: quality(fitted, all.own[place]),
                left_out: quality(left_out, solutions[number + 1].own[place]),
            }
        });
        judged.collect()
    }
}

/// What is solved for any loops: the columns that the records have of their own, the law, the rows that ask for smooth
/// weights, and the noise of a sample.
struct LeaveOneOut<'a> {
    own: &'a OwnColumns,
    basis: &'a WeightBasis,
    penalty: &'a Mat<f64>,
    noise: f64,
}

/// Below this share of the data noise is rounding.
const ROUNDING: f64 = 1e-12;

impl LeaveOneOut<'_> {
    /// The solution of all loops, then those without each of them.
    ///
    /// The triangles of several loops, one below the other, are those of all their samples. So with the triangles of
    /// all loops before and of all loops after each, a loop is left out without taking anything away.
    fn solutions(&self, triangles: &[Mat<f64>], record: impl Fn(usize) -> usize) -> Vec<LeftOutSolution> {
        let count = triangles.len();
        let mut after = vec![Mat::zeros(0, triangles[0].ncols())];
        for triangle in triangles.iter().rev() {
            after.push(joined(triangle, &after[after.len() - 1]));
        }
        let least = self.least_norms(&after[count]);
        let all = self.solve(&after[count], None, &[], &vec![0.0; least.len()]);
        let mut before = Mat::zeros(0, triangles[0].ncols());
        let mut found = vec![all];
        for (number, triangle) in triangles.iter().enumerate() {
            let others = joined(&before, &after[count - 1 - number]);
            let place = record(number);
            let alone = (0..count).all(|other| other == number || record(other) != place);
            let guess = found[0].unknowns.clone();
            found.push(self.solve(&others, alone.then_some(place), &guess, &least));
            before = joined(&before, triangle);
        }
        found
    }

    /// The least norms of the columns of the unknowns that tell them: with less, noise alone would make them larger
    /// than the data of all loops, as of a play that moves in the largest loop only.
    fn least_norms(&self, all: &Mat<f64>) -> Vec<f64> {
        let (a, b) = below_own(all, self.own.len());
        let size = b.iter().map(|b| b * b).sum::<f64>().sqrt();
        let share = (self.noise / size).max(ROUNDING);
        a.col_iter().map(|column| share * column.norm_l2()).collect()
    }

    /// The best weights and offsets, without what a record has of its own that has no samples among these; zero for the
    /// unknowns whose columns have less than their least norm.
    fn solve(&self, factor: &Mat<f64>, without: Option<usize>, like: &[f64], least: &[f64]) -> LeftOutSolution {
        let Self { own, basis, penalty, .. } = *self;
        let dropped: Vec<usize> = without.map_or_else(Vec::new, |place| own.of_record(place).collect());
        let kept: Vec<usize> = (0..factor.ncols()).filter(|j| !dropped.contains(j)).collect();
        let mut factor = match without {
            None => factor.to_owned(),
            Some(_) => triangle_of(Mat::from_fn(factor.nrows(), kept.len(), |i, j| factor[(i, kept[j])])),
        };
        let told = own.len() - dropped.len();
        make_echelon(&mut factor, told);
        let (a, b) = below_own(&factor, told);
        let (a, b) = penalised(&a, &b, penalty);
        // Smooth weights go on where loops end.
        let is_told: Vec<bool> = a.col_iter().zip(least).map(|(column, least)| column.norm_l2() >= *least).collect();
        let of_told = |(bounds, is_told): ((f64, f64), &bool)| if *is_told { bounds } else { (0.0, 0.0) };
        let bounds: Vec<_> = basis.bounds().into_iter().zip(&is_told).map(of_told).collect();
        let guess: Vec<usize> = (0..like.len()).filter(|j| like[*j] != 0.0 && is_told[*j]).collect();
        let unknowns = bounded::solve(a.as_ref(), &b, &bounds, &guess).x;
        let mut values = own_values(&factor, told, &unknowns).into_iter();
        let own = (0..own.len()).map(|j| (!dropped.contains(&j)).then(|| values.next()).flatten()).collect();
        LeftOutSolution { weights: basis.weights(&unknowns), unknowns, own }
    }
}

/// The triangle of the rows of both.
fn joined(above: &Mat<f64>, below: &Mat<f64>) -> Mat<f64> {
    let (top, columns) = (above.nrows(), below.ncols());
    let rows = (top + below.nrows()).max(columns);
    let factor = triangle_of(Mat::from_fn(rows, columns, |i, j| match i.checked_sub(top) {
        None => above[(i, j)],
        Some(i) if i < below.nrows() => below[(i, j)],
        Some(_) => 0.0,
    }));
    factor.get(..columns, ..).to_owned()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stretches(durations: &[f64]) -> Vec<Range<usize>> {
        let loops: Vec<_> = (0..durations.len()).map(|k| (0, k..k + 1)).collect();
        together(durations.iter().copied().zip(&loops)).into_iter().map(|(_, samples)| samples).collect()
    }

    /// Equal loops give equal stretches, whatever rounding makes of their durations.
    #[test]
    fn equal_loops_are_shared_out_equally() {
        for duration in [0.053, 0.1, 1.0 / 3.0] {
            assert_eq!(stretches(&[duration; 20]).len(), 20);
            assert!(stretches(&[duration; 80]).iter().all(|stretch| stretch.len() == 4));
        }
    }

    #[test]
    fn small_loops_lie_together_and_large_ones_alone() {
        let durations = [[1.0; 5].as_slice(), &[0.01; 500]].concat();
        let found = stretches(&durations);
        assert_eq!(found[..5], [0..1, 1..2, 2..3, 3..4, 4..5]);
        assert_eq!(found.len(), 15);
    }

    /// There always is something to predict from.
    #[test]
    fn one_long_loop_is_not_joined_by_the_others() {
        assert_eq!(stretches(&[[1.0; 10].as_slice(), &[190.0]].concat()), [0..10, 10..11]);
        assert_eq!(stretches(&[99.0, 1.0]), [0..1, 1..2]);
    }

    #[test]
    fn records_are_not_joined() {
        let loops = [(0, 0..5), (1, 0..5), (1, 5..10)];
        assert_eq!(together([1.0, 0.01, 0.01].into_iter().zip(&loops)), [(0, 0..5), (1, 0..10)]);
    }
}
