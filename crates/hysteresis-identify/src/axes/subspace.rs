//! The best linear dynamics by the subspace method MOESP with past drives and positions as instruments.
//!
//! After M. Verhaegen, "Identification of the deterministic part of MIMO state space models given in innovations form
//! from input-output data", Automatica 30(1), 61-74, 1994.

use faer::Mat;
use faer::prelude::SolveLstsq;

use super::data::{Data, Stretch};
use super::point::{Point, blocks};
use crate::algebra::factor::TriangularFactor;

/// The largest order that is looked for.
const MOST_STATES: usize = 40;

/// At least so many samples in a window.
const SHORTEST: usize = 12;

/// Samples in a window.
fn window(positions: usize) -> usize {
    (MOST_STATES / positions + 2).max(SHORTEST)
}

/// With fewer samples there is nothing to find.
pub(super) fn fewest_samples(drives: usize, positions: usize, stretches: usize) -> usize {
    let window = window(positions);
    1 + 2 * window * (drives + positions) + 2 * window * stretches
}

/// What the positions behind a moment tell of the state there: one column for each state, the most important first.
pub(super) struct Observability {
    matrix: Mat<f64>,
    positions: usize,
    drives: usize,
}

impl Observability {
    /// From all windows of the stretches. None if there are too few samples.
    pub(super) fn new(data: &Data, stretches: &[Stretch]) -> Option<Self> {
        let (m, p) = (data.drives, data.positions);
        let window = window(p);
        let (behind, ahead) = (window * (m + p), 1 + window * m);
        let columns = ahead + behind + window * p;
        let mut factor = TriangularFactor::new(columns);
        let mut count = 0;
        for (record, range) in stretches {
            let (u, y) = &data.records[*record];
            for k in range.start + window..(range.end + 1).saturating_sub(window) {
                let (past, future) = (k - window..k, k..k + window);
                let of = |signal: &[f64], width: usize, part: &std::ops::Range<usize>| {
                    signal[part.start * width..part.end * width].to_vec()
                };
                let row = [vec![1.0], of(u, m, &future), of(u, m, &past), of(y, p, &past), of(y, p, &future)].concat();
                factor.push(&row);
                count += 1;
            }
        }
        if count < columns {
            return None;
        }
        let triangle = factor.finish();
        let seen = Mat::from_fn(window * p, behind, |i, j| triangle[(ahead + j, ahead + behind + i)]);
        let svd = seen.thin_svd().ok()?;
        let values = svd.S().column_vector();
        let matrix = Mat::from_fn(window * p, window * p, |i, j| svd.U()[(i, j)] * values[j].max(0.0).sqrt());
        Some(Self { matrix, positions: p, drives: m })
    }

    /// The orders that it can tell.
    pub(super) fn most_states(&self) -> usize {
        (self.matrix.nrows() - self.positions).min(MOST_STATES)
    }

    /// A and C of an order, B and D being 0.
    pub(super) fn dynamics(&self, order: usize) -> Option<Point> {
        let (rows, p) = (self.matrix.nrows(), self.positions);
        let from = self.matrix.get(..rows - p, ..order);
        let to = self.matrix.get(p.., ..order);
        let a = from.qr().solve_lstsq(to);
        let c = Mat::from_fn(p, order, |i, j| self.matrix[(i, j)]);
        let (a, c) = blocks(&a, &c)?;
        Some(Point::of_dynamics(a, c, self.drives, p))
    }
}
