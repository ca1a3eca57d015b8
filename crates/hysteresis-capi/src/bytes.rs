//! Stages and saved states as bytes: without files, and smaller than their text.

use core::mem::MaybeUninit;

use hysteresis_control::ObserverState;
use hysteresis_control::binary::{Binary, Sampled};
use hysteresis_control::stage::{self, StageState};
use hysteresis_core::{ControllerState, QuasiStaticState};

use crate::boundary::{Buffer, Failure, Status, at, guard, hand_over, slice, there};
use crate::controller::Controller;
use crate::models::{Forward, Inverse};
use crate::observer::Observer;
use crate::stage::Stage;

/// What C gives as bytes.
///
/// # Safety
/// `bytes` is NULL or `n` bytes, which nothing changes meanwhile.
unsafe fn read<T: Binary>(bytes: *const u8, n: usize) -> Result<T, Failure> {
    // SAFETY: as asked of the caller.
    Ok(T::from_bytes(unsafe { slice("bytes", n, bytes) }?)?)
}

/// Reads a stage from the `n` bytes that mpih_stage_to_bytes wrote, or from those in a header that
/// `mpi-hyst export --c` made. Other bytes are refused: MPIH_STATUS_FORMAT. Free the stage with mpih_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_stage_from_bytes(bytes: *const u8, n: usize, stage: *mut *mut Stage) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, || Stage::of(read::<stage::Stage>(bytes, n)?)) }
}

/// Writes a stage to `bytes`, of which there are `n`, and how many that takes to `needed`. With NULL for `bytes` it
/// only tells how many; `needed` may be NULL otherwise.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_stage_to_bytes(
    stage: Option<&Stage>,
    bytes: *mut u8,
    n: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Buffer { to: bytes, bytes: n, needed }.put("bytes", &there("stage", stage)?.inner.to_bytes()) })
}

/// mpih_forward_save in bytes, without a closing zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_save_bytes(
    forward: Option<&Forward>,
    bytes: *mut u8,
    n: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe {
        Buffer { to: bytes, bytes: n, needed }.put("bytes", &there("forward", forward)?.state().to_bytes())
    })
}

/// mpih_forward_load from the `n` bytes that mpih_forward_save_bytes wrote.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_forward_load_bytes(forward: Option<&mut Forward>, bytes: *const u8, n: usize) -> Status {
    guard(|| {
        let stream = &mut there("forward", forward)?.stream;
        // SAFETY: as the header asks of the caller.
        let state: Sampled<StageState> = unsafe { read(bytes, n) }?;
        Ok(stream.set_state(&at(state, stream.dt())?)?)
    })
}

/// mpih_inverse_save in bytes, without a closing zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_save_bytes(
    inverse: Option<&Inverse>,
    bytes: *mut u8,
    n: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe {
        Buffer { to: bytes, bytes: n, needed }.put("bytes", &there("inverse", inverse)?.state().to_bytes())
    })
}

/// mpih_inverse_load from the `n` bytes that mpih_inverse_save_bytes wrote.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_inverse_load_bytes(inverse: Option<&mut Inverse>, bytes: *const u8, n: usize) -> Status {
    guard(|| {
        let inverse = there("inverse", inverse)?;
        // SAFETY: as the header asks of the caller.
        let state: Sampled<QuasiStaticState> = unsafe { read(bytes, n) }?;
        Ok(inverse.stream.set_state(&at(state, inverse.dt)?)?)
    })
}

/// mpih_controller_save in bytes, without a closing zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_save_bytes(
    controller: Option<&Controller>,
    bytes: *mut u8,
    n: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    guard(|| {
        let state = there("controller", controller)?.controller.state();
        // SAFETY: as the header asks of the caller.
        unsafe { Buffer { to: bytes, bytes: n, needed }.put("bytes", &state.to_bytes()) }
    })
}

/// mpih_controller_load from the `n` bytes that mpih_controller_save_bytes wrote.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_load_bytes(
    controller: Option<&mut Controller>,
    bytes: *const u8,
    n: usize,
) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let state: ControllerState = unsafe { read(bytes, n) }?;
        Ok(controller.controller.set_state(&state)?)
    })
}

/// mpih_observer_save in bytes, without a closing zero byte.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_save_bytes(
    observer: Option<&Observer>,
    bytes: *mut u8,
    n: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe {
        Buffer { to: bytes, bytes: n, needed }.put("bytes", &there("observer", observer)?.observer.state().to_bytes())
    })
}

/// mpih_observer_load from the `n` bytes that mpih_observer_save_bytes wrote.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_load_bytes(
    observer: Option<&mut Observer>,
    bytes: *const u8,
    n: usize,
) -> Status {
    guard(|| {
        let observer = &mut there("observer", observer)?.observer;
        // SAFETY: as the header asks of the caller.
        let state: ObserverState = unsafe { read(bytes, n) }?;
        Ok(observer.set_state(&state)?)
    })
}
