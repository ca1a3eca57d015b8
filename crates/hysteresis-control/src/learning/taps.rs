//! Filters as finite impulse responses around the present sample.

use core::f64::consts::TAU;

use super::spectra::as_f64;

/// The filters reach that many periods of the bandwidth to either side, if the period has room for them.
const REACH: f64 = 1.5;

/// From a periodic impulse response the part around zero, windowed: taps for a window of samples that begins
/// `half_width` samples before its middle.
pub(super) fn taps(impulse_response: &[f64], half_width: usize) -> Box<[f64]> {
    let period = impulse_response.len();
    let width = as_f64(half_width + 1);
    let tap = |i: usize| {
        // The sample i of the window lags the middle by half_width - i.
        let lag = as_f64(half_width) - as_f64(i);
        let place = lag.abs() / width;
        let window = if place < 0.5 { 1.0 } else { 0.5 * (1.0 - (TAU * place).cos()) };
        window * impulse_response[(period + half_width - i) % period]
    };
    (0..=2 * half_width).map(tap).collect()
}

#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "bounded by the period")]
pub(super) fn half_width(period: usize, bandwidth_per_sample: f64) -> usize {
    let wanted = (REACH / bandwidth_per_sample).ceil().max(1.0);
    let most = (period - 1) / 2;
    if wanted < as_f64(most) { wanted as usize } else { most }
}

pub(super) fn dot(taps: &[f64], samples: &[f64]) -> f64 {
    taps.iter().zip(samples).map(|(c, x)| c * x).sum()
}
