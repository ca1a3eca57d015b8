//! Stages and saved states as bytes, through the interface.

use core::ffi::CStr;
use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::ffi::CString;

use mpi_hyst::*;

use crate::stages::files;

const DT: f64 = 1e-4;

type Save<T> = unsafe extern "C" fn(Option<&T>, *mut u8, usize, Option<&mut MaybeUninit<usize>>) -> Status;
type Load<T> = unsafe extern "C" fn(Option<&mut T>, *const u8, usize) -> Status;

fn last_error() -> String {
    // SAFETY: it is a string of this thread, copied at once.
    unsafe { CStr::from_ptr(mpih_last_error()) }.to_str().unwrap().to_owned()
}

fn stages() -> [*mut Stage; 3] {
    files().map(|text| {
        let (text, mut stage) = (CString::new(text).unwrap(), null_mut());
        // SAFETY: a text that ends with a zero byte, and a place for the pointer.
        assert_eq!(unsafe { mpih_stage_from_json(text.as_ptr(), &raw mut stage) }, Status::Ok, "{}", last_error());
        stage
    })
}

fn saved<T>(object: &T, save: Save<T>) -> Vec<u8> {
    let mut needed = MaybeUninit::uninit();
    // SAFETY: without a buffer only the size is told, and it is told if the call succeeds.
    let needed = unsafe {
        assert_eq!(save(Some(object), null_mut(), 0, Some(&mut needed)), Status::Ok, "{}", last_error());
        needed.assume_init()
    };
    let mut bytes = vec![0xAA; needed + 1];
    // SAFETY: a buffer of more bytes than are asked for.
    unsafe {
        assert_eq!(save(Some(object), bytes.as_mut_ptr(), needed - 1, None), Status::Buffer);
        assert_eq!(last_error(), format!("bytes: expected at least {needed}, got {}", needed - 1));
        assert_eq!(save(Some(object), bytes.as_mut_ptr(), needed, None), Status::Ok, "{}", last_error());
        assert_eq!(save(Some(object), null_mut(), 0, None), Status::Null);
    }
    assert_eq!(bytes.pop(), Some(0xAA), "nothing is written behind the buffer");
    bytes
}

/// Steps, saves, steps on, goes back and steps the same again, which must give the same bits.
fn goes_on<T>(object: *mut T, step: impl Fn(&mut T, f64) -> f64, (save, load): (Save<T>, Load<T>)) {
    // SAFETY: an object that was made just now and that nothing else uses.
    let object = unsafe { object.as_mut() }.unwrap();
    let inputs = [3.0, 11.0, -4.0, f64::NAN, 2.0, 9.0];
    let mut steps = || inputs.map(|x| step(object, x).to_bits());
    let before = steps();
    let bytes = saved(object, save);
    let mut steps = || inputs.map(|x| step(object, x).to_bits());
    let after = steps();
    assert_ne!(before, after, "it has a memory");
    // SAFETY: as many bytes as are told.
    unsafe {
        assert_eq!(load(Some(object), bytes.as_ptr(), bytes.len()), Status::Ok, "{}", last_error());
        assert_eq!(inputs.map(|x| step(object, x).to_bits()), after);
        assert_eq!(load(Some(object), bytes.as_ptr(), bytes.len() - 1), Status::Format);
        assert!(last_error().starts_with("bytes: expected the state of a"), "{}", last_error());
        assert_eq!(load(Some(object), null(), 5), Status::Null);
        assert_eq!(load(None, bytes.as_ptr(), bytes.len()), Status::Null);
    }
}

#[test]
fn states_go_on() {
    stages().into_iter().for_each(states_of_a_stage_go_on);
}

fn states_of_a_stage_go_on(stage: *mut Stage) {
    let (mut forward, mut inverse, mut controller, mut observer) = (null_mut(), null_mut(), null_mut(), null_mut());
    // SAFETY: a stage and places for the pointers; nothing is used after it is freed.
    unsafe {
        assert_eq!(mpih_forward_new(stage.as_ref(), DT, null_mut(), 0, &raw mut forward), Status::Ok);
        assert_eq!(
            mpih_inverse_new(stage.as_ref(), DT, f64::NAN, f64::NAN, null_mut(), 0, &raw mut inverse),
            Status::Ok
        );
        assert_eq!(mpih_controller_new(stage.as_ref(), DT, None, null_mut(), 0, &raw mut controller), Status::Ok);
        assert_eq!(mpih_observer_new(stage.as_ref(), DT, 0.5, f64::NAN, null_mut(), 0, &raw mut observer), Status::Ok);
        goes_on(
            forward,
            |forward, u| mpih_forward_step(Some(forward), u),
            (mpih_forward_save_bytes, mpih_forward_load_bytes),
        );
        goes_on(
            inverse,
            |inverse, y| mpih_inverse_step(Some(inverse), y),
            (mpih_inverse_save_bytes, mpih_inverse_load_bytes),
        );
        goes_on(
            controller,
            |controller, y| mpih_controller_step(Some(controller), 1.0 + 0.01 * y, 1.0),
            (mpih_controller_save_bytes, mpih_controller_load_bytes),
        );
        goes_on(
            observer,
            |observer, y| mpih_observer_step(Some(observer), 5.0 * y, y),
            (mpih_observer_save_bytes, mpih_observer_load_bytes),
        );
        let bytes = saved(&*forward, mpih_forward_save_bytes);
        assert_eq!(mpih_inverse_load_bytes(inverse.as_mut(), bytes.as_ptr(), bytes.len()), Status::Format);
        let expected = "bytes: expected the state of an inverse as bytes, got the state of a forward model";
        assert_eq!(last_error(), expected);
        mpih_forward_free(forward);
        mpih_inverse_free(inverse);
        mpih_controller_free(controller);
        mpih_observer_free(observer);
        mpih_stage_free(stage);
    }
}

#[test]
fn stages_come_back_from_their_bytes() {
    stages().into_iter().for_each(a_stage_comes_back_from_its_bytes);
}

fn a_stage_comes_back_from_its_bytes(stage: *mut Stage) {
    let mut other = null_mut();
    // SAFETY: a stage, as many bytes as are told, a place for the pointer; nothing is used after it is freed.
    unsafe {
        let bytes = saved(&*stage, mpih_stage_to_bytes);
        assert_eq!(mpih_stage_from_bytes(bytes.as_ptr(), bytes.len(), &raw mut other), Status::Ok, "{}", last_error());
        assert_eq!(saved(&*other, mpih_stage_to_bytes), bytes);
        assert_eq!(CStr::from_ptr(mpih_stage_position_unit(other.as_ref())), c"um");
        mpih_stage_free(other);
        assert_eq!(mpih_stage_from_bytes(b"{}".as_ptr(), 2, &raw mut other), Status::Format);
        let expected = "bytes: expected a stage as bytes, got bytes that do not begin with \"mpi_hyst\"";
        assert!(other.is_null() && last_error() == expected, "{}", last_error());
        mpih_stage_free(stage);
    }
}
