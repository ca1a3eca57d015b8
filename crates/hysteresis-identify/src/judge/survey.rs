//! One pass over the records with all operators of a model: which of them never move or are not told apart, and whether
//! a slow change of the position lies beside them, or a leak.
//!
//! The operators take up a slow change in part: in loops that only decay, the one correlates with the other.

use std::ops::Range;

use faer::Mat;

use crate::algebra::factor::{DEPENDS, Echelon, TriangularFactor};
use crate::fit::response::{Chain, OperatorsAt};
use crate::fit::tangent::Tangent;
use crate::judge::finding::Finding;
use crate::judge::finding_code::FindingCode;
use crate::records::record::{Record, largest_range};
use crate::records::signal;
use crate::records::signal::as_f64;

/// What the pass leaves behind.
pub(crate) struct Survey {
    /// Measured minus modelled output of the fitted samples of every record, without its mean.
    pub(crate) residuals: Vec<Vec<f64>>,
    /// Smallest and largest output of every operator over all fitted samples.
    operator_bounds: Vec<(f64, f64)>,
    /// The threshold r of every operator.
    thresholds: Vec<f64>,
    /// R of [means | operators | slow columns | residual | integral of the position], in echelon form.
    factor: Mat<f64>,
    /// How far that integral goes in any record, over the range of the position.
    integral_range: f64,
    /// In what time is said, and how long that is: seconds, or samples where no record knows how long these are.
    time: (&'static str, f64),
    /// The norm of the outputs, each record's mean removed.
    output_norm: f64,
}

impl Survey {
    pub(crate) fn of(records: &[Record<'_>], chain: &Chain) -> Self {
        let thresholds = chain.operators.bank.thresholds().to_vec();
        // The operators alone, whether their weights are split or not.
        let tangent = Tangent {
            operators: OperatorsAt { side: None, gain: None, output_map: None, ..chain.operators.clone() },
            linear: chain.linear.clone(),
            columns: thresholds.len(),
            weights: Vec::new(),
            slopes: Vec::new(),
        };
        let (means, n) = (records.len(), thresholds.len());
        let residual_at = means + n + COLUMNS;
        let mut factor = TriangularFactor::new(residual_at + 2);
        let mut row = vec![0.0; residual_at + 2];
        let mut integral_range = 0.0_f64;
        let mut operator_bounds = vec![(f64::INFINITY, f64::NEG_INFINITY); n];
        let (mut residuals, mut squares) = (Vec::new(), 0.0);
        for (place, record) in records.iter().enumerate() {
            let dt = record.dt().unwrap_or(chain.dt);
            let predicted = chain.response_in(place, record.input(), dt);
            let mut rows = tangent.rows(record.input(), dt, None);
            row[..means].fill(0.0);
            row[place] = 1.0;
            let mut slow = Slow::of(record);
            let mut residual = Vec::with_capacity(record.fitted_samples());
            let integral = integral(&record.output()[record.skip()..], dt);
            let (low, high) = signal::bounds(&integral);
            integral_range = integral_range.max((high - low) / record.output_range());
            for (k, measured) in record.output().iter().enumerate().skip(record.skip()) {
                rows.write(k, &mut row[means..means + n]);
                slow.write(&mut row[means + n..residual_at]);
                row[residual_at] = measured - predicted[k];
                row[residual_at + 1] = integral[k - record.skip()];
                factor.push(&row);
                for ((low, high), z) in operator_bounds.iter_mut().zip(&row[means..]) {
                    (*low, *high) = (low.min(*z), high.max(*z));
                }
                residual.push(measured - predicted[k]);
            }
            residuals.push(signal::centred(&residual));
            let output = signal::centred(&record.output()[record.skip()..]);
            squares += as_f64(output.len()) * signal::rms(&output).powi(2);
        }
        let factor = factor.finish();
        let in_seconds = records.iter().all(|record| record.dt().is_some());
        let time = if in_seconds { ("s", 1.0) } else { ("samples", chain.dt) };
        Self { residuals, operator_bounds, thresholds, factor, integral_range, time, output_norm: squares.sqrt() }
    }

    pub(crate) fn operators(&self) -> usize {
        self.thresholds.len()
    }

    /// A slow change beside the operators.
    pub(crate) fn slow_change(&self, records: &[Record<'_>], begins_wrong: bool) -> Option<Finding> {
        let beside_integral = self.factor.get(.., ..self.factor.ncols() - 1).to_owned();
        change(&beside_integral, records, begins_wrong)
    }

    /// Whether the residual, beside the operators and slow changes, falls with the integral of the position: a position
    /// that leaks towards its mean with the time constant tau is the one without a leak less the integral over tau.
    pub(crate) fn leakage(&self) -> Option<Finding> {
        /// The correlation: half of the squares.
        const LIMIT: f64 = 0.7;
        /// How far the leak moves the position at least, over the range.
        const MATTERS: f64 = 0.01;
        let last = self.factor.ncols() - 1;
        let first = Echelon::of(self.factor.as_ref()).rank(last - 1);
        let [residual, integral] = [last - 1, last].map(|column| self.factor.col(column).get(first..));
        let (own, left) = (integral.norm_l2(), residual.norm_l2());
        if own <= DEPENDS * self.factor.col(last).norm_l2() || left == 0.0 {
            return None;
        }
        let product: f64 = residual.iter().zip(integral.iter()).map(|(e, whole)| e * whole).sum();
        let (value, rate) = (-product / own / left, -product / own / own);
        let moved = rate * self.integral_range;
        let message = format!(
            "the position leaks towards its mean, with a time constant of {:.3} {}: it moves by {:.1} % of the range on that account, \
             and one that is held is lost within that time",
            1.0 / rate / self.time.1,
            self.time.0,
            100.0 * moved
        );
        let finding = Finding::new(FindingCode::Leakage, value, LIMIT, message);
        (value > LIMIT && moved > MATTERS).then_some(finding)
    }

    fn is_moved(&self, operator: usize) -> bool {
        let (low, high) = self.operator_bounds[operator];
        low < high
    }

    /// Operators whose output is a constant.
    pub(crate) fn unreached(&self) -> Option<Finding> {
        let still: Vec<f64> =
            (0..self.operators()).filter(|i| !self.is_moved(*i)).map(|i| self.thresholds[i]).collect();
        let smallest = still.iter().copied().fold(f64::INFINITY, f64::min);
        let message = format!(
            "{} of {} operators never move, thresholds from {smallest:.4} on: their weights are not determined",
            still.len(),
            self.operators()
        );
        let measured = Finding::new(FindingCode::UnreachedThreshold, as_f64(still.len()), 0.0, message);
        (!still.is_empty()).then_some(measured)
    }

    /// Operators that the record does not tell apart.
    pub(crate) fn collinear(&self) -> Option<Finding> {
        const LIMIT: f64 = 1.0;
        // Singular values of unit columns are known to the rounding of the operators, about 1e-16.
        const SMALLEST_NOISE: f64 = 1e-9;
        let moved: Vec<usize> = (0..self.operators()).filter(|i| self.is_moved(*i)).collect();
        // Of the operators' outputs, each record's mean removed: all of it stands in as many rows as there are
        // operators.
        let (means, rows) = (self.residuals.len(), self.operators());
        let column = |i: usize| (0..rows).map(|row| self.factor[(means + row, means + i)]).collect::<Vec<f64>>();
        let units: Vec<Vec<f64>> = moved.iter().map(|i| unit(&column(*i))).collect();
        let scaled = Mat::from_fn(rows, moved.len(), |row, i| units[i][row]);
        let smallest = scaled.singular_values().ok()?.into_iter().fold(f64::INFINITY, f64::min);
        let relative_noise = (self.residual_deviation() / self.output_norm).max(SMALLEST_NOISE);
        let value = as_f64(moved.len()) * relative_noise / smallest;
        let uncertain = if value.is_finite() {
            format!("uncertain by {value:.1} times what one contributes")
        } else {
            "not told".into()
        };
        let message = format!(
            "the record does not tell the {} operators apart: the least determined combination of them is {uncertain}; \
             their sum and the output are determined all the same",
            moved.len()
        );
        let measured = Finding::new(FindingCode::CollinearOperators, value, LIMIT, message);
        (moved.len() > 1 && value > LIMIT).then_some(measured)
    }

    /// The rms residual, widened for what correlated residuals add to the error of a mean.
    fn residual_deviation(&self) -> f64 {
        // What is correlated more changes too slowly for the operators to follow: drift, which has its own finding.
        const SLOWEST: f64 = 0.9;
        let samples: usize = self.residuals.iter().map(Vec::len).sum();
        let variance = |residual: &Vec<f64>| {
            let same = signal::neighbours(residual).clamp(0.0, SLOWEST);
            as_f64(residual.len()) * signal::rms(residual).powi(2) * (1.0 + same) / (1.0 - same)
        };
        (self.residuals.iter().map(variance).sum::<f64>() / as_f64(samples)).sqrt()
    }
}

/// The integral of a position about its mean, by trapezoids from 0 on.
fn integral(position: &[f64], dt: f64) -> Vec<f64> {
    let about = signal::centred(position);
    let mut sum = 0.0;
    let mut until = |k: usize| {
        if k > 0 {
            sum += 0.5 * dt * (about[k - 1] + about[k]);
        }
        sum
    };
    (0..about.len()).map(&mut until).collect()
}

/// A column of length one; a column of zeros stays.
fn unit(column: &[f64]) -> Vec<f64> {
    let length = signal::rms(column) * as_f64(column.len()).sqrt();
    column.iter().map(|value| if length > 0.0 { value / length } else { 0.0 }).collect()
}

/// Time, a slow exponential of it, and two fast ones, which are beginnings that settle.
pub(crate) const COLUMNS: usize = 4;

/// How many of them are slow; these come first.
const SLOW: usize = 2;

/// The exponentials fall by so many e-folds in a record.
const FOLDS: [f64; COLUMNS - 1] = [3.0, 6.0, 12.0];

/// The slow columns of a record sample by sample, each from 0 to about 1 over its fitted samples.
pub(crate) struct Slow {
    samples: f64,
    sample: f64,
    /// How much of the way each exponential has left, and what a sample leaves of that.
    left: [f64; FOLDS.len()],
    kept: [f64; FOLDS.len()],
}

impl Slow {
    pub(crate) fn of(record: &Record<'_>) -> Self {
        let samples = as_f64(record.fitted_samples());
        Self { samples, sample: 0.0, left: [1.0; FOLDS.len()], kept: FOLDS.map(|folds| (-folds / samples).exp()) }
    }

    /// Writes the columns at a sample and goes on to the next one.
    pub(crate) fn write(&mut self, columns: &mut [f64]) {
        let (time, exponentials) = columns.split_at_mut(1);
        time[0] = self.sample / self.samples;
        for ((column, left), kept) in exponentials.iter_mut().zip(&mut self.left).zip(self.kept) {
            *column = 1.0 - *left;
            *left *= kept;
        }
        self.sample += 1.0;
    }
}

/// Whether the residual follows a slow change once the operators may give back what they have taken up of it.
///
/// `factor` is R, in echelon form, of the operators, the slow columns and the residual. Columns that depend take no
/// row: those of operators that never move, and a slow one of which operators make all, as that of a ramp makes all of
/// time. A beginning that settles is a slow change, too. Where one was found by itself, `begins_wrong`, the slow change
/// is told in its place if it explains most.
pub(crate) fn change(factor: &Mat<f64>, records: &[Record<'_>], begins_wrong: bool) -> Option<Finding> {
    /// The multiple correlation: a quarter of the squares.
    const LIMIT: f64 = 0.5;
    /// How far it moves the position at least, over the range.
    const MATTERS: f64 = 0.01;
    /// The squares that time or the slow exponential leaves at most, over those that a fast one leaves.
    const SETTLES: f64 = 3.0;
    /// Both limits where a beginning was found: in loops that only decay, operators take up so much that the
    /// exponentials are nearly alike.
    const MOST: (f64, f64) = (0.85, 1.25);
    let beside = Beside::of(factor);
    let [time, slow] = beside.amplitudes();
    let range = largest_range(records);
    let moved = range_of(time, slow) / range;
    let value = (1.0 - beside.left_by_slow() / beside.left()).max(0.0).sqrt();
    let (least, most) = if begins_wrong { MOST } else { (LIMIT, SETTLES) };
    let message = format!(
        "a slow change of {:.1} % of the range lies beside the motion and explains {:.0} % of the squares of the residual: \
         temperature, creep or electronics",
        100.0 * moved,
        100.0 * value * value
    );
    let finding = Finding::new(FindingCode::Drift, value, least, message).try_next(
        "let the stage and its electronics settle before the record, or identify creep as well; a full stroke at the beginning \
         and at the end of the record tells drift from loops"
            .into(),
    );
    (value > least && moved > MATTERS && beside.slow_over_fast() < most).then_some(finding)
}

/// The slow columns and the residual beside the operators.
struct Beside<'a> {
    factor: &'a Mat<f64>,
    echelon: Echelon<'a>,
    /// The place of the residual.
    last: usize,
}

impl<'a> Beside<'a> {
    fn of(factor: &'a Mat<f64>) -> Self {
        Self { factor, echelon: Echelon::of(factor.as_ref()), last: factor.ncols() - 1 }
    }

    /// The squares of a column from the row on in which what is left behind the first columns begins.
    fn squares(&self, column: usize, behind: usize) -> f64 {
        self.factor.col(column).get(self.echelon.rank(behind)..).squared_norm_l2()
    }

    /// The squares of the residual that the operators leave.
    fn left(&self) -> f64 {
        self.squares(self.last, self.last - COLUMNS)
    }

    /// The same, of operators, time and the slow exponential.
    fn left_by_slow(&self) -> f64 {
        self.squares(self.last, self.last - COLUMNS + SLOW)
    }

    /// The same, of operators and one of the slow columns; a column that operators make takes nothing.
    fn left_by(&self, slow: usize) -> f64 {
        let column = self.last - COLUMNS + slow;
        let own = self.squares(column, self.last - COLUMNS);
        if own <= DEPENDS.powi(2) * self.factor.col(column).squared_norm_l2() {
            return self.left();
        }
        let rows = self.echelon.rank(self.last - COLUMNS)..self.factor.nrows();
        let product: f64 = rows.map(|row| self.factor[(row, column)] * self.factor[(row, self.last)]).sum();
        (self.left() - product * product / own).max(0.0)
    }

    /// What the better one of the slow columns leaves, over what the better one of the fast columns leaves.
    fn slow_over_fast(&self) -> f64 {
        let least = |columns: Range<usize>| columns.map(|slow| self.left_by(slow)).fold(f64::INFINITY, f64::min);
        least(0..SLOW) / least(SLOW..COLUMNS)
    }

    /// Of time and the slow exponential, beside the operators.
    fn amplitudes(&self) -> [f64; SLOW] {
        let (first, columns) = (self.last - COLUMNS, self.last - COLUMNS + SLOW);
        let right = (0..self.echelon.rank(columns)).map(|row| self.factor[(row, self.last)]).collect();
        let amplitudes = self.echelon.solve(columns, right);
        [amplitudes[first], amplitudes[first + 1]]
    }
}

/// How far time and a slow exponential move the position over a record.
fn range_of(time: f64, slow: f64) -> f64 {
    const POINTS: usize = 50;
    let at = |point: usize| {
        let done = as_f64(point) / as_f64(POINTS);
        time * done - slow * (-FOLDS[0] * done).exp_m1()
    };
    let values: Vec<f64> = (0..=POINTS).map(at).collect();
    let (low, high) = signal::bounds(&values);
    high - low
}

#[cfg(test)]
mod tests {
    use crate::records::signal::white;

    use super::*;

    type Operator = fn(f64) -> f64;

    /// Of a record of `drive`, with operators that make these of it, beside a slow change of half the range and noise.
    fn found(drive: impl Fn(f64) -> f64, operators: &[Operator], change_of: impl Fn(f64) -> f64) -> Option<Finding> {
        found_in(drive, operators, change_of, false)
    }

    fn found_in(
        drive: impl Fn(f64) -> f64,
        operators: &[Operator],
        change_of: impl Fn(f64) -> f64,
        begins_wrong: bool,
    ) -> Option<Finding> {
        let input: Vec<f64> = (0..400).map(|k| drive(f64::from(k) / 400.0)).collect();
        let records = [Record::new(&input, &input, 0).unwrap()];
        let (mut slow, mut columns) = (Slow::of(&records[0]), [0.0; COLUMNS]);
        let mut factor = TriangularFactor::new(1 + operators.len() + COLUMNS + 1);
        for ((u, e), k) in input.iter().zip(white(400)).zip(0_u32..) {
            slow.write(&mut columns);
            let mut row = vec![1.0];
            row.extend(operators.iter().map(|operator| operator(*u)));
            row.extend(columns);
            row.push(change_of(f64::from(k) / 400.0) + 0.05 * e);
            factor.push(&row);
        }
        change(&factor.finish(), &records, begins_wrong)
    }

    #[test]
    fn operators_that_never_move_hide_no_slow_change() {
        let drive = |t: f64| (1.0 - t) * (40.0 * t).sin();
        let [moves, rests, still]: [Operator; 3] = [|u| u, |_| 0.0, |_| 3.0];
        let alone = found(drive, &[moves], |t| t).unwrap();
        assert!(alone.value > 0.9, "{alone:?}");
        for others in [&[moves, rests][..], &[moves, still], &[rests, still, moves, moves]] {
            let with = found(drive, others, |t| t).unwrap();
            assert!((with.value - alone.value).abs() < 1e-9 && with.message == alone.message, "{with:?} {alone:?}");
        }
        assert_eq!(found(drive, &[moves, rests, still], |_| 0.0), None);
    }

    /// What an operator makes of a ramp is time: of a change it leaves the part that is no ramp.
    #[test]
    fn an_operator_may_make_all_of_time() {
        let finding = found(|t| t, &[|u| u], |t| 0.5 * (1.0 - (-3.0 * t).exp())).unwrap();
        assert!(finding.value > 0.8, "{finding:?}");
        assert!(finding.message.starts_with("a slow change of 47."), "{finding:?}");
    }

    /// What time explains better is a drift, what a fast exponential explains better is a beginning.
    #[test]
    fn a_beginning_that_settles_is_no_drift() {
        let drive = |t: f64| (40.0 * t).sin();
        let (moves, rests): (Operator, Operator) = (|u| u, |_| 0.0);
        let settles = |folds: f64| move |t: f64| (-folds * t).exp();
        for folds in [9.0, 15.0, 30.0] {
            assert_eq!(found_in(drive, &[rests, moves], settles(folds), true), None);
        }
        assert!(found_in(drive, &[rests, moves], settles(2.0), true).is_some());
        // Where no beginning was found this is what is left to tell of it, unless a fast exponential explains far more.
        assert!(found_in(drive, &[rests, moves], |t| (-6.0 * t).exp() + t, false).is_some());
        assert_eq!(found_in(drive, &[rests, moves], settles(12.0), false), None);
    }
}
