//! Gauss-Newton in a box-shaped trust region, from a point to the best one near it.

use faer::Mat;

use super::data::Part;
use super::pass::{Excitation, Linearised, Point};
use crate::algebra::bounded::solve;
use crate::fit::descent::{FIRST_RADIUS, Patience, trusted};
use crate::records::signal::{as_f64, rms};

/// How many passes over the record a descent may take.
const PASSES: usize = 60;

/// Where a descent ended.
#[derive(Clone)]
pub(super) struct Fit {
    pub(super) point: Point,
    pub(super) at: Linearised,
    pub(super) passes: usize,
}

/// How large a parameter is, as the steps see it, and what it may be.
struct Axis {
    scale: f64,
    bounds: (f64, f64),
}

/// Descends from a point. `stiffness` is that of the best linear oscillator: f stays above a ten-thousandth of it.
/// None if the motion at the start leaves all bounds.
pub(super) fn descend(excitation: &Excitation<'_>, start: &Point, stiffness: f64, part: Part) -> Option<Fit> {
    let mut here = Fit { point: start.clone(), at: excitation.linearise(start, part)?, passes: 1 };
    let axes = axes(start, stiffness, &excitation.data.y);
    let mut radius = FIRST_RADIUS;
    let patience = Patience { gain: 1e-2 / as_f64(here.at.residual.len()), passes: PASSES };
    while here.passes < patience.passes {
        let (step, promised) = step(&here, &axes, radius);
        let size = step.iter().fold(0.0, |size: f64, s| size.max(s.abs()));
        if !patience.is_worth(promised, here.at.squares, size) {
            break;
        }
        let mut point = here.point.clone();
        for (parameter, (s, axis)) in numbers(&mut point).zip(step.iter().zip(&axes)) {
            *parameter = (*parameter + s * axis.scale).clamp(axis.bounds.0, axis.bounds.1);
        }
        here.passes += 1;
        let there = excitation.linearise(&point, part);
        let decrease = there.as_ref().map_or(f64::NAN, |there| here.at.squares - there.squares);
        radius = trusted(radius, size, decrease, promised);
        if let Some(at) = there.filter(|_| decrease > 0.0) {
            here = Fit { point, at, passes: here.passes };
        }
    }
    Some(here)
}

fn numbers(point: &mut Point) -> impl Iterator<Item = &mut f64> {
    point.parameters.iter_mut().chain(std::iter::once(&mut point.offset))
}

fn axes(start: &Point, stiffness: f64, y: &[f64]) -> Vec<Axis> {
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    let gain = start.parameters[0];
    // A gain of the other sign would be another oscillator.
    let gain_bounds = if gain > 0.0 { (1e-3 * gain, f64::INFINITY) } else { (f64::NEG_INFINITY, 1e-3 * gain) };
    let mut axes = vec![
        Axis { scale: gain.abs(), bounds: gain_bounds },
        Axis { scale: start.parameters[1].max(0.05 * stiffness.sqrt()), bounds: (0.0, f64::INFINITY) },
        Axis { scale: stiffness, bounds: (0.0, f64::INFINITY) },
    ];
    let slope = || Axis { scale: stiffness, bounds: (1e-4 * stiffness, f64::INFINITY) };
    axes.extend(start.parameters.iter().skip(3).map(|_| slope()));
    axes.push(Axis { scale: rms(y), bounds: free });
    axes
}

/// The step to the least squares of what is linear, in scales within the radius, and what it promises.
fn step(here: &Fit, axes: &[Axis], radius: f64) -> (Vec<f64>, f64) {
    let jacobian = &here.at.jacobian;
    let scaled = Mat::from_fn(jacobian.nrows(), jacobian.ncols(), |i, j| jacobian[(i, j)] * axes[j].scale);
    let values = here.point.parameters.iter().chain([&here.point.offset]);
    let bounds: Vec<(f64, f64)> = values
        .zip(axes)
        .map(|(value, axis)| {
            let (low, high) = ((axis.bounds.0 - value) / axis.scale, (axis.bounds.1 - value) / axis.scale);
            (low.max(-radius).min(0.0), high.min(radius).max(0.0))
        })
        .collect();
    let free: Vec<usize> = (0..axes.len()).collect();
    let found = solve(scaled.as_ref(), &here.at.residual, &bounds, &free);
    (found.x, here.at.squares - found.squares)
}
