//! Measurements that are lost now and then, or all the time: the loop is worse than without a sensor by no more than
//! the reference moves while a loss holds the drive.

use crate::support::models::actuator;
use hysteresis_core::{ControllerOptions, HybridController, Process};

const LIMITS: (f64, f64) = (-500.0, 500.0);
const DT: f64 = 1e-4;

/// How far the reference moves in a sample at most, in um.
const MOTION: f64 = 2.0 * core::f64::consts::TAU * 10.0 * DT;

/// The largest distance of the position from a sine of 2 um and 10 Hz in its second half, on an actuator of another
/// gain than the model's, and how often a measurement was missing.
fn largest_error(bumpless_time: f64, lost: impl FnMut(u32) -> bool) -> (f64, u64) {
    let options = ControllerOptions { bumpless_time, ..ControllerOptions::new(5.0, 6e3, DT, LIMITS) };
    let source = actuator().inverse(Some(LIMITS)).unwrap().into();
    let mut controller = HybridController::new(source, None, &options).unwrap();
    let (mut stage, mut lost) = (actuator().forward(), lost);
    let (mut position, mut largest) = (0.0, 0.0_f64);
    for k in 0..20_000 {
        let reference = 2.0 * (core::f64::consts::TAU * 10.0 * DT * f64::from(k)).sin();
        let measurement = if lost(k) { f64::NAN } else { position };
        position = 1.05 * stage.step(controller.step(reference.into(), measurement));
        if k >= 10_000 {
            largest = largest.max((reference - position).abs());
        }
    }
    (largest, controller.counters().missing_count)
}

#[test]
fn however_many_measurements_are_lost_the_drive_goes_on() {
    for bumpless_time in [5e-3, 1e-3, DT, 0.0] {
        let error = |lost: &mut dyn FnMut(u32) -> bool| largest_error(bumpless_time, lost);
        let (without_a_sensor, all) = error(&mut |_| true);
        assert!(without_a_sensor < 0.11 && all == 20_000, "{without_a_sensor}");
        let (with_it, _) = error(&mut |_| false);
        assert!(with_it < without_a_sensor, "{with_it}");
        let mut random = 1_u32;
        let mut half_at_random = |_: u32| {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random >> 31 == 1
        };
        // How many are lost in a row, or as many as hold the drive.
        let kinds = [
            ("every 60th", 1.0, error(&mut |k| k % 60 == 59)),
            ("every 20th", 1.0, error(&mut |k| k % 20 == 19)),
            ("every other", 1.0, error(&mut |k| k.is_multiple_of(2))),
            ("the others", 1.0, error(&mut |k| !k.is_multiple_of(2))),
            ("two of three", 2.0, error(&mut |k| !k.is_multiple_of(3))),
            ("nine of ten", 9.0, error(&mut |k| !k.is_multiple_of(10))),
            ("half of them at random", 10.0, error(&mut half_at_random)),
        ];
        for (kind, in_a_row, (error, lost)) in kinds {
            let most = 1.1 * without_a_sensor + in_a_row * MOTION;
            assert!(error < most, "{kind}, {lost} lost, {bumpless_time} s: {error} um, not {most} um");
        }
    }
}
