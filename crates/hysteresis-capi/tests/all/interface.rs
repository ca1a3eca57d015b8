//! What C meets: NULL, memory of its own, statuses with messages, saved states, and a loop that never allocates.

use core::ffi::{CStr, c_char, c_void};
use core::mem::MaybeUninit;
use core::ptr::null_mut;
use std::ffi::CString;

use mpi_hyst::*;

const DT: f64 = 1e-4;

fn last_error() -> String {
    // SAFETY: it is a string of this thread, copied at once.
    unsafe { CStr::from_ptr(mpih_last_error()) }.to_str().unwrap().to_owned()
}

fn stage() -> *mut Stage {
    let text = CString::new(include_str!("../../examples/stage.json")).unwrap();
    let mut stage = null_mut();
    // SAFETY: a text and a place for the pointer.
    assert_eq!(unsafe { mpih_stage_from_json(text.as_ptr(), &raw mut stage) }, Status::Ok, "{}", last_error());
    stage
}

/// The object behind a pointer of the interface.
fn at<'a, T>(pointer: *mut T) -> Option<&'a mut T> {
    // SAFETY: the pointers of these tests are NULL or objects that are used by one reference at a time.
    unsafe { pointer.as_mut() }
}

fn controller(stage: *mut Stage, options: &ControllerOptions) -> Result<*mut Controller, (Status, String)> {
    let mut made = null_mut();
    // SAFETY: a stage, options and a place for the pointer.
    let status = unsafe { mpih_controller_new(at(stage).as_deref(), DT, Some(options), null_mut(), 0, &raw mut made) };
    if status == Status::Ok { Ok(made) } else { Err((status, last_error())) }
}

fn options() -> ControllerOptions {
    let mut options = MaybeUninit::uninit();
    assert_eq!(mpih_controller_options_default(Some(&mut options)), Status::Ok);
    // SAFETY: the call succeeded, so they are filled.
    unsafe { options.assume_init() }
}

fn forward(stage: *mut Stage, memory: *mut c_void, bytes: usize) -> (Status, *mut Forward) {
    let mut made = core::ptr::dangling_mut();
    // SAFETY: a stage, memory of so many bytes or NULL, and a place for the pointer.
    let status = unsafe { mpih_forward_new(at(stage).as_deref(), DT, memory, bytes, &raw mut made) };
    (status, made)
}

fn free(stage: *mut Stage) {
    // SAFETY: it was made by the library and is not used after this.
    unsafe { mpih_stage_free(stage) };
}

#[test]
fn an_object_lies_in_memory_of_the_caller_if_that_is_large_enough_and_aligned() {
    let stage = stage();
    let (size, align) = (mpih_forward_size(), mpih_forward_align());
    let mut memory = vec![0_u64; size / 8 + 2];
    let start = memory.as_mut_ptr().cast::<u8>();
    assert!(size > 0 && align == 8, "{size} {align}");
    assert_eq!(forward(stage, start.cast(), size - 1), (Status::Memory, null_mut()));
    assert_eq!(last_error(), format!("bytes: expected at least {size}, got {}", size - 1));
    let odd = start.wrapping_add(1);
    assert_eq!(forward(stage, odd.cast(), size), (Status::Memory, null_mut()));
    assert_eq!(last_error(), format!("memory: expected an address that is a multiple of 8, got {odd:p}"));
    let (status, placed) = forward(stage, start.cast(), size);
    assert_eq!((status, placed.cast()), (Status::Ok, start));
    let (_, on_heap) = forward(stage, null_mut(), 0);
    for k in 0..1000 {
        let drive = f64::from(k % 150);
        assert_eq!(mpih_forward_step(at(placed), drive), mpih_forward_step(at(on_heap), drive));
    }
    for object in [placed, on_heap] {
        // SAFETY: it was made by the library and is not used after this.
        unsafe { mpih_forward_free(object) };
    }
    free(stage);
}

#[test]
fn null_is_told_and_in_the_loop_it_is_nan() {
    assert!(mpih_forward_step(None, 1.0).is_nan() && mpih_forward_advance(None, 1.0).is_nan());
    assert!(mpih_inverse_step(None, 1.0).is_nan() && mpih_inverse_peek(None, 1.0).is_nan());
    assert!(mpih_controller_step(None, 1.0, 1.0).is_nan() && !mpih_controller_commit(None));
    assert!(mpih_observer_step(None, 1.0, 1.0).is_nan());
    assert_eq!(forward(null_mut(), null_mut(), 0), (Status::Null, null_mut()));
    assert_eq!(last_error(), "stage: expected a pointer, got NULL");
    let (stage, mut number) = (stage(), 0.0);
    let (_, model) = forward(stage, null_mut(), 0);
    // SAFETY: NULL is what is tested, and the array has a number.
    let [no_object, no_input, no_numbers] = unsafe {
        [
            mpih_forward_run(None, &raw const number, &raw mut number, 1),
            mpih_forward_run(at(model), core::ptr::null(), &raw mut number, 1),
            mpih_forward_run(at(model), core::ptr::null(), null_mut(), 0),
        ]
    };
    assert_eq!((no_object, no_input, no_numbers), (Status::Null, Status::Null, Status::Ok));
    assert_eq!(last_error(), "drives: expected a pointer, got NULL");
    // SAFETY: it was made by the library and is not used after this; NULL is nothing to free.
    unsafe {
        mpih_forward_free(model);
        mpih_forward_free(null_mut());
        mpih_stage_free(null_mut());
    }
    free(stage);
}

#[test]
fn what_is_wrong_with_a_file_is_told() {
    let read = |text: &CStr| {
        let mut made = core::ptr::dangling_mut();
        // SAFETY: a text and a place for the pointer.
        let status = unsafe { mpih_stage_from_json(text.as_ptr(), &raw mut made) };
        assert!(made.is_null());
        (status, last_error())
    };
    let (status, message) = read(c"{\"schema\": \"other\"}");
    assert_eq!(status, Status::Format);
    assert!(message.starts_with("not a stage file: schema: expected \"mpi_hyst/stage/1\""), "{message}");
    let none = "not a stage file: schema: expected \"mpi_hyst/stage/1\", got none";
    assert_eq!(read(c"{}"), (Status::Format, none.into()));
    assert_eq!(read(c"\xff").0, Status::Format);
    let negative = include_str!("../../examples/stage.json").replace("\"noise\": 0.002", "\"noise\": -1.0");
    let (status, message) = read(&CString::new(negative).unwrap());
    assert_eq!(status, Status::Argument);
    assert!(message.starts_with("noise: ") && message.ends_with("got -1.0"), "{message}");
    let mut made = null_mut();
    // SAFETY: a text and a place for the pointer.
    let status = unsafe { mpih_stage_from_file(c"no/such/stage.json".as_ptr(), &raw mut made) };
    assert_eq!(status, Status::File);
    assert!(last_error().starts_with("no/such/stage.json: "), "{}", last_error());
}

#[test]
fn the_options_of_a_controller_are_checked() {
    let stage = stage();
    let refused = |options| controller(stage, &options).unwrap_err();
    let set = options();
    let alone = refused(ControllerOptions { kp: 1.0, ..set });
    assert_eq!(alone, (Status::Argument, "ki: expected a number beside kp = 1.0, got nan".to_owned()));
    assert!(refused(ControllerOptions { limit_low: 0.0, ..set }).1.starts_with("limit_high: "));
    assert!(refused(ControllerOptions { limit_low: 0.0, limit_high: 500.0, ..set }).1.starts_with("limits[1]: "));
    assert!(refused(ControllerOptions { feedforward: 3, ..set }).1.starts_with("feedforward: expected 0, 1 or 2"));
    assert!(refused(ControllerOptions { ahead: 3, ..set }).1.starts_with("ahead: expected -1"));
    assert!(refused(ControllerOptions { smoothing: 0.1, ..set }).1.starts_with("smoothing: expected 0"));
    assert!(refused(ControllerOptions { max_missing: -2, ..set }).1.starts_with("max_missing: expected 0 or more"));
    assert!(refused(ControllerOptions { reserved: 1, ..set }).1.starts_with("reserved: expected 0"));
    let made = controller(stage, &ControllerOptions { kp: 1.5, ki: 200.0, limit_low: 0.0, limit_high: 100.0, ..set });
    let made = made.unwrap();
    let [mut kp, mut ki, mut low, mut high] = [const { MaybeUninit::<f64>::uninit() }; 4];
    assert_eq!(mpih_controller_gains(at(made).as_deref(), Some(&mut kp), Some(&mut ki)), Status::Ok);
    assert_eq!(mpih_controller_limits(at(made).as_deref(), Some(&mut low), Some(&mut high)), Status::Ok);
    // SAFETY: both calls succeeded, so all four are written.
    assert_eq!([kp, ki, low, high].map(|number| unsafe { number.assume_init() }), [1.5, 200.0, 0.0, 100.0]);
    assert_eq!(mpih_controller_set_mode(at(made), 3), Status::Argument);
    assert_eq!(mpih_controller_set_mode(at(made), Mode::Hold as i32), Status::Ok);
    assert_eq!(mpih_controller_mode(at(made).as_deref()), Mode::Hold);
    // SAFETY: it was made by the library and is not used after this.
    unsafe { mpih_controller_free(made) };
    free(stage);
}

#[test]
fn a_saved_state_goes_on_bit_for_bit_and_others_are_refused() {
    let stage = stage();
    let set = options();
    let made = controller(stage, &ControllerOptions { feedforward: Feedforward::Preview as i32, ..set }).unwrap();
    for k in 0..100 {
        mpih_controller_step(at(made), 0.1 * f64::from(k), 0.09 * f64::from(k));
    }
    let mut needed = MaybeUninit::uninit();
    // SAFETY: without a buffer only the size is told.
    let status = unsafe { mpih_controller_save(at(made).as_deref(), null_mut(), 0, Some(&mut needed)) };
    assert_eq!(status, Status::Ok);
    // SAFETY: the call succeeded, so it is written.
    let bytes = unsafe { needed.assume_init() };
    let mut text = vec![1; bytes];
    let to: *mut c_char = text.as_mut_ptr();
    // SAFETY: a buffer of more bytes than are said.
    let small = unsafe { mpih_controller_save(at(made).as_deref(), to, bytes - 1, None) };
    assert_eq!((small, text.iter().all(|byte| *byte == 1)), (Status::Buffer, true));
    // SAFETY: a buffer of so many bytes.
    assert_eq!(unsafe { mpih_controller_save(at(made).as_deref(), to, bytes, None) }, Status::Ok);
    assert_eq!(text.iter().position(|byte| *byte == 0), Some(bytes - 1));
    let planned = mpih_controller_plan(at(made), 10.0, 9.0);
    let next = mpih_controller_step(at(made), 10.0, 9.0);
    assert_eq!(planned, next);
    // SAFETY: a text that ends with a zero byte.
    assert_eq!(unsafe { mpih_controller_load(at(made), to) }, Status::Ok);
    assert_eq!(mpih_controller_peek(at(made).as_deref(), 10.0, 9.0), next);
    assert_eq!(mpih_controller_set_gains(at(made), 0.5, 100.0), Status::Ok);
    // SAFETY: as above.
    assert_eq!(unsafe { mpih_controller_load(at(made), to) }, Status::State);
    assert!(last_error().starts_with("state.kp: "), "{}", last_error());
    // SAFETY: as above.
    assert_eq!(unsafe { mpih_controller_load(at(made), c"{}".as_ptr()) }, Status::Format);
    // SAFETY: it was made by the library and is not used after this.
    unsafe { mpih_controller_free(made) };
    free(stage);
}

#[test]
fn reset_is_as_made() {
    let stage = stage();
    let (_, model) = forward(stage, null_mut(), 0);
    let run = || [50.0, 120.0, f64::NAN, 999.0, 10.0].map(|drive| mpih_forward_step(at(model), drive).to_bits());
    let first = run();
    let counts = || (mpih_forward_rejected(at(model).as_deref()), mpih_forward_clamped(at(model).as_deref()));
    assert_eq!(counts(), (1, 1));
    mpih_forward_reset(at(model));
    assert_eq!(counts(), (0, 0));
    assert_eq!(run(), first);
    // SAFETY: it was made by the library and is not used after this.
    unsafe { mpih_forward_free(model) };
    free(stage);
}

#[test]
fn the_loop_never_allocates() {
    let stage = stage();
    let (_, model) = forward(stage, null_mut(), 0);
    let loops = controller(stage, &options()).unwrap();
    let (mut inverse, mut observer) = (null_mut(), null_mut());
    // SAFETY: a stage and places for the pointers.
    let made = unsafe {
        [
            mpih_inverse_new(at(stage).as_deref(), DT, f64::NAN, f64::NAN, null_mut(), 0, &raw mut inverse),
            mpih_observer_new(at(stage).as_deref(), DT, 0.5, f64::NAN, null_mut(), 0, &raw mut observer),
        ]
    };
    assert_eq!(made, [Status::Ok; 2]);
    let signal: Vec<f64> = same_bits::Mixed::new(3).map(|s| 14.0 + 18.0 * s).take(10_000).collect();
    let mut out = vec![0.0; signal.len()];
    let count = allocations::count(|| {
        let mut drive = 0.0;
        for x in &signal {
            let measured = mpih_forward_advance(at(model), drive);
            std::hint::black_box((mpih_inverse_step(at(inverse), *x), mpih_inverse_peek(at(inverse).as_deref(), *x)));
            std::hint::black_box(mpih_observer_step(at(observer), drive, *x));
            mpih_controller_plan(at(loops), *x, measured);
            mpih_controller_commit(at(loops));
            drive = mpih_controller_step(at(loops), *x, *x);
            drive += mpih_controller_step_given(at(loops), 1.0, *x, measured);
            let mut terms = MaybeUninit::uninit();
            assert_eq!(mpih_controller_terms(at(loops).as_deref(), Some(&mut terms)), Status::Ok);
        }
        mpih_controller_hold(at(loops));
        mpih_controller_release(at(loops));
        assert_eq!(mpih_controller_stop(at(loops), 100.0, 0.0), Status::Ok);
        let (x, n) = (signal.as_ptr(), signal.len());
        // SAFETY: arrays of n numbers.
        let done = unsafe { mpih_controller_run(at(loops), x, x, out.as_mut_ptr(), n) };
        assert_eq!(done, Status::Ok);
        mpih_controller_reset(at(loops));
    });
    assert_eq!(count, 0);
    // SAFETY: they were made by the library and are not used after this.
    unsafe {
        mpih_forward_free(model);
        mpih_inverse_free(inverse);
        mpih_observer_free(observer);
        mpih_controller_free(loops);
    }
    free(stage);
}
