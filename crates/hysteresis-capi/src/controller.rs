//! The controller: feed-forward and feedback, sample by sample; changes while it runs, how it is set up, what it shows.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::stage::{self, FeedForwardKind};
use hysteresis_core::{Command, ControllerOptions as Options, ControllerState, HybridController};

use crate::boundary::{
    Buffer, Failure, Object, Owner, Place, Status, count, end, given, guard, limits, pair, read, run, save, saved,
    slice, tell, there, wrong,
};
use crate::stage::Stage;

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
fn with_given(reference: f64, feedforward: f64) -> Command {
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

/// Makes a controller of a stage for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap
/// if `memory` is NULL. NULL for `options` stands for those of mpih_controller_options_default. The stage needs limits,
/// or the options. End it with mpih_controller_free.
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
/// The drive is always finite, within the limits and no farther than the slew allows from the last one. The first drive
/// is that of the start. A reference that is not finite holds the drive, a measurement that is not finite or cannot be
/// does so for a few samples; all are counted. NaN for NULL: there is no last drive that could be held.
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
    controller
        .map_or(f64::NAN, |controller| controller.controller.step(with_given(reference, feedforward), measurement))
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
    controller
        .map_or(f64::NAN, |controller| controller.controller.peek(with_given(reference, feedforward), measurement))
}

/// The drive for a sample that only mpih_controller_commit takes: where writing to the amplifier may fail. A plan
/// replaces the one before; any change of the controller drops it. NaN for NULL.
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
    controller
        .map_or(f64::NAN, |controller| controller.controller.plan(with_given(reference, feedforward), measurement))
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
    let inputs = [("references", references), ("measurements", measurements)];
    let step = |controller: &mut Controller, [reference, measurement]: [f64; 2]| {
        controller.controller.step(reference.into(), measurement)
    };
    // SAFETY: as the header asks of the caller.
    unsafe { run(("controller", controller), n, inputs, ("drives", drives), step) }
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
    let inputs = [("references", references), ("feedforwards", feedforwards), ("measurements", measurements)];
    let step = |controller: &mut Controller, [reference, feedforward, measurement]: [f64; 3]| {
        controller.controller.step(with_given(reference, feedforward), measurement)
    };
    // SAFETY: as the header asks of the caller.
    unsafe { run(("controller", controller), n, inputs, ("drives", drives), step) }
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

/// What a controller does with its samples.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// Feed-forward and feedback.
    Run = 0,
    /// Feed-forward alone; the integral is frozen and stays part of the drive.
    Feedforward = 1,
    /// The drive stays.
    Hold = 2,
    /// The drive goes to a rest drive at a given rate and stays there: mpih_controller_stop.
    Stop = 3,
}

impl From<hysteresis_core::Mode> for Mode {
    fn from(mode: hysteresis_core::Mode) -> Self {
        match mode {
            hysteresis_core::Mode::Run => Self::Run,
            hysteresis_core::Mode::Feedforward => Self::Feedforward,
            hysteresis_core::Mode::Hold => Self::Hold,
            hysteresis_core::Mode::Stop => Self::Stop,
        }
    }
}

/// What the controller does with its samples; MPIH_MODE_HOLD for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_mode(controller: Option<&Controller>) -> Mode {
    controller.map_or(Mode::Hold, |controller| controller.controller.mode().into())
}

/// Changes what the controller does with its samples, from the next one on and without a jump: a number of mpih_mode,
/// but for MPIH_MODE_STOP, which mpih_controller_stop enters.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_set_mode(controller: Option<&mut Controller>, mode: i32) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.set_mode(known_mode(mode)?)?))
}

/// The mode of a number of mpih_mode.
pub(crate) fn known_mode(mode: i32) -> Result<hysteresis_core::Mode, Failure> {
    use hysteresis_core::Mode as Known;
    let known = [Known::Run, Known::Feedforward, Known::Hold, Known::Stop];
    let found = known.into_iter().find(|known| Mode::from(*known) as i32 == mode);
    found.ok_or_else(|| wrong(format!("mode: expected 0, 1 or 2, a number of mpih_mode, got {mode}")))
}

/// Holds the drive, from the next sample on. Neither allocates nor fails: it may be called in the loop.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_hold(controller: Option<&mut Controller>) {
    if let Some(controller) = controller {
        controller.controller.hold();
    }
}

/// Ramps the drive to `rest_drive` at `rate` per second, or at the slew if that is slower, and holds it there, whatever
/// reference and measurement come. Go on calling step: every call returns the next drive of the ramp. Does not allocate
/// unless it fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_stop(controller: Option<&mut Controller>, rate: f64, rest_drive: f64) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.stop(rate, rest_drive)?))
}

/// Back from a hold or a stop to the mode before it. Neither allocates nor fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_release(controller: Option<&mut Controller>) {
    if let Some(controller) = controller {
        controller.controller.release();
    }
}

/// Changes the gains, in V/um and V/um/s, without a jump. Filters stay. Does not allocate unless it fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_set_gains(controller: Option<&mut Controller>, kp: f64, ki: f64) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.set_gains(kp, ki)?))
}

/// As made, but for gains that were changed since and for the drive, which stays: the next motion starts from it. All
/// counts are zero. Neither allocates nor fails.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_reset(controller: Option<&mut Controller>) {
    if let Some(controller) = controller {
        controller.controller.reset();
    }
}

/// mpih_controller_reset, the amplifier being at another drive now.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_reset_at(controller: Option<&mut Controller>, drive: f64) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.reset_at(drive)?))
}

/// Goes on from another drive that the amplifier has, with everything that is remembered: after mpih_controller_load,
/// if the amplifier is not where it was.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_start_at(controller: Option<&mut Controller>, drive: f64) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.start_at(drive)?))
}

/// Takes over what was driven before, oldest drive first, one per sampling interval. The next motion starts from the
/// last of the drives.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_follow(
    controller: Option<&mut Controller>,
    drives: *const f64,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        Ok(controller.controller.follow(unsafe { slice("drives", n, drives) }?)?)
    })
}

/// Writes everything that the controller remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_save(
    controller: Option<&Controller>,
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

/// Goes on, bit for bit, from what mpih_controller_save wrote for a controller of the same stage, sampling interval,
/// limits and gains. The amplifier must be at the drive of the state. If it fails the controller is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_load(controller: Option<&mut Controller>, text: *const c_char) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let state: ControllerState = saved(unsafe { read("text", text) }?)?;
        Ok(controller.controller.set_state(&state)?)
    })
}

/// Where the feed-forward of a controller comes from.
#[repr(i32)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Feedforward {
    /// The exact inverse of the reference of now.
    Inverse = 0,
    /// The exact inverse of a target made of references that come early (mpih_controller_ahead samples): through the
    /// inverse of amplifier, modes and dead time too.
    Preview = 1,
    /// Drives that come with every sample: mpih_controller_step_given.
    Given = 2,
}

/// How a controller is set up. Fill it with mpih_controller_options_default first, then change what you need. NaN
/// stands for what the stage says.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct ControllerOptions {
    /// The lowest drive; both limits are given or none. They lie within those of the stage.
    pub limit_low: f64,
    /// The highest drive.
    pub limit_high: f64,
    /// The proportional gain, in V/um. Both gains are given or none: without them gains and filters are tuned for the
    /// stage.
    pub kp: f64,
    /// The integral gain, in V/um/s.
    pub ki: f64,
    /// How fast the drive may move, per second; infinity for no bound.
    pub slew: f64,
    /// The drive that the amplifier has at the start; NaN for 0 or the limit nearest to it.
    pub start_drive: f64,
    /// How long the difference at a start or a switch takes to go to zero, in seconds; NaN for 5 ms.
    pub bumpless_time: f64,
    /// The lowest measurement that the sensor can show; both ends are given or none. NaN for a stroke beyond the
    /// positions.
    pub measurement_low: f64,
    /// The highest measurement that the sensor can show.
    pub measurement_high: f64,
    /// The largest change of the measurement from one sample to the next; NaN for no bound.
    pub max_measurement_step: f64,
    /// Over how many seconds references with steps and corners are smoothed; 0 for not at all. With
    /// MPIH_FEEDFORWARD_PREVIEW only. The `smoothing` of the properties of a stage leaves its modes at rest.
    pub smoothing: f64,
    /// One of the numbers of mpih_feedforward.
    pub feedforward: i32,
    /// How many samples early references come, before smoothing; -1 for as many as the stage needs. With
    /// MPIH_FEEDFORWARD_PREVIEW only.
    pub ahead: i32,
    /// How many measurements in a row may be missing, the drive being held, before feed-forward goes on alone; -1 for 10. Where
    /// losses follow each other within the bumpless time, the last error stands in.
    pub max_missing: i32,
    /// 0.
    pub reserved: i32,
}

impl Default for ControllerOptions {
    fn default() -> Self {
        let open = f64::NAN;
        Self {
            limit_low: open,
            limit_high: open,
            kp: open,
            ki: open,
            slew: open,
            start_drive: open,
            bumpless_time: open,
            measurement_low: open,
            measurement_high: open,
            max_measurement_step: open,
            smoothing: 0.0,
            feedforward: Feedforward::Inverse as i32,
            ahead: -1,
            max_missing: -1,
            reserved: 0,
        }
    }
}

impl ControllerOptions {
    /// A controller of a stage.
    pub(crate) fn controller(&self, stage: &stage::Stage, dt: f64) -> Result<HybridController, Failure> {
        if self.reserved != 0 {
            return Err(wrong(format!("reserved: expected 0, got {}", self.reserved)));
        }
        let kind = self.kind(stage, dt)?;
        let limits = limits(self.limit_low, self.limit_high)?;
        let mut options = match pair(["kp", "ki"], [self.kp, self.ki])? {
            Some(gains) => stage.controller_options_with_gains(dt, limits, gains)?,
            None => stage.controller_options(dt, limits)?,
        };
        self.change(&mut options)?;
        Ok(stage.controller(kind, &options)?)
    }

    /// What is given takes the place of what the stage says.
    fn change(&self, options: &mut Options) -> Result<(), Failure> {
        if let Some(slew) = given(self.slew) {
            options.slew = (slew != f64::INFINITY).then_some(slew);
        }
        options.start_drive = given(self.start_drive).or(options.start_drive);
        options.bumpless_time = given(self.bumpless_time).unwrap_or(options.bumpless_time);
        let range = pair(["measurement_low", "measurement_high"], [self.measurement_low, self.measurement_high])?;
        options.measurement_range = range.or(options.measurement_range);
        options.max_measurement_step = given(self.max_measurement_step).or(options.max_measurement_step);
        options.max_missing = count("max_missing", self.max_missing)?.unwrap_or(options.max_missing);
        Ok(())
    }

    fn kind(&self, stage: &stage::Stage, dt: f64) -> Result<FeedForwardKind, Failure> {
        let ahead = count("ahead", self.ahead)?;
        if self.feedforward == Feedforward::Preview as i32 {
            let ahead = ahead.map_or_else(|| stage.preview_ahead(dt), |ahead| Ok(ahead as usize))?;
            return Ok(FeedForwardKind::Preview { ahead, smoothing: self.smoothing });
        }
        if let Some(ahead) = ahead {
            return Err(wrong(format!("ahead: expected -1 without MPIH_FEEDFORWARD_PREVIEW, got {ahead}")));
        }
        if self.smoothing != 0.0 {
            let got = self.smoothing;
            return Err(wrong(format!("smoothing: expected 0 without MPIH_FEEDFORWARD_PREVIEW, got {got:?}")));
        }
        match self.feedforward {
            known if known == Feedforward::Inverse as i32 => Ok(FeedForwardKind::Inverse),
            known if known == Feedforward::Given as i32 => Ok(FeedForwardKind::Given),
            got => Err(wrong(format!("feedforward: expected 0, 1 or 2, a number of mpih_feedforward, got {got}"))),
        }
    }
}

/// Leaves every option open (NaN, -1): the stage decides when the controller is made. The feed-forward is the exact
/// inverse of the reference of now.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_options_default(options: Option<&mut MaybeUninit<ControllerOptions>>) -> Status {
    guard(|| tell("options", options, ControllerOptions::default()))
}

/// The terms of the last sample that was acted upon: the first four in the unit of the measurement, the others in that
/// of the drive. `unlimited_drive` = `feedforward` + `proportional` + `integral` + `bumpless`.
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

impl From<hysteresis_core::Counters> for Counters {
    fn from(now: hysteresis_core::Counters) -> Self {
        Self {
            rejected: now.rejected_count,
            missing: now.missing_count,
            implausible: now.implausible_count,
            saturated: now.saturated_count,
            slewing: now.slewing_count,
        }
    }
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
    guard(|| tell("counters", counters, there("controller", controller)?.controller.counters().into()))
}
