//! The frequency response of a plant, at as many frequencies as it takes.

use core::f64::consts::PI;

use nalgebra::Complex;

use super::open_loop::OpenLoop;

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
