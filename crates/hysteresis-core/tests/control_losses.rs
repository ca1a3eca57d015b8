//! Measurements that are lost now and then, or all the time: the loop is never worse than without a sensor.

#[path = "support/models.rs"]
mod models;

use hysteresis_core::{ControllerOptions, HybridController, Process};
use models::actuator;

const LIMITS: (f64, f64) = (-500.0, 500.0);
const DT: f64 = 1e-4;

/// The largest distance of the position from a sine of 2 um and 10 Hz in its second half, on an actuator of another gain than the
/// model's, and how often a measurement was missing.
fn largest_error(lost: impl FnMut(u32) -> bool) -> (f64, u64) {
    let options = ControllerOptions::new(5.0, 6e3, DT, LIMITS);
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
    let (without_a_sensor, all) = largest_error(|_| true);
    assert!(without_a_sensor < 0.11 && all == 20_000, "{without_a_sensor}");
    let (with_it, _) = largest_error(|_| false);
    assert!(with_it < without_a_sensor, "{with_it}");
    let mut random = 1_u32;
    let mut half_at_random = |_: u32| {
        random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        random >> 31 == 1
    };
    let every = |n: u32| move |k: u32| k % n == n - 1;
    let all_but = |n: u32| move |k: u32| !k.is_multiple_of(n);
    let kinds = [
        ("every 60th", largest_error(every(60))),
        ("every 20th", largest_error(every(20))),
        ("every other", largest_error(every(2))),
        ("the others", largest_error(all_but(2))),
        ("two of three", largest_error(all_but(3))),
        ("nine of ten", largest_error(all_but(10))),
        ("half of them at random", largest_error(&mut half_at_random)),
    ];
    for (kind, (error, lost)) in kinds {
        assert!(
            error < 1.1 * without_a_sensor,
            "{kind}, {lost} lost: {error} um, without a sensor {without_a_sensor} um"
        );
    }
}
