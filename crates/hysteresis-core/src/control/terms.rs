//! The terms of the control law, and the counters of unusual samples.

/// The terms of the last sample that was acted upon: the first four in the unit of the measurement, the others in volts.
///
/// `unlimited_drive` = `feedforward` + `proportional` + `integral` + `bumpless`. Two cases differ: at the start of a motion
/// it is the present drive, to the bit, and during a stop it is the next drive of the ramp. A change of gains, model or
/// source restates the terms for the new configuration.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let set = ControllerOptions::new(2.0, 5e3, 1e-4, (-10.0, 10.0));
/// let options = ControllerOptions { start_drive: Some(1.0), ..set };
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(3.0.into(), 1.0);
/// let terms = controller.terms();
/// assert_eq!((terms.error, terms.proportional, terms.integral), (2.0, 4.0, 0.0));
/// assert_eq!((terms.bumpless, terms.drive), (-3.0, 1.0)); // starts from the drive that the amplifier has
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Terms {
    /// The reference of the feedback. With a preview it is the one that came `ahead` samples before the newest.
    pub reference: f64,
    /// The target of the feed-forward.
    pub target: f64,
    /// Reference minus measurement. Without a usable measurement it is the last error there was.
    pub error: f64,
    /// The error behind the filters; the error itself without filters.
    #[cfg_attr(feature = "serde", serde(default))]
    pub filtered_error: f64,
    /// The output of the feed-forward, or the volts that came instead.
    pub feedforward: f64,
    /// kp times the filtered error.
    pub proportional: f64,
    /// The sum of ki dt times the filtered errors, this sample included, without the samples for which the integral rests.
    pub integral: f64,
    /// What keeps starts and switches from being jumps. It goes to zero in a straight line.
    pub bumpless: f64,
    /// The drive that the law asks for, before limits and slew.
    pub unlimited_drive: f64,
    /// The drive that goes out.
    pub drive: f64,
    /// Whether the unlimited drive lay beyond the limits.
    pub saturated: bool,
    /// Whether the unlimited drive, within the limits, was farther from the last drive than the slew allows.
    pub slewing: bool,
}

impl Terms {
    /// At rest at a drive.
    pub(super) fn at(drive: f64) -> Self {
        Self {
            reference: 0.0,
            target: 0.0,
            error: 0.0,
            filtered_error: 0.0,
            feedforward: 0.0,
            proportional: 0.0,
            integral: 0.0,
            bumpless: 0.0,
            unlimited_drive: drive,
            drive,
            saturated: false,
            slewing: false,
        }
    }
}

/// How many samples were unusual.
///
/// ```
/// use hysteresis_core::{ControllerOptions, Counters, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 5e3, 1e-4, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(f64::NAN.into(), 1.0);
/// controller.step(3.0.into(), f64::NAN);
/// assert_eq!(controller.counters(), Counters { rejected_count: 1, missing_count: 1, ..Counters::default() });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Counters {
    /// References, targets or feed-forwards that were not finite (or beyond 1e100), or feed-forwards that did not come
    /// though they must be given.
    pub rejected_count: u64,
    /// Measurements that were not finite (or beyond 1e100).
    pub missing_count: u64,
    /// Measurements that were finite but out of their range, or too far from the last one.
    pub implausible_count: u64,
    /// Unlimited drives beyond the limits.
    pub saturated_count: u64,
    /// Unlimited drives farther from the last drive than the slew allows.
    pub slewing_count: u64,
}
