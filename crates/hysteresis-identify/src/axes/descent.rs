//! Levenberg-Marquardt steps: each is the shortest of its kind, so what the data do not tell stays where it is.

use faer::linalg::solvers::Solve;
use faer::{Mat, Side};

use super::data::{Data, Stretch};
use super::pass::{Normal, linearise, missed};
use super::point::{Free, Point};
use crate::records::signal::as_f64;

/// The damping of the first step, beside columns of unit length, and of the lightest.
const FIRST: f64 = 1e-3;
const LEAST: f64 = 1e-8;

/// A step that lowers the squares by a smaller share is one of the last.
const SMALL: f64 = 2e-4;

/// So many small steps in turn end a descent, and so many failures to find any.
const SMALL_STEPS: usize = 2;
const TRIES: usize = 12;

/// Where a descent ended.
#[derive(Clone)]
pub(super) struct Fit {
    pub(super) point: Point,
    pub(super) squares: f64,
    pub(super) passes: usize,
}

/// Whether a point may be gone to: stable, and with operators also where they are steepest and flattest.
fn may_run(point: &Point, data: &Data) -> bool {
    // The interval does not matter here.
    point.is_stable() && point.stage(data, 1.0).is_ok()
}

/// The best point near one, in at most so many steps. None if the motion leaves all bounds at the start, or if no point
/// on the way may be gone to.
///
/// Where points may run is bounded by poles that hardly ring, and the way to a good one often lies across: stiffness
/// goes from A to the operators. So only the end has to be one, unless the way back from beyond is not found.
pub(super) fn descend(start: &Point, data: &Data, stretches: &[Stretch], free: Free, steps: usize) -> Option<Fit> {
    let across = walk(start, data, stretches, (free, steps), |_| true)?;
    if may_run(&across.fit.point, data) {
        return Some(across.fit);
    }
    let within = walk(&across.runs?, data, stretches, (free, steps), |point| may_run(point, data))?;
    let passes = across.fit.passes + within.fit.passes;
    Some(Fit { passes, ..within.fit })
}

/// Where a walk ended, and its last point that may run.
struct Walk {
    fit: Fit,
    runs: Option<Point>,
}

/// Steps that lower the squares, at points that are allowed.
fn walk(
    start: &Point,
    data: &Data,
    stretches: &[Stretch],
    (free, steps): (Free, usize),
    allowed: impl Fn(&Point) -> bool,
) -> Option<Walk> {
    let mut normal = linearise(start, data, stretches, free)?;
    let mut here = Fit { point: start.clone(), squares: normal.squares, passes: 1 };
    let mut runs = may_run(start, data).then(|| start.clone());
    let (mut damping, mut small) = (FIRST, 0);
    for _ in 0..steps {
        let mut found = None;
        for _ in 0..TRIES {
            let there = step(&normal, damping).map(|step| here.point.moved(free, &step));
            if let Some(point) = there.filter(&allowed) {
                here.passes += 1;
                let all = missed(&point, data, stretches);
                let squares = all.map_or(f64::NAN, |all| all.iter().flatten().map(|e| e * e).sum::<f64>());
                if squares < here.squares {
                    found = Some((point, squares));
                    break;
                }
            }
            damping *= 6.0;
        }
        let Some((point, squares)) = found else { break };
        damping = (damping / 10.0).max(LEAST);
        small = if here.squares - squares < SMALL * here.squares { small + 1 } else { 0 };
        (here.point, here.squares) = (point, squares);
        if may_run(&here.point, data) {
            runs = Some(here.point.clone());
        }
        if small >= SMALL_STEPS {
            break;
        }
        here.passes += 1;
        normal = linearise(&here.point, data, stretches, free)?;
    }
    Some(Walk { fit: here, runs })
}

/// The damped step, in columns of unit length.
fn step(normal: &Normal, damping: f64) -> Option<Vec<f64>> {
    let count = normal.vector.len();
    let scale = |i: usize| {
        let square = normal.matrix[(i, i)];
        if square > 0.0 { 1.0 / square.sqrt() } else { 0.0 }
    };
    let scales: Vec<f64> = (0..count).map(scale).collect();
    let matrix = Mat::from_fn(count, count, |i, j| {
        let entry = if i >= j { normal.matrix[(i, j)] * scales[i] * scales[j] } else { 0.0 };
        // A number that moves nothing stays.
        if i == j { entry + if scales[i] > 0.0 { damping } else { 1.0 } } else { entry }
    });
    let vector = Mat::from_fn(count, 1, |i, _| normal.vector[i] * scales[i]);
    let solution = matrix.llt(Side::Lower).ok()?.solve(&vector);
    let step: Vec<f64> = (0..count).map(|i| solution[(i, 0)] * scales[i]).collect();
    step.iter().all(|s| s.is_finite()).then_some(step)
}

/// The root of the mean of squares of each position, in its standard deviations.
pub(super) fn errors(missed: &[Vec<f64>], positions: usize) -> Vec<f64> {
    let rms = |i: usize| {
        let values = || missed.iter().flat_map(|part| part[i..].iter().step_by(positions));
        (values().map(|e| e * e).sum::<f64>() / as_f64(values().count())).sqrt()
    };
    (0..positions).map(rms).collect()
}
