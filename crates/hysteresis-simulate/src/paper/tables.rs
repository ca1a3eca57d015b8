//! The actuator of the paper: Tables I and II as printed, and the digits that Table I lost.

use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

/// The number of operators.
const OPERATORS: usize = 20;

/// Table I, column w, in um/V, as printed (four decimals).
const TABLE_1_WEIGHTS: [f64; OPERATORS] = [
    0.0043, 0.0003, 0.0003, 0.0002, 0.0002, 0.0002, 0.0002, 0.0001, 0.0001, 0.0001, 0.0001, 0.0001, 0.0001, 0.0001,
    0.0002, 0.0002, 0.0002, 0.0002, 0.0003, 0.0003,
];

/// Table II, column w', in V/um.
const TABLE_2_WEIGHTS: [f64; OPERATORS] = [
    234.9005, -17.035, -12.8939, -9.9779, -7.8667, -6.3131, -5.1645, -4.3238, -3.7267, -3.3295, -3.1008, -3.0166,
    -3.0567, -3.2021, -3.4337, -3.7312, -4.073, -4.4364, -4.7987, -5.1381,
];

/// Table II, column r', in um.
const TABLE_2_THRESHOLDS: [f64; OPERATORS] = [
    0.0, 0.1064, 0.2212, 0.3431, 0.4714, 0.605, 0.7432, 0.8855, 1.0315, 1.1806, 1.3328, 1.4879, 1.646, 1.8072, 1.9718,
    2.1402, 2.3129, 2.4907, 2.6742, 2.8644,
];

/// Table II, column ra', in um; columns rb' and rc' are equal.
const TABLE_2_RA: [f64; OPERATORS] = [
    0.0, 0.0958, 0.1991, 0.3088, 0.4242, 0.5445, 0.6689, 0.797, 0.9283, 1.0626, 1.1995, 1.3391, 1.4814, 1.6265, 1.7746,
    1.9262, 2.0816, 2.2416, 2.4068, 2.578,
];

/// Table II, columns rb' and rc', in um.
const TABLE_2_RB: [f64; OPERATORS] = [
    0.0, 0.0372, 0.0774, 0.1201, 0.165, 0.2117, 0.2601, 0.3099, 0.361, 0.4132, 0.4665, 0.5208, 0.5761, 0.6325, 0.6901,
    0.7491, 0.8095, 0.8717, 0.936, 1.0025,
];

/// Thresholds of Table I in V: `r_i` = 25 i.
fn thresholds() -> [f64; OPERATORS] {
    let mut r = [0.0; OPERATORS];
    for i in 1..OPERATORS {
        r[i] = r[i - 1] + 25.0;
    }
    r
}

/// The forward model with the weights printed in Table I: input V, output um, for a drive of -500..500 V.
///
/// The printed weights keep one or two digits and are up to 31 % off; use [`table_1_recovered`] as the actuator.
#[must_use]
pub fn table_1() -> ModifiedPrandtlIshlinskii {
    model(&TABLE_1_WEIGHTS)
}

/// The forward model with the weights that Table II implies: w_i = 1/S'_i - 1/S'_(i-1) with S'_i the sum of the
/// first i + 1 weights of Table II. All 20 round to Table I.
#[must_use]
pub fn table_1_recovered() -> ModifiedPrandtlIshlinskii {
    let mut weights = [0.0; OPERATORS];
    let (mut inverse_slope, mut last_slope) = (0.0, 0.0);
    for (weight, inverse_weight) in weights.iter_mut().zip(TABLE_2_WEIGHTS) {
        inverse_slope += inverse_weight;
        let slope = 1.0 / inverse_slope;
        *weight = slope - last_slope;
        last_slope = slope;
    }
    model(&weights)
}

/// The parametric inverse as printed in Table II: input um, output V.
#[must_use]
pub fn table_2() -> ModifiedPrandtlIshlinskii {
    valid(ModifiedPrandtlIshlinskii::new(
        &TABLE_2_WEIGHTS,
        &TABLE_2_THRESHOLDS,
        &TABLE_2_RA,
        &TABLE_2_RB,
        &TABLE_2_RB,
        Offsets::default(),
    ))
}

fn model(weights: &[f64]) -> ModifiedPrandtlIshlinskii {
    valid(ModifiedPrandtlIshlinskii::from_ratios(weights, &thresholds(), Ratios::PAPER, Offsets::default()))
}

/// The tables are constants; the tests build each of them.
fn valid<E: core::fmt::Debug>(model: Result<ModifiedPrandtlIshlinskii, E>) -> ModifiedPrandtlIshlinskii {
    model.expect("the printed tables are valid")
}
