use crate::error::{Bound, Error, check_finite, check_non_negative, check_positive};

use super::law::{Gains, Keep, Rules};
use super::limiter::Limiter;

/// The form of the law that is evaluated.
///
/// ```
/// use hysteresis_core::Law;
/// assert!(Law::default() == Law::Positional && Law::Positional.is_sound());
/// assert!(!Law::Printed.is_sound());
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Law {
    /// u = H^-1\[r\] + kp e + sum of ki e: equation (8) as it must be meant (errata 10 and 11).
    #[default]
    Positional,
    /// u += change of H^-1\[r\] + kp (change of e) + ki e, from the drive that went out. The same as long as nothing
    /// limits the drive; what a limit cuts off is lost until the integral has made up for it (erratum 12).
    Incremental,
    /// u += H^-1\[r\] + kp (change of e) + ki e: equation (8) as printed, which sums up the feed-forward and runs to the
    /// rail (erratum 10). For comparison only.
    Printed,
}

impl Law {
    /// Whether the law can control anything: not so the printed one.
    #[must_use]
    pub fn is_sound(self) -> bool {
        self != Self::Printed
    }
}

/// What keeps the integral of the positional law from winding up while the drive is limited, by limits or by slew.
///
/// ```
/// use hysteresis_core::AntiWindup;
/// assert_eq!(AntiWindup::default(), AntiWindup::Conditional);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AntiWindup {
    /// The sum takes no error that would push a limited drive further.
    #[default]
    Conditional,
    /// The sum also takes what the limiter cut off, over a tracking time.
    BackCalculation {
        /// The tracking time in seconds; without one, the integral time kp / ki samples, and no less than a sample.
        tracking_time: Option<f64>,
    },
}

/// How a [`HybridController`](super::HybridController) is set up.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let options = ControllerOptions { slew: Some(2e5), ..ControllerOptions::new(60.0, 0.6, (-500.0, 500.0)) };
/// assert!(HybridController::new(FeedForward::None, None, &options).is_ok());
/// let error = HybridController::new(FeedForward::None, None, &ControllerOptions { dt: 0.0, ..options }).unwrap_err();
/// assert_eq!(error.to_string(), "dt: expected a finite number > 0, got 0.0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerOptions {
    /// Proportional gain in volts per unit of the measurement, not negative.
    pub kp: f64,
    /// Integral gain in volts per unit of the measurement and sample, not negative.
    pub ki: f64,
    /// The sampling interval in seconds.
    pub dt: f64,
    /// The lowest and the highest drive in volts.
    pub limits: (f64, f64),
    /// How fast the drive may move, in volts per second.
    pub slew: Option<f64>,
    /// The form of the law.
    pub law: Law,
    /// Of the positional law.
    pub anti_windup: AntiWindup,
    /// How long it takes, in seconds, until the difference at a start or a switch is gone: it goes down in a straight line.
    pub transition: f64,
    /// How many measurements in a row may be missing, the drive being held, before feed-forward goes on alone.
    pub max_missing: u32,
    /// The drive that the amplifier has at the start; without one, zero or the limit nearest to it.
    pub start_drive: Option<f64>,
}

impl ControllerOptions {
    /// 10 kHz, no limit of the slew, the positional law with conditional integration, transitions of 5 ms, at most 10
    /// measurements missing.
    #[must_use]
    pub fn new(kp: f64, ki: f64, limits: (f64, f64)) -> Self {
        Self {
            kp,
            ki,
            dt: 1e-4,
            limits,
            slew: None,
            law: Law::default(),
            anti_windup: AntiWindup::default(),
            transition: 5e-3,
            max_missing: 10,
            start_drive: None,
        }
    }

    pub(super) fn limiter(&self) -> Result<Limiter, Error> {
        let (low, high) = self.limits;
        check_finite("limits", Some(0), low)?;
        check_finite("limits", Some(1), high)?;
        if low >= high {
            let expected = Bound::Above { what: "the low limit", limit: low };
            return Err(Error::Domain { parameter: "limits", index: Some(1), expected, got: high });
        }
        let dt = check_positive("dt", self.dt)?;
        let step = match self.slew {
            Some(slew) => check_positive("slew", slew)? * dt,
            None => f64::INFINITY,
        };
        Ok(Limiter { low, high, step })
    }

    /// The drive at the start.
    pub(super) fn start(&self) -> Result<f64, Error> {
        let (low, high) = self.limits;
        let Some(drive) = self.start_drive else { return Ok(0.0_f64.max(low).min(high)) };
        check_drive("start_drive", drive, self.limits)
    }

    pub(super) fn rules(&self) -> Result<Rules, Error> {
        let gains = Gains::new(self.kp, self.ki)?;
        let transition = check_non_negative("transition", None, self.transition)?;
        let keep = match (self.law, self.anti_windup) {
            (Law::Incremental, _) => Keep::WhatIsLeft,
            (Law::Printed, _) => Keep::WhatIsLeftAndFeedForward,
            (Law::Positional, AntiWindup::Conditional) => Keep::UnlessPushing,
            (Law::Positional, AntiWindup::BackCalculation { tracking_time: None }) => Keep::Tracking { share: None },
            (Law::Positional, AntiWindup::BackCalculation { tracking_time: Some(time) }) => {
                Keep::Tracking { share: Some((self.dt / check_positive("tracking_time", time)?).min(1.0)) }
            }
        };
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
        let fading = (transition / self.dt + 0.5) as u32;
        Ok(Rules { gains, keep, fading, max_missing: self.max_missing })
    }
}

/// Checks a drive that the amplifier is said to have.
pub(super) fn check_drive(parameter: &'static str, got: f64, (low, high): (f64, f64)) -> Result<f64, Error> {
    if low <= got && got <= high {
        Ok(got)
    } else {
        Err(Error::Domain { parameter, index: None, expected: Bound::Between { low, high }, got })
    }
}
