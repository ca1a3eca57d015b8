//! A slow change of the position that the operators have taken up in part: in loops that only decay, the one correlates with the other.

use faer::Mat;

use crate::finding::Finding;
use crate::finding_code::FindingCode;
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
/// `factor` is R of the slow columns and the residual, of which a column in front, that of each operator, is projected out.
pub(super) fn change(factor: &Mat<f64>, records: &[Record<'_>]) -> Option<Finding> {
    /// The multiple correlation: a quarter of the squares.
    const LIMIT: f64 = 0.5;
    /// How far it moves the position at least, over the range.
    const MATTERS: f64 = 0.01;
    /// What remains of a slow change is no beginning that settles.
    const SETTLES: f64 = 0.3;
    let residual = |from: usize| (from..=COLUMNS).map(|row| factor[(row, COLUMNS)].powi(2)).sum::<f64>();
    let (without, with, with_fast) = (residual(0), residual(COLUMNS - 1), residual(COLUMNS));
    // Back substitution for time and the slow exponential.
    let slow = factor[(1, COLUMNS)] / factor[(1, 1)];
    let time = (factor[(0, COLUMNS)] - factor[(0, 1)] * slow) / factor[(0, 0)];
    let range = records.iter().map(Record::output_range).fold(0.0, f64::max);
    let moved = range_of(time, slow) / range;
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
