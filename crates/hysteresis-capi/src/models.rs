//! The forward model, a simulated stage, and the exact inverse, from a target to the drive.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::binary::Sampled;
use hysteresis_control::stage::{StageForward, StageState};
use hysteresis_core::{Process, QuasiStaticInverse, QuasiStaticState};

use crate::boundary::{
    Buffer, Object, Owner, Place, Status, at, end, guard, limits, read, run, save, saved, slice, there,
};
use crate::stage::Stage;

/// The whole stage sample by sample, from the drive to the position: dead time, amplifier, maps, hysteresis, loop
/// shift, creep and modes. A simulated plant, or the model beside a real one.
pub struct Forward {
    owner: Owner,
    rest_drive: f64,
    pub(crate) stream: StageForward,
}

impl Forward {
    pub(crate) fn state(&self) -> Sampled<StageState> {
        Sampled { dt: self.stream.dt(), stream: self.stream.state() }
    }
}

impl Object for Forward {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

/// How many bytes mpih_forward_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_size() -> usize {
    size_of::<Forward>()
}

/// Of which number the address of the memory for mpih_forward_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_align() -> usize {
    align_of::<Forward>()
}

/// Makes a forward model at rest for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap
/// if `memory` is NULL. End it with mpih_forward_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_new(
    stage: Option<&Stage>,
    dt: f64,
    memory: *mut c_void,
    bytes: usize,
    forward: *mut *mut Forward,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        Ok(Forward { owner: Owner::Library, rest_drive: stage.rest_drive(), stream: stage.forward(dt)? })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, forward) })
}

/// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_free(forward: *mut Forward) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(forward) }
}

/// A row of a record: puts out a drive and returns the position at this moment, t_k. The drive is then held until
/// t_(k+1).
///
/// A drive beyond the limits of the stage is clamped and counted. One that is not finite leaves the position as it is
/// and is counted. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_step(forward: Option<&mut Forward>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.step(drive))
}

/// A plant in a loop: holds a drive for one sampling interval and returns the position at its end, just before the next
/// drive. That is what a controller reads next. Bad drives are as for mpih_forward_step. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_advance(forward: Option<&mut Forward>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.advance(drive))
}

/// The position that mpih_forward_step would return; nothing changes. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_peek(forward: Option<&Forward>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.peek(drive))
}

/// mpih_forward_step for `n` drives, bit for bit. Both arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_run(
    forward: Option<&mut Forward>,
    drives: *const f64,
    positions: *mut f64,
    n: usize,
) -> Status {
    let step = |forward: &mut Forward, [drive]: [f64; 1]| forward.stream.step(drive);
    // SAFETY: as the header asks of the caller.
    unsafe { run(("forward", forward), n, [("drives", drives)], ("positions", positions), step) }
}

/// The last position. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_position(forward: Option<&Forward>) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.output())
}

/// How many drives were not finite (or beyond 1e100).
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_rejected(forward: Option<&Forward>) -> u64 {
    forward.map_or(0, |forward| forward.stream.rejected())
}

/// How many drives lay beyond the limits of the stage and were clamped.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_clamped(forward: Option<&Forward>) -> u64 {
    forward.map_or(0, |forward| forward.stream.clamped())
}

/// At rest since forever at a drive: creep and modes at their ends, the hysteresis virgin but for the way there.
/// Returns the position. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_settle(forward: Option<&mut Forward>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.settle(drive))
}

/// As made: at rest at the rest drive of the stage, all counts zero.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_forward_reset(forward: Option<&mut Forward>) {
    if let Some(forward) = forward {
        forward.stream.reset();
        forward.stream.settle(forward.rest_drive);
    }
}

/// Takes over what was driven before, oldest drive first, one per sampling interval.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_follow(forward: Option<&mut Forward>, drives: *const f64, n: usize) -> Status {
    guard(|| {
        let forward = there("forward", forward)?;
        // SAFETY: as the header asks of the caller.
        Ok(forward.stream.follow(unsafe { slice("drives", n, drives) }?)?)
    })
}

/// Writes everything that the model remembers to `text`, as JSON with a closing zero byte, and the bytes that this
/// takes to `needed`. With NULL for `text` it only tells how many; `needed` may be NULL otherwise. Allocates.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_save(
    forward: Option<&Forward>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { save(("forward", forward), Forward::state, Buffer { to: text.cast(), bytes, needed }) }
}

/// Goes on, bit for bit, from what mpih_forward_save wrote for a model of the same stage and sampling interval. If it
/// fails the model is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_load(forward: Option<&mut Forward>, text: *const c_char) -> Status {
    guard(|| {
        let stream = &mut there("forward", forward)?.stream;
        // SAFETY: as the header asks of the caller.
        let state: Sampled<StageState> = saved(unsafe { read("text", text) }?)?;
        Ok(stream.set_state(&at(state, stream.dt())?)?)
    })
}

/// The exact inverse of maps, hysteresis, loop shift and creep, sample by sample: the drive that brings the position to
/// the target. Modes, amplifier and dead time are not part of it. The drive never leaves its limits.
pub struct Inverse {
    owner: Owner,
    pub(crate) dt: f64,
    rest_drive: f64,
    pub(crate) stream: QuasiStaticInverse,
}

impl Inverse {
    pub(crate) fn state(&self) -> Sampled<QuasiStaticState> {
        Sampled { dt: self.dt, stream: self.stream.state() }
    }
}

impl Object for Inverse {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

/// How many bytes mpih_inverse_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_size() -> usize {
    size_of::<Inverse>()
}

/// Of which number the address of the memory for mpih_inverse_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_align() -> usize {
    align_of::<Inverse>()
}

/// Makes an inverse at rest for a sampling interval of `dt` seconds and drives from `limit_low` to `limit_high`, in
/// `memory` of `bytes` bytes, or on the heap if `memory` is NULL. Limits that are both NaN are those of the stage. End
/// it with mpih_inverse_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_new(
    stage: Option<&Stage>,
    dt: f64,
    limit_low: f64,
    limit_high: f64,
    memory: *mut c_void,
    bytes: usize,
    inverse: *mut *mut Inverse,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        let stream = stage.inverse(dt, limits(limit_low, limit_high)?)?;
        Ok(Inverse { owner: Owner::Library, dt, rest_drive: stream.output(), stream })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, inverse) })
}

/// Ends an inverse: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_free(inverse: *mut Inverse) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(inverse) }
}

/// The drive for a target. A target out of reach puts the drive at a limit. One that is not finite leaves the drive as
/// it is and is counted. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_step(inverse: Option<&mut Inverse>, target: f64) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.step(target))
}

/// The drive that mpih_inverse_step would return; nothing changes. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_peek(inverse: Option<&Inverse>, target: f64) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.peek(target))
}

/// mpih_inverse_step for `n` targets, bit for bit. Both arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_run(
    inverse: Option<&mut Inverse>,
    targets: *const f64,
    drives: *mut f64,
    n: usize,
) -> Status {
    let step = |inverse: &mut Inverse, [target]: [f64; 1]| inverse.stream.step(target);
    // SAFETY: as the header asks of the caller.
    unsafe { run(("inverse", inverse), n, [("targets", targets)], ("drives", drives), step) }
}

/// The last drive. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_drive(inverse: Option<&Inverse>) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.output())
}

/// The position that the stage has at the last drive, if it is as the model says. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_position(inverse: Option<&Inverse>) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.position())
}

/// Whether the last target was out of reach and the drive is at a limit.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_saturated(inverse: Option<&Inverse>) -> bool {
    inverse.is_some_and(|inverse| inverse.stream.saturated())
}

/// How many targets were not finite (or beyond 1e100).
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_rejected(inverse: Option<&Inverse>) -> u64 {
    inverse.map_or(0, |inverse| inverse.stream.rejected())
}

/// Puts out another drive than one that a target asks for, and remembers it: where something else drives for a while.
/// It is kept within the limits; one that is not finite is counted and changes nothing else. Returns the drive. NaN for
/// NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_follow_drive(inverse: Option<&mut Inverse>, drive: f64) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.follow_drive(drive))
}

/// At rest since forever at a drive: the creep at its end, the hysteresis virgin but for the way there. Returns the
/// position. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_settle(inverse: Option<&mut Inverse>, drive: f64) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.settle(drive))
}

/// As made: at rest at 0 or the limit nearest to it, all counts zero.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_reset(inverse: Option<&mut Inverse>) {
    if let Some(inverse) = inverse {
        inverse.stream.reset();
        inverse.stream.settle(inverse.rest_drive);
    }
}

/// Takes over what was driven before, oldest drive first, one per sampling interval.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_follow(inverse: Option<&mut Inverse>, drives: *const f64, n: usize) -> Status {
    guard(|| {
        let inverse = there("inverse", inverse)?;
        // SAFETY: as the header asks of the caller.
        Ok(inverse.stream.follow(unsafe { slice("drives", n, drives) }?)?)
    })
}

/// Writes everything that the inverse remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_save(
    inverse: Option<&Inverse>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { save(("inverse", inverse), Inverse::state, Buffer { to: text.cast(), bytes, needed }) }
}

/// Goes on, bit for bit, from what mpih_inverse_save wrote for an inverse of the same stage, sampling interval and
/// limits. If it fails the inverse is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_load(inverse: Option<&mut Inverse>, text: *const c_char) -> Status {
    guard(|| {
        let inverse = there("inverse", inverse)?;
        // SAFETY: as the header asks of the caller.
        let state: Sampled<QuasiStaticState> = saved(unsafe { read("text", text) }?)?;
        Ok(inverse.stream.set_state(&at(state, inverse.dt)?)?)
    })
}
