//! Noise for tests.

/// Numbers in -1..1 without correlation, from a linear congruential generator.
pub(crate) fn white(samples: usize) -> Vec<f64> {
    let states = std::iter::successors(Some(1_u64), |s| {
        Some(s.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407))
    });
    let fraction = |s: u64| f64::from(u32::try_from(s >> 32).unwrap()) / f64::from(u32::MAX);
    states.skip(10).map(|s| 2.0 * fraction(s) - 1.0).take(samples).collect()
}
