//! Eight numbers at once, by the widest instructions that the processor has: in one register, in two or in four.

use fearless_simd::{Level, Simd, SimdBase, SimdSplit, f64x8};

pub(crate) const LANES: usize = 8;

/// Eight numbers in memory.
pub(crate) type Lanes = [f64; LANES];

/// A loop for any vectors. It is a trait, as a closure cannot be generic.
pub(crate) trait SimdLoop {
    type Output;
    /// To be inlined always: else it is compiled for the instructions that every processor has.
    fn run<S: Simd>(self, simd: S) -> Self::Output;
}

/// Runs a loop that is compiled for the instructions of the processor.
pub(crate) fn dispatch<L: SimdLoop>(work: L) -> L::Output {
    fearless_simd::dispatch!(Level::new(), simd => work.run(simd))
}

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, lanes: &Lanes) -> f64x8<S> {
    SimdBase::load_array_ref(simd, lanes)
}

/// Several eights. A loop, as the closure of an array's `map` is not inlined into code for the instructions of the
/// processor.
#[inline(always)]
pub(crate) fn load_all<S: Simd, const N: usize>(simd: S, lanes: [&Lanes; N]) -> [f64x8<S>; N] {
    let mut loaded = [splat(simd, 0.0); N];
    for i in 0..N {
        loaded[i] = load(simd, lanes[i]);
    }
    loaded
}

#[inline(always)]
pub(crate) fn splat<S: Simd>(simd: S, number: f64) -> f64x8<S> {
    SimdBase::splat(simd, number)
}

/// The sum of all eight, in the same order on every processor.
#[inline(always)]
pub(crate) fn sum<S: Simd>(numbers: f64x8<S>) -> f64 {
    let (low, high) = numbers.split();
    let [a, b, c, d]: [f64; LANES / 2] = (low + high).into();
    (a + c) + (b + d)
}

/// A row of numbers as eights, the rest filled up with another one.
pub(crate) fn eights(numbers: &[f64], rest: f64) -> Vec<Lanes> {
    numbers
        .chunks(LANES)
        .map(|chunk| {
            let mut lanes = [rest; LANES];
            lanes[..chunk.len()].copy_from_slice(chunk);
            lanes
        })
        .collect()
}

/// Copies the signals of a sample: `eight(i)` is the i-th group of eight signals.
pub(crate) fn copy_signals<'s>(eight: impl Fn(usize) -> &'s Lanes, signals: &mut [f64]) {
    let (eights, rest) = signals.as_chunks_mut::<LANES>();
    let whole = eights.len();
    for (number, place) in eights.iter_mut().enumerate() {
        *place = *eight(number);
    }
    if !rest.is_empty() {
        rest.iter_mut().zip(eight(whole)).for_each(|(place, value)| *place = *value);
    }
}

#[cfg(all(test, target_arch = "x86_64"))]
mod tests {
    use std::array;

    use fearless_simd::SimdFloat;

    use super::*;

    /// What eights of products and sums come to.
    struct Work<'a>(&'a [[Lanes; 2]]);

    impl SimdLoop for Work<'_> {
        type Output = f64;

        fn run<S: Simd>(self, simd: S) -> f64 {
            let add = |all, [a, b]: &[Lanes; 2]| load(simd, a).mul_add(load(simd, b), all);
            sum(self.0.iter().fold(splat(simd, 0.1), add))
        }
    }

    #[test]
    fn avx2_and_avx512_give_the_same_bits() {
        let numbers: Vec<f64> = (0..640_u32).map(|k| (f64::from(k) * 0.7).sin()).collect();
        let (eights, _) = numbers.as_chunks();
        let (pairs, _) = eights.as_chunks();
        let level = Level::new();
        for count in 0..=pairs.len() {
            let pairs = &pairs[..count];
            let fused = pairs.iter().fold([0.1; LANES], |all, [a, b]| array::from_fn(|j| a[j].mul_add(b[j], all[j])));
            let half: [f64; LANES / 2] = array::from_fn(|j| fused[j] + fused[j + LANES / 2]);
            let expected = (half[0] + half[2]) + (half[1] + half[3]);
            let avx2 = level.as_avx2().map(|avx2| Work(pairs).run(avx2));
            let avx512 = level.as_avx512().map(|avx512| Work(pairs).run(avx512));
            for way in [avx2, avx512].into_iter().flatten() {
                assert_eq!(way.to_bits(), expected.to_bits());
            }
        }
    }
}
