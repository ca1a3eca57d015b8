//! The vectors of x86-64-v3, four numbers, and those of AVX-512, eight.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use fearless_simd::{
    Bytes, Select, Simd, SimdBase, SimdFloat, SimdSplit, f64x4, f64x8, mask64x4, mask64x8, u64x4, u64x8,
};

use super::{Avx2, Avx512, PARTIAL_SUMS, VectorLoop, Vectors, smallest};

/// What both have in common: the names of their vectors, and the width.
macro_rules! vectors {
    ($numbers:ident, $mask:ident, $bits:ident, $width:literal) => {
        type Lanes = [f64; $width];
        type Numbers = $numbers<Self>;
        type Mask = $mask<Self>;
        type Sum = f64x4<Self>;

        #[inline(always)]
        fn load(self, lanes: &Self::Lanes) -> Self::Numbers {
            SimdBase::load_array_ref(self, lanes)
        }

        #[inline(always)]
        fn store(self, numbers: Self::Numbers) -> Self::Lanes {
            numbers.into()
        }

        #[inline(always)]
        fn splat(self, number: f64) -> Self::Numbers {
            SimdBase::splat(self, number)
        }

        #[inline(always)]
        fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            a - b
        }

        #[inline(always)]
        fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            a + b
        }

        #[inline(always)]
        fn product(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            a * b
        }

        #[inline(always)]
        fn signed_sub(self, a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers {
            a.mul_sub(b, c)
        }

        #[inline(always)]
        fn min(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            a.min(b)
        }

        #[inline(always)]
        fn max(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            a.max(b)
        }

        #[inline(always)]
        fn is_below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
            a.simd_lt(b)
        }

        #[inline(always)]
        fn is_at_most(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
            a.simd_le(b)
        }

        #[inline(always)]
        fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
            a & b
        }

        #[inline(always)]
        fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
            a | b
        }

        #[inline(always)]
        fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
            mask.select(a, b)
        }

        #[inline(always)]
        fn turned(self, numbers: Self::Numbers, signs: Self::Numbers) -> Self::Numbers {
            let bits: $bits<Self> = numbers.bitcast();
            (bits ^ signs.bitcast::<$bits<Self>>()).bitcast()
        }

        #[inline(always)]
        fn nothing(self) -> Self::Sum {
            SimdBase::splat(self, 0.0)
        }

        #[inline(always)]
        fn partial_sums(self, sum: Self::Sum) -> [f64; PARTIAL_SUMS] {
            sum.into()
        }

        #[inline(always)]
        fn compiled<L: VectorLoop<Self>>(self, work: L) -> L::Output {
            self.vectorize(
                #[inline(always)]
                move || work.run(self),
            )
        }
    };
}

impl Vectors for Avx2 {
    vectors!(f64x4, mask64x4, u64x4, 4);

    #[inline(always)]
    fn sum(self, sum: Self::Sum, numbers: Self::Numbers) -> Self::Sum {
        sum + numbers
    }

    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        smallest(numbers.into())
    }
}

impl Vectors for Avx512 {
    vectors!(f64x8, mask64x8, u64x8, 8);

    /// One half after the other, as narrower vectors would sum them.
    #[inline(always)]
    fn sum(self, sum: Self::Sum, numbers: Self::Numbers) -> Self::Sum {
        let (low, high) = numbers.split();
        sum + low + high
    }

    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        let (low, high) = numbers.split();
        smallest(low.min(high).into())
    }
}
