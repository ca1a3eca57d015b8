//! A smooth rising curve: the shape of a map that is searched.

use std::sync::Arc;

use hysteresis_core::{Error as CoreError, PiecewiseLinearMap};

use crate::numeric::as_f64;

/// How many coefficients a curve has.
pub(crate) const COEFFICIENTS: usize = 3;

/// How many pieces of equal width stand for it.
const PIECES: usize = 64;

/// A curve through (low, low) and (high, high) that rises everywhere, as straight pieces.
///
/// With s from -1 at low to 1 at high, the logarithm of its slope is `a_1` s + `a_2` (s^2 - 1/3) + `a_3` (s^3 - 3 s / 5), and a
/// constant that keeps both ends. So no coefficient makes it fall, and all zero are the straight line. Saturation, which is a
/// tanh or a square, is met by two of them.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Curve {
    low: f64,
    width: f64,
    /// At the ends of the pieces.
    values: Vec<f64>,
}

impl Curve {
    pub(crate) fn new((low, high): (f64, f64), coefficients: [f64; COEFFICIENTS]) -> Self {
        let [a1, a2, a3] = coefficients;
        let width = (high - low) / as_f64(PIECES);
        let slope = |piece: usize| {
            let s = (as_f64(2 * piece + 1)) / as_f64(PIECES) - 1.0;
            (a1 * s + a2 * (s * s - 1.0 / 3.0) + a3 * s * (s * s - 0.6)).exp()
        };
        let mut values = vec![0.0; PIECES + 1];
        for piece in 0..PIECES {
            values[piece + 1] = values[piece] + slope(piece);
        }
        let scale = (high - low) / values[PIECES];
        for value in &mut values {
            *value = low + scale * *value;
        }
        values[PIECES] = high;
        Self { low, width, values }
    }

    /// The value and the slope there; beyond the ends the end pieces go on.
    #[inline]
    pub(crate) fn at(&self, x: f64) -> (f64, f64) {
        let place = (x - self.low) / self.width;
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "clamped to the pieces")]
        let piece = place.clamp(0.0, as_f64(PIECES - 1)) as usize;
        let rise = self.values[piece + 1] - self.values[piece];
        (self.values[piece] + rise * (place - as_f64(piece)), rise / self.width)
    }

    /// The same curve as a map of the stage, moved up by an offset.
    pub(crate) fn map(&self, offset: f64) -> Result<PiecewiseLinearMap, CoreError> {
        let x: Vec<f64> = (0..=PIECES).map(|i| self.low + self.width * as_f64(i)).collect();
        let y: Vec<f64> = self.values.iter().map(|value| value + offset).collect();
        PiecewiseLinearMap::new(&x, &y)
    }
}

/// Where an output map is searched, and the weight of every operator about whose output it is linear until others are known.
#[derive(Clone)]
pub(crate) struct OutputMap {
    pub(crate) bounds: (f64, f64),
    pub(crate) reference: Arc<[f64]>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_rises_between_its_ends_and_goes_on_beyond() {
        let curve = Curve::new((-1.0, 3.0), [0.9, -2.0, 1.5]);
        let values: Vec<f64> = (0..=600_u32).map(|k| curve.at(-2.0 + 0.01 * f64::from(k)).0).collect();
        assert!(values.windows(2).all(|pair| pair[0] < pair[1]));
        assert!((curve.at(-1.0).0 + 1.0).abs() < 1e-14 && (curve.at(3.0).0 - 3.0).abs() < 1e-14);
        assert_eq!(curve.at(3.5).1, curve.at(2.99).1);
        let map = curve.map(0.0).unwrap();
        for k in 0..60_u32 {
            let x = -2.0 + 0.1 * f64::from(k);
            assert!((map.at(x) - curve.at(x).0).abs() < 1e-13, "{x}");
        }
    }

    #[test]
    fn no_coefficient_is_the_straight_line_and_few_are_a_saturation() {
        let line = Curve::new((0.0, 150.0), [0.0; 3]);
        assert!((line.at(40.0).0 - 40.0).abs() < 1e-12 && (line.at(40.0).1 - 1.0).abs() < 1e-12);
        // log of 1 / cosh(0.5 s)^2 is about -s^2 / 4.
        let curve = Curve::new((-1.0, 1.0), [0.0, -0.24, 0.0]);
        for s in [-0.7_f64, -0.2, 0.4, 0.9] {
            let want = (0.5 * s).tanh() / 0.5_f64.tanh();
            assert!((curve.at(s).0 - want).abs() < 1e-3, "{s}");
        }
    }
}
