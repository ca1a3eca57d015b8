//! Changes of a controller that runs, and its saved state.

use core::ffi::c_char;
use core::mem::MaybeUninit;

use hysteresis_core::ControllerState;

use crate::arrays::slice;
use crate::controller::Controller;
use crate::status::{Failure, Status, guard, there};
use crate::text::{Buffer, read, saved};

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

/// Changes what the controller does with its samples, from the next one on and without a jump: a number of mpih_mode, but for
/// MPIH_MODE_STOP, which mpih_controller_stop enters.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_set_mode(controller: Option<&mut Controller>, mode: i32) -> Status {
    use hysteresis_core::Mode as Known;
    guard(|| {
        let controller = there("controller", controller)?;
        let known = [Known::Run, Known::Feedforward, Known::Hold, Known::Stop];
        let Some(mode) = known.into_iter().find(|known| Mode::from(*known) as i32 == mode) else {
            let message = format!("mode: expected 0, 1 or 2, a number of mpih_mode, got {mode}");
            return Err(Failure::new(Status::Argument, message));
        };
        Ok(controller.controller.set_mode(mode)?)
    })
}

/// Holds the drive, from the next sample on. Neither allocates nor fails: it may be called in the loop.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_hold(controller: Option<&mut Controller>) {
    if let Some(controller) = controller {
        controller.controller.hold();
    }
}

/// Ramps the drive to `rest_drive` at `rate` per second, or at the slew if that is slower, and holds it there, whatever
/// reference and measurement come. Go on calling step: every call returns the next drive of the ramp. Does not allocate unless
/// it fails.
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

/// As made, but for gains that were changed since and for the drive, which stays: the next motion starts from it. All counts
/// are zero. Neither allocates nor fails.
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

/// Goes on from another drive that the amplifier has, with everything that is remembered: after mpih_controller_load, if the
/// amplifier is not where it was.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_controller_start_at(controller: Option<&mut Controller>, drive: f64) -> Status {
    guard(|| Ok(there("controller", controller)?.controller.start_at(drive)?))
}

/// Takes over what was driven before, oldest drive first, one per sampling interval. The next motion starts from the last of
/// the drives.
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
    guard(|| {
        let state = there("controller", controller)?.controller.state();
        // SAFETY: as the header asks of the caller.
        unsafe { Buffer { to: text.cast(), bytes, needed }.save(&state) }
    })
}

/// Goes on, bit for bit, from what mpih_controller_save wrote for a controller of the same stage, sampling interval, limits and
/// gains. The amplifier must be at the drive of the state. If it fails the controller is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_controller_load(controller: Option<&mut Controller>, text: *const c_char) -> Status {
    guard(|| {
        let controller = there("controller", controller)?;
        // SAFETY: as the header asks of the caller.
        let state: ControllerState = saved(unsafe { read("text", text) }?)?;
        Ok(controller.controller.set_state(&state)?)
    })
}
