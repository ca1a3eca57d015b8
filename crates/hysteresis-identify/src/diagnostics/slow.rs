//! A slow change of the position that the operators have taken up in part: in loops that only decay, the one correlates with the other.

use std::ops::Range;

use faer::Mat;

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::factor::{DEPENDS, Echelon};
use crate::numeric::as_f64;
use crate::record::Record;

/// Time, a slow exponential of it, and two fast ones, which are beginnings that settle.
pub(super) const COLUMNS: usize = 4;

/// How many of them are slow; these come first.
const SLOW: usize = 2;

/// The exponentials fall by so many e-folds in a record.
const FOLDS: [f64; COLUMNS - 1] = [3.0, 6.0, 12.0];

/// The slow columns of a record sample by sample, each from 0 to about 1 over its fitted samples.
pub(super) struct Slow {
    samples: f64,
    sample: f64,
    /// How much of the way each exponential has left, and what a sample leaves of that.
    left: [f64; FOLDS.len()],
    kept: [f64; FOLDS.len()],
}

impl Slow {
    pub(super) fn of(record: &Record<'_>) -> Self {
        let samples = as_f64(record.fitted_samples());
        Self { samples, sample: 0.0, left: [1.0; FOLDS.len()], kept: FOLDS.map(|folds| (-folds / samples).exp()) }
    }

    /// Writes the columns at a sample and goes on to the next one.
    pub(super) fn write(&mut self, columns: &mut [f64]) {
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
/// `factor` is R, in echelon form, of the operators, the slow columns and the residual. Columns that depend take no row: those of operators
/// that never move, and a slow one of which operators make all, as that of a ramp makes all of time. A beginning that settles is a slow
/// change, too. Where one was found by itself, `begins_wrong`, the slow change is told in its place if it explains most.
pub(super) fn change(factor: &Mat<f64>, records: &[Record<'_>], begins_wrong: bool) -> Option<Finding> {
    /// The multiple correlation: a quarter of the squares.
    const LIMIT: f64 = 0.5;
    /// How far it moves the position at least, over the range.
    const MATTERS: f64 = 0.01;
    /// The squares that time or the slow exponential leaves at most, over those that a fast one leaves.
    const SETTLES: f64 = 3.0;
    /// Both limits where a beginning was found: in loops that only decay, operators take up so much that the exponentials are nearly alike.
    const MOST: (f64, f64) = (0.85, 1.25);
    let beside = Beside::of(factor);
    let [time, slow] = beside.amplitudes();
    let range = records.iter().map(Record::output_range).fold(0.0, f64::max);
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
    let (low, high) = crate::signal::bounds(&values);
    high - low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::factor::TriangularFactor;
    use crate::white_noise::white;

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
