//! How far weights and searched parameters may be from the truth.
//!
//! The root of a covariance that allows for mismatches that are alike along the drive: with J the weighted rows about the fit and g_f the
//! sum of J_i e_i over stretch f, X = (J'J)^-1 (g_1, g_2, ...), and X X' is the covariance (Liang and Zeger, Biometrika 73, 13, 1986).
//! Known lengths are independent, each with its own standard deviation.

use faer::Mat;

use crate::algebra::factor::{TriangularFactor, back_substitute};
use crate::places::rows::Rows;
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::validation::stretches;
use crate::places::weighing::Law;
use crate::records::signal::as_f64;

/// Into how many stretches the pairs are cut.
const STRETCHES: usize = 40;

/// A column of which less is left beside the others is not told; it counts as known.
const UNTOLD: f64 = 1e-9;

/// An unknown below this share of the largest is at its bound.
const AT_BOUND: f64 = 1e-12;

/// The root of the covariance: one row for each weight, those beside the operators, then one for each axis.
pub(crate) fn root(search: &PlaceSearch<'_>, found: &FoundPlace, smoothness: f64) -> Mat<f64> {
    let (space, point, weighed) = (&found.space, &found.point, &found.weighed);
    let rows = search.tangent_rows(space, point, &weighed.weights);
    let law = search.law(space, point, smoothness);
    let free = free(found, &law);
    let (free, triangle) = told(search, found, &law, &rows, free);
    let scores = scores(search, found, &law, &rows, &free);
    let solved: Vec<Vec<f64>> = scores.into_iter().map(|score| solve(&triangle, score)).collect();
    let of_unknown = |unknown: usize, column: usize| {
        free.iter().position(|place| *place == unknown).map_or(0.0, |place| solved[column][place])
    };
    let of_weights = |column: usize| {
        let unknowns: Vec<f64> = (0..law.linear).map(|unknown| of_unknown(unknown, column)).collect();
        law.weights(&unknowns)
    };
    let weights: Vec<Vec<f64>> = (0..solved.len()).map(of_weights).collect();
    Mat::from_fn(
        rows.width,
        solved.len(),
        |i, column| {
            if i < law.linear { weights[column][i] } else { of_unknown(i, column) }
        },
    )
}

/// The unknowns between their bounds.
fn free(found: &FoundPlace, law: &Law) -> Vec<usize> {
    let unknowns = law.unknowns_of(&found.weighed.weights);
    let largest = unknowns[..law.columns].iter().copied().fold(0.0, f64::max);
    let weights = (0..law.linear).filter(|j| *j >= law.columns || unknowns[*j] > AT_BOUND * largest);
    let axes = found.space.axes.iter().enumerate().filter(|(_, axis)| {
        let ((low, high), value) = (found.space.bounds(**axis), found.point.get(**axis));
        value > low && value < high
    });
    weights.chain(axes.map(|(number, _)| law.linear + number)).collect()
}

/// Those of them that the rows tell, and the triangle of their columns.
fn told(
    search: &PlaceSearch<'_>,
    found: &FoundPlace,
    law: &Law,
    rows: &Rows,
    mut free: Vec<usize>,
) -> (Vec<usize>, Mat<f64>) {
    loop {
        let mut factor = TriangularFactor::new(free.len());
        let mut row = vec![0.0; rows.width];
        let mut squares = vec![0.0; free.len()];
        let mut push = |row: &[f64]| {
            let chosen: Vec<f64> = free.iter().map(|j| row[*j]).collect();
            squares.iter_mut().zip(&chosen).for_each(|(sum, value)| *sum += value * value);
            factor.push(&chosen);
        };
        for (values, (weight, _)) in rows.iter().zip(search.system.factors(&found.weighed.shares)) {
            law.scaled(values, weight, 0.0, &mut row);
            push(&row);
        }
        law.penalty_rows(rows.width).for_each(|row| push(&row));
        let triangle = factor.finish();
        let untold = (0..free.len()).find(|i| triangle[(*i, *i)].abs() <= UNTOLD * squares[*i].sqrt());
        match untold {
            Some(place) => {
                free.remove(place);
            }
            None => return (free, triangle),
        }
    }
}

/// g_f of every stretch and of every length.
fn scores(search: &PlaceSearch<'_>, found: &FoundPlace, law: &Law, rows: &Rows, free: &[usize]) -> Vec<Vec<f64>> {
    let (system, weighed) = (&search.system, &found.weighed);
    let pairs = system.pairs();
    let count = STRETCHES.min(pairs);
    let correction = if count > 1 { (as_f64(count) / as_f64(count - 1)).sqrt() } else { 1.0 };
    let mut scores = vec![vec![0.0; free.len()]; count];
    let inflation = length_inflation(search, found, free.len());
    let mut row = vec![0.0; rows.width];
    let stretches = stretches(search, count.max(1));
    for (equation, (values, (weight, _))) in rows.iter().zip(system.factors(&weighed.shares)).enumerate() {
        law.scaled(values, weight, 0.0, &mut row);
        match equation.checked_sub(pairs) {
            None => {
                let distance = weighed.mismatches[equation] * system.pair_deviations[equation];
                let error = correction * weight * distance;
                let score = stretches[equation].and_then(|stretch| scores.get_mut(stretch));
                for (sum, j) in score.into_iter().flatten().zip(free) {
                    *sum += row[*j] * error;
                }
            }
            Some(number) => {
                let error = inflation * weight * system.length_deviations[number];
                scores.push(free.iter().map(|j| row[*j] * error).collect());
            }
        }
    }
    scores
}

/// Lengths that say nothing of themselves tell how uncertain they are if there are so many more than unknowns.
const TELLING: usize = 5;

/// By what factor the lengths miss the model more than they say themselves; 1 if they do not. Where none says how uncertain it is, by what
/// factor they miss it more or less than is taken for that.
fn length_inflation(search: &PlaceSearch<'_>, found: &FoundPlace, unknowns: usize) -> f64 {
    let errors = found.weighed.length_errors.iter().zip(&search.system.length_deviations);
    let squares: f64 = errors.map(|(error, deviation)| (error / deviation).powi(2)).sum();
    let freedom = found.weighed.length_errors.len().saturating_sub(unknowns).max(1);
    let lengths = search.system.given.lengths;
    let is_told = lengths.len() >= unknowns + TELLING && lengths.iter().all(|known| known.std.is_none());
    (squares / as_f64(freedom)).sqrt().max(if is_told { 0.0 } else { 1.0 })
}

/// Solves R'R x = g.
fn solve(triangle: &Mat<f64>, mut score: Vec<f64>) -> Vec<f64> {
    for i in 0..score.len() {
        let head: f64 = (0..i).map(|j| triangle[(j, i)] * score[j]).sum();
        score[i] = (score[i] - head) / triangle[(i, i)];
    }
    back_substitute(triangle.as_ref(), &mut score);
    score
}
