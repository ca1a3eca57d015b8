//! Where a search may begin beside an oscillator without hysteresis: with friction that bends over a share of the
//! motion, then slides.
//!
//! The measured motion y drives an operator of Dahl's kind, z' = (1 - sgn(y') z / s) y', of a stiffness of 1. Through
//! the best linear oscillator G (c, k) all that is left is linear: y = b G u - (c' - c) G y' - (k' - k) G y - a G z.

use faer::Mat;
use hysteresis_control::oscillator::{Hold, tables};
use hysteresis_core::{Duhem, DuhemForward, MAX_KNOTS, Process};

use super::data::{Data, Part};
use super::pass::{Excitation, Point};
use crate::algebra::bounded::solve;

/// The s that are tried, as shares of the largest motion.
const SHARES: [f64; 8] = [1.5, 0.8, 0.45, 0.25, 0.14, 0.08, 0.045, 0.025];

/// So many of them, those that miss least, are where a search begins.
const STARTS: usize = 2;

/// The points with friction that miss least, about the best linear oscillator. None if the motion of that leaves all
/// bounds.
pub(super) fn starts(data: &Data, linear: &Point, hold: Hold, sub_steps: usize) -> Option<Vec<Point>> {
    let y: Vec<f64> = data.y.iter().map(|y| y - linear.offset).collect();
    let reach = y.iter().fold(0.0, |reach: f64, y| reach.max(y.abs()));
    let [_, damping, stiffness] = linear.parameters[..] else { return None };
    let filter = Point { knots: Vec::new(), parameters: vec![1.0, damping, stiffness], offset: 0.0 };
    let through = |input: &[f64], hold| Excitation::new(data, input, hold, sub_steps).states(&filter);
    let (of_drive, of_position) = (through(&data.u, hold)?, through(&y, Hold::BandLimited)?);
    let mut found: Vec<(f64, Point)> = SHARES
        .iter()
        .filter_map(|share| {
            let operator = Duhem::from_bouc_wen(1.0, 1.0 / (share * reach), 1.0, 0.0).ok()?;
            let of_friction = through(&hysteresis(&operator, &y, data.periods > 1), Hold::BandLimited)?;
            let column = |i: usize, k: usize| match i {
                0 => of_drive[k].position,
                1 => -of_position[k].velocity,
                2 => -of_position[k].position,
                3 => -of_friction[k].position,
                _ => 1.0,
            };
            let ([gain, more_damping, stiffer, friction, _], squares) = fitted(data, &y, column);
            let (damping, stiffness) = ((damping + more_damping).max(0.0), stiffness + stiffer);
            let runs = friction > 0.0 && stiffness > 0.0 && gain * linear.parameters[0] > 0.0;
            let [knots, rising, falling] =
                tables(&operator).map(|table| table.into_iter().map(|number| friction * number).collect::<Vec<_>>());
            let parameters = [&[gain, damping, stiffness][..], &rising, &falling].concat();
            runs.then_some((squares, Point { knots, parameters, offset: linear.offset }))
        })
        .collect();
    found.sort_by(|one, other| one.0.total_cmp(&other.0));
    Some(found.into_iter().take(STARTS).map(|(_, point)| point).collect())
}

/// z over a motion. A period comes again.
fn hysteresis(operator: &Duhem<MAX_KNOTS>, y: &[f64], repeats: bool) -> Vec<f64> {
    let mut z = DuhemForward::new(*operator);
    if repeats {
        for y in y {
            z.step(*y);
        }
    }
    y.iter().map(|y| z.step(*y)).collect()
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
