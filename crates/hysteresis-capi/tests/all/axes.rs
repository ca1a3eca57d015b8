//! Several axes: rows in and out, memory of the caller, what is refused, and saved states.

use core::ffi::{CStr, c_char};
use core::mem::MaybeUninit;
use core::ptr::{null, null_mut};
use std::ffi::CString;

use hysteresis_control::multi_axis::{MultiAxisStage, MultiAxisStageController, TrackingOptions};
use hysteresis_core::ControllerOptions;
use mpi_hyst::*;

const FILE: &str = include_str!("../../examples/axes.json");
const LIMITS: [f64; 4] = [-9.0, 9.0, -8.0, 8.0];

fn last_error() -> String {
    // SAFETY: it is a string of this thread, copied at once.
    unsafe { CStr::from_ptr(mpih_last_error()) }.to_str().unwrap().to_owned()
}

fn stage() -> *mut AxesStage {
    let (text, mut stage) = (CString::new(FILE).unwrap(), null_mut());
    // SAFETY: a text and a place for the pointer.
    assert_eq!(unsafe { mpih_axes_stage_from_json(text.as_ptr(), &raw mut stage) }, Status::Ok, "{}", last_error());
    stage
}

/// A controller with what `change` makes of the options, or why there is none.
fn controller(change: impl FnOnce(&mut AxesControllerOptions)) -> Result<*mut AxesController, String> {
    let (stage, mut made, mut options) = (stage(), null_mut(), MaybeUninit::uninit());
    assert_eq!(mpih_axes_controller_options_default(Some(&mut options)), Status::Ok);
    // SAFETY: options that were filled, arrays of two numbers, and a stage that is not used after it is freed.
    let status = unsafe {
        let mut options = options.assume_init();
        change(&mut options);
        let (limits, options) = (LIMITS.as_ptr(), Some(&options));
        let status = mpih_axes_controller_new(stage.as_ref(), limits, 2, options, null_mut(), 0, &raw mut made);
        mpih_axes_stage_free(stage);
        status
    };
    if status == Status::Ok { Ok(made) } else { Err(last_error()) }
}

fn saved(controller: &AxesController) -> Vec<c_char> {
    let mut needed = MaybeUninit::uninit();
    // SAFETY: without a buffer only the size is told; then there are so many bytes.
    unsafe {
        assert_eq!(mpih_axes_controller_save(Some(controller), null_mut(), 0, Some(&mut needed)), Status::Ok);
        let mut text = vec![0; needed.assume_init()];
        assert_eq!(mpih_axes_controller_save(Some(controller), text.as_mut_ptr(), text.len(), None), Status::Ok);
        text
    }
}

fn references(k: u32) -> [f64; 2] {
    [0.3 + 0.5 * (0.05 * f64::from(k)).sin(), -0.2 + 0.3 * (0.07 * f64::from(k)).sin()]
}

#[test]
fn rows_are_steps_also_in_place_and_a_saved_state_goes_on() {
    let made = controller(|_| ()).unwrap();
    let rows: Vec<f64> = (0..300).flat_map(references).collect();
    // SAFETY: a controller that nothing else uses, and arrays of two numbers or of as many rows.
    unsafe {
        let one = &mut *made;
        let mut drives = [0.0; 2];
        for row in rows.chunks_exact(2).take(100) {
            let mut looked = [0.0; 2];
            assert_eq!(
                mpih_axes_controller_peek(Some(one), row.as_ptr(), row.as_ptr(), looked.as_mut_ptr()),
                Status::Ok
            );
            assert_eq!(
                mpih_axes_controller_plan(Some(one), row.as_ptr(), row.as_ptr(), drives.as_mut_ptr()),
                Status::Ok
            );
            assert!(mpih_axes_controller_commit(Some(one)) && !mpih_axes_controller_commit(Some(one)));
            assert_eq!(drives, looked);
            assert_eq!([0, 1].map(|axis| mpih_axes_controller_drive(Some(one), axis)), drives);
        }
        let text = saved(one);
        let mut after = Vec::new();
        for row in rows.chunks_exact(2).skip(100) {
            mpih_axes_controller_step(Some(one), row.as_ptr(), row.as_ptr(), drives.as_mut_ptr());
            after.extend(drives.map(f64::to_bits));
        }
        assert_eq!(mpih_axes_controller_load(Some(one), text.as_ptr()), Status::Ok, "{}", last_error());
        let mut array = rows[200..].to_vec();
        let (input, output) = (array.as_ptr(), array.as_mut_ptr());
        assert_eq!(mpih_axes_controller_run(Some(one), input, input, output, 200), Status::Ok);
        assert_eq!(array.iter().map(|number| number.to_bits()).collect::<Vec<_>>(), after);
        assert_eq!(mpih_axes_controller_load(Some(one), c"{\"dt\": 1}".as_ptr()), Status::Format);
        mpih_axes_controller_free(made);
    }
}

#[test]
fn what_a_controller_is_told_and_tells() {
    let made = controller(|options| (options.ahead, options.slew) = (12, 125.0)).unwrap();
    // SAFETY: a controller that nothing else uses, and arrays of two numbers or two rows.
    unsafe {
        let one = &mut *made;
        assert_eq!((mpih_axes_controller_ahead(Some(one)), mpih_axes_controller_mode(Some(one), 1)), (12, Mode::Run));
        let (first, bad, mut drives) = ([0.3, -0.2], [f64::NAN, 0.0], [0.0; 2]);
        assert_eq!(mpih_axes_controller_start_at(Some(one), [1.0, 2.0].as_ptr(), 2), Status::Ok);
        mpih_axes_controller_step(Some(one), bad.as_ptr(), bad.as_ptr(), drives.as_mut_ptr());
        assert_eq!(drives, [1.0, 2.0]);
        let mut counters = MaybeUninit::uninit();
        assert_eq!(mpih_axes_controller_counters(Some(one), 0, Some(&mut counters)), Status::Ok);
        assert_eq!(counters.assume_init().rejected, 1);
        assert_eq!(mpih_axes_controller_stop(Some(one), 1e3, [0.0, 9.0].as_ptr(), 2), Status::Argument);
        assert_eq!(mpih_axes_controller_stop(Some(one), 1e3, [0.0, 1.0].as_ptr(), 2), Status::Ok);
        // 125 a second of the slew, in samples of 1 ms.
        mpih_axes_controller_step(Some(one), first.as_ptr(), first.as_ptr(), drives.as_mut_ptr());
        assert_eq!((drives, mpih_axes_controller_mode(Some(one), 0)), ([0.875, 1.875], Mode::Stop));
        mpih_axes_controller_release(Some(one));
        mpih_axes_controller_hold(Some(one));
        assert_eq!(mpih_axes_controller_mode(Some(one), 1), Mode::Hold);
        assert_eq!(mpih_axes_controller_follow(Some(one), [3.0, 4.0, 5.0, 9.0].as_ptr(), 2), Status::Argument);
        assert_eq!(mpih_axes_controller_follow(Some(one), [3.0, 4.0, 5.0, 6.0].as_ptr(), 2), Status::Ok);
        mpih_axes_controller_reset(Some(one));
        assert_eq!([0, 1].map(|axis| mpih_axes_controller_drive(Some(one), axis)), [5.0, 6.0]);
        assert!(mpih_axes_controller_disturbance(Some(one), 1).abs() < 1e-12);
        assert!(mpih_axes_controller_lead_in(Some(one)) > 0.0);
        mpih_axes_controller_free(made);
    }
}

/// A state with another mode, and a bumpless term that goes on, of the second axis alone.
#[test]
fn each_axis_has_a_mode_and_the_longest_lead_in_counts() {
    let made = controller(|_| ()).unwrap();
    // SAFETY: a controller that nothing else uses, arrays of as many rows, and a text with its closing zero byte.
    unsafe {
        let one = &mut *made;
        let mut rows: Vec<f64> = (0..600).flat_map(references).collect();
        let (input, output) = (rows.as_ptr(), rows.as_mut_ptr());
        assert_eq!(mpih_axes_controller_run(Some(one), input, input, output, 600), Status::Ok);
        assert_eq!(mpih_axes_controller_lead_in(Some(one)), 0.0);
        let mut text = CStr::from_ptr(saved(one).as_ptr()).to_str().unwrap().to_owned();
        for (of_both, of_second) in
            [("\"mode\":\"run\"", "\"mode\":\"hold\""), ("bumpless_samples\":0", "bumpless_samples\":5")]
        {
            let place = text.rfind(of_both).unwrap();
            text.replace_range(place..place + of_both.len(), of_second);
        }
        let text = CString::new(text).unwrap();
        assert_eq!(mpih_axes_controller_load(Some(one), text.as_ptr()), Status::Ok, "{}", last_error());
        let modes = [0, 1, 2].map(|axis| mpih_axes_controller_mode(Some(one), axis));
        assert_eq!(modes, [Mode::Run, Mode::Hold, Mode::Hold]);
        assert!((mpih_axes_controller_lead_in(Some(one)) - 4e-3).abs() < 1e-12);
        assert_eq!(mpih_axes_controller_mode(None, 0), Mode::Hold);
        assert!(mpih_axes_controller_lead_in(None).is_nan());
        mpih_axes_controller_free(made);
    }
}

#[test]
fn what_does_not_fit_is_refused() {
    assert_eq!(controller(|options| options.ahead = 0).unwrap_err(), "ahead: expected 1 to 512 samples, got 0");
    assert_eq!(controller(|options| options.ahead = -2).unwrap_err(), "ahead: expected 0 or more, or -1, got -2");
    let error = controller(|options| options.peak_sensitivity = 1.0).unwrap_err();
    assert_eq!(error, "peak_sensitivity: expected 1.05 to 5, got 1.0");
    let (good, mut forward, mut other) = (stage(), null_mut(), null_mut());
    // SAFETY: a stage that is not used after it is freed, arrays of two numbers, and places for pointers.
    unsafe {
        let (limits, place) = (LIMITS.as_ptr(), &raw mut other);
        let stage = good.as_ref();
        assert_eq!(mpih_axes_controller_new(stage, limits, 1, None, null_mut(), 0, place), Status::Argument);
        assert_eq!(last_error(), "n: expected 2, the number of drives, got 1");
        assert_eq!(mpih_axes_controller_new(stage, null(), 2, None, null_mut(), 0, place), Status::Null);
        let (size, mut memory) = (mpih_axes_forward_size(), vec![0_u64; mpih_axes_forward_size() / 8 + 1]);
        assert_eq!(mpih_axes_forward_align(), 8);
        let memory = memory.as_mut_ptr().cast();
        assert_eq!(mpih_axes_forward_new(stage, memory, size - 1, &raw mut forward), Status::Memory);
        assert_eq!(mpih_axes_forward_new(stage, memory, size, &raw mut forward), Status::Ok);
        let mut y = [0.0; 2];
        assert_eq!(mpih_axes_forward_step(forward.as_mut(), null(), y.as_mut_ptr()), Status::Null);
        assert_eq!(last_error(), "drives: expected a pointer, got NULL");
        assert_eq!(mpih_axes_forward_step(forward.as_mut(), [f64::NAN, 1.0].as_ptr(), y.as_mut_ptr()), Status::Ok);
        assert_eq!((y, mpih_axes_forward_rejected(forward.as_ref())), ([0.3, -0.2], 1));
        mpih_axes_forward_reset(forward.as_mut());
        assert_eq!(mpih_axes_forward_rejected(forward.as_ref()), 0);
        mpih_axes_forward_free(forward);
        let text = CString::new(FILE.replace("0.69, 0.58", "1.69, 0.58")).unwrap();
        let mut unstable = null_mut();
        assert_eq!(mpih_axes_stage_from_json(text.as_ptr(), &raw mut unstable), Status::Argument);
        assert!(last_error().starts_with("a: expected eigenvalues inside the unit circle"), "{}", last_error());
        let oscillator = CString::new(include_str!("../../examples/oscillator.json")).unwrap();
        assert_eq!(mpih_axes_stage_from_json(oscillator.as_ptr(), &raw mut unstable), Status::Format);
        let expected = "schema: expected \"mpi_hyst/multi_axis_stage/1\", got \"mpi_hyst/oscillator/1\"";
        assert_eq!(last_error(), expected);
        mpih_axes_stage_free(good);
    }
}

/// An oscillator of a file leads a controller, and is followed.
#[test]
fn an_oscillator_is_a_stage_of_one_axis() {
    const DT: f64 = 1e-3;
    let text = CString::new(include_str!("../../examples/oscillator.json")).unwrap();
    let (mut oscillator, mut stage, mut controller, mut plant) = (null_mut(), null_mut(), null_mut(), null_mut());
    // SAFETY: places for pointers, objects that nothing else uses, and arrays of one number.
    unsafe {
        assert_eq!(mpih_oscillator_from_json(text.as_ptr(), &raw mut oscillator), Status::Ok, "{}", last_error());
        assert_eq!(mpih_axes_stage_of_oscillator(oscillator.as_ref(), DT, 1, &raw mut stage), Status::Ok);
        assert_eq!((mpih_axes_stage_drives(stage.as_ref()), mpih_axes_stage_dt(stage.as_ref())), (1, DT));
        let limits = [-200.0, 200.0];
        let (place, none) = (&raw mut controller, null_mut());
        let status = mpih_axes_controller_new(stage.as_ref(), limits.as_ptr(), 1, None, none, 0, place);
        assert_eq!(status, Status::Ok, "{}", last_error());
        let status = mpih_oscillator_forward_new(oscillator.as_ref(), DT, 1, null_mut(), 0, &raw mut plant);
        assert_eq!((status, last_error().starts_with("sub_steps: ")), (Status::Ok, false));
        mpih_oscillator_forward_free(plant);
        let status = mpih_oscillator_forward_new(oscillator.as_ref(), DT, 20, null_mut(), 0, &raw mut plant);
        assert_eq!(status, Status::Ok);
        let ahead = u32::try_from(mpih_axes_controller_ahead(controller.as_ref())).unwrap();
        let wanted = |k: u32| 5e-4 * (1.0 - (-(1e-2 * f64::from(k)).powi(2)).exp()) * (0.03 * f64::from(k)).sin();
        let (mut y, mut drive) = ([0.0], [0.0]);
        for k in 0..900 {
            let reference = [wanted(k + ahead)];
            mpih_axes_controller_step(controller.as_mut(), reference.as_ptr(), y.as_ptr(), drive.as_mut_ptr());
            y = [mpih_oscillator_forward_advance(plant.as_mut(), drive[0])];
            assert!(k < 200 || (y[0] - wanted(k + 1)).abs() < 1e-6, "{k}: {} {}", y[0], wanted(k + 1));
        }
        assert_eq!(mpih_oscillator_forward_position(plant.as_ref()), y[0]);
        mpih_oscillator_forward_free(plant);
        mpih_axes_controller_free(controller);
        mpih_axes_stage_free(stage);
        mpih_oscillator_free(oscillator);
    }
}

/// A stage with four steps in a sample is the stage of a quarter of the interval, whose drives stay for four samples.
#[test]
fn an_oscillator_has_sub_steps() {
    let text = CString::new(include_str!("../../examples/oscillator.json")).unwrap();
    let (mut oscillator, mut stages, mut plants) = (null_mut(), [null_mut(); 2], [null_mut(); 2]);
    // SAFETY: places for pointers, objects that nothing else uses, and arrays of one number.
    unsafe {
        assert_eq!(mpih_oscillator_from_json(text.as_ptr(), &raw mut oscillator), Status::Ok, "{}", last_error());
        let oscillator_there = oscillator.as_ref();
        let stage = &raw mut stages[0];
        assert_eq!(mpih_axes_stage_of_oscillator(oscillator_there, 1e-3, 0, stage), Status::Argument);
        assert_eq!(last_error(), "sub_steps: expected 1 to 1000 steps in a sample, got 0");
        for ((dt, sub_steps), (stage, plant)) in
            [(1e-3, 4), (2.5e-4, 1)].into_iter().zip(stages.iter_mut().zip(&mut plants))
        {
            assert_eq!(mpih_axes_stage_of_oscillator(oscillator_there, dt, sub_steps, &raw mut *stage), Status::Ok);
            assert_eq!(mpih_axes_stage_dt(stage.as_ref()), dt);
            let status = mpih_axes_forward_new(stage.as_ref(), null_mut(), 0, &raw mut *plant);
            assert_eq!(status, Status::Ok);
            mpih_axes_stage_free(*stage);
        }
        let (mut y, mut same) = ([0.0], [0.0]);
        for k in 0..100 {
            let drive = [100.0 * (0.3 * f64::from(k + 1)).sin()];
            mpih_axes_forward_advance(plants[0].as_mut(), drive.as_ptr(), y.as_mut_ptr());
            for _ in 0..4 {
                mpih_axes_forward_advance(plants[1].as_mut(), drive.as_ptr(), same.as_mut_ptr());
            }
            assert_eq!((y, y == [0.0]), (same, false));
        }
        for plant in plants {
            mpih_axes_forward_free(plant);
        }
        mpih_oscillator_free(oscillator);
    }
}

/// Reset to drives, modes, shares, limits and what no measurement can be, bit for bit as in Rust.
#[test]
fn a_controller_is_changed_as_in_rust() {
    let (ranges, steps) = ([-9.0, 9.0, f64::NAN, f64::NAN], [f64::NAN, 2.0]);
    let made = controller(|options| {
        (options.measurement_range, options.max_measurement_step) = (ranges.as_ptr(), steps.as_ptr());
    })
    .unwrap();
    let stage = MultiAxisStage::from_json(FILE).unwrap();
    let usual = |low, high| ControllerOptions::new(1.0, 0.0, stage.dt(), (low, high));
    let options = [
        ControllerOptions { measurement_range: Some((-9.0, 9.0)), ..usual(LIMITS[0], LIMITS[1]) },
        ControllerOptions { max_measurement_step: Some(2.0), ..usual(LIMITS[2], LIMITS[3]) },
    ];
    let mut rust = stage.controller(&options, &TrackingOptions::default()).unwrap();
    // SAFETY: a controller that nothing else uses, and arrays of two numbers.
    unsafe {
        let one = &mut *made;
        let compare = |one: &mut AxesController, rust: &mut MultiAxisStageController, from: u32| {
            let (mut drives, mut same) = ([0.0; 2], [0.0; 2]);
            for k in from..from + 50 {
                // Twice there is a measurement that cannot be.
                let (row, mut seen) = (references(k), references(k + 3));
                seen[0] += if k % 50 == 20 { 100.0 } else { 0.0 };
                seen[1] += if k % 50 == 40 { 5.0 } else { 0.0 };
                mpih_axes_controller_step(Some(one), row.as_ptr(), seen.as_ptr(), drives.as_mut_ptr());
                rust.step((&row).into(), &seen, &mut same).unwrap();
                assert_eq!(drives.map(f64::to_bits), same.map(f64::to_bits), "{k}");
            }
            drives
        };
        compare(one, &mut rust, 0);
        for axis in 0..2 {
            let mut counters = MaybeUninit::uninit();
            assert_eq!(mpih_axes_controller_counters(Some(one), axis, Some(&mut counters)), Status::Ok);
            let implausible = counters.assume_init().implausible;
            assert_eq!(implausible, rust.controller().controllers()[axis].counters().implausible_count);
            assert!(implausible >= 1, "{axis}");
        }
        assert_eq!(mpih_axes_controller_set_mode(Some(one), Mode::Feedforward as i32), Status::Ok);
        rust.controller_mut().set_mode(hysteresis_core::Mode::Feedforward).unwrap();
        compare(one, &mut rust, 50);
        assert_eq!([0, 1].map(|axis| mpih_axes_controller_mode(Some(one), axis)), [Mode::Feedforward; 2]);
        assert_eq!(mpih_axes_controller_set_mode(Some(one), Mode::Run as i32), Status::Ok);
        rust.controller_mut().set_mode(hysteresis_core::Mode::Run).unwrap();
        assert_eq!(mpih_axes_controller_set_gain(Some(one), 1, 0.5), Status::Ok);
        rust.set_gains(1, 0.5, 0.0).unwrap();
        compare(one, &mut rust, 100);
        assert_eq!(mpih_axes_controller_reset_at(Some(one), [1.0, -2.0].as_ptr(), 2), Status::Ok);
        rust.reset(Some(&[1.0, -2.0])).unwrap();
        assert_eq!([0, 1].map(|axis| mpih_axes_controller_drive(Some(one), axis)), [1.0, -2.0]);
        compare(one, &mut rust, 150);
        for axis in 0..2 {
            let (mut low, mut high) = (MaybeUninit::uninit(), MaybeUninit::uninit());
            let status = mpih_axes_controller_limits(Some(one), axis, Some(&mut low), Some(&mut high));
            assert_eq!(
                (status, low.assume_init(), high.assume_init()),
                (Status::Ok, LIMITS[2 * axis], LIMITS[2 * axis + 1])
            );
            for position in 0..2 {
                let entry = rust.controller().decoupling().entries()[2 * axis + position];
                assert_eq!(mpih_axes_controller_decoupling(Some(one), axis, position), entry);
            }
        }
        mpih_axes_controller_free(made);
    }
}

/// What is refused leaves the controller as it is.
#[test]
fn changes_that_do_not_fit_are_refused() {
    let made = controller(|_| ()).unwrap();
    // SAFETY: a controller that nothing else uses, and arrays of two numbers.
    unsafe {
        let one = &mut *made;
        let before = saved(one);
        assert_eq!(mpih_axes_controller_set_mode(Some(one), 4), Status::Argument);
        assert_eq!(last_error(), "mode: expected 0, 1 or 2, a number of mpih_mode, got 4");
        assert_eq!(mpih_axes_controller_set_mode(Some(one), Mode::Stop as i32), Status::Argument);
        assert_eq!(mpih_axes_controller_set_gain(Some(one), 2, 0.5), Status::Argument);
        assert!(last_error().starts_with("axis: "), "{}", last_error());
        assert_eq!(mpih_axes_controller_set_gain(Some(one), 0, 1.5), Status::Argument);
        assert!(last_error().starts_with("kp: expected 0 to 1 where a stage leads"), "{}", last_error());
        assert_eq!(mpih_axes_controller_reset_at(Some(one), [1.0, 9.0].as_ptr(), 2), Status::Argument);
        assert_eq!(mpih_axes_controller_reset_at(Some(one), [1.0].as_ptr(), 1), Status::Argument);
        assert_eq!(mpih_axes_controller_reset_at(Some(one), null(), 2), Status::Null);
        let mut number = MaybeUninit::uninit();
        assert_eq!(mpih_axes_controller_limits(Some(one), 0, Some(&mut number), None), Status::Null);
        assert_eq!(mpih_axes_controller_limits(Some(one), 2, Some(&mut number), None), Status::Argument);
        assert_eq!(last_error(), "axis: expected a number below 2, got 2");
        assert!(mpih_axes_controller_decoupling(Some(one), 2, 0).is_nan());
        assert!(mpih_axes_controller_decoupling(None, 0, 0).is_nan());
        assert_eq!(mpih_axes_controller_set_mode(None, 0), Status::Null);
        assert_eq!(saved(one), before);
        mpih_axes_controller_free(made);
    }
    let error = controller(|options| options.measurement_range = [1.0, f64::NAN, 0.0, 1.0].as_ptr()).unwrap_err();
    assert!(error.starts_with("measurement_range"), "{error}");
    let error = controller(|options| options.max_measurement_step = [1.0, -1.0].as_ptr()).unwrap_err();
    assert!(error.starts_with("max_measurement_step: "), "{error}");
}

#[test]
fn samples_allocate_nothing() {
    let (made, stage, mut plant) = (controller(|_| ()).unwrap(), stage(), null_mut());
    // SAFETY: objects that nothing else uses, and arrays of two numbers.
    unsafe {
        assert_eq!(mpih_axes_forward_new(stage.as_ref(), null_mut(), 0, &raw mut plant), Status::Ok);
        let (mut y, mut drives) = ([0.3, -0.2], [0.0; 2]);
        let count = allocations::count(|| {
            for k in 0..100 {
                let row = references(k);
                mpih_axes_controller_step(made.as_mut(), row.as_ptr(), y.as_ptr(), drives.as_mut_ptr());
                mpih_axes_forward_advance(plant.as_mut(), drives.as_ptr(), y.as_mut_ptr());
            }
        });
        assert_eq!(count, 0);
        mpih_axes_forward_free(plant);
        mpih_axes_controller_free(made);
        mpih_axes_stage_free(stage);
    }
}
