//! What all objects have in common: `run` is `step`, and a saved state goes on bit for bit; and what a stage says of
//! itself.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use core::ptr::null_mut;
use std::ffi::CString;

use mpi_hyst::*;

use crate::stages::files;

const DT: f64 = 1e-4;
const N: usize = 2000;

type Save<T> = unsafe extern "C" fn(Option<&T>, *mut c_char, usize, Option<&mut MaybeUninit<usize>>) -> Status;
type Load<T> = unsafe extern "C" fn(Option<&mut T>, *const c_char) -> Status;

fn last_error() -> String {
    // SAFETY: it is a string of this thread, copied at once.
    unsafe { CStr::from_ptr(mpih_last_error()) }.to_str().unwrap().to_owned()
}

fn stage(text: &str) -> *mut Stage {
    let text = CString::new(text).unwrap();
    let mut stage = null_mut();
    // SAFETY: a text and a place for the pointer.
    assert_eq!(unsafe { mpih_stage_from_json(text.as_ptr(), &raw mut stage) }, Status::Ok, "{}", last_error());
    stage
}

/// What `make` makes of the stage of a file.
fn made<T>(file: &str, make: impl FnOnce(Option<&Stage>, *mut *mut T) -> Status) -> *mut T {
    let (stage, mut object) = (stage(file), null_mut());
    // SAFETY: a stage that was made just now.
    assert_eq!(make(unsafe { stage.as_ref() }, &raw mut object), Status::Ok, "{}", last_error());
    // SAFETY: it is not used after this, and what was made from it does not need it.
    unsafe { mpih_stage_free(stage) };
    object
}

fn saved<T>(object: &T, save: Save<T>) -> Vec<c_char> {
    let mut needed = MaybeUninit::uninit();
    // SAFETY: without a buffer only the size is told, and it is told if the call succeeds.
    let needed = unsafe {
        assert_eq!(save(Some(object), null_mut(), 0, Some(&mut needed)), Status::Ok);
        needed.assume_init()
    };
    let mut text = vec![0; needed];
    // SAFETY: a buffer of so many bytes.
    assert_eq!(unsafe { save(Some(object), text.as_mut_ptr(), needed, None) }, Status::Ok, "{}", last_error());
    text
}

/// Steps, saves, steps on, goes back and runs the same in one call, which must give the same bits.
fn goes_on<T>(
    object: *mut T,
    step: impl Fn(&mut T, usize) -> f64,
    run: impl Fn(&mut T, *mut f64) -> Status,
    (save, load): (Save<T>, Load<T>),
) {
    // SAFETY: an object that was made just now and that nothing else uses.
    let object = unsafe { &mut *object };
    let before: Vec<f64> = (0..N).map(|k| step(object, k)).collect();
    let text = saved(object, save);
    let after: Vec<u64> = (0..N).map(|k| step(object, k).to_bits()).collect();
    assert!(before.iter().zip(&after).any(|(one, other)| one.to_bits() != *other), "it has a memory");
    // SAFETY: a text that ends with a zero byte.
    assert_eq!(unsafe { load(Some(object), text.as_ptr()) }, Status::Ok, "{}", last_error());
    let mut out = [0.0; N];
    assert_eq!(run(object, out.as_mut_ptr()), Status::Ok);
    assert_eq!(out.map(f64::to_bits), *after);
    // SAFETY: as above.
    assert_eq!(unsafe { load(Some(object), c"{\"dt\": 1}".as_ptr()) }, Status::Format);
}

fn signal(seed: u16) -> Vec<f64> {
    // From saturation to bad samples, which two signals do not have at once.
    let first = 3500 + 503 * usize::from(seed);
    same_bits::Mixed::new(seed.into()).skip(first).map(|s| 14.0 + 18.0 * s).take(N).collect()
}

#[test]
fn forward_models_go_on() {
    for file in files() {
        a_forward_model_goes_on(&file);
    }
}

fn a_forward_model_goes_on(file: &str) {
    let u = signal(1);
    // SAFETY: a place for the pointer; the model is not used after it is freed; arrays of N numbers.
    unsafe {
        let model = made(file, |stage, place| mpih_forward_new(stage, DT, null_mut(), 0, place));
        goes_on(
            model,
            |model, k| mpih_forward_step(Some(model), u[k]),
            |model, out| mpih_forward_run(Some(model), u.as_ptr(), out, N),
            (mpih_forward_save, mpih_forward_load),
        );
        assert_eq!(mpih_forward_follow(model.as_mut(), [10.0, 50.0].as_ptr(), 2), Status::Ok);
        let coarse = made(file, |stage, place| mpih_forward_new(stage, 2.0 * DT, null_mut(), 0, place));
        let text = saved(&*coarse, mpih_forward_save);
        assert_eq!(mpih_forward_load(model.as_mut(), text.as_ptr()), Status::State);
        assert_eq!(last_error(), "state.dt: expected 0.0001, got 0.0002");
        mpih_forward_free(coarse);
        mpih_forward_free(model);
    }
}

#[test]
fn inverses_go_on() {
    for file in files() {
        an_inverse_goes_on(&file);
    }
}

fn an_inverse_goes_on(file: &str) {
    let y = signal(1);
    // SAFETY: a place for the pointer; the inverse is not used after it is freed; arrays of N numbers.
    unsafe {
        let inverse = made(file, |stage, place| mpih_inverse_new(stage, DT, 0.0, 100.0, null_mut(), 0, place));
        goes_on(
            inverse,
            |inverse, k| mpih_inverse_step(Some(inverse), y[k]),
            |inverse, out| mpih_inverse_run(Some(inverse), y.as_ptr(), out, N),
            (mpih_inverse_save, mpih_inverse_load),
        );
        assert_eq!(mpih_inverse_step(inverse.as_mut(), 1e3), 100.0);
        assert!(mpih_inverse_saturated(inverse.as_ref()));
        assert_eq!(mpih_inverse_follow(inverse.as_mut(), [10.0, 101.0].as_ptr(), 2), Status::Argument);
        assert_eq!(mpih_inverse_follow(inverse.as_mut(), [10.0, 50.0].as_ptr(), 2), Status::Ok);
        assert_eq!(mpih_inverse_drive(inverse.as_ref()), 50.0);
        mpih_inverse_free(inverse);
    }
}

#[test]
fn observers_go_on() {
    for file in files() {
        an_observer_goes_on(&file);
    }
}

fn an_observer_goes_on(file: &str) {
    let (u, y) = (signal(1), signal(2));
    // SAFETY: a place for the pointer; the observer is not used after it is freed; arrays of N numbers.
    unsafe {
        let observer = made(file, |stage, place| mpih_observer_new(stage, DT, 0.5, f64::NAN, null_mut(), 0, place));
        goes_on(
            observer,
            |observer, k| mpih_observer_step(Some(observer), u[k], y[k]),
            |observer, out| mpih_observer_run(Some(observer), u.as_ptr(), y.as_ptr(), out, N),
            (mpih_observer_save, mpih_observer_load),
        );
        mpih_observer_reset(observer.as_mut());
        assert_eq!(mpih_observer_rejected(observer.as_ref()), 0);
        mpih_observer_free(observer);
    }
}

#[test]
fn controllers_go_on_with_drives_that_are_given() {
    for file in files() {
        a_controller_goes_on_with_drives_that_are_given(&file);
    }
}

fn a_controller_goes_on_with_drives_that_are_given(file: &str) {
    let (x, y) = (signal(1), signal(2));
    // SAFETY: a place for the pointer; the controller is not used after it is freed; arrays of N numbers.
    unsafe {
        let mut options = MaybeUninit::uninit();
        assert_eq!(mpih_controller_options_default(Some(&mut options)), Status::Ok);
        let given = Feedforward::Given as i32;
        let options = ControllerOptions { feedforward: given, kp: 1.0, ki: 500.0, ..options.assume_init() };
        let controller =
            made(file, |stage, place| mpih_controller_new(stage, DT, Some(&options), null_mut(), 0, place));
        // The same array may be feed-forward and drives.
        let run = |controller: &mut Controller, out: *mut f64| {
            out.copy_from(x.as_ptr(), N);
            mpih_controller_run_given(Some(controller), x.as_ptr(), out, y.as_ptr(), out, N)
        };
        let step = |controller: &mut Controller, k: usize| {
            let peeked = mpih_controller_peek_given(Some(controller), x[k], x[k], y[k]);
            let planned = mpih_controller_plan_given(Some(controller), x[k], x[k], y[k]);
            assert_eq!(peeked.to_bits(), planned.to_bits());
            mpih_controller_step_given(Some(controller), x[k], x[k], y[k])
        };
        goes_on(controller, step, run, (mpih_controller_save, mpih_controller_load));
        let held = mpih_controller_drive(controller.as_ref());
        assert_eq!(mpih_controller_step(controller.as_mut(), 1.0, 1.0), held, "none was given");
        let mut counters = MaybeUninit::uninit();
        assert_eq!(mpih_controller_counters(controller.as_ref(), Some(&mut counters)), Status::Ok);
        let Counters { rejected, missing, .. } = counters.assume_init();
        assert!(rejected > 0 && missing > 0);
        assert_eq!(mpih_controller_reset_at(controller.as_mut(), 7.0), Status::Ok);
        assert_eq!(mpih_controller_start_at(controller.as_mut(), 151.0), Status::Argument);
        assert_eq!(mpih_controller_drive(controller.as_ref()), 7.0);
        mpih_controller_free(controller);
    }
}

#[test]
fn a_stage_says_what_its_file_says() {
    let identified = r#""identified": {"drive_range": [0.0, 120.0], "position_range": [-1.0, 25.0], "dt": [1e-4], "rmse": 0.01,
        "max_error": 0.05, "parameters": [], "covariance": [], "records": [], "warnings": [{"code": "drift", "severity": "red",
        "message": "The record drifts.", "value": 1.0, "limit": 0.5, "hint": "Wait."}]}"#;
    let text = include_str!("../../examples/stage.json").replace("\"identified\": null", identified);
    let made = stage(&text.replace("\"slew\": 200000.0", "\"slew\": null"));
    // SAFETY: a stage that is not used after it is freed, and strings that are read before.
    unsafe {
        let mut properties = MaybeUninit::uninit();
        assert_eq!(mpih_stage_properties(made.as_ref(), Some(&mut properties)), Status::Ok);
        let said = properties.assume_init();
        assert_eq!([said.limit_low, said.limit_high, said.drive_low, said.drive_high], [-30.0, 150.0, 0.0, 120.0]);
        // What the model reaches between the drives of the records, not what the records held.
        let reached = hysteresis_control::stage::Stage::from_json(&text).unwrap().position_range().unwrap();
        assert_eq!(((said.position_low, said.position_high), said.rest_drive), (reached, 0.0));
        assert_eq!([said.dead_time, said.noise, said.smoothing], [2e-4, 0.002, 3.0 / 800.0]);
        assert!(said.slew.is_nan() && 0.0 < said.slope_low && said.slope_low < said.slope_high);
        assert_eq!(CStr::from_ptr(mpih_stage_drive_unit(made.as_ref())), c"V");
        assert_eq!(CStr::from_ptr(mpih_stage_position_unit(made.as_ref())), c"um");
        assert_eq!(mpih_stage_warning_count(made.as_ref()), 1);
        let warning = CStr::from_ptr(mpih_stage_warning(made.as_ref(), 0));
        assert_eq!(warning, c"red: drift: The record drifts.: Wait.");
        assert!(mpih_stage_warning(made.as_ref(), 1).is_null());
        mpih_stage_free(made);
    }
}

#[test]
fn each_thread_has_its_own_last_error() {
    assert_eq!(mpih_controller_set_gains(None, 1.0, 1.0), Status::Null);
    let here = last_error();
    let there = std::thread::spawn(|| {
        let before = last_error();
        assert_eq!(mpih_stage_properties(None, None), Status::Null);
        (before, last_error())
    });
    let expected = (String::new(), "stage: expected a pointer, got NULL".to_owned());
    assert_eq!(there.join().unwrap(), expected);
    assert_eq!((here.as_str(), last_error()), ("controller: expected a pointer, got NULL", here.clone()));
}

#[test]
fn a_status_has_a_name() {
    for (status, name) in [(Status::Ok, c"MPIH_STATUS_OK"), (Status::Internal, c"MPIH_STATUS_INTERNAL")] {
        // SAFETY: names are constants.
        assert_eq!(unsafe { CStr::from_ptr(mpih_status_name(status as i32)) }, name);
    }
    // SAFETY: as above.
    assert_eq!(unsafe { CStr::from_ptr(mpih_status_name(10)) }, c"unknown status");
}
