//! The vectors of x86-64-v3, four numbers, and those of x86-64-v4, eight.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use pulp::{Simd, WithSimd, cast, f64x4};

#[cfg(feature = "avx512")]
use super::V4;
use super::{PARTIAL_SUMS, V3, VectorLoop, Vectors, smallest};

/// A loop, compiled for these instructions.
struct Compiled<L, V>(L, V);

impl<L: VectorLoop<V>, V> WithSimd for Compiled<L, V> {
    type Output = L::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> L::Output {
        self.0.run(self.1)
    }
}

/// What both have in common: the name of the instructions, and the width.
macro_rules! vectors {
    ($width:literal) => {
        type Lanes = [f64; $width];
        type Numbers = <Self as Simd>::f64s;
        type Mask = <Self as Simd>::m64s;
        type Sum = f64x4;

        #[inline(always)]
        fn load(self, lanes: &Self::Lanes) -> Self::Numbers {
            cast(*lanes)
        }

        #[inline(always)]
        fn store(self, numbers: Self::Numbers) -> Self::Lanes {
            cast(numbers)
        }

        #[inline(always)]
        fn splat(self, number: f64) -> Self::Numbers {
            self.splat_f64s(number)
        }

        #[inline(always)]
        fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.sub_f64s(a, b)
        }

        #[inline(always)]
        fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.add_f64s(a, b)
        }

        #[inline(always)]
        fn product(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.mul_f64s(a, b)
        }

        #[inline(always)]
        fn min(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.min_f64s(a, b)
        }

        #[inline(always)]
        fn max(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.max_f64s(a, b)
        }

        #[inline(always)]
        fn is_below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
            self.less_than_f64s(a, b)
        }

        #[inline(always)]
        fn is_at_most(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
            self.less_than_or_equal_f64s(a, b)
        }

        #[inline(always)]
        fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
            self.and_m64s(a, b)
        }

        #[inline(always)]
        fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
            self.or_m64s(a, b)
        }

        #[inline(always)]
        fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            self.select_f64s(mask, a, b)
        }

        #[inline(always)]
        fn turned(self, numbers: Self::Numbers, signs: Self::Numbers) -> Self::Numbers {
            self.xor_f64s(numbers, signs)
        }

        #[inline(always)]
        fn nothing(self) -> f64x4 {
            f64x4(0.0, 0.0, 0.0, 0.0)
        }

        #[inline(always)]
        fn partial_sums(self, sum: f64x4) -> [f64; PARTIAL_SUMS] {
            cast(sum)
        }

        #[inline(always)]
        fn compiled<L: VectorLoop<Self>>(self, work: L) -> L::Output {
            Simd::vectorize(self, Compiled(work, self))
        }
    };
}

impl Vectors for V3 {
    vectors!(4);

    #[inline(always)]
    fn signed_sub(self, a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers {
        self.mul_sub_f64x4(a, b, c)
    }

    #[inline(always)]
    fn sum(self, sum: f64x4, numbers: Self::Numbers) -> f64x4 {
        self.add_f64s(sum, numbers)
    }

    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        smallest(cast(numbers))
    }
}

#[cfg(feature = "avx512")]
impl Vectors for V4 {
    vectors!(8);

    #[inline(always)]
    fn signed_sub(self, a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers {
        self.mul_sub_f64x8(a, b, c)
    }

    /// One half after the other, as narrower vectors would sum them.
    #[inline(always)]
    fn sum(self, sum: f64x4, numbers: Self::Numbers) -> f64x4 {
        let [low, high]: [f64x4; 2] = cast(numbers);
        let v3 = *self;
        v3.add_f64s(v3.add_f64s(sum, low), high)
    }

    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        let [low, high]: [f64x4; 2] = cast(numbers);
        smallest(cast(self.min_f64x4(low, high)))
    }
}
