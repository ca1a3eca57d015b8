//! The actuator of tests that need no random one: that of the paper to four digits, in um for a drive in V.
#![allow(dead_code, reason = "other crates use some of these")]

use hysteresis_core::{ModifiedPrandtlIshlinskii, Offsets, Ratios};

/// Weights in um/kV.
const WEIGHTS: [f64; 20] = [
    4.257, 0.3329, 0.2887, 0.2496, 0.2156, 0.1866, 0.1626, 0.1437, 0.1298, 0.1209, 0.1171, 0.1183, 0.1246, 0.1359,
    0.1523, 0.1737, 0.2001, 0.2315, 0.2681, 0.3096,
];

/// 20 operators over 0..475 V.
pub(crate) fn actuator() -> ModifiedPrandtlIshlinskii {
    let thresholds: Vec<f64> = (0..20).map(|i| 25.0 * f64::from(i)).collect();
    let weights = WEIGHTS.map(|weight| 1e-3 * weight);
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &thresholds, Ratios::PAPER, Offsets::default()).unwrap()
}

/// Its approximate inverse in closed form: um in, V out.
pub(crate) fn parametric_inverse() -> ModifiedPrandtlIshlinskii {
    actuator().parametric_inverse(Ratios::PAPER_INVERSE).unwrap()
}
