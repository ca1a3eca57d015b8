//! How a controller is set up.

#[cfg(feature = "alloc")]
use crate::error::check_each_between;
use crate::error::{Bound, Error, MAX_MAGNITUDE, check_between, check_finite, check_non_negative, check_positive};
use crate::filter::Sections;

/// The form of the law that is evaluated.
///
/// ```
/// use hysteresis_core::Law;
/// assert_eq!(Law::default(), Law::Positional);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Law {
    /// u = H^-1\[target\] + kp e + ki dt sum e: equation (8) as it must be meant (errata 10 and 11).
    #[default]
    Positional,
    /// u += change of H^-1\[target\] + kp (change of e) + ki dt e, from the drive that went out. The same as long as
    /// nothing limits the drive. What a limit cuts off is lost until the integral has made up for it (erratum 12).
    Incremental,
}

/// What keeps the integral of the positional law from winding up while limits or slew limit the drive.
///
/// ```
/// use hysteresis_core::AntiWindup;
/// assert_eq!(AntiWindup::default(), AntiWindup::Conditional);
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AntiWindup {
    /// Conditional integration: the integral takes no error that would push a limited drive further.
    #[default]
    Conditional,
    /// Back-calculation: the integral also takes what the limiter cut off, over a tracking time.
    BackCalculation {
        /// The tracking time in seconds; without one, the integral time kp / ki. A time below `dt` acts as `dt`.
        tracking_time: Option<f64>,
    },
}

/// How a [`HybridController`](super::HybridController) is set up.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let set = ControllerOptions::new(60.0, 6e3, 1e-4, (-500.0, 500.0)); // V/um, V/um/s, s, V
/// let options = ControllerOptions { slew: Some(2e5), ..set };
/// assert!(HybridController::new(FeedForward::None, None, &options).is_ok());
/// let error = HybridController::new(FeedForward::None, None, &ControllerOptions { dt: 0.0, ..options }).unwrap_err();
/// assert_eq!(error.to_string(), "dt: expected a finite number > 0, got 0.0");
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ControllerOptions {
    /// Proportional gain in volts per unit of the measurement (V/um). It is negative behind filters only: that is
    /// active damping.
    pub kp: f64,
    /// Integral gain in volts per unit of the measurement and second (V/um/s), not negative.
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
    /// How long, in seconds, the difference at a start or a switch takes to go to zero, in a straight line: the lead-in
    /// of a motion.
    pub bumpless_time: f64,
    /// How many measurements in a row may be missing or implausible, the drive being held, before feed-forward goes on
    /// alone. If the drive has not come back to that of the law since it was held last, it is not held, and the last
    /// error stands in.
    pub max_missing: u32,
    /// The lowest and the highest measurement that the sensor can show. What lies outside is implausible.
    pub measurement_range: Option<(f64, f64)>,
    /// The largest change of the measurement from one sample to the next. What is farther from the last plausible
    /// measurement is implausible; but after `max_missing` unusable ones in a row (and at least one) the next one
    /// within the range is taken as it is, so a real change of level is never shut out.
    pub max_measurement_step: Option<f64>,
    /// What shapes the error before it is fed back: notches, low-passes, leads, active damping. None by default.
    pub filters: Sections,
    /// The drive that the amplifier has at the start; without one, zero or the limit nearest to it.
    pub start_drive: Option<f64>,
}

impl ControllerOptions {
    /// The positional law with conditional integration, no limit of the slew, a bumpless time of 5 ms, at most 10
    /// measurements missing, every finite measurement plausible.
    #[must_use]
    pub fn new(kp: f64, ki: f64, dt: f64, limits: (f64, f64)) -> Self {
        Self {
            kp,
            ki,
            dt,
            limits,
            slew: None,
            law: Law::default(),
            anti_windup: AntiWindup::default(),
            bumpless_time: 5e-3,
            max_missing: 10,
            measurement_range: None,
            max_measurement_step: None,
            filters: Sections::default(),
            start_drive: None,
        }
    }

    /// The sampling interval, checked.
    pub(super) fn checked_dt(&self) -> Result<f64, Error> {
        check_positive("dt", self.dt)
    }

    /// The drive at the start.
    pub(super) fn checked_start_drive(&self) -> Result<f64, Error> {
        let (low, high) = self.limits;
        let Some(drive) = self.start_drive else { return Ok(0.0_f64.max(low).min(high)) };
        check_between("start_drive", None, drive, self.limits)
    }
}

/// Gains of the feedback, for one sample.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gains {
    pub(super) kp: f64,
    /// ki dt.
    pub(super) ki_dt: f64,
}

impl Gains {
    /// A negative gain would drive away from the reference, but for a proportional one behind filters: it damps.
    pub(super) fn new(kp: f64, ki: f64, dt: f64, filters: &Sections) -> Result<Self, Error> {
        let has_filters = !filters.as_slice().is_empty();
        let kp = if has_filters { check_finite("kp", None, kp)? } else { check_non_negative("kp", None, kp)? };
        Ok(Self { kp, ki_dt: per_sample("ki", ki, dt, MAX_MAGNITUDE)? })
    }

    /// One sample over the integral time |kp| / ki, at most 1.
    pub(super) fn integral_share(self) -> f64 {
        let kp = self.kp.abs();
        if self.ki_dt < kp { self.ki_dt / kp } else { 1.0 }
    }
}

/// A gain per second, which may not be negative, for one sample of `dt` seconds: at most `most` there.
pub(super) fn per_sample(parameter: &'static str, gain: f64, dt: f64, most: f64) -> Result<f64, Error> {
    let per_sample = check_non_negative(parameter, None, gain)? * dt;
    if per_sample <= most {
        return Ok(per_sample);
    }
    let expected = Bound::Between { low: 0.0, high: most / dt };
    Err(Error::Domain { parameter, index: None, expected, got: gain })
}

/// The bumpless time in samples of `dt` seconds.
pub(super) fn bumpless_samples(bumpless_time: f64, dt: f64) -> Result<u32, Error> {
    let time = check_non_negative("bumpless_time", None, bumpless_time)?;
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "saturates, and is not negative")]
    let samples = (time / dt + 0.5) as u32;
    Ok(samples)
}

/// Checks numbers of a saved state, each beside that of the controller, or names the first that is another one.
#[cfg(feature = "alloc")]
pub(super) fn check_unchanged<const N: usize>(numbers: [(&'static str, f64, f64); N]) -> Result<(), Error> {
    match numbers.into_iter().find(|(_, value, got)| value != got) {
        None => Ok(()),
        Some((parameter, value, got)) => {
            let expected = Bound::EqualTo { value, what: "as in this controller" };
            Err(Error::Domain { parameter, index: None, expected, got })
        }
    }
}

/// Checks the rate of a stop and the drive at which each actuator is to rest, or names them.
#[cfg(feature = "alloc")]
pub(super) fn check_stop(
    [rate_name, drives_name]: [&'static str; 2],
    rate: f64,
    rest_drives: &[f64],
    limits: impl ExactSizeIterator<Item = (f64, f64)>,
) -> Result<(), Error> {
    check_positive(rate_name, rate)?;
    check_each_between(drives_name, rest_drives, limits)
}
