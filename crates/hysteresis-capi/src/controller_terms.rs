//! What a controller shows of its samples, as plain structs.

use core::mem::MaybeUninit;

use crate::controller::Controller;
use crate::status::{Status, guard, tell, there};

/// The terms of the last sample that was acted upon: the first four in the unit of the measurement, the others in that of the
/// drive. `unlimited_drive` = `feedforward` + `proportional` + `integral` + `bumpless`.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Terms {
    /// The reference of the feedback. With a preview it is the one that came `ahead` samples before the newest.
    pub reference: f64,
    /// The target of the feed-forward.
    pub target: f64,
    /// Reference minus measurement. Without a usable measurement it is the last error there was.
    pub error: f64,
    /// The error behind the filters.
    pub filtered_error: f64,
    /// The output of the feed-forward, or the drive that came instead.
    pub feedforward: f64,
    /// kp times the filtered error.
    pub proportional: f64,
    /// The sum of ki dt times the filtered errors.
    pub integral: f64,
    /// What keeps starts and switches from being jumps.
    pub bumpless: f64,
    /// The drive that the law asks for, before limits and slew.
    pub unlimited_drive: f64,
    /// The drive that goes out.
    pub drive: f64,
    /// 1 if the unlimited drive lay beyond the limits, else 0.
    pub saturated: i32,
    /// 1 if the unlimited drive was farther from the last drive than the slew allows, else 0.
    pub slewing: i32,
}

/// How many samples were unusual.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct Counters {
    /// References, or given feed-forwards, that were not finite (or beyond 1e100), or feed-forwards that did not come.
    pub rejected: u64,
    /// Measurements that were not finite (or beyond 1e100).
    pub missing: u64,
    /// Measurements that were finite but cannot be.
    pub implausible: u64,
    /// Unlimited drives beyond the limits.
    pub saturated: u64,
    /// Unlimited drives farther from the last drive than the slew allows.
    pub slewing: u64,
}

/// The terms of the last sample. Does not allocate.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_terms(
    controller: Option<&Controller>,
    terms: Option<&mut MaybeUninit<Terms>>,
) -> Status {
    guard(|| {
        let now = there("controller", controller)?.controller.terms();
        let made = Terms {
            reference: now.reference,
            target: now.target,
            error: now.error,
            filtered_error: now.filtered_error,
            feedforward: now.feedforward,
            proportional: now.proportional,
            integral: now.integral,
            bumpless: now.bumpless,
            unlimited_drive: now.unlimited_drive,
            drive: now.drive,
            saturated: i32::from(now.saturated),
            slewing: i32::from(now.slewing),
        };
        tell("terms", terms, made)
    })
}

/// How many samples were unusual since the controller was made or reset. Does not allocate.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_counters(
    controller: Option<&Controller>,
    counters: Option<&mut MaybeUninit<Counters>>,
) -> Status {
    guard(|| {
        let now = there("controller", controller)?.controller.counters();
        let made = Counters {
            rejected: now.rejected_count,
            missing: now.missing_count,
            implausible: now.implausible_count,
            saturated: now.saturated_count,
            slewing: now.slewing_count,
        };
        tell("counters", counters, made)
    })
}
