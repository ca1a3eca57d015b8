//! Noise of the drive that the position does not follow.

use crate::finding::Finding;
use crate::finding_code::FindingCode;
use crate::numeric::as_f64;
use crate::record::Record;
use crate::signal;

/// So many samples later the position may still answer the drive.
const ANSWER: usize = 8;

/// White noise of unit deviation has second differences of this variance.
const SECOND_DIFFERENCES: f64 = 6.0;

/// The recorded drive is that of a noisy monitor.
pub(super) fn noisy_input(record: &Record<'_>) -> Option<Finding> {
    const LIMIT: f64 = 0.003;
    /// The position follows if what it does on that account is this share of what its gain makes of the noise.
    const FOLLOWED: f64 = 0.1;
    /// Neighbouring second differences of white noise have a correlation of -2/3, and those of any motion more.
    const WHITE: f64 = -0.5;
    let (input, output) = (&record.input()[record.skip()..], &record.output()[record.skip()..]);
    let (low, high) = signal::bounds(input);
    let (drive, position) = (curvature(input), curvature(output));
    let value = signal::robust_deviation(&drive) / SECOND_DIFFERENCES.sqrt() / (high - low);
    if drive.len() <= 2 * ANSWER || signal::neighbours(&drive) > WHITE {
        return None;
    }
    let later: Vec<Vec<f64>> = (0..ANSWER).map(|lag| drive[ANSWER - lag..drive.len() - lag].to_vec()).collect();
    let answered = &position[ANSWER..];
    let chance = as_f64(ANSWER) / as_f64(answered.len()) * signal::rms(answered).powi(2);
    let answer = signal::rms(&signal::projection(answered, &later)).powi(2) - chance;
    let expected = FOLLOWED * record.output_range() / (high - low) * signal::rms(&drive);
    let message = format!(
        "the recorded drive has noise of {:.2} % of its range, and the position does not follow it: a monitor's, which biases \
         thresholds and weights",
        100.0 * value
    );
    (answer < expected * expected).then(|| Finding::new(FindingCode::NoisyInput, value, LIMIT, message))
}

/// The second differences, those at turns and jumps cut off.
fn curvature(values: &[f64]) -> Vec<f64> {
    const USUAL: f64 = 4.0;
    let all: Vec<f64> = values.windows(3).map(|three| three[2] - 2.0 * three[1] + three[0]).collect();
    if all.is_empty() {
        return all;
    }
    let most = USUAL * signal::robust_deviation(&all);
    all.into_iter().map(|one| one.clamp(-most, most)).collect()
}
