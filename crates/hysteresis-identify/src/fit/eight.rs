//! Eight numbers at once, in as many registers as the processor needs for them.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use pulp::{Arch, Simd, WithSimd};

pub(crate) const LANES: usize = 8;

/// Eight numbers in memory.
pub(crate) type Lanes = [f64; LANES];

/// The same in G registers.
pub(crate) type Numbers<S, const G: usize> = [<S as Simd>::f64s; G];

/// What is done with eight numbers in G registers.
#[derive(Clone, Copy)]
pub(crate) struct Eight<S: Simd, const G: usize>(S);

/// A loop over eights.
pub(crate) trait EightLoop {
    fn run<S: Simd, const G: usize>(self, eight: Eight<S, G>);
}

/// Runs a loop with the instructions that were found.
pub(crate) fn dispatch<L: EightLoop>(arch: Arch, work: L) {
    arch.dispatch(Work(work));
}

struct Work<L>(L);

impl<L: EightLoop> WithSimd for Work<L> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match S::F64_LANES {
            8 => self.0.run(Eight::<S, 1>(simd)),
            4 => self.0.run(Eight::<S, 2>(simd)),
            2 => self.0.run(Eight::<S, 4>(simd)),
            _ => self.0.run(Eight::<S, 8>(simd)),
        }
    }
}

impl<S: Simd, const G: usize> Eight<S, G> {
    #[inline(always)]
    pub(crate) fn load(self, lanes: &Lanes) -> Numbers<S, G> {
        let (registers, _) = S::as_simd_f64s(lanes);
        let mut numbers = self.splat(0.0);
        numbers.copy_from_slice(&registers[..G]);
        numbers
    }

    #[inline(always)]
    #[expect(clippy::unused_self, reason = "written as `load` is")]
    pub(crate) fn store(self, numbers: Numbers<S, G>, lanes: &mut Lanes) {
        let (registers, _) = S::as_mut_simd_f64s(lanes);
        registers[..G].copy_from_slice(&numbers);
    }

    #[inline(always)]
    pub(crate) fn splat(self, number: f64) -> Numbers<S, G> {
        [self.0.splat_f64s(number); G]
    }

    #[inline(always)]
    pub(crate) fn add(self, mut a: Numbers<S, G>, b: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.add_f64s(a[i], b[i]);
        }
        a
    }

    #[inline(always)]
    pub(crate) fn sub(self, mut a: Numbers<S, G>, b: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.sub_f64s(a[i], b[i]);
        }
        a
    }

    #[inline(always)]
    pub(crate) fn mul(self, mut a: Numbers<S, G>, b: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.mul_f64s(a[i], b[i]);
        }
        a
    }

    /// a b + c, rounded once where the processor has an instruction for that.
    #[inline(always)]
    pub(crate) fn mul_add(self, mut a: Numbers<S, G>, b: Numbers<S, G>, c: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.mul_add_e_f64s(a[i], b[i], c[i]);
        }
        a
    }

    #[inline(always)]
    pub(crate) fn min(self, mut a: Numbers<S, G>, b: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.min_f64s(a[i], b[i]);
        }
        a
    }

    #[inline(always)]
    pub(crate) fn max(self, mut a: Numbers<S, G>, b: Numbers<S, G>) -> Numbers<S, G> {
        for i in 0..G {
            a[i] = self.0.max_f64s(a[i], b[i]);
        }
        a
    }

    /// The sum of all eight.
    #[inline(always)]
    pub(crate) fn total(self, numbers: Numbers<S, G>) -> f64 {
        let mut sum = numbers[0];
        for more in &numbers[1..] {
            sum = self.0.add_f64s(sum, *more);
        }
        self.0.reduce_sum_f64s(sum)
    }
}

/// A row of numbers as eights, the rest filled up with zeros.
pub(crate) fn eights(numbers: &[f64]) -> Vec<Lanes> {
    numbers
        .chunks(LANES)
        .map(|chunk| {
            let mut lanes = [0.0; LANES];
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
