//! The covariance of recursive least squares as P = U D U', U unit upper triangular, D diagonal; and the nearest point
//! within lower bounds in its metric.

/// The covariance in factors, and the room to change them in.
///
/// After Bierman (Factorization Methods for Discrete Sequential Estimation, 1977, chapter V): D stays positive by
/// construction, so rounding never makes P indefinite, which a plain P does after some thousand samples.
#[derive(Clone, Debug)]
pub(crate) struct Covariance {
    /// The columns of U above the diagonal, one after the other, each with room for m numbers.
    upper: Box<[f64]>,
    diagonal: Box<[f64]>,
    /// U' z of the regressor z at hand.
    seen: Box<[f64]>,
    /// P z times what the last measurement left unscaled: the gain is this over `innovation`.
    direction: Box<[f64]>,
}

impl Covariance {
    /// `variance` times the identity of size m.
    pub(crate) fn new(m: usize, variance: f64) -> Self {
        let zeros: Box<[f64]> = vec![0.0; m].into();
        let diagonal = vec![variance; m].into();
        Self { upper: vec![0.0; m * m].into(), diagonal, seen: zeros.clone(), direction: zeros }
    }

    /// Back to `variance` times the identity.
    pub(crate) fn reset(&mut self, variance: f64) {
        self.upper.fill(0.0);
        self.diagonal.fill(variance);
    }

    fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// The leverage z' P z of a regressor, which is then at hand.
    pub(crate) fn look(&mut self, z: &[f64]) -> f64 {
        let m = self.size();
        let mut leverage = 0.0;
        for (j, column) in self.upper.chunks_exact(m).enumerate() {
            let seen = z[j] + dot(&column[..j], &z[..j]);
            self.seen[j] = seen;
            leverage += self.diagonal[j] * seen * seen;
        }
        leverage
    }

    /// P <- P - P z z' P / (noise + z' P z) for the regressor at hand: its `noise` is the variance of the measurement.
    /// The gain P z / (noise + z' P z) is left in [`gain`](Self::gain).
    pub(crate) fn measure(&mut self, noise: f64) {
        self.fold(0, noise);
    }

    /// A measurement of unknown `i` alone with this `noise`.
    pub(crate) fn measure_one(&mut self, i: usize, noise: f64) {
        let m = self.size();
        self.seen[i] = 1.0;
        for j in i + 1..m {
            self.seen[j] = self.upper[j * m + i];
        }
        self.fold(i, noise);
    }

    /// Bierman's update, the columns before `first` seeing nothing of the regressor.
    fn fold(&mut self, first: usize, noise: f64) {
        let m = self.size();
        let mut innovation = noise;
        self.direction[..first].fill(0.0);
        for j in first..m {
            let (seen, weighted) = (self.seen[j], self.diagonal[j] * self.seen[j]);
            let (before, after) = (innovation, innovation + seen * weighted);
            self.diagonal[j] *= before / after;
            let shift = -seen / before;
            let column = &mut self.upper[j * m..j * m + j];
            for (u, direction) in column.iter_mut().zip(&mut self.direction[..j]) {
                let old = *u;
                *u += *direction * shift;
                *direction += old * weighted;
            }
            self.direction[j] = weighted;
            innovation = after;
        }
        for direction in &mut self.direction {
            *direction /= innovation;
        }
    }

    /// The gain of the last measurement.
    pub(crate) fn gain(&self) -> &[f64] {
        &self.direction
    }

    /// P <- P / forgetting.
    pub(crate) fn forget(&mut self, forgetting: f64) {
        for d in &mut self.diagonal {
            *d /= forgetting;
        }
    }

    /// One entry of P.
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        let m = self.size();
        let (low, high) = (i.min(j), i.max(j));
        let at_high = if low == high { 1.0 } else { self.upper[high * m + low] };
        let beyond: f64 =
            (high + 1..m).map(|k| self.upper[k * m + low] * self.diagonal[k] * self.upper[k * m + high]).sum();
        at_high * self.diagonal[high] + beyond
    }

    /// Column j of U above the diagonal, and D there.
    pub(crate) fn column(&self, j: usize) -> (&[f64], f64) {
        let start = j * self.size();
        (&self.upper[start..start + j], self.diagonal[j])
    }

    /// Exchanges the unknowns j and j + 1.
    ///
    /// With the two rows of U exchanged, the two columns of U are combined anew, so that U is triangular again and
    /// their share of U D U' stays: the new D are sums and products of positive numbers.
    pub(crate) fn exchange(&mut self, j: usize) {
        let m = self.size();
        let (left, right) = self.upper.split_at_mut((j + 1) * m);
        let (one, other) = (&mut left[j * m..], right);
        let (u, d, e) = (other[j], self.diagonal[j], self.diagonal[j + 1]);
        let sum = d + e * u * u;
        let (share, rest) = if sum > 0.0 { (d / sum, e * u / sum) } else { (1.0, 0.0) };
        for (one, other) in one[..j].iter_mut().zip(&mut other[..j]) {
            (*one, *other) = (*other - u * *one, share * *one + rest * *other);
        }
        other[j] = rest;
        self.diagonal[j] = share * e;
        self.diagonal[j + 1] = sum;
        for column in self.upper.chunks_exact_mut(m).skip(j + 2) {
            column.swap(j, j + 1);
        }
    }

    /// U above the diagonal, column by column, and D: what [`restore`](Self::restore) takes.
    pub(crate) fn factors(&self) -> (Vec<f64>, Vec<f64>) {
        let m = self.size();
        let upper = self.upper.chunks_exact(m).enumerate().flat_map(|(j, column)| column[..j].iter().copied());
        (upper.collect(), self.diagonal.to_vec())
    }

    /// Continues from factors of the right lengths.
    pub(crate) fn restore(&mut self, mut upper: &[f64], diagonal: &[f64]) {
        let m = self.size();
        for (j, column) in self.upper.chunks_exact_mut(m).enumerate() {
            let (here, rest) = upper.split_at(j);
            column[..j].copy_from_slice(here);
            upper = rest;
        }
        self.diagonal.copy_from_slice(diagonal);
    }
}

/// In four sums, so that the compiler works on several products at a time.
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let (a, b) = (a.chunks_exact(4), b.chunks_exact(4));
    let rest: f64 = a.remainder().iter().zip(b.remainder()).map(|(a, b)| a * b).sum();
    let mut sums = [0.0; 4];
    for (a, b) in a.zip(b) {
        for k in 0..4 {
            sums[k] += a[k] * b[k];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3]) + rest
}

/// How many unknowns may change sides in one projection; what is left is done at the next one.
const MAX_CHANGES: usize = 3;

/// Unknowns with lower bounds in an order of their own: first those that are free, then those that lie at their bounds.
///
/// So the last block of P = U D U' is that of the bounds, in factors already, and a projection is two substitutions.
#[derive(Clone, Debug)]
pub(crate) struct Bounds {
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
    pub(crate) fn new(lower: Box<[f64]>) -> Self {
        let order: Box<[usize]> = (0..lower.len()).collect();
        Self { places: order.clone(), free: lower.len(), multipliers: vec![0.0; lower.len()].into(), order, lower }
    }

    /// The unknowns in their order.
    pub(crate) fn order(&self) -> &[usize] {
        &self.order
    }

    /// Where an unknown stands.
    pub(crate) fn place(&self, unknown: usize) -> usize {
        self.places[unknown]
    }

    /// How many unknowns are free.
    pub(crate) fn free(&self) -> usize {
        self.free
    }

    /// Whether numbers are within the bounds.
    pub(crate) fn allow(&self, x: &[f64]) -> bool {
        x.iter().zip(&self.lower).all(|(x, lower)| x >= lower)
    }

    /// All unknowns free, in their natural order.
    pub(crate) fn reset(&mut self) {
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
    pub(crate) fn clamp(&self, estimate: &[f64], x: &mut [f64]) {
        for ((x, estimate), lower) in x.iter_mut().zip(estimate).zip(&self.lower) {
            *x = estimate.max(*lower);
        }
    }

    /// Whether every unknown that is held has a bound to be held at.
    pub(crate) fn holds_only_bounded(&self) -> bool {
        self.lower[self.free..].iter().all(|lower| lower.is_finite())
    }

    /// Takes over a permutation of the unknowns and how many of them are free, everything else being in that order.
    pub(crate) fn restore(&mut self, order: &[usize], free: usize) {
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
    /// From the unknowns that were at their bounds last time, the last one on the wrong side changes sides until there
    /// is none, which ends from any start (Murty, Linear Algebra and its Applications 9, 1974). Most projections take
    /// no change; if [`MAX_CHANGES`] do not suffice, the next one goes on from here.
    pub(crate) fn project(
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
