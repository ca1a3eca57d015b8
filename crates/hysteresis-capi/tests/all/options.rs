//! Every option of a controller reaches the controller: the bits and counts are those of one that was made in Rust.

use core::mem::MaybeUninit;
use core::ptr::null_mut;
use std::ffi::CString;

use hysteresis_control::stage::{FeedForwardKind, Stage};
use hysteresis_core::{ControllerOptions as Direct, HybridController, Sections};
use mpi_hyst::*;

const DT: f64 = 1e-4;
const FILE: &str = include_str!("../../examples/stage.json");

/// References and measurements of every kind.
fn rows() -> impl Iterator<Item = (f64, f64)> {
    let scaled = |s: f64| 14.0 + 18.0 * s;
    same_bits::Mixed::new(1)
        .zip(same_bits::Mixed::new(2).skip(503))
        .map(move |(x, y)| (scaled(x), scaled(y)))
        .take(6000)
}

fn made(change: impl FnOnce(&mut ControllerOptions)) -> *mut Controller {
    let (mut stage, mut made, mut options) = (null_mut(), null_mut(), MaybeUninit::uninit());
    let text = CString::new(FILE).unwrap();
    // SAFETY: a text, places for the pointers, and a stage that is not used after it is freed.
    unsafe {
        assert_eq!(mpih_stage_from_json(text.as_ptr(), &raw mut stage), Status::Ok);
        assert_eq!(mpih_controller_options_default(Some(&mut options)), Status::Ok);
        let mut options = options.assume_init();
        change(&mut options);
        let status = mpih_controller_new(stage.as_ref(), DT, Some(&options), null_mut(), 0, &raw mut made);
        assert_eq!(status, Status::Ok);
        mpih_stage_free(stage);
    }
    made
}

/// Both give the same drives, and the same counts, which are returned.
fn compare(ours: *mut Controller, mut direct: HybridController) -> [u64; 5] {
    let mut counters = MaybeUninit::uninit();
    // SAFETY: a controller that was made just now and is not used after it is freed.
    let ours = unsafe {
        for (k, (reference, measurement)) in rows().enumerate() {
            let drive = mpih_controller_step(ours.as_mut(), reference, measurement);
            assert_eq!(drive.to_bits(), direct.step(reference.into(), measurement).to_bits(), "{k}");
        }
        assert_eq!(mpih_controller_ahead(ours.as_ref()), direct.preview().map_or(0, hysteresis_core::Preview::ahead));
        assert_eq!(mpih_controller_counters(ours.as_ref(), Some(&mut counters)), Status::Ok);
        mpih_controller_free(ours);
        counters.assume_init()
    };
    let counts = [ours.rejected, ours.missing, ours.implausible, ours.saturated, ours.slewing];
    let there = direct.counters();
    let expected = [there.rejected_count, there.missing_count, there.implausible_count, there.saturated_count];
    assert_eq!((&counts[..4], counts[4]), (&expected[..], there.slewing_count));
    counts
}

#[test]
fn all_options_that_are_given() {
    let ours = made(|options| {
        *options = ControllerOptions {
            limit_low: 0.0,
            limit_high: 100.0,
            kp: 0.8,
            ki: 700.0,
            slew: 5e4,
            start_drive: 12.0,
            bumpless_time: 0.01,
            measurement_low: -1.0,
            measurement_high: 26.0,
            max_measurement_step: 20.0,
            smoothing: 0.003,
            feedforward: Feedforward::Preview as i32,
            ahead: 10,
            max_missing: 3,
            reserved: 0,
        }
    });
    let options = Direct {
        slew: Some(5e4),
        start_drive: Some(12.0),
        bumpless_time: 0.01,
        measurement_range: Some((-1.0, 26.0)),
        max_measurement_step: Some(20.0),
        max_missing: 3,
        filters: Sections::default(),
        ..Direct::new(0.8, 700.0, DT, (0.0, 100.0))
    };
    let kind = FeedForwardKind::Preview { ahead: 10, smoothing: 0.003 };
    let direct = Stage::from_json(FILE).unwrap().controller(kind, &options).unwrap();
    let counts = compare(ours, direct);
    assert!(counts.iter().all(|count| *count > 0), "{counts:?}");
}

#[test]
fn what_is_left_open_is_of_the_stage() {
    let stage = Stage::from_json(FILE).unwrap();
    let options = stage.controller_options(DT, None).unwrap();
    assert!(!options.filters.as_slice().is_empty(), "tuned gains of this stage have filters");
    compare(made(|_| {}), stage.controller(FeedForwardKind::Inverse, &options).unwrap());
    let unbounded = Direct { slew: None, ..options };
    let kind = FeedForwardKind::Preview { ahead: stage.preview_ahead(DT).unwrap(), smoothing: 0.0 };
    let ours = made(|options| {
        (options.slew, options.feedforward) = (f64::INFINITY, Feedforward::Preview as i32);
    });
    let counts = compare(ours, stage.controller(kind, &unbounded).unwrap());
    assert_eq!(counts[4], 0);
}
