//! How to learn, and what came of it.

use serde::{Deserialize, Serialize};

/// How to learn.
///
/// ```
/// use hysteresis_control::learning::LearningOptions;
/// let options = LearningOptions { target_limits: Some((-3.0, 3.0)), ..LearningOptions::new(150.0) };
/// assert_eq!(options.min_gain, 0.15);
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there. Above a third of the frequency of the
    /// dynamics, an error of theirs soon costs more than learning gains.
    pub bandwidth: f64,
    /// The gain gamma is 1 / j at the j-th period, which averages noise, and never less than this.
    pub min_gain: f64,
    /// The target never leaves (low, high), in the unit of the displacement.
    pub target_limits: Option<(f64, f64)>,
}

impl LearningOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth, min_gain: 0.15, target_limits: None }
    }
}

/// What a period was like.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Trial {
    /// The largest magnitude of the measured error.
    pub max_error: f64,
    /// The root mean square of the measured error.
    pub rmse: f64,
    /// Whether it was learned from. If not, the error had grown to twice the best: the target went back to the best one,
    /// and the gain was halved.
    pub accepted: bool,
}

/// How to learn in the loop.
///
/// ```
/// use hysteresis_control::learning::RepetitiveOptions;
/// let options = RepetitiveOptions { settle: 3, ..RepetitiveOptions::new(150.0) };
/// assert_eq!((options.gain, options.limit), (0.3, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there.
    pub bandwidth: f64,
    /// The gain gamma: less averages noise over more periods.
    pub gain: f64,
    /// So many periods pass before the first one that is learned from.
    pub settle: u32,
    /// The correction never exceeds this magnitude, in the unit of the displacement.
    pub limit: Option<f64>,
}

impl RepetitiveOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth, gain: 0.3, settle: 1, limit: None }
    }
}
