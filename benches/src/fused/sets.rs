//! What the loop needs of each instruction set.

/// Pairs of numbers in plain Rust, which every 64-bit processor has instructions for.
pub(super) mod portable {
    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use crate::fused::kernel::{Block, blocks, kernel};

    const LANES: usize = 2;

    /// Aligned, so that an instruction may take it from memory.
    #[derive(Clone, Copy, Debug)]
    #[repr(align(16))]
    struct Vector([f64; LANES]);

    #[inline(always)]
    fn lanewise(a: Vector, b: Vector, f: impl Fn(f64, f64) -> f64) -> Vector {
        Vector([f(a.0[0], b.0[0]), f(a.0[1], b.0[1])])
    }

    fn vector(lanes: [f64; LANES]) -> Vector {
        Vector(lanes)
    }

    #[inline(always)]
    fn splat(x: f64) -> Vector {
        Vector([x; LANES])
    }

    #[inline(always)]
    fn add(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, |a, b| a + b)
    }

    #[inline(always)]
    fn sub(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, |a, b| a - b)
    }

    /// `f64::min` is one instruction on aarch64. On x86-64 it is several, because of NaN, and the comparison is one.
    #[inline(always)]
    fn min(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, if cfg!(target_arch = "x86_64") { |a, b| if a < b { a } else { b } } else { f64::min })
    }

    #[inline(always)]
    fn max(a: Vector, b: Vector) -> Vector {
        lanewise(a, b, if cfg!(target_arch = "x86_64") { |a, b| if a > b { a } else { b } } else { f64::max })
    }

    /// Fused where every processor of the architecture can.
    #[inline(always)]
    fn mul_add(a: Vector, b: Vector, c: Vector) -> Vector {
        if cfg!(target_arch = "aarch64") {
            Vector([a.0[0].mul_add(b.0[0], c.0[0]), a.0[1].mul_add(b.0[1], c.0[1])])
        } else {
            add(lanewise(a, b, |a, b| a * b), c)
        }
    }

    #[inline(always)]
    fn total(sum: Vector) -> f64 {
        sum.0[0] + sum.0[1]
    }

    kernel!();
}

/// Four numbers at once: AVX2 and FMA.
#[cfg(target_arch = "x86_64")]
pub(super) mod v3 {
    use std::arch::x86_64::{
        __m256d as Vector, _mm_add_pd, _mm_add_sd, _mm_cvtsd_f64, _mm_unpackhi_pd, _mm256_add_pd as add,
        _mm256_castpd256_pd128, _mm256_extractf128_pd, _mm256_fmadd_pd as mul_add, _mm256_max_pd as max,
        _mm256_min_pd as min, _mm256_set1_pd as splat, _mm256_setr_pd, _mm256_sub_pd as sub,
    };

    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use crate::fused::kernel::{Block, blocks, kernel};

    const LANES: usize = 4;

    #[target_feature(enable = "avx2,fma")]
    fn vector([a, b, c, d]: [f64; LANES]) -> Vector {
        _mm256_setr_pd(a, b, c, d)
    }

    #[inline]
    #[target_feature(enable = "avx2,fma")]
    fn total(sum: Vector) -> f64 {
        let pair = _mm_add_pd(_mm256_castpd256_pd128(sum), _mm256_extractf128_pd::<1>(sum));
        _mm_cvtsd_f64(_mm_add_sd(pair, _mm_unpackhi_pd(pair, pair)))
    }

    kernel!(#[target_feature(enable = "avx2,fma")]);
}

/// Eight numbers at once: AVX-512.
#[cfg(target_arch = "x86_64")]
pub(super) mod v4 {
    use std::arch::x86_64::{
        __m512d as Vector, _mm512_add_pd as add, _mm512_fmadd_pd as mul_add, _mm512_max_pd as max,
        _mm512_min_pd as min, _mm512_reduce_add_pd as total, _mm512_set1_pd as splat, _mm512_setr_pd,
        _mm512_sub_pd as sub,
    };

    use hysteresis_core::ModifiedPrandtlIshlinskii;

    use crate::fused::kernel::{Block, blocks, kernel};

    const LANES: usize = 8;

    #[target_feature(enable = "avx512f")]
    fn vector([a, b, c, d, e, f, g, h]: [f64; LANES]) -> Vector {
        _mm512_setr_pd(a, b, c, d, e, f, g, h)
    }

    kernel!(#[target_feature(enable = "avx512f")]);
}
