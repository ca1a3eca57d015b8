//! The controller: feed-forward and feedback, sample by sample.

use core::ffi::c_void;
use core::mem::MaybeUninit;

use hysteresis_core::{Command, HybridController};

use crate::arrays::{check, each_row};
use crate::controller_options::ControllerOptions;
use crate::memory::{Object, Owner, Place, end};
use crate::stage::Stage;
use crate::status::{Status, guard, tell, there};

/// Feed-forward and proportional-integral feedback, sample by sample, within limits and slew rate.
pub struct Controller {
    owner: Owner,
    pub(crate) controller: HybridController,
}

impl Object for Controller {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

/// What is asked of a sample whose feed-forward comes with it. NaN is no missing number here: it is rejected.
fn given(reference: f64, feedforward: f64) -> Command {
    Command { feedforward: Some(feedforward), ..reference.into() }
}

/// How many bytes mpih_controller_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_size() -> usize {
    size_of::<Controller>()
}

/// Of which number the address of the memory for mpih_controller_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_align() -> usize {
    align_of::<Controller>()
}

/// Makes a controller of a stage for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap if
/// `memory` is NULL. NULL for `options` stands for those of mpih_controller_options_default. The stage needs limits, or the
/// options. End it with mpih_controller_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_new(
    stage: Option<&Stage>,
    dt: f64,
    options: Option<&ControllerOptions>,
    memory: *mut c_void,
    bytes: usize,
    controller: *mut *mut Controller,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        let controller = options.copied().unwrap_or_default().controller(stage, dt)?;
        Ok(Controller { owner: Owner::Library, controller })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, controller) })
}

/// Ends a controller: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_free(controller: *mut Controller) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(controller) }
}

/// Takes the reference and the measurement of now and returns the drive to put out.
///
/// The drive is always finite, within the limits and no farther than the slew allows from the last one. The first drive is
/// that of the start. A reference that is not finite holds the drive, a measurement that is not finite or cannot be does so
/// for a few samples; all are counted. NaN for NULL: there is no last drive that could be held.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_step(controller: Option<&mut Controller>, reference: f64, measurement: f64) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.step(reference.into(), measurement))
}

/// mpih_controller_step with a drive that takes the place of the feed-forward for this sample: always with
/// MPIH_FEEDFORWARD_GIVEN. A drive that is not finite holds the last one and is counted. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_step_given(
    controller: Option<&mut Controller>,
    reference: f64,
    feedforward: f64,
    measurement: f64,
) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.step(given(reference, feedforward), measurement))
}

/// The drive that mpih_controller_step would return; nothing changes. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_peek(controller: Option<&Controller>, reference: f64, measurement: f64) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.peek(reference.into(), measurement))
}

/// The drive that mpih_controller_step_given would return; nothing changes. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_peek_given(
    controller: Option<&Controller>,
    reference: f64,
    feedforward: f64,
    measurement: f64,
) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.peek(given(reference, feedforward), measurement))
}

/// The drive for a sample that only mpih_controller_commit takes: where writing to the amplifier may fail. A plan replaces the
/// one before; any change of the controller drops it. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_plan(controller: Option<&mut Controller>, reference: f64, measurement: f64) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.plan(reference.into(), measurement))
}

/// mpih_controller_plan with a drive that takes the place of the feed-forward. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_plan_given(
    controller: Option<&mut Controller>,
    reference: f64,
    feedforward: f64,
    measurement: f64,
) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.plan(given(reference, feedforward), measurement))
}

/// Takes the sample that was planned; false if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_commit(controller: Option<&mut Controller>) -> bool {
    controller.is_some_and(|controller| controller.controller.commit())
}

/// mpih_controller_step for `n` rows, bit for bit. Arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_run(
    controller: Option<&mut Controller>,
    references: *const f64,
    measurements: *const f64,
    drives: *mut f64,
    n: usize,
) -> Status {
    let Some(controller) = controller else { return guard(|| there("controller", None)) };
    let status = check(n, [("references", references), ("measurements", measurements), ("drives", drives)]);
    if status == Status::Ok {
        let step = |[reference, measurement]: [f64; 2]| controller.controller.step(reference.into(), measurement);
        // SAFETY: as the header asks of the caller.
        unsafe { each_row(n, [references, measurements], drives, step) }
    }
    status
}

/// mpih_controller_step_given for `n` rows, bit for bit. Arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_run_given(
    controller: Option<&mut Controller>,
    references: *const f64,
    feedforwards: *const f64,
    measurements: *const f64,
    drives: *mut f64,
    n: usize,
) -> Status {
    let Some(controller) = controller else { return guard(|| there("controller", None)) };
    let inputs = [references, feedforwards, measurements];
    let named = [
        ("references", references),
        ("feedforwards", feedforwards),
        ("measurements", measurements),
        ("drives", drives.cast_const()),
    ];
    let status = check(n, named);
    if status == Status::Ok {
        let step = |[reference, feedforward, measurement]: [f64; 3]| {
            controller.controller.step(given(reference, feedforward), measurement)
        };
        // SAFETY: as the header asks of the caller.
        unsafe { each_row(n, inputs, drives, step) }
    }
    status
}

/// The present drive: what the amplifier has. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_drive(controller: Option<&Controller>) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.drive())
}

/// How many samples early references must come, smoothing included; 0 without MPIH_FEEDFORWARD_PREVIEW.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_ahead(controller: Option<&Controller>) -> usize {
    controller.and_then(|controller| controller.controller.preview()).map_or(0, hysteresis_core::Preview::ahead)
}

/// For how many seconds at most, from the next sample on, the drive is not yet that of the law. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_lead_in(controller: Option<&Controller>) -> f64 {
    controller.map_or(f64::NAN, |controller| controller.controller.lead_in())
}

/// The gains, given or tuned, in V/um and V/um/s.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_gains(
    controller: Option<&Controller>,
    kp: Option<&mut MaybeUninit<f64>>,
    ki: Option<&mut MaybeUninit<f64>>,
) -> Status {
    guard(|| {
        let options = there("controller", controller)?.controller.options();
        tell("kp", kp, options.kp)?;
        tell("ki", ki, options.ki)
    })
}

/// The lowest and the highest drive.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_limits(
    controller: Option<&Controller>,
    low: Option<&mut MaybeUninit<f64>>,
    high: Option<&mut MaybeUninit<f64>>,
) -> Status {
    guard(|| {
        let limits = there("controller", controller)?.controller.options().limits;
        tell("low", low, limits.0)?;
        tell("high", high, limits.1)
    })
}
