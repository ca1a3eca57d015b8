//! How well a model fits, always with the base of every percentage.

/// The errors of a model over fitted samples, in the unit of the output.
///
/// e(k) = y(k) - prediction(k); skipped samples do not count. For several records together the samples are pooled
/// and `range` is the largest range of any record: their output offsets differ, so a joint peak-to-peak would mean
/// nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Quality {
    /// The largest |e|.
    pub max_error: f64,
    /// The root of the mean of e^2.
    pub rmse: f64,
    /// The mean of e^2, in the unit of the output squared.
    pub mse: f64,
    /// The base of the percentages: peak-to-peak of the measured output over the fitted samples.
    pub range: f64,
    /// 100 `max_error` / `range`.
    pub max_error_percent: f64,
    /// 100 `rmse` / `range`.
    pub rmse_percent: f64,
    /// How many samples were fitted.
    pub samples: usize,
}

impl Quality {
    /// The quality of a prediction of `measured` samples with this peak-to-peak range.
    pub(crate) fn of(measured: &[f64], predicted: &[f64], range: f64) -> Self {
        let (mut max_error, mut squares) = (0.0_f64, 0.0);
        for (y, prediction) in measured.iter().zip(predicted) {
            let error = y - prediction;
            max_error = max_error.max(error.abs());
            squares += (error / range) * (error / range);
        }
        Self::from_sums(max_error, squares, range, measured.len())
    }

    /// The quality over all records together.
    #[must_use]
    pub fn pooled(records: &[Self]) -> Self {
        let range = records.iter().fold(0.0, |range: f64, record| range.max(record.range));
        let (mut max_error, mut squares, mut samples) = (0.0_f64, 0.0, 0);
        for record in records {
            max_error = max_error.max(record.max_error);
            squares += (record.rmse / range) * (record.rmse / range) * as_f64(record.samples);
            samples += record.samples;
        }
        Self::from_sums(max_error, squares, range, samples)
    }

    /// From the sum of the squares of e / range: squares of e alone may underflow in a unit like the metre.
    fn from_sums(max_error: f64, squares: f64, range: f64, samples: usize) -> Self {
        let mean = squares / as_f64(samples);
        let (mse, rmse) = (mean * range * range, mean.sqrt() * range);
        Self {
            max_error,
            rmse,
            mse,
            range,
            max_error_percent: 100.0 * max_error / range,
            rmse_percent: 100.0 * rmse / range,
            samples,
        }
    }
}

/// A count as a number; exact up to 2^53.
#[expect(clippy::cast_precision_loss, reason = "no record has 2^53 samples")]
pub(crate) fn as_f64(count: usize) -> f64 {
    count as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_by_hand() {
        let first = Quality::of(&[0.0, 4.0], &[1.0, 1.0], 4.0);
        assert_eq!((first.max_error, first.mse, first.rmse), (3.0, 5.0, 5.0_f64.sqrt()));
        assert_eq!((first.max_error_percent, first.samples), (75.0, 2));
        let second = Quality::of(&[0.0, 0.0, 10.0, 0.0], &[0.0, 0.0, 10.0, 0.0], 10.0);
        let both = Quality::pooled(&[first, second]);
        assert_eq!((both.max_error, both.range, both.samples), (3.0, 10.0, 6));
        assert!((both.mse - 10.0 / 6.0).abs() < 1e-15);
        assert!((both.rmse_percent - 10.0 * both.rmse).abs() < 1e-13);
    }

    #[test]
    fn the_unit_does_not_matter() {
        let (one, tiny) =
            (Quality::of(&[0.0, 4.0], &[1.0, 1.0], 4.0), Quality::of(&[0.0, 4e-200], &[1e-200; 2], 4e-200));
        assert!((one.rmse_percent - tiny.rmse_percent).abs() < 1e-12 && (tiny.rmse / one.rmse - 1e-200).abs() < 1e-212);
    }
}
