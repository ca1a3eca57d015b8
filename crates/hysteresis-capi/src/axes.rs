//! Stages of several axes, read from their files, and their forward model.

use core::ffi::{c_char, c_void};
use core::mem::MaybeUninit;

use hysteresis_control::multi_axis::{MultiAxisForward, MultiAxisForwardState, MultiAxisStage};

use crate::boundary::{
    Buffer, Object, Owner, Place, Rows, Status, end, free, guard, hand_over, read, read_file, run_rows, save, saved,
    there,
};
use crate::oscillator::Oscillator;

/// A stage of several axes: what the file of a MultiAxisStage says. It never changes, so several threads may use it at
/// once. What is made from it keeps what it needs: the stage may be freed before.
pub struct AxesStage {
    pub(crate) inner: MultiAxisStage,
}

/// Reads a stage of several axes from the text of its file. `text` is UTF-8 and ends with a zero byte. Free the stage
/// with mpih_axes_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_stage_from_json(text: *const c_char, stage: *mut *mut AxesStage) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, || Ok(AxesStage { inner: MultiAxisStage::from_json(read("text", text)?)? })) }
}

/// Reads the file of a stage of several axes. `path` is UTF-8 and ends with a zero byte. Free the stage with
/// mpih_axes_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_stage_from_file(path: *const c_char, stage: *mut *mut AxesStage) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, || Ok(AxesStage { inner: MultiAxisStage::from_json(&read_file(path)?)? })) }
}

/// An oscillator sampled every `dt` seconds as a stage of one axis, with 1 to 1000 steps in a sample: for
/// mpih_axes_controller_new. Errors of what it shows go with the square of a step: on a public benchmark 0.2 to 2 %
/// of the motion with 20 steps in its shortest period, 0.01 to 0.1 % with 80. To simulate finely take
/// mpih_oscillator_forward_new. Free the stage with mpih_axes_stage_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_stage_of_oscillator(
    oscillator: Option<&Oscillator>,
    dt: f64,
    sub_steps: usize,
    stage: *mut *mut AxesStage,
) -> Status {
    let make = || {
        let oscillator = &there("oscillator", oscillator)?.inner;
        Ok(AxesStage { inner: MultiAxisStage::of_oscillator(oscillator, dt, sub_steps)? })
    };
    // SAFETY: as the header asks of the caller.
    unsafe { hand_over("stage", stage, make) }
}

/// Frees a stage of several axes; nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_stage_free(stage: *mut AxesStage) {
    // SAFETY: as the header asks of the caller.
    unsafe { free(stage) }
}

/// The number of drives. 0 for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_stage_drives(stage: Option<&AxesStage>) -> usize {
    stage.map_or(0, |stage| stage.inner.drives())
}

/// The number of positions. 0 for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_stage_positions(stage: Option<&AxesStage>) -> usize {
    stage.map_or(0, |stage| stage.inner.positions())
}

/// The sampling interval in seconds, which is part of the stage. NaN for NULL.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_stage_dt(stage: Option<&AxesStage>) -> f64 {
    stage.map_or(f64::NAN, |stage| stage.inner.dt())
}

/// A stage of several axes sample by sample, from the drives to the positions. A simulated plant, or the model beside a
/// real one.
pub struct AxesForward {
    owner: Owner,
    stream: MultiAxisForward,
    drives: Box<[f64]>,
    positions: Box<[f64]>,
}

impl Object for AxesForward {
    fn owner(&mut self) -> &mut Owner {
        &mut self.owner
    }
}

impl Rows<1> for AxesForward {
    fn rows(&mut self) -> ([&mut [f64]; 1], &mut [f64]) {
        ([&mut self.drives], &mut self.positions)
    }
}

impl AxesForward {
    fn step(&mut self) {
        // Lengths are those of the stage, so nothing is left undone.
        let _ = self.stream.step(&self.drives, &mut self.positions);
    }

    fn advance(&mut self) {
        let _ = self.stream.advance(&self.drives, &mut self.positions);
    }
}

/// How many bytes mpih_axes_forward_new needs.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_forward_size() -> usize {
    size_of::<AxesForward>()
}

/// Of which number the address of the memory for mpih_axes_forward_new must be a multiple.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_forward_align() -> usize {
    align_of::<AxesForward>()
}

/// Makes a forward model of a stage of several axes at rest, in `memory` of `bytes` bytes, or on the heap if `memory`
/// is NULL. End it with mpih_axes_forward_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_new(
    stage: Option<&AxesStage>,
    memory: *mut c_void,
    bytes: usize,
    forward: *mut *mut AxesForward,
) -> Status {
    let make = || {
        let stage = &there("stage", stage)?.inner;
        let (drives, positions) = (vec![0.0; stage.drives()].into(), vec![0.0; stage.positions()].into());
        Ok(AxesForward { owner: Owner::Library, stream: MultiAxisForward::new(stage), drives, positions })
    };
    // SAFETY: as the header asks of the caller.
    guard(|| unsafe { Place { memory, bytes }.put(make, forward) })
}

/// Ends a forward model: frees what it holds, and itself unless it lies in memory of the caller. Nothing for NULL.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_free(forward: *mut AxesForward) {
    // SAFETY: as the header asks of the caller.
    unsafe { end(forward) }
}

/// A row of a record: writes the positions at this moment, t_k. The drives are then held until t_(k+1).
///
/// A drive that is not finite counts as the last one of its axis. A step of the model that would bring a state beyond
/// 1e100 leaves the states as they are, and is the last one of its interval. Both are counted. Fails for NULL alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_step(
    forward: Option<&mut AxesForward>,
    drives: *const f64,
    positions: *mut f64,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { mpih_axes_forward_run(forward, drives, positions, 1) }
}

/// A plant in a loop: holds the drives for one sampling interval, then writes the positions at its end, just before the
/// next drives. That is what a controller reads next. Bad drives are as for mpih_axes_forward_step. Fails for NULL
/// alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_advance(
    forward: Option<&mut AxesForward>,
    drives: *const f64,
    positions: *mut f64,
) -> Status {
    let (inputs, output) = ([("drives", drives)], ("positions", positions));
    // SAFETY: as the header asks of the caller.
    unsafe { run_rows(("forward", forward), 1, inputs, output, AxesForward::advance) }
}

/// mpih_axes_forward_step for `n` rows, one behind the other, bit for bit. Both arrays may be the same where rows of
/// both are as long.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_run(
    forward: Option<&mut AxesForward>,
    drives: *const f64,
    positions: *mut f64,
    n: usize,
) -> Status {
    let (inputs, output) = ([("drives", drives)], ("positions", positions));
    // SAFETY: as the header asks of the caller.
    unsafe { run_rows(("forward", forward), n, inputs, output, AxesForward::step) }
}

/// How many drives were not finite (or beyond 1e100), and how many samples would have brought a state beyond 1e100.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_forward_rejected(forward: Option<&AxesForward>) -> u64 {
    forward.map_or(0, |forward| forward.stream.rejected())
}

/// Back to rest, all counts zero.
#[unsafe(no_mangle)]
pub extern "C" fn mpih_axes_forward_reset(forward: Option<&mut AxesForward>) {
    if let Some(forward) = forward {
        forward.stream.reset();
    }
}

/// Writes everything that the model remembers to `text`, as mpih_forward_save does.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_save(
    forward: Option<&AxesForward>,
    text: *mut c_char,
    bytes: usize,
    needed: Option<&mut MaybeUninit<usize>>,
) -> Status {
    // SAFETY: as the header asks of the caller.
    unsafe { save(("forward", forward), |forward| forward.stream.state(), Buffer { to: text.cast(), bytes, needed }) }
}

/// Goes on, bit for bit, from what mpih_axes_forward_save wrote for a model of the same stage. If it fails the model is
/// as before.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn mpih_axes_forward_load(forward: Option<&mut AxesForward>, text: *const c_char) -> Status {
    guard(|| {
        let stream = &mut there("forward", forward)?.stream;
        // SAFETY: as the header asks of the caller.
        let state: MultiAxisForwardState = saved(unsafe { read("text", text) }?)?;
        Ok(stream.set_state(&state)?)
    })
}
