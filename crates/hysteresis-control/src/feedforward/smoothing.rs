//! Smoothing of references that are known beforehand.

use crate::linear::{Error, check_positive};

/// The longest kernel, in samples.
const MOST_SAMPLES: f64 = 1000.0;

/// Weights that smooth a reference over so many seconds: three means of a third of it, one behind the other.
///
/// A mean over one period of a resonance passes nothing of its frequency, and three of them little of what is near: for one 5 % off,
/// 1.3e-4 of it. So a step of a reference becomes a motion within `seconds` that leaves three periods long resonances at rest. The
/// number of weights is odd, they sum to 1, and they have no phase.
///
/// ```
/// use hysteresis_control::feedforward::smoothing_kernel;
/// let kernel = smoothing_kernel(3.7e-3, 1e-4)?; // three periods of a resonance of 800 Hz
/// assert_eq!(kernel.len(), 35);
/// let at = |frequency: f64| -> f64 {
///     let wave = |(i, s): (usize, &f64)| s * (core::f64::consts::TAU * frequency * 1e-4 * (i as f64 - 17.0)).cos();
///     kernel.iter().enumerate().map(wave).sum()
/// };
/// assert!((at(0.0) - 1.0).abs() < 1e-12 && at(800.0).abs() < 1e-4 && at(840.0).abs() < 1e-3);
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
///
/// # Errors
/// [`Error`] for numbers that are not above 0, or more than 1000 samples.
pub fn smoothing_kernel(seconds: f64, dt: f64) -> Result<Vec<f64>, Error> {
    check_positive("dt", None, dt)?;
    let third = check_positive("smoothing", None, seconds)? / (3.0 * dt);
    if 3.0 * third > MOST_SAMPLES {
        return Err(Error::domain("smoothing", None, "at most 1000 samples", seconds));
    }
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "at most 334, and not negative")]
    let (nearest, half) = (third.round().max(1.0) as usize, (0.5 * third) as usize);
    let kernel = mean(&mean(&[1.0], nearest), nearest);
    // With an odd third mean the whole is odd.
    Ok(mean(&kernel, 2 * half + 1))
}

/// The running mean over so many samples.
fn mean(kernel: &[f64], samples: usize) -> Vec<f64> {
    let mut next = vec![0.0; kernel.len() + samples - 1];
    for (i, weight) in kernel.iter().enumerate() {
        for sum in &mut next[i..i + samples] {
            *sum += weight;
        }
    }
    let all: f64 = next.iter().sum();
    for weight in &mut next {
        *weight /= all;
    }
    next
}
