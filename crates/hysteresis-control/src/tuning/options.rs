use serde::{Deserialize, Serialize};

use super::family::ModeUncertainty;
use super::margins::Margins;
use super::structure::Structure;
use crate::filters::FeedbackFilter;

/// What the feedback is to achieve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TuningOptions {
    /// The least and the greatest slope of the hysteresis, in output per input (um/V).
    pub slopes: (f64, f64),
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The greatest peak of the sensitivity, 1.05 to 5; 1.2 is cautious, 2 is bold.
    pub peak_sensitivity: f64,
    /// How well lightly damped modes are known.
    pub uncertainty: ModeUncertainty,
    /// The only structure that is admitted; with none the one that suits the dynamics.
    pub structure: Option<Structure>,
}

impl TuningOptions {
    /// For modes that are known to 5 % of their frequency and a factor of 2 of their damping.
    #[must_use]
    pub fn new(slopes: (f64, f64), dt: f64, peak_sensitivity: f64) -> Self {
        Self { slopes, dt, peak_sensitivity, uncertainty: ModeUncertainty::default(), structure: None }
    }
}

/// Filters and gains of the feedback, and how robust the loop is with them. Made by [`tune`](super::tune).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// What shapes the error.
    pub structure: Structure,
    /// The filters before both gains.
    pub filters: Vec<FeedbackFilter>,
    /// Proportional gain, in input per output (V/um); negative for active damping.
    pub kp: f64,
    /// Integral gain, in input per output and second (V/um/s).
    pub ki: f64,
    /// Where the hysteresis has its least slope, with the dynamics as they are known.
    pub at_min_slope: Margins,
    /// Where it has its greatest slope, likewise.
    pub at_max_slope: Margins,
    /// The peak of the sensitivity over all slopes between and all modes that may be.
    pub peak_sensitivity: f64,
    /// Up to which frequency in Hz disturbances are reduced to 1/sqrt(2) at least, for all slopes and modes that may be.
    pub rejection_bandwidth: f64,
    /// The bandwidth in Hz of white noise of the sensor that the position follows, with the greatest slope.
    pub noise_bandwidth: f64,
    /// The best of every structure that was tried, and its ki; empty where nothing but gains was sought.
    pub tried: Vec<(Structure, f64)>,
}
