//! Maps: a smooth rising curve of the drive in front of the hysteresis, or of the position behind it.
//!
//! In front of the input map there may be an amplifier: together they are the path of the drive.

use core::f64::consts::TAU;
use std::sync::Arc;

use hysteresis_core::{Error as CoreError, PiecewiseLinearMap};

use crate::records::signal::as_f64;

/// A map of the drive in front of the hysteresis, or of the position behind it.
///
/// A map that is fitted is smooth and rises: the logarithm of its slope is a cubic over the range of the records.
///
/// ```
/// use hysteresis_identify::{MapModel, Options};
/// let options = Options { output_map: MapModel::Smooth, ..Options::default() };
/// assert_ne!(options.output_map, options.input_map);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum MapModel {
    /// None.
    None,
    /// A smooth one if cross-validation over stretches of the records asks for it; none without a sampling interval or
    /// for the conventional model. Where both maps are left open, the second one must lower the error further. Where
    /// loops are all alike a map must halve the error of a fit that leaves 0.5 % of the range; more where less is left,
    /// and a fifth of it where 2 % is left. Loops that only decay must say more for a map than for a loop shift, which
    /// is told as [`MapNotTold`](crate::FindingCode::MapNotTold) if they do not.
    #[default]
    Auto,
    /// A smooth one.
    Smooth,
}

/// How many coefficients a curve has.
pub(crate) const COEFFICIENTS: usize = 3;

/// How many pieces of equal width stand for it.
const PIECES: usize = 64;

/// A curve through (low, low) and (high, high) that rises everywhere, as straight pieces.
///
/// With s from -1 at low to 1 at high, the logarithm of its slope is `a_1` s + `a_2` (s^2 - 1/3) + `a_3` (s^3 - 3 s /
/// 5), and a constant that keeps both ends. So no coefficient makes it fall, and all zero are the straight line.
/// Saturation, which is a tanh or a square, is met by two of them.
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

/// Where an output map is searched, and the weights of the operators, one or two for each, about whose output it is
/// linear.
#[derive(Clone)]
pub(crate) struct OutputMap {
    pub(crate) bounds: (f64, f64),
    pub(crate) reference: Arc<[f64]>,
}

/// The amplifier, and the input map behind it.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct DrivePath {
    /// The bandwidth of the amplifier in Hz.
    pub(crate) bandwidth: Option<f64>,
    /// Whether its voltage is seen at a sample, before the drive of that acts: without dynamics, which go on from
    /// there.
    #[cfg_attr(feature = "serde", serde(default))]
    pub(crate) is_seen_before: bool,
    pub(crate) map: Option<Curve>,
}

/// The drives of one record on their way, sample by sample; the amplifier at rest at the first.
pub(crate) struct PathLane<'a> {
    map: Option<&'a Curve>,
    amplifier: Option<Lag>,
}

/// A lag of first order whose input is held for a sampling interval.
struct Lag {
    /// exp(-dt / tau).
    decay: f64,
    is_seen_before: bool,
    /// Before the newest drive acts and at the end of its interval, once there was one.
    voltages: Option<(f64, f64)>,
}

impl DrivePath {
    /// Whether the operators may be shown reversals alone.
    pub(crate) fn keeps_turns(&self) -> bool {
        self.bandwidth.is_none()
    }

    pub(crate) fn lane(&self, dt: f64) -> PathLane<'_> {
        let lag = |bandwidth: f64| Lag {
            decay: (-TAU * bandwidth * dt).exp(),
            is_seen_before: self.is_seen_before,
            voltages: None,
        };
        PathLane { map: self.map.as_ref(), amplifier: self.bandwidth.map(lag) }
    }
}

impl PathLane<'_> {
    /// What reaches the operators: at the end of an interval in which a drive is held, or at its start without dynamics
    /// behind the amplifier or without an amplifier.
    #[inline]
    pub(crate) fn next(&mut self, u: f64) -> f64 {
        let voltage = self.amplifier.as_mut().map_or(u, |lag| lag.next(u));
        self.map.map_or(voltage, |map| map.at(voltage).0)
    }

    /// What the input map is shown for a drive: the drive of a loop shift.
    pub(crate) fn voltage(&self, u: f64) -> f64 {
        self.amplifier.as_ref().map_or(u, |lag| lag.seen(u))
    }
}

impl Lag {
    fn next(&mut self, u: f64) -> f64 {
        let before = self.voltages.map_or(u, |(_, end)| end);
        let end = u + self.decay * (before - u);
        self.voltages = Some((before, end));
        self.seen(u)
    }

    /// What the operators are shown; for a drive that is held since ever, itself.
    fn seen(&self, u: f64) -> f64 {
        self.voltages.map_or(u, |(before, end)| if self.is_seen_before { before } else { end })
    }
}

#[cfg(test)]
mod tests_of_curve {
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

#[cfg(test)]
mod tests_of_drive_path {
    use super::*;

    #[test]
    fn the_amplifier_settles_at_the_first_drive_and_then_follows() {
        let path = DrivePath { bandwidth: Some(400.0), ..DrivePath::default() };
        let mut lane = path.lane(1e-4);
        assert_eq!([lane.next(2.0), lane.next(2.0)], [2.0, 2.0]);
        let decay = (-TAU * 0.04_f64).exp();
        assert!((lane.next(3.0) - (3.0 - decay)).abs() < 1e-15);
        assert_eq!(lane.voltage(3.0), 3.0 - decay);
        assert!(!path.keeps_turns());
    }

    #[test]
    fn without_dynamics_the_amplifier_is_seen_before_the_drive_acts() {
        let path = DrivePath { bandwidth: Some(400.0), is_seen_before: true, map: None };
        let mut lane = path.lane(1e-4);
        assert_eq!([lane.next(2.0), lane.next(3.0)], [2.0, 2.0]);
        assert_eq!(lane.voltage(3.0), 2.0);
        assert!((lane.next(3.0) - (3.0 - (-TAU * 0.04_f64).exp())).abs() < 1e-15);
    }

    #[test]
    fn without_an_amplifier_the_map_alone_is_passed() {
        let map = Curve::new((0.0, 10.0), [0.5, 0.0, 0.0]);
        let path = DrivePath { map: Some(map.clone()), ..DrivePath::default() };
        let mut lane = path.lane(1e-4);
        assert_eq!((lane.next(4.0), lane.voltage(4.0), path.keeps_turns()), (map.at(4.0).0, 4.0, true));
    }
}
