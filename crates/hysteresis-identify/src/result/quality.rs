//! How well a model fits, always with the base of every percentage; and how wide the loops of a record are.

use crate::error::RecordError;
use crate::records::record::check_finite;
use crate::records::signal::{as_f64, bounds, turns};

/// The errors of a model over fitted samples, in the unit of the output.
///
/// e(k) = y(k) - prediction(k); skipped samples do not count, and neither do those that were left out as glitches. For
/// several records together the samples are pooled, `range` is the largest range of any record (their output offsets
/// differ, so a joint peak-to-peak would mean nothing), and the loop width is that of the record with the largest error
/// of it.
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

/// How many parts of the input range are looked at.
const PARTS: usize = 50;

/// The widest distance between the falling and the rising outputs of full strokes at the same input, in the unit of the
/// output; none without a full stroke in both directions.
///
/// A full stroke leads from the lowest to the highest twentieth of the input range, or back. The outputs of all rising
/// strokes are averaged in fifty parts of the range, those of the falling ones likewise, so noise averages out.
///
/// # Errors
/// [`RecordError::Length`] for unequal lengths, [`RecordError::NotFinite`] for a NaN, an infinity or a magnitude beyond
/// 1e100.
///
/// ```
/// use hysteresis_identify::loop_width;
/// // A play of threshold 2: its loop is 4 wide.
/// let input: Vec<f64> = (0..2000).map(|k| 10.0 * (k as f64 / 100.0).sin()).collect();
/// let mut play = 0.0_f64;
/// let output: Vec<f64> = input.iter().map(|u| { play = play.clamp(u - 2.0, u + 2.0); play }).collect();
/// assert!((loop_width(&input, &output)?.unwrap() - 4.0).abs() < 0.1);
/// assert_eq!(loop_width(&input[..150], &output[..150])?, None);
/// # Ok::<(), hysteresis_identify::RecordError>(())
/// ```
pub fn loop_width(input: &[f64], output: &[f64]) -> Result<Option<f64>, RecordError> {
    if output.len() != input.len() {
        return Err(RecordError::Length { argument: "output", expected: input.len(), got: output.len() });
    }
    check_finite("input", input)?;
    check_finite("output", output)?;
    let (low, high) = bounds(input);
    let range = high - low;
    if input.is_empty() || range == 0.0 {
        return Ok(None);
    }
    let at = |level: f64| input.iter().position(|u| *u == level).map_or(0.0, |k| output[k]);
    let slope = (at(high) - at(low)) / range;
    let mut parts = [[(0.0, 0_usize); PARTS]; 2];
    for stroke in full_strokes(input, low, high) {
        let rising = input[*stroke.start()] < input[*stroke.end()];
        for k in stroke {
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "from 0 to PARTS")]
            let part = ((input[k] - low) / range * as_f64(PARTS)) as usize;
            let (sum, count) = &mut parts[usize::from(rising)][part.min(PARTS - 1)];
            // Without the straight line, as samples of one part lie at different inputs.
            *sum += output[k] - slope * (input[k] - low);
            *count += 1;
        }
    }
    let [falling, rising] = parts;
    let distance = |((down, n), (up, m)): (&(f64, usize), &(f64, usize))| {
        (*n > 0 && *m > 0).then(|| (down / as_f64(*n) - up / as_f64(*m)).abs())
    };
    Ok(falling.iter().zip(&rising).filter_map(distance).reduce(f64::max))
}

/// The samples of every move from one end of the range to the other.
fn full_strokes(input: &[f64], low: f64, high: f64) -> impl Iterator<Item = std::ops::RangeInclusive<usize>> {
    let margin = 0.05 * (high - low);
    let mut ends = vec![0];
    ends.extend(turns(input, margin));
    ends.push(input.len() - 1);
    let strokes: Vec<_> = ends.windows(2).map(|pair| pair[0]..=pair[1]).collect();
    strokes.into_iter().filter(move |stroke| {
        let (from, to) = (input[*stroke.start()], input[*stroke.end()]);
        from.min(to) <= low + margin && from.max(to) >= high - margin
    })
}

#[cfg(test)]
mod tests_of_quality {
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

#[cfg(test)]
mod tests_of_loop_width {
    use super::*;

    #[test]
    fn lengths_and_numbers_are_checked() {
        let message = |u: &[f64], y: &[f64]| loop_width(u, y).unwrap_err().to_string();
        assert!(message(&[0.0, 1.0], &[0.0]).starts_with("output: expected"));
        assert!(message(&[0.0, f64::NAN], &[0.0, 1.0]).starts_with("input[1]: expected"));
        assert!(message(&[0.0, 1.0], &[f64::INFINITY, 1.0]).starts_with("output[0]: expected"));
        assert_eq!(loop_width(&[], &[]), Ok(None));
        assert_eq!(loop_width(&[1.0, 1.0], &[1.0, 2.0]), Ok(None));
        assert_eq!(loop_width(&[0.0, 1.0], &[1.0, 2.0]), Ok(None));
    }

    #[test]
    fn a_line_has_no_width_however_it_is_sampled() {
        let rising = (0..40).map(|k| -10.0 + 0.5 * f64::from(k));
        let falling = (0..40).map(|k| 10.0 - 0.7 * f64::from(k));
        let input: Vec<f64> = rising.chain(falling.filter(|u| *u >= -10.0)).collect();
        let output: Vec<f64> = input.iter().map(|u| 2.0 * u + 3.0).collect();
        // a difference of numbers up to 23
        assert!(loop_width(&input, &output).unwrap().unwrap() < 1e-13);
    }

    #[test]
    fn minor_loops_and_the_way_to_the_first_end_do_not_count() {
        // Full strokes with offsets of 1 and -1; what comes before and after has others.
        let walk = [(0.0, 10.0, -9.0), (10.0, -10.0, 1.0), (-10.0, 10.0, -1.0), (10.0, 3.0, 7.0), (3.0, 8.0, 7.0)];
        let (mut input, mut output) = (Vec::new(), Vec::new());
        for (from, to, offset) in walk {
            for k in 0..500 {
                let u = from + (to - from) * f64::from(k) / 500.0;
                input.push(u);
                output.push(2.0 * u + offset);
            }
        }
        let width = loop_width(&input, &output).unwrap().unwrap();
        // the first sample of a move belongs to the one before it too
        assert!((width - 2.0).abs() < 0.5, "{width}");
    }
}
