//! The nearest point within lower bounds, in the metric of a covariance.

use super::covariance::{Covariance, dot};

/// How often the set of unknowns at their bounds may change in one projection; what is left is done at the next one.
const MAX_CHANGES: usize = 10;

/// How often all unknowns on the wrong side may change sides at once without there being fewer of them.
const MAX_FRUITLESS: usize = 3;

/// A pivot below this share of its variance is rounding: unknowns that depend on each other.
const MIN_PIVOT: f64 = 1e-14;

/// Lower bounds of unknowns, which of them hold at present, and the room to find out.
#[derive(Clone, Debug)]
pub(super) struct Bounds {
    /// Minus infinity for an unknown that is free.
    lower: Box<[f64]>,
    at_bound: Box<[bool]>,
    /// The unknowns at their bounds, in order; the first `held` count.
    members: Box<[usize]>,
    held: usize,
    /// The Cholesky factor of their covariance, row by row, each with room for m numbers.
    factor: Box<[f64]>,
    multipliers: Box<[f64]>,
    /// The rows of U of the unknowns at their bounds, and the same times D.
    rows: Box<[f64]>,
    weighted_rows: Box<[f64]>,
    /// D U' times the multipliers.
    pushed: Box<[f64]>,
}

/// sum += factor row.
fn add(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, x) in sum.iter_mut().zip(row) {
        *sum += factor * x;
    }
}

impl Bounds {
    pub(super) fn new(lower: Box<[f64]>) -> Self {
        let m = lower.len();
        Self {
            at_bound: vec![false; m].into(),
            members: vec![0; m].into(),
            held: 0,
            factor: vec![0.0; m * m].into(),
            multipliers: vec![0.0; m].into(),
            rows: vec![0.0; m * m].into(),
            weighted_rows: vec![0.0; m * m].into(),
            pushed: vec![0.0; m].into(),
            lower,
        }
    }

    /// Whether no bound holds: the projection is the estimate itself.
    pub(super) fn idle(&self) -> bool {
        self.held == 0
    }

    /// The unknowns at their bounds.
    pub(super) fn members(&self) -> &[usize] {
        &self.members[..self.held]
    }

    /// Whether numbers are within the bounds.
    pub(super) fn allow(&self, x: &[f64]) -> bool {
        x.iter().zip(&self.lower).all(|(x, lower)| x >= lower)
    }

    /// Makes exactly these unknowns lie at their bounds.
    pub(super) fn restore(&mut self, members: &[usize]) {
        self.at_bound.fill(false);
        for i in members {
            self.at_bound[*i] = self.lower[*i].is_finite();
        }
        self.collect();
    }

    /// Writes to `x` the minimiser of (x - estimate)' P^-1 (x - estimate) over x >= lower.
    ///
    /// Block principal pivoting (Portugal, Judice, Vicente, Math. Comp. 63, 1994), with one change at a time where
    /// blocks gain nothing, which ends from any start. It starts from the unknowns that were at their bounds last time,
    /// so most projections take no change at all. If [`MAX_CHANGES`] do not suffice, `x` is within the bounds but not
    /// nearest, and the next projection goes on from here.
    pub(super) fn project(&mut self, covariance: &Covariance, estimate: &[f64], x: &mut [f64]) {
        let (mut fewest, mut fruitless) = (usize::MAX, 0);
        for _ in 0..MAX_CHANGES {
            self.solve(covariance, estimate, x);
            let wrong = self.wrong(x);
            if wrong == 0 {
                return;
            }
            if wrong < fewest {
                (fewest, fruitless) = (wrong, 0);
            } else {
                fruitless += 1;
            }
            self.change_sides(x, fruitless > MAX_FRUITLESS);
        }
        for (x, lower) in x.iter_mut().zip(&self.lower) {
            *x = x.max(*lower);
        }
    }

    /// The nearest point with the present unknowns at their bounds, and the multipliers that hold them there.
    fn solve(&mut self, covariance: &Covariance, estimate: &[f64], x: &mut [f64]) {
        x.copy_from_slice(estimate);
        if self.held == 0 {
            return;
        }
        self.factorise(covariance);
        self.find_multipliers(estimate);
        // P v = U (D U' v), v being the multipliers at the bounds.
        let m = self.lower.len();
        self.pushed.fill(0.0);
        for (row, multiplier) in self.weighted_rows.chunks_exact(m).zip(&self.multipliers[..self.held]) {
            add(&mut self.pushed, *multiplier, row);
        }
        covariance.add_upper_times(&self.pushed, x);
        for i in &self.members[..self.held] {
            x[*i] = self.lower[*i];
        }
    }

    /// The Cholesky factor of the covariance of the unknowns at their bounds.
    fn factorise(&mut self, covariance: &Covariance) {
        let m = self.lower.len();
        let rows = self.rows.chunks_exact_mut(m).zip(self.weighted_rows.chunks_exact_mut(m));
        for (i, (row, weighted)) in self.members[..self.held].iter().zip(rows) {
            covariance.row(*i, row, weighted);
        }
        for a in 0..self.held {
            let high = self.members[a];
            let (earlier, this) = self.factor.split_at_mut(a * m);
            for b in 0..=a {
                let entry = dot(&self.rows[a * m + high..(a + 1) * m], &self.weighted_rows[b * m + high..(b + 1) * m]);
                if a == b {
                    this[a] = (entry - dot(&this[..a], &this[..a])).max(MIN_PIVOT * entry).sqrt();
                } else {
                    let other = &earlier[b * m..];
                    this[b] = (entry - dot(&this[..b], &other[..b])) / other[b];
                }
            }
        }
    }

    /// Solves for the multipliers: their covariance times them is how far the bounds are from the estimate.
    fn find_multipliers(&mut self, estimate: &[f64]) {
        let m = self.lower.len();
        for (a, row) in self.factor.chunks_exact(m).take(self.held).enumerate() {
            let i = self.members[a];
            self.multipliers[a] = (self.lower[i] - estimate[i] - dot(&row[..a], &self.multipliers[..a])) / row[a];
        }
        for (a, row) in self.factor.chunks_exact(m).enumerate().take(self.held).rev() {
            let (earlier, this) = self.multipliers.split_at_mut(a);
            this[0] /= row[a];
            add(earlier, -this[0], row);
        }
    }

    /// Whether unknown `i` is below its bound, or pulled to it from above; `place` is its place among those at bounds.
    fn is_wrong(&self, x: &[f64], i: usize, place: usize) -> bool {
        if self.at_bound[i] { self.multipliers[place] < 0.0 } else { x[i] < self.lower[i] }
    }

    fn wrong(&self, x: &[f64]) -> usize {
        let mut place = 0;
        let mut count = 0;
        for i in 0..x.len() {
            count += usize::from(self.is_wrong(x, i, place));
            place += usize::from(self.at_bound[i]);
        }
        count
    }

    /// Moves the unknowns on the wrong side to the other one: all of them, or only the last.
    fn change_sides(&mut self, x: &[f64], only_last: bool) {
        let mut place = self.held;
        for i in (0..x.len()).rev() {
            place -= usize::from(self.at_bound[i]);
            if self.is_wrong(x, i, place) {
                self.at_bound[i] = !self.at_bound[i];
                if only_last {
                    break;
                }
            }
        }
        self.collect();
    }

    fn collect(&mut self) {
        self.held = 0;
        for (i, at_bound) in self.at_bound.iter().enumerate() {
            if *at_bound {
                self.members[self.held] = i;
                self.held += 1;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// A covariance after some measurements.
    fn covariance(m: usize, rows: &[f64], variance: f64) -> Covariance {
        let mut covariance = Covariance::new(m, variance);
        for z in rows.chunks_exact(m) {
            covariance.look(z);
            covariance.measure(1.0);
        }
        covariance
    }

    proptest! {
        /// The conditions of Karush, Kuhn and Tucker: within the bounds, pushed only upwards, and only at a bound. The
        /// multipliers are P^-1 (x - estimate), here from the information that the measurements sum to.
        #[test]
        fn a_projection_is_the_nearest_point(
            m in 1_usize..12,
            values in prop::collection::vec(-1.0..1.0_f64, 30 * 12),
            estimate in prop::collection::vec(-1.0..1.0_f64, 12),
            shift in prop::collection::vec(-0.5..0.5_f64, 12),
            start in prop::collection::vec(any::<bool>(), 12),
            free in 0_usize..12,
        ) {
            let rows = &values[..30 * m];
            let p = covariance(m, rows, 1e3);
            let lower: Box<[f64]> = (0..m).map(|i| if i == free { f64::NEG_INFINITY } else { shift[i] * 0.1 }).collect();
            let mut bounds = Bounds::new(lower.clone());
            bounds.restore(&(0..m).filter(|i| start[*i]).collect::<Vec<_>>());
            let mut x = vec![0.0; m];
            for _ in 0..20 {
                bounds.project(&p, &estimate[..m], &mut x);
                prop_assert!(bounds.allow(&x));
            }
            let away: Vec<f64> = x.iter().zip(&estimate).map(|(x, e)| x - e).collect();
            for i in 0..m {
                let along = |z: &[f64]| z[i] * z.iter().zip(&away).map(|(z, a)| z * a).sum::<f64>();
                let push = 1e-3 * away[i] + rows.chunks_exact(m).map(along).sum::<f64>();
                prop_assert!(push >= -1e-9, "{i} is pulled to its bound: {push}");
                prop_assert!(push.abs() <= 1e-9 || x[i] == lower[i], "{i} is pushed at {} over {}", x[i], lower[i]);
            }
        }
    }
}
