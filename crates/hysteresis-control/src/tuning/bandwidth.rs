//! How far up a loop rejects disturbances, and how much noise it follows.

use core::f64::consts::FRAC_1_SQRT_2;

use super::feedback::Gains;
use super::open_loop::OpenLoop;
use super::response::FrequencyPoint;
use super::search::bisection;

/// The angle per sample up to which |S| is at most 1/sqrt(2); half a turn if it is so at all frequencies.
pub(super) fn rejection(gains: Gains, slope: f64, open: &OpenLoop, points: &[FrequencyPoint]) -> f64 {
    let excess = |point: &FrequencyPoint| (1.0 + gains.at(point) * slope).inv().norm() - FRAC_1_SQRT_2;
    match points.iter().position(|point| excess(point) > 0.0) {
        None => points.last().map_or(0.0, |last| last.angle),
        Some(0) => 0.0,
        Some(i) => bisection(points[i - 1].angle, points[i].angle, |angle| excess(&FrequencyPoint::new(open, angle))),
    }
}

/// The integral of |T|^2, T = L / (1 + L), over the angle per sample, by the trapezoidal rule.
pub(super) fn noise(gains: Gains, slope: f64, points: &[FrequencyPoint]) -> f64 {
    let power = |point: &FrequencyPoint| {
        let l = gains.at(point) * slope;
        (l / (1.0 + l)).norm_sqr()
    };
    let first = points.first().map_or(0.0, |first| first.angle * power(first));
    points
        .windows(2)
        .map(|pair| 0.5 * (pair[1].angle - pair[0].angle) * (power(&pair[0]) + power(&pair[1])))
        .sum::<f64>()
        + first
}
