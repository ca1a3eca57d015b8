//! Where a search may begin beside an oscillator without hysteresis: with friction that bends over a share of the
//! motion, then slides.
//!
//! The measured motion y drives an operator of Dahl's kind, z' = (1 - sgn(y') z / s) y', of a stiffness of 1. Through
//! the best linear oscillator G (c, k) all that is left is linear: y = b G u - (c' - c) G y' - (k' - k) G y - a G z.

use faer::Mat;
use hysteresis_control::oscillator::Hold;

use super::data::{Data, Part};
use super::pass::Point;
use crate::algebra::bounded::solve;
use crate::records::signal::as_f64;

/// The s that are tried, as shares of the largest motion.
const SHARES: [f64; 8] = [1.5, 0.8, 0.45, 0.25, 0.14, 0.08, 0.045, 0.025];

/// So many of them, those that miss least, are where a search begins.
const STARTS: usize = 2;

/// Steps of the linear oscillator in a sample.
const SUB_STEPS: usize = 4;

/// What f falls to where friction slides, as a share of its largest value.
const SLIDES: f64 = 1e-3;

/// The points with friction that miss least, about the best linear oscillator.
pub(super) fn starts(data: &Data, linear: &Point, hold: Hold) -> Vec<Point> {
    let y: Vec<f64> = data.y.iter().map(|y| y - linear.offset).collect();
    let reach = y.iter().fold(0.0, |reach: f64, y| reach.max(y.abs()));
    let filter = Filter { damping: linear.parameters[1], stiffness: linear.parameters[2], data };
    let (of_drive, of_position) = (filter.response(&data.u, hold), filter.response(&y, Hold::BandLimited));
    let mut found: Vec<(f64, Point)> = SHARES
        .iter()
        .filter_map(|share| {
            let bend = share * reach;
            let of_friction = filter.response(&dahl(&y, bend, data.periods > 1), Hold::BandLimited);
            let column = |i: usize, k: usize| match i {
                0 => of_drive[k].0,
                1 => -of_position[k].1,
                2 => -of_position[k].0,
                3 => -of_friction[k].0,
                _ => 1.0,
            };
            let (numbers, squares) = fitted(data, &y, column);
            let [gain, damping, stiffness, friction, _] = numbers;
            let (damping, stiffness) = (linear.parameters[1] + damping, linear.parameters[2] + stiffness);
            let runs = friction > 0.0 && stiffness > 0.0 && gain * linear.parameters[0] > 0.0;
            runs.then(|| (squares, with_friction([gain, damping.max(0.0), stiffness], friction, bend, linear.offset)))
        })
        .collect();
    found.sort_by(|one, other| one.0.total_cmp(&other.0));
    found.into_iter().take(STARTS).map(|(_, point)| point).collect()
}

/// Least squares over the fitted samples; what multiplies the friction is not below 0.
fn fitted(data: &Data, y: &[f64], column: impl Fn(usize, usize) -> f64) -> ([f64; 5], f64) {
    let rows: Vec<usize> = data.samples(Part::Fitted).collect();
    let norms: [f64; 5] =
        std::array::from_fn(|i| rows.iter().map(|k| column(i, *k).powi(2)).sum::<f64>().sqrt().max(f64::MIN_POSITIVE));
    let matrix = Mat::from_fn(rows.len(), norms.len(), |row, i| column(i, rows[row]) / norms[i]);
    let target: Vec<f64> = rows.iter().map(|k| y[*k]).collect();
    let free = (f64::NEG_INFINITY, f64::INFINITY);
    let bounds = [free, free, free, (0.0, f64::INFINITY), free];
    let solution = solve(matrix.as_ref(), &target, &bounds, &[0, 1, 2, 3, 4]);
    (std::array::from_fn(|i| solution.x[i] / norms[i]), solution.squares)
}

/// f+ falls from twice the stiffness of the friction to nothing where it slides, f- the other way round.
fn with_friction([gain, damping, stiffness]: [f64; 3], friction: f64, bend: f64, offset: f64) -> Point {
    let (force, slides) = (friction * bend, 2.0 * SLIDES * friction);
    let falls = [2.0 * friction, friction, slides];
    let rises = [slides, friction, 2.0 * friction];
    let parameters = [&[gain, damping, stiffness][..], &falls, &rises].concat();
    Point { knots: vec![-force, 0.0, force], parameters, offset }
}

/// z over a motion, with a stiffness of 1 that bends over `bend`. A period comes again.
fn dahl(y: &[f64], bend: f64, repeats: bool) -> Vec<f64> {
    let (mut z, mut last) = (0.0, y.first().copied().unwrap_or_default());
    let mut all = Vec::new();
    for _ in 0..=usize::from(repeats) {
        all.clear();
        for now in y {
            let end = if *now > last { bend } else { -bend };
            z = end + (z - end) * (-(now - last).abs() / bend).exp();
            last = *now;
            all.push(z);
        }
    }
    all
}

/// A linear oscillator with a gain of 1.
struct Filter<'a> {
    damping: f64,
    stiffness: f64,
    data: &'a Data,
}

impl Filter<'_> {
    /// Position and velocity at every sample, by the trapezoidal rule. A period comes again.
    fn response(&self, input: &[f64], hold: Hold) -> Vec<(f64, f64)> {
        let (c, k, h) = (self.damping, self.stiffness, self.data.dt / as_f64(SUB_STEPS));
        let inertia = 1.0 + 0.5 * h * c + 0.25 * h * h * k;
        let (mut x, mut v) = (0.0, 0.0);
        let mut a = input.first().copied().unwrap_or_default();
        let mut all = Vec::new();
        for _ in 0..=usize::from(self.data.periods > 1) {
            all.clear();
            for (place, from) in input.iter().enumerate() {
                all.push((x, v));
                let to = if hold == Hold::Zero { from } else { input.get(place + 1).unwrap_or(&input[0]) };
                for step in 1..=SUB_STEPS {
                    let force = from + (to - from) * as_f64(step) / as_f64(SUB_STEPS);
                    let (ahead, faster) = (x + h * v + 0.25 * h * h * a, v + 0.5 * h * a);
                    let next = (force - c * faster - k * ahead) / inertia;
                    (x, v, a) = (ahead + 0.25 * h * h * next, faster + 0.5 * h * next, next);
                }
            }
        }
        all
    }
}
