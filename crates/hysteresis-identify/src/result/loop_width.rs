//! How wide the loops of a record are.

use crate::error::RecordError;
use crate::numeric::as_f64;
use crate::record::check_finite;
use crate::signal::{bounds, turns};

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
mod tests {
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
