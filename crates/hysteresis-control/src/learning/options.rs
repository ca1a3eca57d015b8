//! How to learn, and what came of it.

use hysteresis_core::is_admissible;
use serde::{Deserialize, Serialize};

use super::uncertainty::LoopUncertainty;
use crate::linear::{Error, check_positive};

/// How to learn.
///
/// ```
/// use hysteresis_control::learning::LearningOptions;
/// let options = LearningOptions { target_limits: Some((-3.0, 3.0)), ..LearningOptions::default() };
/// assert_eq!((options.min_gain, options.bandwidth), (0.15, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LearningOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there. Without one, wherever errors show above the noise
    /// and the loop is known well enough.
    pub bandwidth: Option<f64>,
    /// Old periods are forgotten so fast that the gain never falls below this. Less averages noise over more periods.
    pub min_gain: f64,
    /// The target never leaves (low, high), in the unit of the displacement.
    pub target_limits: Option<(f64, f64)>,
    /// The root mean square of the measurement noise, in the unit of the displacement. Without one, the upper half of the harmonics
    /// of the first period tells it.
    pub noise: Option<f64>,
    /// How far the true loop may be from the believed one.
    pub uncertainty: LoopUncertainty,
    /// So many periods pass before the first one that is learned from, and after each change of the target. A lightly damped loop needs
    /// one: what rings after a change belongs to no period.
    pub settle: u32,
    /// Whether the motion is repeated on demand, from rest to rest. If not, one period follows the other. Where the target rests at its
    /// ends, up to a tenth of it at each, the correction comes and goes smoothly: so nothing jumps there.
    pub on_demand: bool,
}

impl LearningOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth: Some(bandwidth), ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let error = |parameter, index, expected, got| Err(Error::domain(parameter, index, expected, got));
        self.bandwidth.map_or(Ok(0.0), |bandwidth| check_positive("bandwidth", None, bandwidth))?;
        if !(self.min_gain > 0.0 && self.min_gain <= 1.0) {
            return error("min_gain", None, "a number above 0, at most 1", self.min_gain);
        }
        if let Some(noise) = self.noise.filter(|noise| !(is_admissible(*noise) && *noise >= 0.0)) {
            return error("noise", None, "a finite number >= 0", noise);
        }
        if let Some((low, high)) = self.target_limits
            && !(is_admissible(low) && is_admissible(high) && low < high)
        {
            let (index, got) = if is_admissible(low) { (1, high) } else { (0, low) };
            return error("target_limits", Some(index), "finite limits, the high one above the low one", got);
        }
        Ok(())
    }
}

impl Default for LearningOptions {
    /// No bandwidth, a gain of at least 0.15, no limits, noise as the first period tells it, the usual uncertainty, no
    /// period to settle, periods that follow each other.
    fn default() -> Self {
        let uncertainty = LoopUncertainty::default();
        Self {
            bandwidth: None,
            min_gain: 0.15,
            target_limits: None,
            noise: None,
            uncertainty,
            settle: 0,
            on_demand: false,
        }
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
    /// Whether it was used. If not, the loop was settling, or the error had grown to twice the best: the target went back to the best
    /// one then, and the steps were halved.
    pub accepted: bool,
}

/// How to learn in the loop.
///
/// ```
/// use hysteresis_control::learning::RepetitiveOptions;
/// let options = RepetitiveOptions { settle: 3, ..RepetitiveOptions::default() };
/// assert_eq!((options.gain, options.bandwidth), (0.3, None));
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RepetitiveOptions {
    /// Up to which frequency to learn, in Hz: half of a correction is kept there. Without one, as far as learning converges on every
    /// loop that the true one may be.
    pub bandwidth: Option<f64>,
    /// The gain gamma: less averages noise over more periods.
    pub gain: f64,
    /// So many periods pass before the first one that is learned from.
    pub settle: u32,
    /// The correction never exceeds this magnitude, in the unit of the displacement.
    pub limit: Option<f64>,
    /// How far the true loop may be from the believed one.
    pub uncertainty: LoopUncertainty,
}

impl RepetitiveOptions {
    /// The usual options for a bandwidth in Hz.
    #[must_use]
    pub fn new(bandwidth: f64) -> Self {
        Self { bandwidth: Some(bandwidth), ..Self::default() }
    }

    pub(super) fn check(&self) -> Result<(), Error> {
        let error = |parameter, expected, got| Err(Error::domain(parameter, None, expected, got));
        self.bandwidth.map_or(Ok(0.0), |bandwidth| check_positive("bandwidth", None, bandwidth))?;
        if !(self.gain > 0.0 && self.gain <= 1.0) {
            return error("gain", "a number above 0, at most 1", self.gain);
        }
        match self.limit.filter(|limit| limit.is_nan() || *limit < 0.0) {
            Some(limit) => error("limit", "a number >= 0", limit),
            None => Ok(()),
        }
    }
}

impl Default for RepetitiveOptions {
    /// A bandwidth that suits the loop, a gain of 0.3, one period to settle, no limit, the usual uncertainty.
    fn default() -> Self {
        Self { bandwidth: None, gain: 0.3, settle: 1, limit: None, uncertainty: LoopUncertainty::default() }
    }
}
