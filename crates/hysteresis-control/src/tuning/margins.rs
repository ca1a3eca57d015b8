//! How robust a loop is.

use core::f64::consts::TAU;

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::feedback::{Gains, Slopes, peak};
use super::open_loop::OpenLoop;
use super::response::FrequencyPoint;
use super::search::bisection;

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
