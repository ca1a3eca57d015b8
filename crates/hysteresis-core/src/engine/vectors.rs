//! Several numbers at once, by the widest instructions that the processor has: eight with AVX-512 as of Ice Lake and
//! Zen 4, four with x86-64-v3 or any other.
//!
//! Every way does the same with the same numbers in the same order, and rounds wherever the others do: no bit depends
//! on the processor. Everything here is always inlined: what is called must be compiled for the instructions of the
//! caller.

use core::array;

#[cfg(all(feature = "simd", target_arch = "x86_64"))]
use fearless_simd::Level;
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
pub(crate) use fearless_simd::x86::{Avx2, Avx512};

/// The numbers of a vector in memory.
pub(crate) trait Lanes: Copy + 'static {
    /// Numbers one vector after the other; those at the end that fill none are left out.
    fn vectors(numbers: &[f64]) -> &[Self];
    fn vectors_mut(numbers: &mut [f64]) -> &mut [Self];
}

impl<const N: usize> Lanes for [f64; N] {
    #[inline(always)]
    fn vectors(numbers: &[f64]) -> &[Self] {
        numbers.as_chunks().0
    }

    #[inline(always)]
    fn vectors_mut(numbers: &mut [f64]) -> &mut [Self] {
        numbers.as_chunks_mut().0
    }
}

/// The most numbers of a vector.
pub(crate) const WIDEST: usize = 8;

/// Four partial sums, whatever the width: every fourth number goes to the same one.
const PARTIAL_SUMS: usize = 4;

/// What is done with vectors of numbers.
pub(crate) trait Vectors: Copy {
    type Lanes: Lanes;
    type Numbers: Copy;
    type Mask: Copy;
    type Sum: Copy;

    fn load(self, lanes: &Self::Lanes) -> Self::Numbers;
    fn store(self, numbers: Self::Numbers) -> Self::Lanes;
    fn splat(self, number: f64) -> Self::Numbers;
    fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
    fn product(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers;
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

    /// The sum of no numbers.
    fn nothing(self) -> Self::Sum;
    /// A sum with these numbers too.
    fn sum(self, sum: Self::Sum, numbers: Self::Numbers) -> Self::Sum;
    fn partial_sums(self, sum: Self::Sum) -> [f64; PARTIAL_SUMS];
    /// The smallest number of a vector.
    fn smallest(self, numbers: Self::Numbers) -> f64;

    /// Runs a loop that is compiled for these vectors.
    fn compiled<R>(self, work: impl FnOnce(Self) -> R) -> R;

    /// sum + a b. The product is rounded too: to fuse both, as some processors can, would give other bits there.
    #[inline(always)]
    fn sum_product(self, sum: Self::Sum, a: Self::Numbers, b: Self::Numbers) -> Self::Sum {
        self.sum(sum, self.product(a, b))
    }

    /// The same numbers with the other sign; zero stays zero.
    #[inline(always)]
    fn negated(self, numbers: Self::Numbers) -> Self::Numbers {
        self.sub(self.splat(0.0), numbers)
    }

    /// The largest number of a vector.
    #[inline(always)]
    fn largest(self, numbers: Self::Numbers) -> f64 {
        -self.smallest(self.negated(numbers))
    }

    /// What the numbers sum to.
    #[inline(always)]
    fn total(self, sum: Self::Sum) -> f64 {
        let [a, b, c, d] = self.partial_sums(sum);
        (a + c) + (b + d)
    }
}

/// Four numbers at once, by any instructions: plain arrays.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Portable;

impl Vectors for Portable {
    type Lanes = [f64; 4];
    type Numbers = [f64; 4];
    type Mask = [bool; 4];
    type Sum = [f64; 4];

    #[inline(always)]
    fn load(self, lanes: &Self::Lanes) -> Self::Numbers {
        *lanes
    }

    #[inline(always)]
    fn store(self, numbers: Self::Numbers) -> Self::Lanes {
        numbers
    }

    #[inline(always)]
    fn splat(self, number: f64) -> Self::Numbers {
        [number; 4]
    }

    #[inline(always)]
    fn sub(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| a[i] - b[i])
    }

    #[inline(always)]
    fn add(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| a[i] + b[i])
    }

    #[inline(always)]
    fn product(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| a[i] * b[i])
    }

    #[inline(always)]
    fn signed_sub(self, a: Self::Numbers, b: Self::Numbers, c: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| a[i] * b[i] - c[i])
    }

    #[inline(always)]
    fn min(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| if a[i] < b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn max(self, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| if a[i] > b[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn is_below(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
        array::from_fn(|i| a[i] < b[i])
    }

    #[inline(always)]
    fn is_at_most(self, a: Self::Numbers, b: Self::Numbers) -> Self::Mask {
        array::from_fn(|i| a[i] <= b[i])
    }

    #[inline(always)]
    fn and(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        array::from_fn(|i| a[i] & b[i])
    }

    #[inline(always)]
    fn or(self, a: Self::Mask, b: Self::Mask) -> Self::Mask {
        array::from_fn(|i| a[i] | b[i])
    }

    #[inline(always)]
    fn select(self, mask: Self::Mask, a: Self::Numbers, b: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| if mask[i] { a[i] } else { b[i] })
    }

    #[inline(always)]
    fn turned(self, numbers: Self::Numbers, signs: Self::Numbers) -> Self::Numbers {
        array::from_fn(|i| f64::from_bits(numbers[i].to_bits() ^ signs[i].to_bits()))
    }

    #[inline(always)]
    fn nothing(self) -> Self::Numbers {
        self.splat(0.0)
    }

    #[inline(always)]
    fn sum(self, sum: Self::Numbers, numbers: Self::Numbers) -> Self::Numbers {
        self.add(sum, numbers)
    }

    #[inline(always)]
    fn partial_sums(self, sum: Self::Numbers) -> [f64; PARTIAL_SUMS] {
        sum
    }

    #[inline(always)]
    fn smallest(self, numbers: Self::Numbers) -> f64 {
        smallest(numbers)
    }

    /// Out of line: where wider vectors are at hand, what calls this stays short.
    #[inline(never)]
    fn compiled<R>(self, work: impl FnOnce(Self) -> R) -> R {
        work(self)
    }
}

/// The vectors of x86-64-v3, four numbers, and those of AVX-512, eight.
#[cfg(all(feature = "simd", target_arch = "x86_64"))]
mod x86_64 {
    use fearless_simd::{
        Bytes, Select, Simd, SimdBase, SimdFloat, SimdSplit, f64x4, f64x8, mask64x4, mask64x8, u64x4, u64x8,
    };

    use super::{Avx2, Avx512, PARTIAL_SUMS, Vectors, smallest};

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
            fn compiled<R>(self, work: impl FnOnce(Self) -> R) -> R {
                self.vectorize(
                    #[inline(always)]
                    move || work(self),
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
}

/// Which vectors a processor has.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Processor {
    Portable,
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx2(Avx2),
    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
    Avx512(Avx512),
}

impl Processor {
    /// The widest ones that this one has.
    pub(crate) fn here() -> Self {
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        {
            let level = Level::new();
            if let Some(avx512) = level.as_avx512() {
                return Self::Avx512(avx512);
            }
            if let Some(avx2) = level.as_avx2() {
                return Self::Avx2(avx2);
            }
        }
        Self::Portable
    }

    /// All that this one has.
    #[cfg(test)]
    pub(crate) fn all_here() -> impl Iterator<Item = Self> {
        let all = core::iter::once(Self::Portable);
        #[cfg(all(feature = "simd", target_arch = "x86_64"))]
        let all = {
            let level = Level::new();
            all.chain(level.as_avx2().map(Self::Avx2)).chain(level.as_avx512().map(Self::Avx512))
        };
        all
    }
}

/// The smallest of four numbers. Zeros compare equal: which of them it finds hangs on the width, so they are made one.
#[inline(always)]
fn smallest([a, b, c, d]: [f64; PARTIAL_SUMS]) -> f64 {
    let smaller = |a: f64, b: f64| if a < b { a } else { b };
    smaller(smaller(a, c), smaller(b, d)) + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The smallest of some numbers, and the largest.
    fn ends<V: Vectors>(v: V, numbers: &[f64; 24]) -> [f64; 2] {
        let numbers = V::Lanes::vectors(numbers);
        let pair = |merged: fn(V, V::Numbers, V::Numbers) -> V::Numbers| {
            let all = numbers.iter().map(|lanes| v.load(lanes));
            all.reduce(|a, b| merged(v, a, b)).unwrap_or_else(|| v.splat(f64::NAN))
        };
        [v.smallest(pair(V::min)), v.largest(pair(V::max))]
    }

    #[test]
    fn the_ends_of_numbers_have_the_same_bits_for_vectors_of_any_width() {
        // Which zero is found hangs on the order where a later number is another one.
        let zeros: [f64; 24] = array::from_fn(|i| [1.0, 1.0, 1.0, 0.0, -0.0, 1.0][i / 4]);
        let (turned, others) = (zeros.map(|zero| -zero), array::from_fn(|i| [3.0, -0.0, 7.0, -2.0, 9.0][i * i % 5]));
        for numbers in [zeros, turned, others] {
            let any = Portable.compiled(|v| ends(v, &numbers)).map(f64::to_bits);
            for processor in Processor::all_here() {
                let ends = match processor {
                    Processor::Portable => Portable.compiled(|v| ends(v, &numbers)),
                    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
                    Processor::Avx2(avx2) => avx2.compiled(|v| ends(v, &numbers)),
                    #[cfg(all(feature = "simd", target_arch = "x86_64"))]
                    Processor::Avx512(avx512) => avx512.compiled(|v| ends(v, &numbers)),
                };
                assert_eq!(ends.map(f64::to_bits), any, "{processor:?}, {numbers:?}");
            }
        }
    }
}
