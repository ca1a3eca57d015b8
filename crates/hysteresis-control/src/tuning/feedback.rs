//! A loop of given gains: its sensitivity and whether it is stable.

use core::f64::consts::{PI, TAU};

use nalgebra::Complex;

use super::Margins;
use super::response::Point;
use crate::linear::PulseTransfer;

/// Proportional and integral gain, in drive per position and per position and sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) kp: f64,
    pub(super) ki: f64,
}

/// Slopes from the least to the greatest.
#[derive(Clone, Copy, Debug)]
pub(super) struct Slopes {
    pub(super) min: f64,
    pub(super) max: f64,
}

impl Gains {
    /// L / slope at a frequency.
    fn at(self, point: &Point) -> Complex<f64> {
        (self.kp + self.ki / point.difference) * point.plant
    }
}

impl Slopes {
    /// The least |1 + s l| over the slopes s: a parabola in s.
    fn min_distance(self, l: Complex<f64>) -> f64 {
        let nearest = (-l.re / l.norm_sqr()).clamp(self.min, self.max);
        (1.0 + l * nearest).norm()
    }
}

/// Whether the peak of the sensitivity is at most `limit` and the loop stable for every slope.
///
/// (1 + L) (1 - 1/z) has no pole on or outside the unit circle and tends to 1 for great z, so it has no zero there if it
/// does not wind about 0 along the circle. As 1 + L vanishes for no slope and no frequency, one slope tells for all.
pub(super) fn is_admissible(gains: Gains, slopes: Slopes, points: &[Point], limit: f64) -> bool {
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
pub(super) fn peak(gains: Gains, slopes: Slopes, transfer: &PulseTransfer, points: &[Point]) -> (f64, f64) {
    let sensitivity = |point: &Point| 1.0 / slopes.min_distance(gains.at(point));
    let coarse: Vec<f64> = points.iter().map(sensitivity).collect();
    let last = coarse.len() - 1;
    let highest = coarse.iter().copied().fold(0.0, f64::max);
    let summits = (0..=last).filter(|i| {
        let neighbours = coarse[i.saturating_sub(1)].max(coarse[(i + 1).min(last)]);
        coarse[*i] >= neighbours && coarse[*i] > 0.95 * highest
    });
    let refined = summits.flat_map(|i| {
        let (low, high) = (points[i.saturating_sub(1)].angle, points[(i + 1).min(last)].angle);
        let (angle, found) = golden_section(low, high, |angle| sensitivity(&Point::new(transfer, angle)));
        [(found, angle), (coarse[i], points[i].angle)]
    });
    refined.max_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((highest, 0.0))
}

/// The margins of the loop with one slope.
pub(super) fn margins(gains: Gains, slope: f64, transfer: &PulseTransfer, points: &[Point], dt: f64) -> Margins {
    let at = |point: &Point| gains.at(point) * slope;
    let exactly = |a: &Point, b: &Point, f: &dyn Fn(Complex<f64>) -> f64| {
        let angle = bisection(a.angle, b.angle, |angle| f(at(&Point::new(transfer, angle))));
        (angle, at(&Point::new(transfer, angle)))
    };
    let (mut gain_margin, mut phase_margin, mut crossover) = (f64::INFINITY, f64::INFINITY, 0.0);
    for pair in points.windows(2) {
        let (a, b) = (at(&pair[0]), at(&pair[1]));
        if (a.norm() > 1.0) != (b.norm() > 1.0) {
            let (angle, l) = exactly(&pair[0], &pair[1], &|l| l.norm() - 1.0);
            phase_margin = f64::min(phase_margin, (-l).arg().abs().to_degrees());
            crossover = angle;
        }
        if (a.im > 0.0) != (b.im > 0.0) && a.re.min(b.re) < 0.0 {
            let (_, l) = exactly(&pair[0], &pair[1], &|l| l.im);
            if l.re < 0.0 && l.re > -1.0 {
                gain_margin = gain_margin.min(-1.0 / l.re);
            }
        }
    }
    // At half the sampling rate L is real.
    if let Some(l) = points.last().map(at)
        && l.re < 0.0
    {
        gain_margin = gain_margin.min(-1.0 / l.re);
    }
    let (peak_sensitivity, peak_angle) = peak(gains, Slopes { min: slope, max: slope }, transfer, points);
    let hertz = |angle: f64| angle / (TAU * dt);
    let (crossover, peak_frequency) = (hertz(crossover), hertz(peak_angle));
    Margins { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency }
}

/// The highest of a function that rises and then falls, and where.
pub(super) fn golden_section(low: f64, high: f64, f: impl Fn(f64) -> f64) -> (f64, f64) {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut low, mut high) = (low, high);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut fa, mut fb) = (f(a), f(b));
    for _ in 0..60 {
        if fa < fb {
            (low, a, fa) = (a, b, fb);
            b = low + share * (high - low);
            fb = f(b);
        } else {
            (high, b, fb) = (b, a, fa);
            a = high - share * (high - low);
            fa = f(a);
        }
    }
    if fa < fb { (b, fb) } else { (a, fa) }
}

/// Where a function changes its sign between two points at which it has different ones.
fn bisection(low: f64, high: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rises = f(high) > 0.0;
    let (mut low, mut high) = (low, high);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        *(if (f(middle) > 0.0) == rises { &mut high } else { &mut low }) = middle;
    }
    0.5 * (low + high)
}
