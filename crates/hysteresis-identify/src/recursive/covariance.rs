//! The covariance of recursive least squares as P = U D U', U unit upper triangular, D diagonal.

/// The covariance in factors, and the room to change them in.
///
/// After Bierman (Factorization Methods for Discrete Sequential Estimation, 1977, chapter V): D stays positive by
/// construction, so rounding never makes P indefinite, which a plain P does after some thousand samples.
#[derive(Clone, Debug)]
pub(super) struct Covariance {
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
    pub(super) fn new(m: usize, variance: f64) -> Self {
        let zeros: Box<[f64]> = vec![0.0; m].into();
        let diagonal = vec![variance; m].into();
        Self { upper: vec![0.0; m * m].into(), diagonal, seen: zeros.clone(), direction: zeros }
    }

    /// Back to `variance` times the identity.
    pub(super) fn reset(&mut self, variance: f64) {
        self.upper.fill(0.0);
        self.diagonal.fill(variance);
    }

    fn size(&self) -> usize {
        self.diagonal.len()
    }

    /// The leverage z' P z of a regressor, which is then at hand.
    pub(super) fn look(&mut self, z: &[f64]) -> f64 {
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
    pub(super) fn measure(&mut self, noise: f64) {
        self.fold(0, noise);
    }

    /// A measurement of unknown `i` alone with this `noise`.
    pub(super) fn measure_one(&mut self, i: usize, noise: f64) {
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
    pub(super) fn gain(&self) -> &[f64] {
        &self.direction
    }

    /// P <- P / forgetting.
    pub(super) fn forget(&mut self, forgetting: f64) {
        for d in &mut self.diagonal {
            *d /= forgetting;
        }
    }

    /// One entry of P.
    pub(super) fn entry(&self, i: usize, j: usize) -> f64 {
        let m = self.size();
        let (low, high) = (i.min(j), i.max(j));
        let at_high = if low == high { 1.0 } else { self.upper[high * m + low] };
        let beyond: f64 =
            (high + 1..m).map(|k| self.upper[k * m + low] * self.diagonal[k] * self.upper[k * m + high]).sum();
        at_high * self.diagonal[high] + beyond
    }

    /// Column j of U above the diagonal, and D there.
    pub(super) fn column(&self, j: usize) -> (&[f64], f64) {
        let start = j * self.size();
        (&self.upper[start..start + j], self.diagonal[j])
    }

    /// Exchanges the unknowns j and j + 1.
    ///
    /// With the two rows of U exchanged, the two columns of U are combined anew, so that U is triangular again and
    /// their share of U D U' stays: the new D are sums and products of positive numbers.
    pub(super) fn exchange(&mut self, j: usize) {
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
    pub(super) fn factors(&self) -> (Vec<f64>, Vec<f64>) {
        let m = self.size();
        let upper = self.upper.chunks_exact(m).enumerate().flat_map(|(j, column)| column[..j].iter().copied());
        (upper.collect(), self.diagonal.to_vec())
    }

    /// Continues from factors of the right lengths.
    pub(super) fn restore(&mut self, mut upper: &[f64], diagonal: &[f64]) {
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
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
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
