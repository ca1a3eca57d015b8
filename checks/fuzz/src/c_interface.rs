//! Any sequence of calls of the C interface.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use core::ptr;
use std::ffi::CString;
use std::sync::LazyLock;

use mpi_hyst::{
    Controller, ControllerOptions, Forward, Inverse, Observer, Stage, Status, mpih_controller_align,
    mpih_controller_commit, mpih_controller_counters, mpih_controller_drive, mpih_controller_follow,
    mpih_controller_free, mpih_controller_hold, mpih_controller_limits, mpih_controller_load, mpih_controller_new,
    mpih_controller_options_default, mpih_controller_peek, mpih_controller_plan, mpih_controller_release,
    mpih_controller_reset, mpih_controller_reset_at, mpih_controller_run, mpih_controller_save,
    mpih_controller_set_gains, mpih_controller_set_mode, mpih_controller_size, mpih_controller_start_at,
    mpih_controller_step, mpih_controller_step_given, mpih_controller_stop, mpih_controller_terms,
    mpih_forward_advance, mpih_forward_align, mpih_forward_follow, mpih_forward_free, mpih_forward_load,
    mpih_forward_new, mpih_forward_run, mpih_forward_save, mpih_forward_settle, mpih_forward_size, mpih_forward_step,
    mpih_inverse_align, mpih_inverse_drive, mpih_inverse_follow, mpih_inverse_follow_drive, mpih_inverse_free,
    mpih_inverse_load, mpih_inverse_new, mpih_inverse_run, mpih_inverse_save, mpih_inverse_settle, mpih_inverse_size,
    mpih_inverse_step, mpih_last_error, mpih_observer_align, mpih_observer_follow, mpih_observer_free,
    mpih_observer_load, mpih_observer_new, mpih_observer_run, mpih_observer_save, mpih_observer_size,
    mpih_observer_step, mpih_stage_free, mpih_stage_from_json, mpih_stage_properties, mpih_stage_warning,
    mpih_stage_warning_count,
};

use crate::bytes::Bytes;
use crate::objects::Slot;
use crate::stages::every_part;

/// The reach of the stage in its units.
const DRIVES: f64 = 150.0;
const POSITIONS: f64 = 25.0;

/// No call crashes or writes where it must not; what fails says why; drives are finite and within the limits.
///
/// # Panics
/// If not.
pub fn c_interface(data: &[u8]) {
    let mut bytes = Bytes::new(data);
    let first = bytes.byte();
    let (own, number) = (first.is_multiple_of(4), first / 4);
    let stage = if own { read(&spoilt_text(every_part(number), &mut bytes)) } else { whole(number) };
    // SAFETY: NULL, or a stage that lives until it is freed below.
    let shared = unsafe { stage.as_ref() };
    describe(shared);
    let mut objects = Objects::new(&mut bytes, shared);
    if own {
        // What was made keeps what it needs.
        // SAFETY: NULL, or a stage that nobody uses after this.
        unsafe { mpih_stage_free(stage) };
    }
    while !bytes.is_empty() {
        objects.call(&mut bytes);
    }
}

/// The stages with every part, read once: reading takes longer than all that is done with them.
static WHOLE: LazyLock<[Shared; 3]> = LazyLock::new(|| {
    [0, 1, 2].map(|number| Shared(read(&CString::new(every_part(number)).expect("a file without zero bytes"))))
});

/// One of them.
fn whole(number: u8) -> *mut Stage {
    WHOLE[usize::from(number) % WHOLE.len()].0
}

struct Shared(*mut Stage);

// SAFETY: a stage never changes, so several threads may use it at once.
unsafe impl Send for Shared {}
// SAFETY: as above.
unsafe impl Sync for Shared {}

fn read(text: &CStr) -> *mut Stage {
    let mut stage: *mut Stage = ptr::null_mut();
    // SAFETY: the text ends with a zero byte, and the place may be written.
    said(unsafe { mpih_stage_from_json(text.as_ptr(), &raw mut stage) });
    stage
}

/// A file, some of its bytes written over, or the bytes themselves.
fn spoilt_text(file: &str, bytes: &mut Bytes<'_>) -> CString {
    let mut text = file.as_bytes().to_vec();
    if bytes.coin() {
        let count = usize::from(bytes.byte());
        text = bytes.some(count).to_vec();
    } else {
        let at = usize::from(bytes.byte()) * text.len() / 256;
        let count = usize::from(bytes.below(8));
        for (old, new) in text[at..].iter_mut().zip(bytes.some(count)) {
            *old = *new;
        }
    }
    text.retain(|byte| *byte != 0);
    CString::new(text).expect("zero bytes were taken out")
}

/// What fails leaves a message.
fn said(status: Status) {
    if status != Status::Ok {
        // SAFETY: a message of this thread, which nothing has changed since.
        let message = unsafe { CStr::from_ptr(mpih_last_error()) };
        assert!(!message.is_empty(), "a call that fails says why");
    }
}

fn describe(stage: Option<&Stage>) {
    let mut properties = MaybeUninit::uninit();
    said(mpih_stage_properties(stage, Some(&mut properties)));
    for index in 0..=mpih_stage_warning_count(stage) {
        let warning = mpih_stage_warning(stage, index);
        // SAFETY: NULL, or text that lives as long as the stage.
        assert!(warning.is_null() || unsafe { CStr::from_ptr(warning) }.to_str().is_ok(), "a warning is text");
    }
}

fn options(bytes: &mut Bytes<'_>) -> ControllerOptions {
    let mut options = MaybeUninit::uninit();
    assert_eq!(mpih_controller_options_default(Some(&mut options)), Status::Ok);
    // SAFETY: the call above has filled it.
    let mut options = unsafe { options.assume_init() };
    // Without gains a loop is tuned: that takes a second, and has tests of its own.
    (options.kp, options.ki) = (bytes.magnitude(-3.0, 5.0).max(0.0), bytes.magnitude(-1.0, 9.0).max(0.0));
    options.feedforward = bytes.below(4).into();
    for number in [
        &mut options.limit_low,
        &mut options.limit_high,
        &mut options.slew,
        &mut options.start_drive,
        &mut options.bumpless_time,
        &mut options.measurement_low,
        &mut options.measurement_high,
        &mut options.max_measurement_step,
        &mut options.smoothing,
    ] {
        if bytes.below(8) == 0 {
            *number = bytes.number(DRIVES);
        }
    }
    for number in [&mut options.ahead, &mut options.max_missing, &mut options.reserved] {
        if bytes.below(8) == 0 {
            *number = i32::from(bytes.byte()) - 4;
        }
    }
    options
}

type Save<T> = unsafe extern "C" fn(Option<&T>, *mut c_char, usize, Option<&mut MaybeUninit<usize>>) -> Status;
type Load<T> = unsafe extern "C" fn(Option<&mut T>, *const c_char) -> Status;

/// Saves, perhaps into too small a room, perhaps with other bytes in it, and loads.
fn save_and_load<T>(bytes: &mut Bytes<'_>, slot: &mut Slot<T>, save: Save<T>, load: Load<T>) {
    let mut needed = MaybeUninit::new(0);
    // SAFETY: without a text only the number is written.
    if unsafe { save(slot.shared(), ptr::null_mut(), 0, Some(&mut needed)) } != Status::Ok {
        return;
    }
    // SAFETY: it had a value before the call, too.
    let needed = unsafe { needed.assume_init() };
    let mut text = vec![0_u8; needed];
    let short = usize::from(bytes.below(8) == 0);
    // SAFETY: the text has at least as many bytes as are said.
    let status = unsafe { save(slot.shared(), text.as_mut_ptr().cast(), needed - short, None) };
    assert_eq!(status == Status::Ok, short == 0, "what does not fit is not written");
    if short == 1 {
        return said(status);
    }
    let spoilt = bytes.below(4) == 0;
    if spoilt {
        let at = usize::from(bytes.byte()) * (needed - 1) / 256;
        let count = usize::from(bytes.below(8));
        for (old, new) in text[at..needed - 1].iter_mut().zip(bytes.some(count)) {
            *old = *new;
        }
    }
    // SAFETY: the text ends with the zero byte that was saved, or before it.
    let status = unsafe { load(slot.unique(), text.as_ptr().cast()) };
    said(status);
    assert!(spoilt || status == Status::Ok, "what was saved can be loaded");
}

struct Objects {
    forward: Slot<Forward>,
    inverse: Slot<Inverse>,
    controller: Slot<Controller>,
    observer: Slot<Observer>,
}

impl Objects {
    fn new(bytes: &mut Bytes<'_>, stage: Option<&Stage>) -> Self {
        let dt = if bytes.below(8) == 0 { bytes.magnitude(-9.0, 3.0) } else { 1e-4 };
        let size = (mpih_forward_size(), mpih_forward_align());
        // SAFETY: here and below, the place may be written, and the memory has the bytes that are said.
        let forward = Slot::new(bytes, size, mpih_forward_free, |memory, room, place| unsafe {
            mpih_forward_new(stage, dt, memory, room, place)
        });
        let size = (mpih_inverse_size(), mpih_inverse_align());
        let open = bytes.coin();
        let (low, high) = if open { (f64::NAN, f64::NAN) } else { (bytes.number(DRIVES), bytes.number(DRIVES)) };
        // SAFETY: as above.
        let inverse = Slot::new(bytes, size, mpih_inverse_free, |memory, room, place| unsafe {
            mpih_inverse_new(stage, dt, low, high, memory, room, place)
        });
        let size = (mpih_controller_size(), mpih_controller_align());
        let options = options(bytes);
        // SAFETY: as above.
        let controller = Slot::new(bytes, size, mpih_controller_free, |memory, room, place| unsafe {
            mpih_controller_new(stage, dt, Some(&options), memory, room, place)
        });
        let size = (mpih_observer_size(), mpih_observer_align());
        let (drift, noise) = (bytes.magnitude(-4.0, 4.0), bytes.magnitude(-6.0, 1.0));
        // SAFETY: as above.
        let observer = Slot::new(bytes, size, mpih_observer_free, |memory, room, place| unsafe {
            mpih_observer_new(stage, dt, drift, noise, memory, room, place)
        });
        Self { forward, inverse, controller, observer }
    }

    fn call(&mut self, bytes: &mut Bytes<'_>) {
        match bytes.below(4) {
            0 => self.call_forward(bytes),
            1 => self.call_inverse(bytes),
            2 => self.call_controller(bytes),
            _ => self.call_observer(bytes),
        }
    }

    fn call_forward(&mut self, bytes: &mut Bytes<'_>) {
        let made = self.forward.shared().is_some();
        let slot = &mut self.forward;
        let position = match bytes.below(6) {
            0 => mpih_forward_step(slot.unique(), bytes.number(DRIVES)),
            1 => mpih_forward_advance(slot.unique(), bytes.number(DRIVES)),
            2 => mpih_forward_settle(slot.unique(), bytes.number(DRIVES)),
            3 => {
                let mut drives = bytes.numbers(DRIVES);
                // SAFETY: the array has so many numbers; both may be the same.
                said(unsafe { mpih_forward_run(slot.unique(), drives.as_ptr(), drives.as_mut_ptr(), drives.len()) });
                drives.last().copied().filter(|_| made).unwrap_or_default()
            }
            4 => {
                let drives = bytes.numbers(DRIVES);
                // SAFETY: the array has so many numbers.
                said(unsafe { mpih_forward_follow(slot.unique(), drives.as_ptr(), drives.len()) });
                return;
            }
            _ => return save_and_load(bytes, slot, mpih_forward_save, mpih_forward_load),
        };
        assert!(!made || position.is_finite(), "a position is finite, got {position}");
    }

    fn call_inverse(&mut self, bytes: &mut Bytes<'_>) {
        let made = self.inverse.shared().is_some();
        let slot = &mut self.inverse;
        match bytes.below(6) {
            0 => {
                mpih_inverse_step(slot.unique(), bytes.number(POSITIONS));
            }
            1 => {
                mpih_inverse_follow_drive(slot.unique(), bytes.number(DRIVES));
            }
            2 => {
                mpih_inverse_settle(slot.unique(), bytes.number(DRIVES));
            }
            3 => {
                let mut targets = bytes.numbers(POSITIONS);
                let n = targets.len();
                // SAFETY: the array has so many numbers; both may be the same.
                said(unsafe { mpih_inverse_run(slot.unique(), targets.as_ptr(), targets.as_mut_ptr(), n) });
            }
            4 => {
                let drives = bytes.numbers(DRIVES);
                // SAFETY: the array has so many numbers.
                said(unsafe { mpih_inverse_follow(slot.unique(), drives.as_ptr(), drives.len()) });
            }
            _ => save_and_load(bytes, slot, mpih_inverse_save, mpih_inverse_load),
        }
        let drive = mpih_inverse_drive(slot.shared());
        assert!(!made || drive.is_finite(), "a drive is finite, got {drive}");
    }

    fn call_controller(&mut self, bytes: &mut Bytes<'_>) {
        let slot = &mut self.controller;
        match bytes.below(16) {
            0 | 1 => {
                let (reference, measurement) = (bytes.number(POSITIONS), bytes.number(POSITIONS));
                let peeked = mpih_controller_peek(slot.shared(), reference, measurement);
                let drive = mpih_controller_step(slot.unique(), reference, measurement);
                assert_eq!(peeked.to_bits(), drive.to_bits(), "a peek is the step that follows");
            }
            2 => {
                let given = bytes.number(DRIVES);
                mpih_controller_step_given(slot.unique(), bytes.number(POSITIONS), given, bytes.number(POSITIONS));
            }
            3 => {
                mpih_controller_plan(slot.unique(), bytes.number(POSITIONS), bytes.number(POSITIONS));
            }
            4 => {
                mpih_controller_commit(slot.unique());
            }
            5 => {
                let mut rows = bytes.numbers(POSITIONS);
                let n = rows.len();
                // SAFETY: the arrays have so many numbers and may be the same.
                said(unsafe { mpih_controller_run(slot.unique(), rows.as_ptr(), rows.as_ptr(), rows.as_mut_ptr(), n) });
            }
            6 => mpih_controller_hold(slot.unique()),
            7 => mpih_controller_release(slot.unique()),
            8 => said(mpih_controller_set_mode(slot.unique(), i32::from(bytes.byte()) - 2)),
            9 => said(mpih_controller_stop(slot.unique(), bytes.magnitude(0.0, 8.0), bytes.number(DRIVES))),
            10 => {
                said(mpih_controller_set_gains(slot.unique(), bytes.magnitude(-3.0, 5.0), bytes.magnitude(-1.0, 9.0)));
            }
            11 => mpih_controller_reset(slot.unique()),
            12 => said(mpih_controller_reset_at(slot.unique(), bytes.number(DRIVES))),
            13 => said(mpih_controller_start_at(slot.unique(), bytes.number(DRIVES))),
            14 => {
                let drives = bytes.numbers(DRIVES);
                // SAFETY: the array has so many numbers.
                said(unsafe { mpih_controller_follow(slot.unique(), drives.as_ptr(), drives.len()) });
            }
            _ => save_and_load(bytes, slot, mpih_controller_save, mpih_controller_load),
        }
        self.look();
    }

    /// The drive of the controller is within its limits.
    fn look(&self) {
        let (mut terms, mut counters) = (MaybeUninit::uninit(), MaybeUninit::uninit());
        said(mpih_controller_terms(self.controller.shared(), Some(&mut terms)));
        said(mpih_controller_counters(self.controller.shared(), Some(&mut counters)));
        let (mut low, mut high) = (MaybeUninit::new(0.0), MaybeUninit::new(0.0));
        if mpih_controller_limits(self.controller.shared(), Some(&mut low), Some(&mut high)) == Status::Ok {
            // SAFETY: they had a value before the call, too.
            let (low, high) = unsafe { (low.assume_init(), high.assume_init()) };
            let drive = mpih_controller_drive(self.controller.shared());
            assert!((low..=high).contains(&drive), "the drive is within {low} to {high}, got {drive}");
        }
    }

    fn call_observer(&mut self, bytes: &mut Bytes<'_>) {
        let made = self.observer.shared().is_some();
        let slot = &mut self.observer;
        let position = match bytes.below(4) {
            0 => mpih_observer_step(slot.unique(), bytes.number(DRIVES), bytes.number(POSITIONS)),
            1 => {
                let mut rows = bytes.numbers(DRIVES);
                let n = rows.len();
                // SAFETY: the arrays have so many numbers and may be the same.
                said(unsafe { mpih_observer_run(slot.unique(), rows.as_ptr(), rows.as_ptr(), rows.as_mut_ptr(), n) });
                rows.last().copied().filter(|_| made).unwrap_or_default()
            }
            2 => {
                let drives = bytes.numbers(DRIVES);
                // SAFETY: the array has so many numbers.
                said(unsafe { mpih_observer_follow(slot.unique(), drives.as_ptr(), drives.len()) });
                return;
            }
            _ => return save_and_load(bytes, slot, mpih_observer_save, mpih_observer_load),
        };
        assert!(!made || position.is_finite(), "a position is finite, got {position}");
    }
}
