//! How far weights and searched parameters may be from the truth.
//!
//! The root of a covariance that allows for mismatches that are alike: with J the weighted rows about the fit and g_f
//! the sum of J_i e_i over cluster f, X = (J'J)^-1 (g_1, g_2, ...), and X X' is the covariance (Liang and Zeger,
//! Biometrika 73, 13, 1986). Mismatches are alike on neighbouring lines, where images move; and at one place of all
//! lines, where windows of a match see the same. So pairs are clustered along the time and along the drive, finely and
//! coarsely, and the clusters that leave positions least certain count: clusters that cut through what is alike claim
//! too little. Known lengths are independent, each with its own standard deviation.

use faer::Mat;

use crate::algebra::factor::{TriangularFactor, back_substitute};
use crate::fit::tangent::Tangent;
use crate::places::given::{Given, PlacePair};
use crate::places::rows::{Rows, value_at};
use crate::places::search::{FoundPlace, PlaceSearch};
use crate::places::weighing::Law;
use crate::records::course::{Course, turns};
use crate::records::signal::{as_f64, mean};

/// Into how many clusters the pairs are cut, each time.
const CLUSTERS: [usize; 3] = [10, 20, 40];

/// How many samples of a drive speak for its positions.
const POSITIONS: usize = 200;

/// A column of which less is left beside the others is not told; it counts as known.
const UNTOLD: f64 = 1e-9;

/// An unknown below this share of the largest is at its bound.
const AT_BOUND: f64 = 1e-12;

/// How far a fit may be from the truth.
pub(crate) struct Uncertainty {
    /// The root of the covariance: one row for each weight, those beside the operators, then one for each axis.
    pub(crate) root: Mat<f64>,
    /// The same for what is a part of a prediction alone: weights, the amplitude of a Duhem operator, axes.
    pub(crate) own: Mat<f64>,
    /// The standard error of the positions along a drive, rms, the largest of all drives.
    pub(crate) positions: f64,
}

impl Uncertainty {
    /// About a fit with this tangent.
    pub(crate) fn new(search: &PlaceSearch<'_>, found: &FoundPlace, smoothness: f64, tangent: &Tangent) -> Self {
        let (space, point, weighed) = (&found.space, &found.point, &found.weighed);
        let rows = search.tangent_rows(space, point, &weighed.weights);
        let law = search.law(space, point, smoothness);
        let (free, triangle) = told(search, found, &law, &rows, free(found, &law));
        let gradients = gradients(&search.system.given, tangent);
        let of_clusters = |clusters: Vec<usize>| {
            let scores = scores(search, found, (&law, &rows), &free, &clusters);
            let root = root(&law, &free, &triangle, scores, rows.width);
            // The derivative by the thermal lag is no part of a tangent.
            let count = tangent.columns + tangent.slopes.len();
            let place = |i: usize| if i < tangent.columns { i } else { i + space.not_of_stage() };
            let own = Mat::from_fn(count, root.ncols(), |i, k| root[(place(i), k)]);
            let positions = gradients.iter().map(|drive| deviation_along(drive, &own)).fold(0.0, f64::max);
            Self { root, own, positions }
        };
        let all = clusterings(&search.system.given).into_iter().map(&of_clusters);
        let widest = all.reduce(|widest, other| if other.positions > widest.positions { other } else { widest });
        // Of a few pairs each is a cluster of its own; without pairs there is none.
        widest.unwrap_or_else(|| of_clusters((0..search.system.pairs()).collect()))
    }
}

/// The cluster of every pair: of those next to each other in time, or in the drive; neither without pairs.
fn clusterings(given: &Given<'_>) -> Vec<Vec<usize>> {
    let number = |pair: &PlacePair| as_f64(pair.drive);
    let drive_at = |pair: &PlacePair, instant| value_at(given.drives[pair.drive], instant);
    let middle = |pair: &PlacePair| 0.5 * (drive_at(pair, pair.first) + drive_at(pair, pair.second));
    let by_time: Vec<(f64, f64)> = given.pairs.iter().map(|pair| (number(pair), pair.earlier())).collect();
    let by_drive: Vec<(f64, f64)> = given.pairs.iter().map(|pair| (middle(pair), pair.earlier())).collect();
    let of = |keys: &Vec<(f64, f64)>, count: usize| {
        let mut order: Vec<usize> = (0..keys.len()).collect();
        order.sort_by(|a, b| keys[*a].partial_cmp(&keys[*b]).unwrap_or(std::cmp::Ordering::Equal));
        let mut clusters = vec![0; keys.len()];
        order.iter().enumerate().for_each(|(rank, place)| clusters[*place] = rank * count / keys.len());
        clusters
    };
    let counts = CLUSTERS.into_iter().filter(|count| *count <= given.pairs.len());
    counts.flat_map(|count| [of(&by_time, count), of(&by_drive, count)]).collect()
}

/// What the position at some samples of each drive changes by with the columns of a tangent and its searched
/// parameters: about its mean where there are pairs, which tell no offset, and from the first sample of the first drive
/// where there are lengths alone.
fn gradients(given: &Given<'_>, tangent: &Tangent) -> Vec<Vec<Vec<f64>>> {
    let width = tangent.columns + tangent.slopes.len();
    let mut first: Option<Vec<f64>> = None;
    let of_drive = |drive: &&[f64]| {
        let last = drive.len() - 1;
        let count = POSITIONS.min(last);
        let samples: Vec<usize> = (0..=count).map(|number| number * last / count).collect();
        let course = Course::Some { rows: samples.clone(), turns: Some(turns(drive, 0.0)) };
        let mut rows = tangent.rows(drive, given.dt, Some(&course));
        let at = |sample: &usize| {
            let mut row = vec![0.0; width];
            rows.write(*sample, &mut row);
            row
        };
        let mut all: Vec<Vec<f64>> = samples.iter().map(at).collect();
        let first = first.get_or_insert_with(|| all[0].clone());
        let of_mean = |i: usize| mean(&all.iter().map(|row| row[i]).collect::<Vec<_>>());
        let zero = if given.pairs.is_empty() { first.clone() } else { (0..width).map(of_mean).collect() };
        all.iter_mut().flatten().zip(zero.iter().cycle()).for_each(|(value, zero)| *value -= zero);
        all
    };
    given.drives.iter().map(of_drive).collect()
}

/// Where a model is at some samples of each drive, but for an offset of each.
pub(crate) fn positions(given: &Given<'_>, found: &FoundPlace) -> Vec<Vec<f64>> {
    let tangent = found.space.tangent(&found.point, None);
    let linear = &found.weighed.weights;
    let amplitude = found.space.amplitude(linear);
    let of_stage = || linear[..tangent.columns].iter().chain(std::iter::once(&amplitude));
    let at = |row: &Vec<f64>| row.iter().zip(of_stage()).map(|(value, weight)| value * weight).sum();
    gradients(given, &tangent).iter().map(|drive| drive.iter().map(at).collect()).collect()
}

/// The standard error of positions with these gradients, rms.
fn deviation_along(gradients: &[Vec<f64>], root: &Mat<f64>) -> f64 {
    let along = |row: &Vec<f64>, k: usize| row.iter().enumerate().map(|(i, slope)| slope * root[(i, k)]).sum::<f64>();
    let square = |row: &Vec<f64>| (0..root.ncols()).map(|k| along(row, k).powi(2)).sum::<f64>();
    mean(&gradients.iter().map(square).collect::<Vec<_>>()).sqrt()
}

/// One row for each weight, those beside the operators, then one for each axis.
fn root(law: &Law, free: &[usize], triangle: &Mat<f64>, scores: Vec<Vec<f64>>, width: usize) -> Mat<f64> {
    let solved: Vec<Vec<f64>> = scores.into_iter().map(|score| solve(triangle, score)).collect();
    let of_unknown = |unknown: usize, column: usize| {
        free.iter().position(|place| *place == unknown).map_or(0.0, |place| solved[column][place])
    };
    let of_weights = |column: usize| {
        let unknowns: Vec<f64> = (0..law.linear).map(|unknown| of_unknown(unknown, column)).collect();
        law.weights(&unknowns)
    };
    let weights: Vec<Vec<f64>> = (0..solved.len()).map(of_weights).collect();
    Mat::from_fn(
        width,
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
    let (space, point) = (&found.space, &found.point);
    let unknowns = law.unknowns_of(&found.weighed.weights);
    // As far as one may go: a weight to zero, an axis by the stride of the search.
    let reach = |j: usize| match j.checked_sub(law.linear) {
        None => unknowns[j].abs(),
        Some(axis) => space.stride(space.axes[axis]).max(point.get(space.axes[axis]).abs()),
    };
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
        let moves = |i: usize| squares[i].sqrt() * reach(free[i]);
        let most = (0..free.len()).map(moves).fold(0.0, f64::max);
        let says_nothing = |i: usize| triangle[(i, i)].abs() <= UNTOLD * squares[i].sqrt() || moves(i) <= UNTOLD * most;
        let untold = (0..free.len()).find(|i| says_nothing(*i));
        match untold {
            Some(place) => {
                free.remove(place);
            }
            None => return (free, triangle),
        }
    }
}

/// g_f of every cluster and of every length.
fn scores(
    search: &PlaceSearch<'_>,
    found: &FoundPlace,
    (law, rows): (&Law, &Rows),
    free: &[usize],
    clusters: &[usize],
) -> Vec<Vec<f64>> {
    let (system, weighed) = (&search.system, &found.weighed);
    let pairs = system.pairs();
    let count = clusters.iter().max().map_or(0, |last| last + 1);
    let correction = if count > 1 { (as_f64(count) / as_f64(count - 1)).sqrt() } else { 1.0 };
    let mut scores = vec![vec![0.0; free.len()]; count];
    let inflation = length_inflation(search, found, free.len());
    let mut row = vec![0.0; rows.width];
    for (equation, (values, (weight, _))) in rows.iter().zip(system.factors(&weighed.shares)).enumerate() {
        law.scaled(values, weight, 0.0, &mut row);
        match equation.checked_sub(pairs) {
            None => {
                let distance = weighed.mismatches[equation] * system.pair_deviations[equation];
                let error = correction * weight * distance;
                let score = clusters.get(equation).and_then(|cluster| scores.get_mut(*cluster));
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

/// Lengths that say nothing of themselves tell how uncertain they are if there are so many more than unknowns that they
/// tell.
const TELLING: usize = 5;

/// By what factor the lengths miss the model more than they say themselves; 1 if they do not. Where none says how
/// uncertain it is, by what factor they miss it more or less than is taken for that.
fn length_inflation(search: &PlaceSearch<'_>, found: &FoundPlace, unknowns: usize) -> f64 {
    let shares = &found.weighed.shares.of_lengths;
    let errors = found.weighed.length_errors.iter().zip(&search.system.length_deviations);
    let squares: f64 = errors.zip(shares).map(|((error, deviation), share)| share * (error / deviation).powi(2)).sum();
    let kept = shares.iter().filter(|share| **share > 0.0).count();
    let unknowns = search.system.told_by_lengths(unknowns);
    let freedom = kept.saturating_sub(unknowns).max(1);
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
