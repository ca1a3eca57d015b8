//! f (e^(g h) - 1) / g and ln(b / a) / (b - a) to rounding of g h and b / a: there is neither exponential nor logarithm
//! without std.

/// 1 / (n + 1)! for n = 0 ..= 15: (e^t - 1) / t as a power series.
const SERIES: [f64; 16] = [
    1.0,
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
    1.0 / 87_178_291_200.0,
    1.0 / 1_307_674_368_000.0,
    1.0 / 20_922_789_888_000.0,
];

/// Up to this magnitude these terms are enough: the next one is below 2e-17.
const SMALL: f64 = 0.7;

/// ln 2 in two parts: a count times the first is exact.
const LN_2: (f64, f64) = (6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10);

/// Up to this magnitude of s the terms of artanh(s) / s are enough: the next one is below 1e-19.
const NEAR: f64 = 0.18;

/// 1 / (2 n + 1) for n = 0 ..= 11: artanh(s) / s as a power series of s^2.
const ARTANH: [f64; 12] = [
    1.0,
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
    1.0 / 19.0,
    1.0 / 21.0,
    1.0 / 23.0,
];

/// The power series of (e^t - 1) / t, summed in pairs: a chain of products would take four times as long.
#[inline(always)]
fn series(t: f64) -> f64 {
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11, c12, c13, c14, c15] = SERIES;
    let (t2, pair) = (t * t, |a: f64, b: f64| a + b * t);
    let (t4, four) = (t2 * t2, |a: f64, b: f64| a + b * t2);
    let low = four(pair(c0, c1), pair(c2, c3)) + four(pair(c4, c5), pair(c6, c7)) * t4;
    let high = four(pair(c8, c9), pair(c10, c11)) + four(pair(c12, c13), pair(c14, c15)) * t4;
    low + high * (t4 * t4)
}

/// artanh(s) / s by its power series of s^2, summed in pairs as well.
#[inline(always)]
fn artanh_ratio(square: f64) -> f64 {
    let [c0, c1, c2, c3, c4, c5, c6, c7, c8, c9, c10, c11] = ARTANH;
    let (square2, pair) = (square * square, |a: f64, b: f64| a + b * square);
    let (square4, four) = (square2 * square2, |a: f64, b: f64| a + b * square2);
    let [low, middle, high] =
        [four(pair(c0, c1), pair(c2, c3)), four(pair(c4, c5), pair(c6, c7)), four(pair(c8, c9), pair(c10, c11))];
    low + (middle + high * square4) * square4
}

/// f (e^(g h) - 1) / g, which is f h for g = 0. Beyond g h = 700 it is that of 700, or less.
#[inline]
pub(super) fn exponential_rise(f: f64, g: f64, h: f64) -> f64 {
    let t = g * h;
    if t.abs() <= SMALL { f * h * series(t) } else { f / g * exponential_less_one(t) }
}

/// e^t - 1 away from 0.
#[inline(never)]
fn exponential_less_one(t: f64) -> f64 {
    // Below, it is -1 to rounding.
    let t = t.clamp(-50.0, 700.0);
    #[expect(clippy::cast_possible_truncation, reason = "within -73 to 1010")]
    let twos = (t * core::f64::consts::LOG2_E + 0.5_f64.copysign(t)) as i32;
    let count = f64::from(twos);
    let rest = (t - count * LN_2.0) - count * LN_2.1;
    let power = power_of_two(twos);
    power * (rest * series(rest)) + (power - 1.0)
}

/// 2^n for n within -1022 and 1023.
fn power_of_two(n: i32) -> f64 {
    f64::from_bits(u64::from((n + 1023).unsigned_abs()) << 52)
}

/// `rise` ln(b / a) / (b - a) of positive normal numbers, given their difference, too, each to rounding.
#[inline(always)]
pub(super) fn per_logarithmic_mean(rise: f64, (a, b): (f64, f64), difference: f64) -> f64 {
    let per_sum = 1.0 / (a + b);
    let s = difference * per_sum;
    if s.abs() <= NEAR { 2.0 * rise * per_sum * artanh_ratio(s * s) } else { rise / difference * logarithm(b / a) }
}

/// ln of a positive normal number away from 1.
#[inline(never)]
fn logarithm(x: f64) -> f64 {
    const MANTISSA: u64 = (1 << 52) - 1;
    let bits = x.to_bits();
    let exponent = (bits >> 52) as i32 - 1023;
    let mantissa = f64::from_bits(bits & MANTISSA | 1023 << 52);
    // Near 1 on both sides.
    let above = mantissa > core::f64::consts::SQRT_2;
    let (mantissa, exponent) = if above { (0.5 * mantissa, exponent + 1) } else { (mantissa, exponent) };
    let s = (mantissa - 1.0) / (mantissa + 1.0);
    let count = f64::from(exponent);
    count * LN_2.0 + (2.0 * s * artanh_ratio(s * s) + count * LN_2.1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan() -> impl Iterator<Item = f64> {
        let sizes = (0..4000).map(|i| 10.0_f64.powf(-18.0 + 0.0051 * f64::from(i)));
        sizes.flat_map(|size| [size, -size])
    }

    #[test]
    fn growth_is_that_of_the_standard_library() {
        for t in scan().filter(|t| (-600.0..600.0).contains(t)) {
            let (got, want) = (exponential_rise(1.0, t, 1.0), t.exp_m1() / t);
            assert!((got / want - 1.0).abs() < 6e-16, "{t} {got} {want}");
        }
        for (f, g, h) in [(0.25, 0.5, 1.0), (0.25, 4.0, 0.5), (3.0, -8.0, 0.25), (-2.0, 0.125, -4.0)] {
            let (got, want) = (exponential_rise(f, g, h), f / g * (g * h).exp_m1());
            assert!((got / want - 1.0).abs() < 6e-16, "{f} {g} {h}: {got} {want}");
        }
        assert_eq!((exponential_rise(1.0, 0.0, 1.0), exponential_rise(1.0, -1e100, 1.0)), (1.0, 1e-100));
        assert!(exponential_rise(1.0, 1e100, 1.0) < f64::INFINITY);
    }

    #[test]
    fn logarithm_is_that_of_the_standard_library() {
        for q in scan().filter(|q| (-0.999..600.0).contains(q)) {
            let (got, want) = (per_logarithmic_mean(1.0, (1.0, 1.0 + q), q), q.ln_1p() / q);
            assert!((got / want - 1.0).abs() < 8e-16, "{q} {got} {want}");
        }
        for (rise, a, b) in [(3.0_f64, 4.0_f64, 4.5_f64), (0.25, 8.0, 0.5), (5.0, 2.0, 64.0)] {
            let (got, want) = (per_logarithmic_mean(rise, (a, b), b - a), rise * (b / a).ln() / (b - a));
            assert!((got / want - 1.0).abs() < 8e-16, "{rise} {a} {b}: {got} {want}");
        }
        for exponent in -99..99 {
            let x = 1.37 * 10.0_f64.powi(exponent);
            let (got, want) = (per_logarithmic_mean(1.0, (1.0, x), x - 1.0), x.ln() / (x - 1.0));
            assert!((got / want - 1.0).abs() < 6e-16, "{x} {got} {want}");
        }
    }
}
