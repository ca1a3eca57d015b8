//! Oscillators with hysteresis inside, read from their files, and their forward model.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::oscillator::{HystereticOscillator, OscillatorForward, OscillatorState};
use hysteresis_core::Process;

use crate::boundary::{
    Buffer, Object, Owner, Place, Status, end, free, guard, hand_over, read, read_file, run, save, saved, there,
};

/// An oscillator with hysteresis inside: what the file of a HystereticOscillator says. It never changes, so several
/// threads may use it at once. What is made from it keeps what it needs: the oscillator may be freed before.
pub struct Oscillator {
    pub(crate) inner: HystereticOscillator,
}

/// Reads an oscillator from the text of its file. `text` is UTF-8 and ends with a zero byte. Free it with
/// mpih_oscillator_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_from_json(text: *const c_char, oscillator: *mut *mut Oscillator) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe {
        hand_over("oscillator", oscillator, || {
            Ok(Oscillator { inner: HystereticOscillator::from_json(read("text", text)?)? })
        })
    }
}

/// Reads the file of an oscillator. `path` is UTF-8 and ends with a zero byte. Free it with mpih_oscillator_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_from_file(path: *const c_char, oscillator: *mut *mut Oscillator) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe {
        hand_over("oscillator", oscillator, || {
            Ok(Oscillator { inner: HystereticOscillator::from_json(&read_file(path)?)? })
        })
    }
}

/// Frees an oscillator; nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_free(oscillator: *mut Oscillator) {
    // SAFETY: as the header asks of the caller.
    unsafe { free(oscillator) }
}

/// An oscillator sample by sample, from the drive to the position, integrated in sub-steps.
pub struct OscillatorStream {
    owner: Owner,
    stream: OscillatorForward,
}

impl Object for OscillatorStream {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

/// How many bytes mpih_oscillator_forward_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_size() -> usize {
    size_of::<OscillatorStream>()
}

/// Of which number the address of the memory for mpih_oscillator_forward_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_align() -> usize {
    align_of::<OscillatorStream>()
}

/// Makes a forward model of an oscillator at rest for a sampling interval of `dt` seconds, integrated in so many
/// sub-steps, or in as many as the oscillator needs for 0; in `memory` of `bytes` bytes, or on the heap if `memory` is
/// NULL. End it with mpih_oscillator_forward_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_forward_new(
    oscillator: Option<&Oscillator>,
    dt: f64,
    sub_steps: usize,
    memory: *mut c_void,
    bytes: usize,
    forward: *mut *mut OscillatorStream,
) -> Status {
    let make = || {
        let asked = (sub_steps > 0).then_some(sub_steps);
        let stream = OscillatorForward::new(&there("oscillator", oscillator)?.inner, dt, asked)?;
        Ok(OscillatorStream { owner: Owner::Library, stream })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, forward) })
}

/// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_forward_free(forward: *mut OscillatorStream) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(forward) }
}

/// A row of a record: returns the position at this moment, t_k, then holds the drive until t_(k+1).
///
/// A drive that is not finite counts as the last one. One that would bring the motion beyond 1e100 changes nothing.
/// Both are counted. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_step(forward: Option<&mut OscillatorStream>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.step(drive))
}

/// A plant in a loop: holds a drive for one sampling interval and returns the position at its end. Bad drives are as
/// for mpih_oscillator_forward_step. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_advance(forward: Option<&mut OscillatorStream>, drive: f64) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.advance(drive))
}

/// mpih_oscillator_forward_step for `n` drives, bit for bit. Both arrays may be the same.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_forward_run(
    forward: Option<&mut OscillatorStream>,
    drives: *const f64,
    positions: *mut f64,
    n: usize,
) -> Status {
    let step = |forward: &mut OscillatorStream, [drive]: [f64; 1]| forward.stream.step(drive);
    // SAFETY: as the header asks of the caller.
    unsafe { run(("forward", forward), n, [("drives", drives)], ("positions", positions), step) }
}

/// The position of now. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_position(forward: Option<&OscillatorStream>) -> f64 {
    forward.map_or(f64::NAN, |forward| forward.stream.output())
}

/// How many drives were not finite, or would have brought the motion beyond 1e100.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_rejected(forward: Option<&OscillatorStream>) -> u64 {
    forward.map_or(0, |forward| forward.stream.rejected())
}

/// Back to rest, all counts zero.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_oscillator_forward_reset(forward: Option<&mut OscillatorStream>) {
    if let Some(forward) = forward {
        forward.stream.reset();
    }
}

/// Writes everything that the model remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_forward_save(
    forward: Option<&OscillatorStream>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { save(("forward", forward), |forward| forward.stream.state(), Buffer { to: text.cast(), bytes, needed }) }
}

/// Goes on, bit for bit, from what mpih_oscillator_forward_save wrote for a model of the same oscillator. If it fails
/// the model is as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_oscillator_forward_load(
    forward: Option<&mut OscillatorStream>,
    text: *const c_char,
) -> Status {
    guard(|| {
        let stream = &mut there("forward", forward)?.stream;
        // SAFETY: as the header asks of the caller.
        let state: OscillatorState = saved(unsafe { read("text", text) }?)?;
        Ok(stream.set_state(&state)?)
    })
}
