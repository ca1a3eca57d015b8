//! The exact inverse: from a target to the drive.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::binary::Sampled;
use hysteresis_core::{Process, QuasiStaticInverse, QuasiStaticState};

use crate::arrays::{check, each_row, slice};
use crate::controller_options::limits;
use crate::memory::{Object, Owner, Place, end};
use crate::stage::Stage;
use crate::status::{Status, guard, there};
use crate::text::{Buffer, at, read, saved};

/// The exact inverse of maps, hysteresis, loop shift and creep, sample by sample: the drive that brings the position to the
/// target. Modes, amplifier and dead time are not part of it. The drive never leaves its limits.
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

/// Makes an inverse at rest for a sampling interval of `dt` seconds and drives from `limit_low` to `limit_high`, in `memory`
/// of `bytes` bytes, or on the heap if `memory` is NULL. Limits that are both NaN are those of the stage. End it with
/// mpih_inverse_free.
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

/// The drive for a target. A target out of reach puts the drive at a limit. One that is not finite leaves the drive as it is
/// and is counted. NaN for NULL.
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
    let Some(inverse) = inverse else { return guard(|| there("inverse", None)) };
    let status = check(n, [("targets", targets), ("drives", drives)]);
    if status == Status::Ok {
        // SAFETY: as the header asks of the caller.
        unsafe { each_row(n, [targets], drives, |[target]| inverse.stream.step(target)) }
    }
    status
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

/// Puts out another drive than one that a target asks for, and remembers it: where something else drives for a while. It is
/// kept within the limits; one that is not finite is counted and changes nothing else. Returns the drive. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_inverse_follow_drive(inverse: Option<&mut Inverse>, drive: f64) -> f64 {
    inverse.map_or(f64::NAN, |inverse| inverse.stream.follow_drive(drive))
}

/// At rest since forever at a drive: the creep at its end, the hysteresis virgin but for the way there. Returns the position.
/// NaN for NULL.
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
    guard(|| {
        let state = there("inverse", inverse)?.state();
        // SAFETY: as the header asks of the caller.
        unsafe { Buffer { to: text.cast(), bytes, needed }.save(&state) }
    })
}

/// Goes on, bit for bit, from what mpih_inverse_save wrote for an inverse of the same stage, sampling interval and limits. If
/// it fails the inverse is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_load(inverse: Option<&mut Inverse>, text: *const c_char) -> Status {
    guard(|| {
        let inverse = there("inverse", inverse)?;
        // SAFETY: as the header asks of the caller.
        let state: Sampled<QuasiStaticState> = saved(unsafe { read("text", text) }?)?;
        Ok(inverse.stream.set_state(&at(state, inverse.dt)?)?)
    })
}
