//! A slow change of the position that the operators have taken up in part: in loops that only decay, the one correlates with the other.

use faer::Mat;

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::fit::factor::Echelon;
use crate::numeric::as_f64;
use crate::record::Record;

/// Time, a slow exponential of it, and a fast one, which is a beginning that settles.
pub(super) const COLUMNS: usize = 3;

/// The multiple correlation of a slow change that explains most of what is left: two thirds of the squares.
pub(super) const MOST: f64 = 0.8;

/// The exponentials fall by so many e-folds in a record.
const FOLDS: [f64; 2] = [3.0, 12.0];

/// The slow columns of a record sample by sample, each from 0 to about 1 over its fitted samples.
pub(super) struct Slow {
    samples: f64,
    sample: f64,
    /// How much of the way each exponential has left, and what a sample leaves of that.
    left: [f64; 2],
    kept: [f64; 2],
}

impl Slow {
    pub(super) fn of(record: &Record<'_>) -> Self {
        let samples = as_f64(record.fitted_samples());
        Self { samples, sample: 0.0, left: [1.0; 2], kept: FOLDS.map(|folds| (-folds / samples).exp()) }
    }

    /// Writes the columns at a sample and goes on to the next one.
    pub(super) fn write(&mut self, columns: &mut [f64]) {
        let [slow, fast] = self.left;
        columns.copy_from_slice(&[self.sample / self.samples, 1.0 - slow, 1.0 - fast]);
        self.sample += 1.0;
        self.left = [slow * self.kept[0], fast * self.kept[1]];
    }
}

/// Whether the residual follows a slow change once the operators may give back what they have taken up of it.
///
/// `factor` is R, in echelon form, of the operators, the slow columns and the residual. Columns that depend take no row: those of operators
/// that never move, and a slow one of which operators make all, as that of a ramp makes all of time.
pub(super) fn change(factor: &Mat<f64>, records: &[Record<'_>]) -> Option<Finding> {
    /// The multiple correlation: a quarter of the squares.
    const LIMIT: f64 = 0.5;
    /// How far it moves the position at least, over the range.
    const MATTERS: f64 = 0.01;
    /// What remains of a slow change is no beginning that settles.
    const SETTLES: f64 = 0.3;
    let (echelon, last) = (Echelon::of(factor.as_ref()), factor.ncols() - 1);
    let beside = |slow: usize| {
        let first = echelon.rank(last - COLUMNS + slow);
        (first..factor.nrows()).map(|row| factor[(row, last)].powi(2)).sum::<f64>()
    };
    let (without, with, with_fast) = (beside(0), beside(COLUMNS - 1), beside(COLUMNS));
    // The operators, time and the slow exponential.
    let first = last - COLUMNS;
    let right = (0..echelon.rank(last - 1)).map(|row| factor[(row, last)]).collect();
    let amplitudes = echelon.solve(last - 1, right);
    let range = records.iter().map(Record::output_range).fold(0.0, f64::max);
    let moved = range_of(amplitudes[first], amplitudes[first + 1]) / range;
    let value = (1.0 - with / without).max(0.0).sqrt();
    let message = format!(
        "a slow change of {:.1} % of the range lies beside the motion and explains {:.0} % of the squares of the residual: \
         temperature, creep or electronics",
        100.0 * moved,
        100.0 * value * value
    );
    let finding = Finding::new(FindingCode::Drift, value, LIMIT, message).try_next(
        "let the stage and its electronics settle before the record, or identify creep as well; a full stroke at the beginning \
         and at the end of the record tells drift from loops"
            .into(),
    );
    (value > LIMIT && moved > MATTERS && with_fast > SETTLES * with).then_some(finding)
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
        change(&factor.finish(), &records)
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
}
