//! A loop of given gains over frequency: its response, its sensitivity, whether it is stable, margins and bandwidths.

use core::f64::consts::{FRAC_1_SQRT_2, PI, TAU};

use hysteresis_core::Sections;
use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::search::{bisection, golden_section};
use crate::filters;
use crate::linear::PulseTransfer;

/// The filters of the feedback, and the dynamics behind the hysteresis.
#[derive(Clone, Debug)]
pub(super) struct OpenLoop {
    pub(super) filters: Sections,
    pub(super) transfer: PulseTransfer,
}

impl OpenLoop {
    pub(super) fn at(&self, z: Complex<f64>) -> Complex<f64> {
        let plant = self.transfer.at(z);
        // Without filters every bit is that of the plant.
        if self.filters.as_slice().is_empty() { plant } else { plant * filters::response(self.filters.as_slice(), z) }
    }
}

/// The greatest change of the response from one frequency to the next, relative to the greater of the two.
const STEP: f64 = 0.04;

/// Below this share of the static gain nothing is resolved.
const FLOOR: f64 = 1e-3;

/// How often an interval is halved at most.
const HALVINGS: u32 = 24;

/// Angles per sample between decades of the first frequencies.
const PER_DECADE: i32 = 24;

/// How many decades below half the sampling rate the first frequency lies.
const DECADES: i32 = 7;

/// Filters and plant at one frequency.
#[derive(Clone, Copy, Debug)]
pub(super) struct FrequencyPoint {
    /// w T, from 0 to pi.
    pub(super) angle: f64,
    pub(super) plant: Complex<f64>,
    /// 1 - 1 / z: what an integrator divides by.
    pub(super) difference: Complex<f64>,
}

impl FrequencyPoint {
    pub(super) fn new(open: &OpenLoop, angle: f64) -> Self {
        // 1 - exp(-i angle) without cancellation.
        let half = 0.5 * angle;
        let difference = Complex::from_polar(2.0 * half.sin(), 0.5 * PI - half);
        Self { angle, plant: open.at(Complex::cis(angle)), difference }
    }
}

/// The response from very low frequencies to half the sampling rate, so dense that it nowhere changes by more than 4 %
/// between neighbours, nor turns by more.
pub(super) fn response(open: &OpenLoop, static_gain: f64) -> Vec<FrequencyPoint> {
    let angles = (0..=DECADES * PER_DECADE).rev();
    let first = angles.map(|i| PI * 10.0_f64.powf(-f64::from(i) / f64::from(PER_DECADE)));
    let mut points: Vec<FrequencyPoint> = Vec::new();
    for angle in first {
        let point = FrequencyPoint::new(open, angle);
        match points.last().copied() {
            None => points.push(point),
            Some(last) => refine(open, (last, point), FLOOR * static_gain, HALVINGS, &mut points),
        }
    }
    points
}

/// Appends what lies between, and the second of the points.
fn refine(
    open: &OpenLoop,
    (from, to): (FrequencyPoint, FrequencyPoint),
    floor: f64,
    halvings: u32,
    points: &mut Vec<FrequencyPoint>,
) {
    let (a, b) = (from.plant, to.plant);
    if halvings > 0 && (a - b).norm() > STEP * a.norm().max(b.norm()).max(floor) {
        let middle = FrequencyPoint::new(open, 0.5 * (from.angle + to.angle));
        refine(open, (from, middle), floor, halvings - 1, points);
        refine(open, (middle, to), floor, halvings - 1, points);
    } else {
        points.push(to);
    }
}

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
/// (1 + L) (1 - 1/z) has no pole on or outside the unit circle and tends to 1 for great z, so it has no zero there if
/// it does not wind about 0 along the circle. As 1 + L vanishes for no slope and no frequency, one slope tells for all.
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

/// How robust a loop is at one slope of the hysteresis.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Margins {
    /// The slope, in output per input.
    pub slope: f64,
    /// The factor by which the gain may grow until the loop oscillates: 1 / |L| where L is real and negative.
    pub gain_margin: f64,
    /// How many degrees the phase may lag more, the least over all frequencies with |L| = 1; infinite without any.
    pub phase_margin: f64,
    /// The highest frequency in Hz with |L| = 1; 0 without any.
    pub crossover: f64,
    /// The peak of |S|, S = 1 / (1 + L).
    pub peak_sensitivity: f64,
    /// Where that peak is, in Hz.
    pub peak_frequency: f64,
}

/// The margins of the loop with one slope.
pub(super) fn margins(gains: Gains, slope: f64, open: &OpenLoop, points: &[FrequencyPoint], dt: f64) -> Margins {
    let at = |point: &FrequencyPoint| gains.at(point) * slope;
    let exactly = |a: &FrequencyPoint, b: &FrequencyPoint, f: &dyn Fn(Complex<f64>) -> f64| {
        let angle = bisection(a.angle, b.angle, |angle| f(at(&FrequencyPoint::new(open, angle))));
        (angle, at(&FrequencyPoint::new(open, angle)))
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
    let (peak_sensitivity, peak_angle) = peak(gains, Slopes { min: slope, max: slope }, open, points);
    let hertz = |angle: f64| angle / (TAU * dt);
    let (crossover, peak_frequency) = (hertz(crossover), hertz(peak_angle));
    Margins { slope, gain_margin, phase_margin, crossover, peak_sensitivity, peak_frequency }
}

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
