//! What a sample was made of, and what was counted.

/// The terms of the last sample that was acted upon, in volts but for the first three.
///
/// `demanded` = `feedforward` + `proportional` + `integral` + `transition`, the start of a motion apart, where it is the
/// present drive to the bit. A switch restates them for the new configuration.
///
/// ```
/// use hysteresis_core::{ControllerOptions, FeedForward, HybridController};
/// let options = ControllerOptions { start_drive: Some(1.0), ..ControllerOptions::new(2.0, 0.5, (-10.0, 10.0)) };
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(3.0.into(), 1.0);
/// let terms = controller.terms();
/// assert_eq!((terms.error, terms.proportional, terms.integral), (2.0, 4.0, 0.0));
/// assert_eq!((terms.transition, terms.drive), (-3.0, 1.0)); // starts from the drive that the amplifier has
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Terms {
    /// The reference of the feedback, with a preview that of `ahead` samples before the newest. In the unit of the
    /// measurement, as the next two.
    pub reference: f64,
    /// What the feed-forward was to reach.
    pub target: f64,
    /// Reference minus measurement; without a measurement the last one there was.
    pub error: f64,
    /// The output of the feed-forward, or the number given instead.
    pub feedforward: f64,
    /// kp times the error.
    pub proportional: f64,
    /// The sum of ki times the errors, this sample included, those apart where the integral rests.
    pub integral: f64,
    /// What keeps starts and switches from being jumps; it fades.
    pub transition: f64,
    /// What the law asks for.
    pub demanded: f64,
    /// What the limiter lets through: the output.
    pub drive: f64,
    /// Whether the demand lay beyond the limits.
    pub saturated: bool,
    /// Whether the demand was farther from the last drive than the slew allows.
    pub slewing: bool,
}

impl Terms {
    /// At rest at a drive.
    pub(super) fn at(drive: f64) -> Self {
        Self {
            reference: 0.0,
            target: 0.0,
            error: 0.0,
            feedforward: 0.0,
            proportional: 0.0,
            integral: 0.0,
            transition: 0.0,
            demanded: drive,
            drive,
            saturated: false,
            slewing: false,
        }
    }
}

/// How many samples were other than they should be.
///
/// ```
/// use hysteresis_core::{ControllerOptions, Counters, FeedForward, HybridController};
/// let options = ControllerOptions::new(2.0, 0.5, (-10.0, 10.0));
/// let mut controller = HybridController::new(FeedForward::None, None, &options)?;
/// controller.step(f64::NAN.into(), 1.0);
/// controller.step(3.0.into(), f64::NAN);
/// assert_eq!(controller.counters(), Counters { rejected: 1, missing: 1, ..Counters::default() });
/// # Ok::<(), hysteresis_core::Error>(())
/// ```
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize), serde(deny_unknown_fields))]
pub struct Counters {
    /// References, targets or feed-forwards that were not finite (or beyond 1e100), or missing where they must be given.
    pub rejected: u64,
    /// Measurements that were not finite (or beyond 1e100).
    pub missing: u64,
    /// Demands beyond the limits.
    pub saturated: u64,
    /// Demands farther from the last drive than the slew allows.
    pub slewing: u64,
}
