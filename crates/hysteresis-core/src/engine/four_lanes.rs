//! Four numbers at once: by the instructions of x86-64-v3 where the processor has them, else by any.
//!
//! Both ways do the same with the same numbers in the same order, and round wherever the other does: no bit depends on the processor.
#![expect(clippy::inline_always, reason = "what is called must be compiled for the instructions of the caller")]

use core::array;

/// Four numbers.
pub(crate) type Lanes = [f64; LANES];

pub(crate) const LANES: usize = 4;

/// What is done with four numbers.
pub(crate) trait FourLanes: Copy {
    type Numbers: Copy;
    type Mask: Copy;

    fn load(self, lanes: &Lanes) -> Self::Numbers;
    fn store(self, numbers: Self::Numbers) -> Lanes;
    fn splat(self, number: f64) -> Self::Numbers;
    fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// sum + a b. The product is rounded too: to fuse both, as some processors can, would give other bits there.
    fn add_product(self, sum: Self::Numbers, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// a b - c, for b of 1 or -1: fused or not, it is rounded once.
    fn signed_sub(self, a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers;
    /// The smaller; b where neither is.
    fn min(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    /// The larger; b where neither is.
    fn max(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn is_below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask;
    fn is_at_most(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask;
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask;
    /// a where the mask is set, else b.
    fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;

    /// The numbers, with the other sign where `signs` is -0.
    fn turned(self, numbers: Self::Numbers, signs: Self::Numbers) -> Self::Numbers;

    /// The same numbers with the other sign; zero stays zero.
    #[inline(always)]
    fn negated(self, numbers: Self::Numbers) -> Self::Numbers {
        self.sub(self.splat(0.0), numbers)
    }

    /// The smallest of all four.
    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        let smaller = |a: f64, b: f64| if a < b { a } else { b };
        let [a, b, c, d] = self.store(numbers);
        smaller(smaller(a, c), smaller(b, d))
    }

    /// The largest of all four.
    #[inline(always)]
    fn largest(self, numbers: Self::Numbers) -> f64 {
        -self.smallest(self.negated(numbers))
    }

    /// The sum of all four.
    #[inline(always)]
    fn total(self, numbers: Self::Numbers) -> f64 {
        let [a, b, c, d] = self.store(numbers);
        (a + c) + (b + d)
    }
}

/// A loop over blocks of four.
pub(crate) trait FourLaneLoop {
    type Output;
    fn run<F: FourLanes>(self, four: F) -> Self::Output;
}

/// The instructions of the processor, found when a model is made.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Processor {
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    v3: Option<pulp::x86::V3>,
}

impl Processor {
    pub(crate) fn here() -> Self {
        Self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            v3: pulp::x86::V3::try_new(),
        }
    }

    /// Any processor.
    #[cfg(test)]
    pub(crate) fn portable() -> Self {
        Self {
            #[cfg(all(feature = "simd", target_arch = "x86_64"))]
            v3: None,
        }
    }

    #[inline]
    pub(crate) fn run<L: FourLaneLoop>(self, lanes: L) -> L::Output {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        if let Some(v3) = self.v3 {
            return pulp::Simd::vectorize(v3, x86_64_v3::OnV3(lanes, v3));
        }
        lanes.run(Portable)
    }
}

/// Plain arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl FourLanes for Portable {
    type Numbers = Lanes;
    type Mask = [bool; LANES];

    #[inline(always)]
    fn load(self, lanes: &Lanes) -> Lanes {
        *lanes
    }

    #[inline(always)]
    fn store(self, numbers: Lanes) -> Lanes {
        numbers
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Lanes {
        [number; LANES]
    }

    #[inline(always)]
    fn add(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn sub(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn add_product(self, sum: Lanes, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| sum[i] + a[i] * b[i])
    }

    #[inline(always)]
    fn signed_sub(self, a: Lanes, b: Lanes, c: Lanes) -> Lanes {
        array::from_fn(|i| a[i] * b[i] - c[i])
    }

    #[inline(always)]
    fn min(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max(self, a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn is_below(self, a: Lanes, b: Lanes) -> [bool; LANES] {
        array::from_fn(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn is_at_most(self, a: Lanes, b: Lanes) -> [bool; LANES] {
        array::from_fn(|i| a[i] <= b[i])
    }

    #[inline(always)]
    fn and(self, a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        array::from_fn(|i| a[i] & b[i])
    }

    #[inline(always)]
    fn or(self, a: [bool; LANES], b: [bool; LANES]) -> [bool; LANES] {
        array::from_fn(|i| a[i] | b[i])
    }

    #[inline(always)]
    fn turned(self, numbers: Lanes, signs: Lanes) -> Lanes {
        array::from_fn(|i| f64::from_bits(numbers[i].to_bits() ^ signs[i].to_bits()))
    }

    #[inline(always)]
    fn select(self, mask: [bool; LANES], a: Lanes, b: Lanes) -> Lanes {
        array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
    }
}

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
mod x86_64_v3 {
    use pulp::x86::V3;
    use pulp::{Simd, WithSimd, cast, f64x4, m64x4};

    use super::{FourLaneLoop, FourLanes, Lanes};

    /// A loop, compiled for these instructions.
    pub(super) struct OnV3<L>(pub(super) L, pub(super) V3);

    impl<L: FourLaneLoop> WithSimd for OnV3<L> {
        type Output = L::Output;

        #[inline(always)]
        fn with_simd<S: Simd>(self, _: S) -> L::Output {
            self.0.run(self.1)
        }
    }

    impl FourLanes for V3 {
        type Numbers = f64x4;
        type Mask = m64x4;

        #[inline(always)]
        fn load(self, lanes: &Lanes) -> f64x4 {
            cast(*lanes)
        }

        #[inline(always)]
        fn store(self, numbers: f64x4) -> Lanes {
            cast(numbers)
        }

        #[inline(always)]
        fn splat(self, number: f64) -> f64x4 {
            self.splat_f64s(number)
        }

        #[inline(always)]
        fn add(self, a: f64x4, b: f64x4) -> f64x4 {
            self.add_f64s(a, b)
        }

        #[inline(always)]
        fn sub(self, a: f64x4, b: f64x4) -> f64x4 {
            self.sub_f64s(a, b)
        }

        #[inline(always)]
        fn add_product(self, sum: f64x4, a: f64x4, b: f64x4) -> f64x4 {
            self.add_f64s(sum, self.mul_f64s(a, b))
        }

        #[inline(always)]
        fn signed_sub(self, a: f64x4, b: f64x4, c: f64x4) -> f64x4 {
            self.mul_sub_f64x4(a, b, c)
        }

        #[inline(always)]
        fn min(self, a: f64x4, b: f64x4) -> f64x4 {
            self.min_f64s(a, b)
        }

        #[inline(always)]
        fn max(self, a: f64x4, b: f64x4) -> f64x4 {
            self.max_f64s(a, b)
        }

        #[inline(always)]
        fn is_below(self, a: f64x4, b: f64x4) -> m64x4 {
            self.less_than_f64s(a, b)
        }

        #[inline(always)]
        fn is_at_most(self, a: f64x4, b: f64x4) -> m64x4 {
            self.less_than_or_equal_f64s(a, b)
        }

        #[inline(always)]
        fn and(self, a: m64x4, b: m64x4) -> m64x4 {
            self.and_m64s(a, b)
        }

        #[inline(always)]
        fn or(self, a: m64x4, b: m64x4) -> m64x4 {
            self.or_m64s(a, b)
        }

        #[inline(always)]
        fn turned(self, numbers: f64x4, signs: f64x4) -> f64x4 {
            self.xor_f64s(numbers, signs)
        }

        #[inline(always)]
        fn select(self, mask: m64x4, a: f64x4, b: f64x4) -> f64x4 {
            self.select_f64s(mask, a, b)
        }
    }
}
