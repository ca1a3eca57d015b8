//! The functions of the standard, called as a tool calls them.

use core::ffi::{CStr, c_char, c_int, c_void};
use core::ptr::{null, null_mut};
use std::cell::RefCell;
use std::ffi::CString;
use std::fs;

use hysteresis_control::stage::Stage;
use hysteresis_export::{Kind, MockUp, Settings, Simulation};
use mpi_hyst_fmu::*;

const DT: f64 = 1e-4;

thread_local! {
    static SAID: RefCell<Vec<String>> = RefCell::default();
}

/// A logger without what is formatted: the library formats nothing.
unsafe extern "C" fn log(_: *mut c_void, _: *const c_char, _: c_int, _: *const c_char, message: *const c_char) {
    // SAFETY: a text of the library.
    let message = unsafe { CStr::from_ptr(message) }.to_str().unwrap().to_owned();
    SAID.with_borrow_mut(|said| said.push(message));
}

#[repr(C)]
struct Callbacks {
    log: unsafe extern "C" fn(*mut c_void, *const c_char, c_int, *const c_char, *const c_char),
    others: [*mut c_void; 4],
}

fn said() -> String {
    SAID.take().join("\n")
}

fn stage() -> Stage {
    Stage::from_json(include_str!("../../hysteresis-capi/examples/stage.json")).unwrap()
}

/// A folder with the resources of a unit, and its GUID.
fn unit(kind: Kind) -> (tempfile::TempDir, String) {
    let unit = MockUp::new(&stage(), &Settings::new(kind, DT), "x").unwrap();
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("settings.json"), &unit.settings).unwrap();
    fs::write(folder.path().join("stage.json"), &unit.stage).unwrap();
    (folder, Settings::from_json(&unit.settings).unwrap().guid)
}

fn instance(folder: &tempfile::TempDir, guid: &str, kind: c_int) -> Option<Box<Component>> {
    let location = CString::new(format!("file://{}", folder.path().display())).unwrap();
    let guid = CString::new(guid).unwrap();
    let callbacks = Callbacks { log, others: [null_mut(); 4] };
    // SAFETY: the same struct but for the variable arguments of the logger, and it is called with none of them. Texts
    // end with a zero byte.
    unsafe {
        let callbacks = &*(&raw const callbacks).cast::<CallbackFunctions>();
        fmi2Instantiate(c"one".as_ptr(), kind, guid.as_ptr(), location.as_ptr(), Some(callbacks), 0, 0)
    }
}

fn running(kind: Kind) -> Box<Component> {
    let (folder, guid) = unit(kind);
    let mut made = instance(&folder, &guid, 1).unwrap_or_else(|| panic!("{}", said()));
    let component = &mut *made;
    assert_eq!(fmi2SetupExperiment(Some(component), 0, 0.0, 0.0, 0, 0.0), Status::Ok);
    assert_eq!(fmi2EnterInitializationMode(Some(component)), Status::Ok);
    assert_eq!(fmi2ExitInitializationMode(Some(component)), Status::Ok);
    made
}

fn set(component: &mut Component, reference: u32, value: f64) -> Status {
    // SAFETY: arrays of one element.
    unsafe { fmi2SetReal(Some(component), &raw const reference, 1, &raw const value) }
}

fn get(component: &mut Component, reference: u32) -> f64 {
    let mut value = f64::NAN;
    // SAFETY: arrays of one element.
    let status = unsafe { fmi2GetReal(Some(component), &raw const reference, 1, &raw mut value) };
    assert_eq!(status, Status::Ok, "{}", said());
    value
}

/// Sets the first variable, takes a step and reads the second one.
fn step(component: &mut Component, input: f64) -> f64 {
    assert_eq!(set(component, 0, input), Status::Ok);
    assert_eq!(fmi2DoStep(Some(component), 0.0, DT, 1), Status::Ok, "{}", said());
    get(component, 1)
}

#[test]
fn it_says_what_it_is() {
    // SAFETY: texts of the library.
    let (version, platform) = unsafe { (CStr::from_ptr(fmi2GetVersion()), CStr::from_ptr(fmi2GetTypesPlatform())) };
    assert_eq!((version, platform), (c"2.0", c"default"));
}

#[test]
fn a_unit_runs_its_simulation() {
    let mut component = running(Kind::Inverse);
    let mut expected = Simulation::new(&stage(), &Settings::new(Kind::Inverse, DT)).unwrap();
    for k in 0..200 {
        let target = if k == 20 { f64::NAN } else { f64::from(k * k % 31) };
        expected.set_real(0, target).unwrap();
        expected.step(DT).unwrap();
        assert_eq!(step(&mut component, target).to_bits(), expected.real(1).unwrap().to_bits());
    }
    let (mut rejected, mut saturated) = (0, 7);
    // SAFETY: arrays of one element.
    unsafe {
        assert_eq!(fmi2GetInteger(Some(&mut component), &4, 1, &raw mut rejected), Status::Ok);
        assert_eq!(fmi2GetBoolean(Some(&mut component), &3, 1, &raw mut saturated), Status::Ok);
    }
    assert_eq!((rejected, saturated), (1, i32::from(expected.boolean(3).unwrap())));
    assert_eq!(fmi2Reset(Some(&mut component)), Status::Ok);
    let fresh = Simulation::new(&stage(), &Settings::new(Kind::Inverse, DT)).unwrap();
    assert_eq!(get(&mut component, 1), fresh.real(1).unwrap());
}

#[test]
fn a_kept_state_goes_on_bit_for_bit() {
    let mut component = running(Kind::Forward);
    let drives = [10.0, 80.0, -20.0, 60.0];
    for drive in drives {
        step(&mut component, drive);
    }
    let mut kept = None;
    assert_eq!(fmi2GetFMUstate(Some(&mut component), Some(&mut kept)), Status::Ok);
    let kept = kept.as_deref();
    let mut size = 0;
    assert_eq!(fmi2SerializedFMUstateSize(Some(&mut component), kept, Some(&mut size)), Status::Ok);
    let mut bytes = vec![0; size];
    let expected = drives.map(|drive| step(&mut component, drive).to_bits());
    assert_eq!(fmi2SetFMUstate(Some(&mut component), kept), Status::Ok);
    assert_eq!(drives.map(|drive| step(&mut component, drive).to_bits()), expected);
    let mut other = running(Kind::Forward);
    let mut back = None;
    // SAFETY: as many bytes as are told.
    unsafe {
        assert_eq!(fmi2SerializeFMUstate(Some(&mut component), kept, bytes.as_mut_ptr(), size - 1), Status::Error);
        assert_eq!(fmi2SerializeFMUstate(Some(&mut component), kept, bytes.as_mut_ptr(), size), Status::Ok);
        assert_eq!(fmi2DeSerializeFMUstate(Some(&mut other), bytes.as_ptr(), size - 1, Some(&mut back)), Status::Error);
        assert!(said().contains("bytes: expected the state of an FMU as bytes, got"));
        assert_eq!(fmi2DeSerializeFMUstate(Some(&mut other), bytes.as_ptr(), size, Some(&mut back)), Status::Ok);
    }
    assert_eq!(fmi2SetFMUstate(Some(&mut other), back.as_deref()), Status::Ok);
    assert_eq!(drives.map(|drive| step(&mut other, drive).to_bits()), expected);
    assert_eq!(fmi2FreeFMUstate(Some(&mut other), Some(&mut back)), Status::Ok);
    assert!(back.is_none());
    assert_eq!(fmi2SetFMUstate(Some(&mut other), None), Status::Error);
}

#[test]
fn refusals_reach_the_logger() {
    let mut component = running(Kind::Forward);
    assert_eq!(fmi2DoStep(Some(&mut component), 0.0, 1.5 * DT, 1), Status::Error);
    let expected = "communicationStepSize: expected a whole multiple of the sampling interval, 0.0001 s, got 0.00015";
    assert!(said().starts_with(expected));
    assert_eq!(set(&mut component, 1, 0.0), Status::Error);
    assert_eq!(said(), "value reference: expected that of an input, got \"position\"");
    // SAFETY: without arrays nothing is read or written.
    unsafe {
        assert_eq!(fmi2GetReal(Some(&mut component), null(), 1, null_mut()), Status::Error);
        assert_eq!(fmi2GetReal(Some(&mut component), null(), 0, null_mut()), Status::Ok);
        assert_eq!(fmi2GetReal(None, null(), 0, null_mut()), Status::Error);
    }
    assert_eq!(said(), "vr, value: expected arrays, got NULL");
    assert_eq!(fmi2GetString(Some(&mut component), null(), 1, null_mut()), Status::Error);
    assert_eq!(fmi2Terminate(Some(&mut component)), Status::Ok);
    assert_eq!(fmi2DoStep(Some(&mut component), 0.0, DT, 1), Status::Error);
    assert!(said().ends_with("fmi2DoStep: expected an instance that is Running, got one that is Terminated"));
    assert!(get(&mut component, 1).is_finite());
}

#[test]
fn an_instance_that_cannot_be_is_none() {
    let (folder, guid) = unit(Kind::Forward);
    assert!(instance(&folder, &guid, 0).is_none());
    assert_eq!(said(), "fmuType: expected fmi2CoSimulation (1), got 0");
    assert!(instance(&folder, "{100%s}", 1).is_none());
    assert_eq!(said(), format!("fmuGUID: expected {guid}, that of the resources, got {{100%%s}}"));
    fs::write(folder.path().join("stage.json"), "{").unwrap();
    assert!(instance(&folder, &guid, 1).is_none());
    assert!(said().starts_with("stage.json: not a stage file: "));
    fs::remove_file(folder.path().join("settings.json")).unwrap();
    assert!(instance(&folder, &guid, 1).is_none());
    assert!(said().contains("settings.json: No such file"));
    // SAFETY: NULL instead of texts and callbacks.
    assert!(unsafe { fmi2Instantiate(null(), 1, null(), null(), None, 0, 0) }.is_none());
    fmi2FreeInstance(None);
}
