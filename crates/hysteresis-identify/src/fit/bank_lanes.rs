//! The operators of a bank over a block of samples, eight at once.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{Simd, SimdBase, SimdFloat};

use super::bank::OperatorBank;
use super::eight::{Lanes, SimdLoop, dispatch, eights, load, splat, sum};

/// So many samples make a block: what is done with it stays in the nearest cache.
pub(crate) const BLOCK: usize = 32;

/// Above so many runs a block takes both bounds at every sample: what they save is less than what their turns cost.
const MOST_RUNS: usize = BLOCK / 4;

/// Successive samples of an input at which the same bounds can move an operator.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Run {
    /// The sample behind its last one.
    end: usize,
    bounds: Bounds,
}

/// What can move an operator. A rising input only raises lo, and z is below hi already; below zero lo is x - rc, as rc <= r. Likewise
/// of a falling one, as rb <= ra.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Bounds {
    Both,
    RisingBelow,
    RisingAbove,
    FallingBelow,
    FallingAbove,
}

/// What the operators are shown, block by block.
#[derive(Debug)]
pub(crate) struct Runs {
    /// The last sample of the block before.
    last: Option<f64>,
    runs: Vec<Run>,
}

impl Runs {
    pub(crate) fn new() -> Self {
        Self { last: None, runs: Vec::with_capacity(BLOCK) }
    }

    /// Those of the next block.
    pub(crate) fn take(&mut self, xs: &[f64]) {
        self.runs.clear();
        let Some(end) = xs.last() else { return };
        // Before the first sample no operator is where it may be.
        let mut last = self.last.unwrap_or(f64::NAN);
        for (number, x) in xs.iter().enumerate() {
            let bounds = match (*x >= last, *x <= last) {
                (true, _) if *x <= 0.0 => Bounds::RisingBelow,
                (true, _) => Bounds::RisingAbove,
                (_, true) if *x >= 0.0 => Bounds::FallingAbove,
                (_, true) => Bounds::FallingBelow,
                _ => Bounds::Both,
            };
            last = *x;
            match self.runs.last_mut() {
                Some(run) if run.bounds == bounds => run.end = number + 1,
                _ => self.runs.push(Run { end: number + 1, bounds }),
            }
        }
        if self.runs.len() > MOST_RUNS {
            self.runs.clear();
            self.runs.push(Run { end: xs.len(), bounds: Bounds::Both });
        }
        self.last = Some(*end);
    }
}

/// The operators of a bank, from z = 0.
#[derive(Debug)]
pub(crate) struct BankLanes {
    thresholds: Vec<Thresholds>,
    z: Vec<Lanes>,
}

/// Of eight operators.
#[derive(Clone, Copy, Debug)]
struct Thresholds {
    r: Lanes,
    ra: Lanes,
    rb: Lanes,
    rc: Lanes,
}

impl BankLanes {
    pub(crate) fn new(bank: &OperatorBank) -> Self {
        let [r, ra, rb, rc] = bank.all_thresholds().map(eights);
        let thresholds: Vec<_> =
            (0..r.len()).map(|i| Thresholds { r: r[i], ra: ra[i], rb: rb[i], rc: rc[i] }).collect();
        let z = vec![[0.0; 8]; thresholds.len()];
        Self { thresholds, z }
    }

    /// How many eights of operators there are.
    pub(crate) fn eights(&self) -> usize {
        self.z.len()
    }

    /// z of every operator for every sample of a block, the first eight of them at all samples, then the next: bit for bit those of the
    /// core.
    pub(crate) fn put_out(&mut self, xs: &[f64], runs: &Runs, z: &mut [Lanes]) {
        dispatch(PutOut { lanes: self, xs, runs: &runs.runs, out: z });
    }
}

struct PutOut<'a> {
    lanes: &'a mut BankLanes,
    xs: &'a [f64],
    runs: &'a [Run],
    out: &'a mut [Lanes],
}

impl SimdLoop for PutOut<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let eights = self.lanes.thresholds.iter().zip(&mut self.lanes.z);
        for ((thresholds, state), out) in eights.zip(self.out.chunks_exact_mut(BLOCK)) {
            let [r, ra, rb, rc] =
                [&thresholds.r, &thresholds.ra, &thresholds.rb, &thresholds.rc].map(|t| load(simd, t));
            let (zero, mut z, mut first) = (splat(simd, 0.0), load(simd, state), 0);
            for run in self.runs {
                let samples = self.xs[first..run.end].iter().zip(&mut out[first..run.end]);
                first = run.end;
                match run.bounds {
                    Bounds::RisingBelow => {
                        for (x, out) in samples {
                            z = z.max(splat(simd, *x) - rc);
                            *out = z.into();
                        }
                    }
                    Bounds::RisingAbove => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            z = z.max((x - r).max((x - rc).min(zero)));
                            *out = z.into();
                        }
                    }
                    Bounds::FallingAbove => {
                        for (x, out) in samples {
                            z = z.min(splat(simd, *x) + rb);
                            *out = z.into();
                        }
                    }
                    Bounds::FallingBelow => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            z = z.min((x + ra).min((x + rb).max(zero)));
                            *out = z.into();
                        }
                    }
                    Bounds::Both => {
                        for (x, out) in samples {
                            let x = splat(simd, *x);
                            let lo = (x - r).max((x - rc).min(zero));
                            let hi = (x + ra).min((x + rb).max(zero));
                            z = lo.max(hi.min(z));
                            *out = z.into();
                        }
                    }
                }
            }
            *state = z.into();
        }
    }
}

/// Weights of operators, one for each, or one for its output above zero and one for that below.
#[derive(Debug)]
pub(crate) struct WeightLanes {
    above: Vec<Lanes>,
    below: Vec<Lanes>,
}

impl WeightLanes {
    /// For so many operators.
    pub(crate) fn new(weights: &[f64], operators: usize) -> Self {
        let (above, below) = weights.split_at(operators.min(weights.len()));
        Self { above: eights(above), below: eights(below) }
    }

    /// The weighted sums of outputs, sample by sample.
    pub(crate) fn sums(&self, z: &[Lanes], sums: &mut [f64]) {
        dispatch(Weigh { weights: self, z, sums });
    }
}

struct Weigh<'a> {
    weights: &'a WeightLanes,
    z: &'a [Lanes],
    sums: &'a mut [f64],
}

impl SimdLoop for Weigh<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let WeightLanes { above, below } = self.weights;
        let zero = splat(simd, 0.0);
        for (k, place) in self.sums.iter_mut().enumerate() {
            let mut total = zero;
            if below.is_empty() {
                for (weight, z) in above.iter().zip(self.z.chunks_exact(BLOCK)) {
                    total = load(simd, weight).mul_add(load(simd, &z[k]), total);
                }
            } else {
                for ((above, below), z) in above.iter().zip(below).zip(self.z.chunks_exact(BLOCK)) {
                    let z = load(simd, &z[k]);
                    total = load(simd, above).mul_add(z.max(zero), total);
                    total = load(simd, below).mul_add(z.min(zero), total);
                }
            }
            *place = sum(total);
        }
    }
}

#[cfg(test)]
mod tests {
    use hysteresis_core::Ratios;
    use proptest::prelude::*;

    use super::super::eight::LANES;
    use super::*;

    fn steps() -> impl Strategy<Value = Vec<f64>> {
        // Smooth ways and jumps: both kinds of blocks.
        let smooth = (0.05..1.5_f64, 1.0..12.0_f64)
            .prop_map(|(rate, size)| (0..90).map(|k| size * (rate * f64::from(k) / 8.0).sin()).collect());
        prop_oneof![smooth, prop::collection::vec(prop_oneof![-10.0..10.0_f64, Just(1.0), Just(0.0)], 1..90)]
    }

    proptest! {
        /// Bit for bit the operators of the bank, which are those of the core, whatever the blocks; and their weighted sums.
        #[test]
        fn equals_the_bank(
            xs in steps(),
            r in prop::collection::vec(0.0..8.0_f64, 1..20),
            (ra, rb, rc) in (0.0..2.0_f64, 0.0..=1.0_f64, 0.0..=1.0_f64),
            block in 1..=BLOCK,
        ) {
            let bank = OperatorBank::from_ratios(&r, Ratios { ra, rb: rb * ra, rc });
            let (mut lanes, mut runs) = (BankLanes::new(&bank), Runs::new());
            let weights: Vec<f64> = (1_u32..).take(2 * r.len()).map(|i| 1.0 / f64::from(i)).collect();
            let (above, below) = weights.split_at(r.len());
            let (one, split) = (WeightLanes::new(above, r.len()), WeightLanes::new(&weights, r.len()));
            let mut got = vec![[f64::NAN; LANES]; lanes.eights() * BLOCK];
            let (mut last, mut z) = (vec![0.0; r.len()], vec![0.0; r.len()]);
            for xs in xs.chunks(block) {
                let mut sums = [[0.0; BLOCK]; 2];
                runs.take(xs);
                lanes.put_out(xs, &runs, &mut got);
                one.sums(&got, &mut sums[0][..xs.len()]);
                split.sums(&got, &mut sums[1][..xs.len()]);
                for (k, x) in xs.iter().enumerate() {
                    std::mem::swap(&mut last, &mut z);
                    bank.next(&last, *x, &mut z);
                    for (i, z) in z.iter().enumerate() {
                        prop_assert_eq!(got[i / LANES * BLOCK + k][i % LANES], *z, "sample {}, operator {}", k, i);
                    }
                    let sum: f64 = above.iter().zip(&z).map(|(w, z)| w * z).sum();
                    prop_assert!((sums[0][k] - sum).abs() < 1e-12 * (1.0 + sum.abs()));
                    let lower: f64 = below.iter().zip(&z).map(|(w, z)| w * z.min(0.0)).sum();
                    let upper: f64 = above.iter().zip(&z).map(|(w, z)| w * z.max(0.0)).sum();
                    prop_assert!((sums[1][k] - (upper + lower)).abs() < 1e-12 * (1.0 + upper - lower));
                }
            }
        }
    }
}
