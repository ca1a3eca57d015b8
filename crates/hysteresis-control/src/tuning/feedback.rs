//! A loop of given gains: its sensitivity and whether it is stable.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::open_loop::OpenLoop;
use super::response::FrequencyPoint;
use super::search::golden_section;

/// Proportional and integral gain for one sample, both in drive per position.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) kp: f64,
    /// ki dt.
    pub(super) ki_dt: f64,
}

/// Slopes from the least to the greatest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slopes {
    pub(super) min: f64,
    pub(super) max: f64,
}

impl Gains {
    /// L / slope at a frequency.
    pub(super) fn at(self, point: &FrequencyPoint) -> Complex<f64> {
        (self.kp + self.ki_dt / point.difference) * point.plant
    }
}

impl Slopes {
    /// The least |1 + s l| over the slopes s: a parabola in s.
    pub(super) fn min_distance(self, l: Complex<f64>) -> f64 {
        let nearest = (-l.re / l.norm_sqr()).clamp(self.min, self.max);
        (1.0 + l * nearest).norm()
    }
}

/// Whether the peak of the sensitivity is at most `limit` and the loop stable for every slope.
///
/// (1 + L) (1 - 1/z) has no pole on or outside the unit circle and tends to 1 for great z, so it has no zero there if it
/// does not wind about 0 along the circle. As 1 + L vanishes for no slope and no frequency, one slope tells for all.
pub(super) fn is_admissible(gains: Gains, slopes: Slopes, points: &[FrequencyPoint], limit: f64) -> bool {
    // At z = 1 it is ki slope > 0.
    let (mut last, mut turned) = (Complex::from(1.0), 0.0);
    for point in points {
        let l = gains.at(point);
        if slopes.min_distance(l) * limit < 1.0 {
            return false;
        }
        let here = (1.0 + l * slopes.max) * point.difference;
        turned += (here * last.conj()).arg();
        last = here;
    }
    turned.abs() < 0.5 * PI
}

/// Peak of the sensitivity over the slopes and frequencies, and the angle per sample where it is.
///
/// A peak between the points is higher than they are, by less than they are apart: so all that come close to the
/// highest are looked at.
pub(super) fn peak(gains: Gains, slopes: Slopes, open: &OpenLoop, points: &[FrequencyPoint]) -> (f64, f64) {
    let sensitivity = |point: &FrequencyPoint| 1.0 / slopes.min_distance(gains.at(point));
    let coarse: Vec<f64> = points.iter().map(sensitivity).collect();
    let last = coarse.len() - 1;
    let highest = coarse.iter().copied().fold(0.0, f64::max);
    let summits = (0..=last).filter(|i| {
        let neighbours = coarse[i.saturating_sub(1)].max(coarse[(i + 1).min(last)]);
        coarse[*i] >= neighbours && coarse[*i] > 0.95 * highest
    });
    let refined = summits.flat_map(|i| {
        let (low, high) = (points[i.saturating_sub(1)].angle, points[(i + 1).min(last)].angle);
        let (angle, found) = golden_section(low, high, |angle| sensitivity(&FrequencyPoint::new(open, angle)));
        [(found, angle), (coarse[i], points[i].angle)]
    });
    refined.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((highest, 0.0))
}
