//! The controller of a stage of several axes, sample by sample.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;
use core::ptr::null;

use hysteresis_control::multi_axis::{
    MultiAxisStage, MultiAxisStageController, MultiAxisStageState, Tracking, TrackingOptions,
};
use hysteresis_core::{ControllerOptions, HybridController};

use crate::axes::AxesStage;
use crate::boundary::{
    Buffer, Failure, Object, Owner, Place, Rows, Status, count, end, given, guard, read, run_rows, save, saved, slice,
    tell, there, wrong,
};
use crate::controller::{Counters, Mode, known_mode};

/// Feed-forward and feedback that lead all drives of a stage of several axes, within limits and slew rates.
pub struct AxesController {
    owner: Owner,
    controller: MultiAxisStageController,
    references: Box<[f64]>,
    measurements: Box<[f64]>,
    drives: Box<[f64]>,
}

impl Object for AxesController {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

impl Rows<2> for AxesController {
    fn rows(&mut self) -> ([&mut [f64]; 2], &mut [f64]) {
        ([&mut self.references, &mut self.measurements], &mut self.drives)
    }
}

impl AxesController {
    fn new(controller: MultiAxisStageController) -> Self {
        let room = || vec![0.0; controller.controller().controllers().len()].into();
        let (references, measurements, drives) = (room(), room(), room());
        Self { owner: Owner::Library, controller, references, measurements, drives }
    }

    // Of these three lengths are those of the stage, so nothing is left undone.

    fn step(&mut self) {
        let Self { controller, references, measurements, drives, .. } = self;
        let _ = controller.step((&**references).into(), measurements, drives);
    }

    fn peek(&mut self) {
        let Self { controller, references, measurements, drives, .. } = self;
        let _ = controller.peek((&**references).into(), measurements, drives);
    }

    fn plan(&mut self) {
        let Self { controller, references, measurements, drives, .. } = self;
        let _ = controller.plan((&**references).into(), measurements, drives);
    }

    fn axes(&self) -> &[HybridController] {
        self.controller.controller().controllers()
    }

    fn axis(&self, axis: usize) -> Result<&HybridController, Failure> {
        let axes = self.axes();
        axes.get(axis).ok_or_else(|| wrong(format!("axis: expected a number below {}, got {axis}", axes.len())))
    }
}

/// How a controller of several axes is set up. Fill it with mpih_axes_controller_options_default first, then change
/// what you need.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct AxesControllerOptions {
    /// How fast each drive may move, per second; NaN or infinity for no bound.
    pub slew: f64,
    /// By how much the feedback may at most amplify what disturbs a position, at any frequency: 1.05 to 5; NaN for 2.
    pub peak_sensitivity: f64,
    /// How long a motion takes from where it starts to its references, and a change to vanish, in seconds; NaN for 5
    /// ms.
    pub bumpless_time: f64,
    /// How many samples early references come, 1 to 512; -1 for as many as the dynamics use.
    pub ahead: i32,
    /// For how many measurements in a row that are missing the estimate stands in, before feed-forward goes on alone;
    /// -1 for 10.
    pub max_missing: i32,
    /// A row for each drive, the lowest and the highest measurement that can be, as its controller sees it: in the
    /// unit of the drive, what mpih_axes_controller_decoupling makes of the positions. A row of NaN is for no bounds,
    /// NULL for none at all. A measurement that cannot be moves no estimate.
    pub measurement_range: *const f64,
    /// For each drive the largest change of that from one sample to the next; NaN for no bound, NULL for none at all.
    pub max_measurement_step: *const f64,
}

impl Default for AxesControllerOptions {
    fn default() -> Self {
        let open = f64::NAN;
        Self {
            slew: open,
            peak_sensitivity: open,
            bumpless_time: open,
            ahead: -1,
            max_missing: -1,
            measurement_range: null(),
            max_measurement_step: null(),
        }
    }
}

/// `n` numbers, or as many that are left open for NULL.
///
/// # Safety
/// As for [`slice`] unless `numbers` is NULL.
unsafe fn open_or(name: &'static str, n: usize, numbers: *const f64) -> Result<Vec<f64>, Failure> {
    if numbers.is_null() {
        return Ok(vec![f64::NAN; n]);
    }
    // SAFETY: as above.
    unsafe { slice(name, n, numbers) }.map(<[f64]>::to_vec)
}

impl AxesControllerOptions {
    /// # Safety
    /// The pointers are NULL, or to two numbers and to one for each of the limits.
    unsafe fn controller(
        &self,
        stage: &MultiAxisStage,
        limits: &[[f64; 2]],
    ) -> Result<MultiAxisStageController, Failure> {
        let slew = given(self.slew).filter(|slew| *slew != f64::INFINITY);
        let (missing, ahead) = (count("max_missing", self.max_missing)?, count("ahead", self.ahead)?);
        // SAFETY: as above.
        let (ranges, steps) = unsafe {
            let ranges = open_or("measurement_range", 2 * limits.len(), self.measurement_range)?;
            (ranges, open_or("max_measurement_step", limits.len(), self.max_measurement_step)?)
        };
        let of = |((limits, range), step): ((&[f64; 2], &[f64; 2]), &f64)| {
            let usual = ControllerOptions::new(1.0, 0.0, stage.dt(), (limits[0], limits[1]));
            ControllerOptions {
                slew,
                bumpless_time: given(self.bumpless_time).unwrap_or(usual.bumpless_time),
                max_missing: missing.unwrap_or(usual.max_missing),
                measurement_range: (!range.iter().all(|end| end.is_nan())).then_some((range[0], range[1])),
                max_measurement_step: given(*step),
                ..usual
            }
        };
        let options: Vec<_> = limits.iter().zip(ranges.as_chunks().0).zip(&steps).map(of).collect();
        let usual = TrackingOptions::default();
        let peak_sensitivity = given(self.peak_sensitivity).unwrap_or(usual.peak_sensitivity);
        let tracking = TrackingOptions { ahead: ahead.map(|ahead| ahead as usize), peak_sensitivity };
        Ok(stage.controller(&options, &tracking)?)
    }
}

/// Leaves every option open (NaN, -1, NULL): what stands for it is chosen when the controller is made.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_options_default(
    options: Option<&mut MaybeUninit<AxesControllerOptions>>,
) -> Status {
    guard(|| tell("options", options, AxesControllerOptions::default()))
}

/// How many bytes mpih_axes_controller_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_size() -> usize {
    size_of::<AxesController>()
}

/// Of which number the address of the memory for mpih_axes_controller_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_align() -> usize {
    align_of::<AxesController>()
}

/// Makes a controller of a stage with as many drives as positions, 16 at most, in `memory` of `bytes` bytes, or on the
/// heap if `memory` is NULL. `limits` has `n` rows, the lowest and the highest drive of each. NULL for `options` stands
/// for those of mpih_axes_controller_options_default. End it with mpih_axes_controller_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_new(
    stage: Option<&AxesStage>,
    limits: *const f64,
    n: usize,
    options: Option<&AxesControllerOptions>,
    memory: *mut c_void,
    bytes: usize,
    controller: *mut *mut AxesController,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        if n != stage.drives() {
            return Err(wrong(format!("n: expected {}, the number of drives, got {n}", stage.drives())));
        }
        // SAFETY: as the header asks of the caller.
        let limits = unsafe { slice("limits", n.saturating_mul(2), limits) }?;
        // SAFETY: as the header asks of the caller.
        let made = unsafe { options.copied().unwrap_or_default().controller(stage, limits.as_chunks().0) }?;
        Ok(AxesController::new(made))
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, controller) })
}

/// Ends a controller: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_free(controller: *mut AxesController) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(controller) }
}

/// Takes the references, which come mpih_axes_controller_ahead samples early, and the measurements of now, and writes
/// the drives to put out: a number for each axis.
///
/// Drives are always finite, within their limits and no farther than the slew allows from the last ones. A reference
/// that is not finite holds all drives; a measurement that is not finite moves no estimate. All are counted. Fails for
/// NULL alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_step(
    controller: Option<&mut AxesController>,
    references: *const f64,
    measurements: *const f64,
    drives: *mut f64,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { mpih_axes_controller_run(controller, references, measurements, drives, 1) }
}

/// mpih_axes_controller_step for `n` rows, one behind the other, bit for bit. Arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_run(
    controller: Option<&mut AxesController>,
    references: *const f64,
    measurements: *const f64,
    drives: *mut f64,
    n: usize,
) -> Status {
    let inputs = [("references", references), ("measurements", measurements)];
    // SAFETY: as the header asks of the caller.
    unsafe { run_rows(("controller", controller), n, inputs, ("drives", drives), AxesController::step) }
}

/// The drives that mpih_axes_controller_step would write; nothing changes. Fails for NULL alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_peek(
    controller: Option<&mut AxesController>,
    references: *const f64,
    measurements: *const f64,
    drives: *mut f64,
) -> Status {
    let inputs = [("references", references), ("measurements", measurements)];
    // SAFETY: as the header asks of the caller.
    unsafe { run_rows(("controller", controller), 1, inputs, ("drives", drives), AxesController::peek) }
}

/// The drives for a sample that only mpih_axes_controller_commit takes: where writing to the amplifiers may fail. A
/// plan replaces the one before; any change of the controller drops it. Fails for NULL alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_plan(
    controller: Option<&mut AxesController>,
    references: *const f64,
    measurements: *const f64,
    drives: *mut f64,
) -> Status {
    let inputs = [("references", references), ("measurements", measurements)];
    // SAFETY: as the header asks of the caller.
    unsafe { run_rows(("controller", controller), 1, inputs, ("drives", drives), AxesController::plan) }
}

/// Takes the sample that was planned; false if there is none.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_commit(controller: Option<&mut AxesController>) -> bool {
    controller.is_some_and(|controller| controller.controller.commit())
}

/// The present drive of an axis: what its amplifier has. NaN for NULL, and if there is no such axis.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_drive(controller: Option<&AxesController>, axis: usize) -> f64 {
    let of_axis = controller.and_then(|controller| controller.axes().get(axis));
    of_axis.map_or(f64::NAN, HybridController::drive)
}

/// What comes in with a drive that is not of the model, as measurements tell. NaN for NULL, and if there is no such
/// axis.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_disturbance(controller: Option<&AxesController>, axis: usize) -> f64 {
    let of = |controller: &AxesController| controller.controller.tracking()?.disturbance().get(axis).copied();
    controller.and_then(of).unwrap_or(f64::NAN)
}

/// The lowest and the highest drive of an axis.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_limits(
    controller: Option<&AxesController>,
    axis: usize,
    low: Option<&mut MaybeUninit<f64>>,
    high: Option<&mut MaybeUninit<f64>>,
) -> Status {
    guard(|| {
        let limits = there("controller", controller)?.axis(axis)?.options().limits;
        tell("low", low, limits.0)?;
        tell("high", high, limits.1)
    })
}

/// By how much a drive would have to change to move a position by one unit, once all has settled: the inverse of the
/// static gain of the stage, so that all other positions stay. The controller of a drive sees the sum of these times
/// the positions. NaN for NULL, and if there is no such drive or position.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_decoupling(
    controller: Option<&AxesController>,
    drive: usize,
    position: usize,
) -> f64 {
    let entry = |controller: &AxesController| {
        let matrix = controller.controller.controller().decoupling();
        matrix.entries().chunks_exact(matrix.axes()).nth(drive)?.get(position).copied()
    };
    controller.and_then(entry).unwrap_or(f64::NAN)
}

/// How many samples early references must come.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_ahead(controller: Option<&AxesController>) -> usize {
    controller.and_then(|controller| controller.controller.tracking()).map_or(0, Tracking::ahead)
}

/// For how many seconds at most, from the next sample on, a drive is not yet that of the law: the longest of all axes.
/// NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_lead_in(controller: Option<&AxesController>) -> f64 {
    let longest =
        |controller: &AxesController| controller.axes().iter().map(HybridController::lead_in).fold(0.0, f64::max);
    controller.map_or(f64::NAN, longest)
}

/// What the controller of an axis does with its samples. MPIH_MODE_HOLD for NULL, and if there is no such axis.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_mode(controller: Option<&AxesController>, axis: usize) -> Mode {
    let of_axis = controller.and_then(|controller| controller.axes().get(axis));
    of_axis.map_or(Mode::Hold, |of_axis| of_axis.mode().into())
}

/// Changes what the controllers of all axes do with their samples, from the next one on and without a jump: a number of
/// mpih_mode, but for MPIH_MODE_STOP, which mpih_axes_controller_stop enters. Does not allocate unless it fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_set_mode(controller: Option<&mut AxesController>, mode: i32) -> Status {
    guard(|| {
        let controller = &mut there("controller", controller)?.controller;
        Ok(controller.controller_mut().set_mode(known_mode(mode)?)?)
    })
}

/// Which share of the disturbance the drive of an axis takes away, 0 to 1, from the next sample on and without a
/// jump. It is 1 in a new controller. Does not allocate unless it fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_set_gain(
    controller: Option<&mut AxesController>,
    axis: usize,
    kp: f64,
) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.set_gains(axis, kp, 0.0)?))
}

/// Holds all drives, from the next sample on. Neither allocates nor fails: it may be called in the loop.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_hold(controller: Option<&mut AxesController>) {
    if let Some(controller) = controller {
        controller.controller.controller_mut().hold();
    }
}

/// Ramps the `n` drives to their `rest_drives` at `rate` per second, or at the slew if that is slower, and holds them
/// there, whatever references and measurements come. Go on calling step: every call writes the next drives of the ramp.
/// Does not allocate unless it fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_stop(
    controller: Option<&mut AxesController>,
    rate: f64,
    rest_drives: *const f64,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let rest = unsafe { slice("rest_drives", n, rest_drives) }?;
        Ok(controller.controller.controller_mut().stop(rate, rest)?)
    })
}

/// Back from a hold or a stop to the mode before it. Neither allocates nor fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_release(controller: Option<&mut AxesController>) {
    if let Some(controller) = controller {
        controller.controller.controller_mut().release();
    }
}

/// As made, but for the drives, which stay: the next motion starts from them. For the model it is as if they had come
/// from rest one sample ago: mpih_axes_controller_follow tells it more. All counts are zero. Neither allocates nor
/// fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_reset(controller: Option<&mut AxesController>) {
    if let Some(controller) = controller {
        // Only drives that are given can be refused.
        let _ = controller.controller.reset(None);
    }
}

/// mpih_axes_controller_reset, the amplifiers being at `n` other drives now. If it fails the controller is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_reset_at(
    controller: Option<&mut AxesController>,
    drives: *const f64,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        Ok(controller.controller.reset(Some(unsafe { slice("drives", n, drives) }?))?)
    })
}

/// Goes on from `n` other drives that the amplifiers have, with everything that is remembered. For the model they go
/// out for one sample more: in a new controller, as if they had come from rest one sample ago.
/// mpih_axes_controller_follow tells it more.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_start_at(
    controller: Option<&mut AxesController>,
    drives: *const f64,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        Ok(controller.controller.start_at(unsafe { slice("drives", n, drives) }?)?)
    })
}

/// Takes over what was driven before: `n` rows of drives, oldest first, one per sampling interval.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_follow(
    controller: Option<&mut AxesController>,
    drives: *const f64,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let drives = unsafe { slice("drives", n.saturating_mul(controller.drives.len()), drives) }?;
        Ok(controller.controller.follow(drives)?)
    })
}

/// How many samples of an axis were unusual since the controller was made or reset. Does not allocate unless it fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_controller_counters(
    controller: Option<&AxesController>,
    axis: usize,
    counters: Option<&mut MaybeUninit<Counters>>,
) -> Status {
    guard(|| {
        let counted = there("controller", controller)?.axis(axis)?.counters();
        tell("counters", counters, counted.into())
    })
}

/// Writes everything that the controller remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_save(
    controller: Option<&AxesController>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe {
        save(
            ("controller", controller),
            |controller| controller.controller.state(),
            Buffer { to: text.cast(), bytes, needed },
        )
    }
}

/// Goes on, bit for bit, from what mpih_axes_controller_save wrote for a controller of the same stage, limits and
/// options. The amplifiers must be at the drives of the state. If it fails the controller is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_controller_load(
    controller: Option<&mut AxesController>,
    text: *const c_char,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let state: MultiAxisStageState = saved(unsafe { read("text", text) }?)?;
        Ok(controller.controller.set_state(&state)?)
    })
}
