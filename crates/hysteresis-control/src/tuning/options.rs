use serde::{Deserialize, Serialize};

use super::margins::Margins;

/// What the gains are to achieve.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct TuningOptions {
    /// The least and the greatest slope of the hysteresis, in output per input (um/V).
    pub slopes: (f64, f64),
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The greatest peak of the sensitivity, 1.05 to 5; 1.2 is cautious, 2 is bold.
    pub peak_sensitivity: f64,
}

/// Gains of the proportional-integral feedback, and how robust the loop is with them. Made by [`tune`](super::tune).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Tuning {
    /// Proportional gain, in input per output (V/um).
    pub kp: f64,
    /// Integral gain, in input per output and second (V/um/s).
    pub ki: f64,
    /// Where the hysteresis has its least slope.
    pub at_min_slope: Margins,
    /// Where it has its greatest slope.
    pub at_max_slope: Margins,
    /// The peak of the sensitivity over all slopes between.
    pub peak_sensitivity: f64,
}
