//! Feed-forward for a reference whose samples are all known.

use hysteresis_core::is_admissible;

use super::Shaper;
use super::preview::check_window;
use crate::linear::{Block, Error, LinearDynamics};

impl Shaper {
    /// The targets of a reference of which all samples are given, T apart.
    ///
    /// Derivatives are those of the polynomial of degree 5 (less where the window has fewer than 6 samples) that fits
    /// the `window` samples about the moment that the target aims at, at the ends of the record the nearest ones; so the
    /// targets of a polynomial up to that degree are exact. What is aimed at beyond the last sample is the last sample.
    ///
    /// A corner has no second derivative: there the polynomial rounds it over the window. [`worst_miss`] tells what that
    /// costs.
    ///
    /// ```
    /// use hysteresis_control::linear::FirstOrder;
    /// use hysteresis_control::feedforward::Shaper;
    /// let lag = FirstOrder::from_time_constant(2e-3)?;
    /// let ramp: Vec<f64> = (0..20).map(f64::from).collect(); // one per sample of 1 ms
    /// let targets = Shaper::new(&lag.into(), 1e-3)?.shape(&ramp, 8)?;
    /// assert!((targets[7] - (7.0 + 0.5 + 2.0)).abs() < 1e-12); // half a sample and two of lag
    /// # Ok::<(), hysteresis_control::linear::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`] for samples that are not finite or fewer than the window, or a window that is not 2 to 1000 samples and
    /// longer than the order of the dynamics.
    pub fn shape(&self, trajectory: &[f64], window: usize) -> Result<Vec<f64>, Error> {
        let window = check_window(window)?;
        let degree = self.check_degree(None, window).map_err(|error| {
            let expected = "more samples than the order of dynamics and amplifier";
            #[expect(clippy::cast_precision_loss, reason = "only shown")]
            Error { parameter: "window", expected, got: window as f64, ..error }
        })?;
        check_samples(trajectory, window)?;
        let (last, last_window) = (trajectory.len() - 1, trajectory.len() - window);
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay of at most 2^20 samples")]
        let whole = self.lead as usize;
        // The window whose middle is nearest to the aim begins so many samples before the sample that the aim follows.
        #[expect(clippy::cast_precision_loss, reason = "windows are short")]
        let middle = 0.5 * (window - 1) as f64 - self.lead.fract();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "windows are short")]
        let before = middle.round().max(0.0) as usize;
        let (mut weights, mut aimed_at) = (Vec::new(), f64::NAN);
        let target = |k: usize| {
            let (follows, share) = if k + whole < last { (k + whole, self.lead.fract()) } else { (last, 0.0) };
            let first = follows.saturating_sub(before).min(last_window);
            #[expect(clippy::cast_precision_loss, reason = "windows are short")]
            let x = (follows - first) as f64 + share;
            if x != aimed_at {
                (weights, aimed_at) = (self.weights(window, degree, x)?, x);
            }
            Ok(weights.iter().zip(&trajectory[first..]).map(|(weight, sample)| weight * sample).sum())
        };
        (0..trajectory.len()).map(target).collect()
    }
}

fn check_samples(trajectory: &[f64], window: usize) -> Result<(), Error> {
    #[expect(clippy::cast_precision_loss, reason = "only shown")]
    if trajectory.len() < window {
        let expected = "at least as many samples as the window";
        return Err(Error { parameter: "trajectory", index: None, expected, got: trajectory.len() as f64 });
    }
    match trajectory.iter().position(|sample| !is_admissible(*sample)) {
        None => Ok(()),
        Some(index) => {
            let expected = "a finite number (at most 1e100 in magnitude)";
            Err(Error { parameter: "trajectory", index: Some(index), expected, got: trajectory[index] })
        }
    }
}

/// Where the position is furthest from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Miss {
    /// The sample of the reference.
    pub sample: usize,
    /// How far, in its unit.
    pub error: f64,
}

/// How far from the reference the position behind the linear part comes that is driven by the targets, from rest at the
/// first reference; nothing if all samples pass before the start has faded.
///
/// The first samples are left out, the delay and 7 [settling times](LinearDynamics::settling_time): what rests cannot follow a
/// reference that starts with a velocity, and exp(-7) of that is left.
///
/// # Errors
/// As for [`LinearDynamics::block`].
pub fn worst_miss(
    dynamics: &LinearDynamics,
    dt: f64,
    trajectory: &[f64],
    targets: &[f64],
) -> Result<Option<Miss>, Error> {
    let mut block = dynamics.block(dt)?;
    let Some(first) = trajectory.first() else { return Ok(None) };
    block.settle(*first);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates")]
    let settled = ((dynamics.dead_time() + 7.0 * dynamics.settling_time()) / dt).ceil() as usize;
    // The position that a target leads to is read at the next sample.
    let errors = targets.iter().zip(trajectory.iter().enumerate().skip(1));
    let errors = errors.map(|(target, (sample, r))| Miss { sample, error: (block.advance(*target) - r).abs() });
    Ok(errors.filter(|miss| miss.sample > settled).max_by(|a, b| a.error.total_cmp(&b.error)))
}
