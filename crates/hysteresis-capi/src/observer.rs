//! The observer: the position behind a noisy measurement.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::stage::Error;
use hysteresis_control::{ObserverOptions, ObserverState};

use crate::boundary::{Buffer, Object, Owner, Place, Status, end, given, guard, read, run, save, saved, slice, there};
use crate::stage::Stage;

/// What the model of a stage and a noisy measurement say together of the position: a Kalman filter. Feed its estimate
/// to the controller instead of the measurement.
pub struct Observer {
    owner: Owner,
    pub(crate) observer: hysteresis_control::Observer,
}

impl Object for Observer {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

/// How many bytes mpih_observer_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_size() -> usize {
    size_of::<Observer>()
}

/// Of which number the address of the memory for mpih_observer_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_align() -> usize {
    align_of::<Observer>()
}

/// Makes an observer at rest for a sampling interval of `dt` seconds, in `memory` of `bytes` bytes, or on the heap if
/// `memory` is NULL. End it with mpih_observer_free.
///
/// `drift`: by how much what the model does not know changes in one second, rms, in the unit of the position. `noise`:
/// the rms noise of the measurement; NaN for that of the stage.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_new(
    stage: Option<&Stage>,
    dt: f64,
    drift: f64,
    noise: f64,
    memory: *mut c_void,
    bytes: usize,
    observer: *mut *mut Observer,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        let noise = given(noise).or(stage.parts().noise).ok_or(Error::NoNoise)?;
        let observer = hysteresis_control::Observer::new(stage, dt, &ObserverOptions { noise, drift })?;
        Ok(Observer { owner: Owner::Library, observer })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, observer) })
}

/// Ends an observer: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_free(observer: *mut Observer) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(observer) }
}

/// Takes the drive that was held since the last sample and the measurement of now, read just before the next drive is
/// put out; returns the position of now.
///
/// Without a finite measurement the model goes on alone, without a finite drive it stays at the last one; either is
/// counted. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_step(observer: Option<&mut Observer>, drive: f64, measurement: f64) -> f64 {
    observer.map_or(f64::NAN, |observer| observer.observer.step(drive, measurement))
}

/// mpih_observer_step for `n` rows, bit for bit. Arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_run(
    observer: Option<&mut Observer>,
    drives: *const f64,
    measurements: *const f64,
    positions: *mut f64,
    n: usize,
) -> Status {
    let inputs = [("drives", drives), ("measurements", measurements)];
    let step = |observer: &mut Observer, [drive, measurement]: [f64; 2]| observer.observer.step(drive, measurement);
    // SAFETY: as the header asks of the caller.
    unsafe { run(("observer", observer), n, inputs, ("positions", positions), step) }
}

/// What the model does not know, at the input of the modes, in the unit of the position. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_disturbance(observer: Option<&Observer>) -> f64 {
    observer.map_or(f64::NAN, |observer| observer.observer.disturbance())
}

/// How many drives or measurements were not finite.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_rejected(observer: Option<&Observer>) -> u64 {
    observer.map_or(0, |observer| observer.observer.rejected())
}

/// As made: at rest at the rest drive of the stage, all counts zero.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_observer_reset(observer: Option<&mut Observer>) {
    if let Some(observer) = observer {
        observer.observer.reset();
    }
}

/// Takes over what was driven before, oldest drive first, one per sampling interval, without measurements.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_follow(observer: Option<&mut Observer>, drives: *const f64, n: usize) -> Status {
    guard(|| {
        let observer = there("observer", observer)?;
        // SAFETY: as the header asks of the caller.
        Ok(observer.observer.follow(unsafe { slice("drives", n, drives) }?)?)
    })
}

/// Writes everything that the observer remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_save(
    observer: Option<&Observer>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe {
        save(("observer", observer), |observer| observer.observer.state(), Buffer { to: text.cast(), bytes, needed })
    }
}

/// Goes on, bit for bit, from what mpih_observer_save wrote for an observer of the same stage, sampling interval, noise
/// and drift. If it fails the observer is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_observer_load(observer: Option<&mut Observer>, text: *const c_char) -> Status {
    guard(|| {
        let observer = there("observer", observer)?;
        // SAFETY: as the header asks of the caller.
        let state: ObserverState = saved(unsafe { read("text", text) }?)?;
        Ok(observer.observer.set_state(&state)?)
    })
}
