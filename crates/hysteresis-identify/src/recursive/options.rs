//! How a recursive identification forgets, and what it starts from.

use hysteresis_control::linear::LinearDynamics;
use hysteresis_core::is_admissible;

use crate::error::Error;
use crate::options::Setting;

/// What a [`RecursiveIdentifier`](super::RecursiveIdentifier) may be told.
///
/// ```
/// use hysteresis_identify::{RecursiveOptions, Setting};
/// let tracking = RecursiveOptions { forgetting: 0.9999, ..RecursiveOptions::default() }; // a second at 10 kHz
/// assert_eq!(tracking.output_offset, Setting::Fit);
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct RecursiveOptions {
    /// What a sample counts after the next one, from 0.5 to 1: the memory is 1 / (1 - forgetting) samples long. 1
    /// forgets nothing: least squares over all samples.
    pub forgetting: f64,
    /// Fit the output offset of the model as one more unknown, as a sensor has one, or hold it.
    pub output_offset: Setting<f64>,
    /// The variance of every unknown at the start, in units of the variance of the measurement noise, the unknowns being
    /// w_i X and the output offset. X is the largest threshold, rounded up to a power of two. The default lets the samples
    /// alone decide; with 1 the model counts as one sample of full range.
    pub covariance: f64,
    /// The variance that forgetting may bring back, in the same units.
    pub covariance_limit: f64,
    /// The linear dynamics between the hysteresis and the measurement with their dead time, and the sampling interval in
    /// seconds; without any the measurement follows the input at once.
    pub dynamics: Option<(LinearDynamics, f64)>,
}

impl Default for RecursiveOptions {
    /// Nothing is forgotten, the offset is fitted, the samples alone decide, there are no dynamics.
    fn default() -> Self {
        Self { forgetting: 1.0, output_offset: Setting::Fit, covariance: 1e12, covariance_limit: 1e4, dynamics: None }
    }
}

impl RecursiveOptions {
    pub(super) fn check(&self) -> Result<(), Error> {
        let domain = |parameter, expected, got| Err(Error::domain(parameter, None, expected, got));
        if !(0.5..=1.0).contains(&self.forgetting) {
            return domain("forgetting", "a number from 0.5 to 1", self.forgetting);
        }
        for (parameter, got) in [("covariance", self.covariance), ("covariance_limit", self.covariance_limit)] {
            if !(1e-30..=1e30).contains(&got) {
                return domain(parameter, "a number from 1e-30 to 1e30", got);
            }
        }
        match self.output_offset {
            Setting::Fixed(got) if !is_admissible(got) => {
                domain("output_offset", "a finite number (at most 1e100 in magnitude)", got)
            }
            _ => Ok(()),
        }
    }
}
