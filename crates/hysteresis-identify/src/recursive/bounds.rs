//! The nearest point within lower bounds, in the metric of a covariance.

use super::covariance::{Covariance, dot};

/// How many unknowns may change sides in one projection; what is left is done at the next one.
const MAX_CHANGES: usize = 3;

/// Unknowns with lower bounds in an order of their own: first those that are free, then those that lie at their bounds.
///
/// So the last block of P = U D U' is that of the bounds, in factors already, and a projection is two substitutions.
#[derive(Clone, Debug)]
pub(super) struct Bounds {
    /// Which unknown stands at each place, and the other way round.
    order: Box<[usize]>,
    places: Box<[usize]>,
    /// The bound of each place: minus infinity for an unknown that has none.
    lower: Box<[f64]>,
    /// How many are free.
    free: usize,
    /// How strongly each place is pushed up by its bound.
    multipliers: Box<[f64]>,
}

impl Bounds {
    pub(super) fn new(lower: Box<[f64]>) -> Self {
        let order: Box<[usize]> = (0..lower.len()).collect();
        Self { places: order.clone(), free: lower.len(), multipliers: vec![0.0; lower.len()].into(), order, lower }
    }

    /// The unknowns in their order.
    pub(super) fn order(&self) -> &[usize] {
        &self.order
    }

    /// Where an unknown stands.
    pub(super) fn place(&self, unknown: usize) -> usize {
        self.places[unknown]
    }

    /// How many unknowns are free.
    pub(super) fn free(&self) -> usize {
        self.free
    }

    /// Whether numbers are within the bounds.
    pub(super) fn allow(&self, x: &[f64]) -> bool {
        x.iter().zip(&self.lower).all(|(x, lower)| x >= lower)
    }

    /// All unknowns free, in their natural order.
    pub(super) fn reset(&mut self) {
        for place in 0..self.order.len() {
            while self.order[place] != place {
                let other = self.order[place];
                self.order.swap(place, other);
                self.lower.swap(place, other);
            }
            self.places[place] = place;
        }
        self.free = self.order.len();
    }

    /// The nearest point where unknowns do not depend on each other.
    pub(super) fn clamp(&self, estimate: &[f64], x: &mut [f64]) {
        for ((x, estimate), lower) in x.iter_mut().zip(estimate).zip(&self.lower) {
            *x = estimate.max(*lower);
        }
    }

    /// Whether every unknown that is held has a bound to be held at.
    pub(super) fn holds_only_bounded(&self) -> bool {
        self.lower[self.free..].iter().all(|lower| lower.is_finite())
    }

    /// Takes over a permutation of the unknowns and how many of them are free, everything else being in that order.
    pub(super) fn restore(&mut self, order: &[usize], free: usize) {
        let bound: Box<[f64]> = order.iter().map(|unknown| self.lower[self.places[*unknown]]).collect();
        for (place, unknown) in order.iter().enumerate() {
            self.places[*unknown] = place;
        }
        self.order.copy_from_slice(order);
        self.lower.copy_from_slice(&bound);
        self.free = free;
    }

    /// Writes to `x` the minimiser of (x - estimate)' P^-1 (x - estimate) over x >= lower: whether it came to it.
    ///
    /// From the unknowns that were at their bounds last time, the last one on the wrong side changes sides until there is
    /// none, which ends from any start (Murty, Linear Algebra and its Applications 9, 1974). Most projections take no
    /// change; if [`MAX_CHANGES`] do not suffice, the next one goes on from here.
    pub(super) fn project(
        &mut self,
        covariance: &mut Covariance,
        estimate: &mut [f64],
        others: [&mut [f64]; 2],
        x: &mut [f64],
    ) -> bool {
        let [one, other] = others;
        for change in 0..=MAX_CHANGES {
            self.solve(covariance, estimate, x);
            let Some(place) = self.last_wrong(x) else { return true };
            if change < MAX_CHANGES {
                self.change_sides(place, |j| {
                    covariance.exchange(j);
                    for numbers in [&mut *estimate, &mut *one, &mut *other] {
                        numbers.swap(j, j + 1);
                    }
                });
            }
        }
        false
    }

    /// The nearest point with the present unknowns at their bounds, and the multipliers that hold them there.
    fn solve(&mut self, covariance: &Covariance, estimate: &[f64], x: &mut [f64]) {
        let (free, m) = (self.free, x.len());
        x.copy_from_slice(estimate);
        // x = estimate + U v: v solves the lower block, and what it adds to the upper one is added on the way.
        for j in (free..m).rev() {
            let v = self.lower[j] - x[j];
            let (column, d) = covariance.column(j);
            for (x, u) in x[..j].iter_mut().zip(column) {
                *x += u * v;
            }
            x[j] = self.lower[j];
            self.multipliers[j] = v / d.max(f64::MIN_POSITIVE);
        }
        // v = D U' multiplier.
        for j in free..m {
            let (column, _) = covariance.column(j);
            self.multipliers[j] -= dot(&column[free..], &self.multipliers[free..j]);
        }
    }

    /// The place of the last unknown that is below its bound, or pulled to it from above.
    fn last_wrong(&self, x: &[f64]) -> Option<usize> {
        let free = x.iter().zip(&self.lower).take(self.free).map(|(x, lower)| x < lower);
        let held = self.multipliers[self.free..].iter().map(|multiplier| *multiplier < 0.0);
        let wrong = free.chain(held).enumerate().filter(|(_, wrong)| *wrong);
        wrong.map(|(place, _)| place).max_by_key(|place| self.order[*place])
    }

    /// Moves the unknown at `place` past the border between free and held, neighbour by neighbour.
    fn change_sides(&mut self, mut place: usize, mut exchange: impl FnMut(usize)) {
        let goes_up = place < self.free;
        if goes_up {
            self.free -= 1;
        }
        while place != self.free {
            let j = if goes_up { place } else { place - 1 };
            exchange(j);
            self.order.swap(j, j + 1);
            self.lower.swap(j, j + 1);
            place = if goes_up { place + 1 } else { j };
        }
        if !goes_up {
            self.free += 1;
        }
        for (place, unknown) in self.order.iter().enumerate() {
            self.places[*unknown] = place;
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        /// The conditions of Karush, Kuhn and Tucker: within the bounds, pushed only upwards, and only at a bound. The
        /// push is P^-1 (x - estimate), here from the information that the measurements sum to.
        #[test]
        fn a_projection_is_the_nearest_point(
            m in 1_usize..12,
            values in prop::collection::vec(-1.0..1.0_f64, 30 * 12),
            estimate in prop::collection::vec(-1.0..1.0_f64, 12),
            next in prop::collection::vec(-1.0..1.0_f64, 12),
            shift in prop::collection::vec(-0.05..0.05_f64, 12),
            free in 0_usize..12,
        ) {
            let rows = &values[..30 * m];
            let mut p = Covariance::new(m, 1e3);
            for z in rows.chunks_exact(m) {
                p.look(z);
                p.measure(1.0);
            }
            let lower: Box<[f64]> = (0..m).map(|i| if i == free { f64::NEG_INFINITY } else { shift[i] }).collect();
            let mut bounds = Bounds::new(lower.clone());
            // The second one starts from where the first one ended.
            for estimate in [&estimate[..m], &next[..m]] {
                let mut numbers: Vec<f64> = bounds.order().iter().map(|i| estimate[*i]).collect();
                let (mut one, mut other, mut x) = (vec![0.0; m], vec![0.0; m], vec![0.0; m]);
                let mut rounds = 0;
                while !bounds.project(&mut p, &mut numbers, [&mut one, &mut other], &mut x) {
                    rounds += 1;
                    prop_assert!(rounds < 1000);
                }
                prop_assert!(bounds.allow(&x));
                let found: Vec<f64> = (0..m).map(|i| x[bounds.place(i)]).collect();
                let away: Vec<f64> = found.iter().zip(estimate).map(|(x, e)| x - e).collect();
                for i in 0..m {
                    let along = |z: &[f64]| z[i] * z.iter().zip(&away).map(|(z, a)| z * a).sum::<f64>();
                    let push = 1e-3 * away[i] + rows.chunks_exact(m).map(along).sum::<f64>();
                    prop_assert!(push >= -1e-9, "{i} is pulled to its bound: {push}");
                    prop_assert!(push.abs() <= 1e-9 || found[i] == lower[i], "{i} is pushed at {}", found[i]);
                }
            }
        }
    }
}
