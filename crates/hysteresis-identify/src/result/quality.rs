//! How well a model fits, always with the base of every percentage.

use super::loop_width::loop_width;
use crate::numeric::as_f64;

/// The errors of a model over fitted samples, in the unit of the output.
///
/// e(k) = y(k) - prediction(k); skipped samples do not count, and neither do those that were left out as glitches. For several records together the samples are pooled,
/// `range` is the largest range of any record (their output offsets differ, so a joint peak-to-peak would mean nothing),
/// and the loop width is that of the record with the largest error of it.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
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
    /// Half of `range`.
    pub amplitude: f64,
    /// 100 `max_error` / `range`.
    pub max_error_percent: f64,
    /// 100 `rmse` / `range`.
    pub rmse_percent: f64,
    /// 100 `max_error` / `amplitude`.
    pub max_error_percent_of_amplitude: f64,
    /// 100 `rmse` / `amplitude`.
    pub rmse_percent_of_amplitude: f64,
    /// The normalised root mean square error (NRMSE), sqrt(mean e^2) / (max y - min y) = `rmse` / `range`: not that of
    /// the tools which divide by the standard deviation of y.
    pub nrmse: f64,
    /// The width of the measured loops, as [`loop_width`](crate::loop_width()) measures it; none without full strokes.
    pub loop_width: Option<f64>,
    /// How much wider the modelled loops are.
    pub loop_width_error: Option<f64>,
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

    /// The same with the width of the loops, for the input of these samples.
    pub(crate) fn with_loops(self, input: &[f64], measured: &[f64], predicted: &[f64]) -> Self {
        // No error is left: the samples of a record and what a model makes of them are finite and equally many.
        let width = |output| loop_width(input, output).ok().flatten();
        let (loop_width, modelled) = (width(measured), width(predicted));
        Self {
            loop_width,
            loop_width_error: modelled.zip(loop_width).map(|(modelled, width)| modelled - width),
            ..self
        }
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
        let error = |record: &&Self| record.loop_width_error.map_or(-1.0, f64::abs);
        let widest = records.iter().max_by(|p, q| error(p).total_cmp(&error(q)));
        Self {
            loop_width: widest.and_then(|record| record.loop_width),
            loop_width_error: widest.and_then(|record| record.loop_width_error),
            ..Self::from_sums(max_error, squares, range, samples)
        }
    }

    /// From the sum of the squares of e / range: squares of e alone may underflow in a unit like the metre.
    fn from_sums(max_error: f64, squares: f64, range: f64, samples: usize) -> Self {
        let mean = squares / as_f64(samples);
        let (mse, rmse, amplitude) = (mean * range * range, mean.sqrt() * range, 0.5 * range);
        Self {
            max_error,
            rmse,
            mse,
            range,
            amplitude,
            max_error_percent: 100.0 * max_error / range,
            rmse_percent: 100.0 * rmse / range,
            max_error_percent_of_amplitude: 100.0 * max_error / amplitude,
            rmse_percent_of_amplitude: 100.0 * rmse / amplitude,
            nrmse: rmse / range,
            loop_width: None,
            loop_width_error: None,
            samples,
        }
    }
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
        assert_eq!((first.amplitude, first.max_error_percent_of_amplitude), (2.0, 150.0));
        assert_eq!((first.nrmse, first.rmse_percent_of_amplitude), (first.rmse / 4.0, 50.0 * first.rmse));
        assert_eq!((both.loop_width, both.loop_width_error), (None, None));
    }

    /// A loop 2 wide, and a model whose loop is 3 wide: of several records the one that is furthest off counts.
    #[test]
    fn loop_widths_of_measurement_and_model() {
        let input: Vec<f64> = (0..2000).map(|k| 10.0 * (f64::from(k) / 100.0).sin()).collect();
        let play = |r: f64| {
            let mut play = 0.0_f64;
            input.iter().map(|u| (play = play.clamp(u - r, u + r), play).1).collect::<Vec<f64>>()
        };
        let quality = |r| Quality::of(&play(1.0), &play(r), 18.0).with_loops(&input, &play(1.0), &play(r));
        let (near, far) = (quality(1.1), quality(1.5));
        // the play's loop is 2 r wide but for the samples' distance from the ends of a part
        assert!((far.loop_width.unwrap() - 2.0).abs() < 0.1 && (far.loop_width_error.unwrap() - 1.0).abs() < 0.1);
        let without = Quality::of(&[0.0, 4.0], &[1.0, 1.0], 4.0);
        let pooled = Quality::pooled(&[near, far, without]);
        assert_eq!((pooled.loop_width, pooled.loop_width_error), (far.loop_width, far.loop_width_error));
    }

    #[test]
    fn the_unit_does_not_matter() {
        let (one, tiny) =
            (Quality::of(&[0.0, 4.0], &[1.0, 1.0], 4.0), Quality::of(&[0.0, 4e-200], &[1e-200; 2], 4e-200));
        assert!((one.rmse_percent - tiny.rmse_percent).abs() < 1e-12 && (tiny.rmse / one.rmse - 1e-200).abs() < 1e-212);
    }
}
