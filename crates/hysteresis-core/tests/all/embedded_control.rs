//! A controller over an inverse of fixed size: with f64 that over the inverse of the heap, bit for bit.

use crate::support::models::actuator;
use hysteresis_core::embedded::{Inverse, Model};
use hysteresis_core::{AntiWindup, Command, ControllerOptions, HybridController, Mode, Offsets, PrandtlIshlinskii};
use proptest::collection::vec;
use proptest::prelude::*;

const LIMITS: (f64, f64) = (-500.0, 500.0);

/// What may come from a reference or a sensor, in um.
fn reading() -> impl Strategy<Value = f64> {
    prop_oneof![12 => -4.0..4.0_f64, 2 => Just(f64::NAN), 1 => Just(1e30), 1 => Just(f64::INFINITY), 1 => -50.0..50.0_f64]
}

#[derive(Clone, Debug)]
enum Event {
    Sample(f64, f64),
    Planned(f64, f64),
    Mode(Mode),
    Stop(f64),
    Gains(f64, f64),
    Release,
    Reset,
}

fn event() -> impl Strategy<Value = Event> {
    let mode = prop_oneof![Just(Mode::Run), Just(Mode::Feedforward), Just(Mode::Hold)];
    prop_oneof![
        16 => (reading(), reading()).prop_map(|(r, y)| Event::Sample(r, y)),
        4 => (reading(), reading()).prop_map(|(r, y)| Event::Planned(r, y)),
        1 => mode.prop_map(Event::Mode),
        1 => (-500.0..500.0).prop_map(Event::Stop),
        1 => (0.0..50.0, 0.0..1e4).prop_map(|(kp, ki)| Event::Gains(kp, ki)),
        2 => Just(Event::Release),
        1 => Just(Event::Reset),
    ]
}

fn options() -> impl Strategy<Value = ControllerOptions> {
    let set = ControllerOptions::new(20.0, 5e3, 1e-4, LIMITS);
    (prop_oneof![Just(None), Just(Some(2e5))], prop_oneof![Just(None), Just(Some(1.0))], any::<bool>()).prop_map(
        move |(slew, max_measurement_step, tracking)| {
            let tracking = if tracking { AntiWindup::BackCalculation { tracking_time: None } } else { set.anti_windup };
            ControllerOptions { slew, max_measurement_step, anti_windup: tracking, max_missing: 2, ..set }
        },
    )
}

proptest! {
    #[test]
    fn a_controller_over_an_embedded_inverse_has_the_bits_of_the_heap(
        options in options(),
        events in vec(event(), 1..150),
    ) {
        let model = actuator();
        let fixed = Inverse::new(Model::<f64, 20>::try_from(&model).unwrap(), Some(LIMITS)).unwrap();
        let single = Model::<f32, 20>::try_from(&model).unwrap();
        let single = Inverse::new(&single, Some((-500.0, 500.0))).unwrap();
        let mut heap = HybridController::new(model.inverse(Some(LIMITS)).unwrap().into(), None, &options).unwrap();
        let mut fixed = HybridController::with_source(fixed, None, &options).unwrap();
        let mut single = HybridController::with_source(single, None, &options).unwrap();
        let step = options.slew.map_or(f64::INFINITY, |slew| slew * options.dt);
        for event in events {
            let before = single.drive();
            match event {
                Event::Sample(r, y) => {
                    let (command, expected) = (Command::from(r), heap.peek(r.into(), y));
                    prop_assert_eq!(fixed.peek(command, y).to_bits(), expected.to_bits());
                    prop_assert_eq!(heap.step(command, y).to_bits(), expected.to_bits());
                    prop_assert_eq!(fixed.step(command, y).to_bits(), expected.to_bits());
                    single.step(command, y);
                    prop_assert!((single.drive() - before).abs() <= step);
                }
                Event::Planned(r, y) => {
                    prop_assert_eq!(heap.plan(r.into(), y).to_bits(), fixed.plan(r.into(), y).to_bits());
                    prop_assert_eq!(heap.commit(), fixed.commit());
                    single.plan(r.into(), y);
                    single.commit();
                }
                Event::Mode(mode) => {
                    heap.set_mode(mode).unwrap();
                    fixed.set_mode(mode).unwrap();
                    single.set_mode(mode).unwrap();
                }
                Event::Stop(rest) => {
                    heap.stop(1e5, rest).unwrap();
                    fixed.stop(1e5, rest).unwrap();
                    single.stop(1e5, rest).unwrap();
                }
                Event::Gains(kp, ki) => {
                    heap.set_gains(kp, ki).unwrap();
                    fixed.set_gains(kp, ki).unwrap();
                    single.set_gains(kp, ki).unwrap();
                }
                Event::Release => {
                    heap.release();
                    fixed.release();
                    single.release();
                }
                Event::Reset => {
                    heap.reset();
                    fixed.reset();
                    single.reset();
                }
            }
            prop_assert_eq!(heap.counters(), fixed.counters());
            prop_assert_eq!(heap.terms(), fixed.terms());
            // Behind f32 another law may hold or take the same samples, but no drive ever leaves the limits.
            prop_assert!((LIMITS.0..=LIMITS.1).contains(&single.drive()), "{}", single.drive());
            prop_assert_eq!(heap.counters().missing_count, single.counters().missing_count);
        }
    }
}

#[test]
fn drives_before_are_followed_by_both() {
    let options = ControllerOptions { bumpless_time: 0.0, ..ControllerOptions::new(0.0, 0.0, 1e-4, (-10.0, 10.0)) };
    let (w, r) = ([1.0, 0.5], [0.0, 2.0]);
    let heap = PrandtlIshlinskii::new(&w, &r, Offsets::default()).unwrap().inverse(Some(options.limits)).unwrap();
    let model = Model::<f64, 2>::conventional(&w, &r, Offsets::default()).unwrap();
    let mut heap = HybridController::new(heap.into(), None, &options).unwrap();
    let fixed = Inverse::new(model, Some(options.limits)).unwrap();
    let mut fixed = HybridController::with_source(fixed, None, &options).unwrap();
    heap.follow(&[8.0, 4.0]).unwrap();
    fixed.follow(&[8.0, 4.0]).unwrap();
    for reference in [7.0, 7.0, 2.0, -3.0] {
        assert_eq!(heap.step(reference.into(), 0.0), fixed.step(reference.into(), 0.0));
    }
    assert!(fixed.follow(&[11.0]).is_err());
}

#[test]
fn the_limits_of_inverse_and_controller_must_be_the_same() {
    let model = Model::<f32, 2>::conventional(&[1.0, 0.5], &[0.0, 2.0], Offsets::default()).unwrap();
    let inverse = Inverse::new(&model, Some((-0.1, 10.0))).unwrap();
    let of = |low| ControllerOptions::new(0.0, 0.0, 1e-4, (low, 10.0));
    // As f32 the limit is not quite the same number.
    let error = HybridController::with_source(inverse.clone(), None, &of(-0.1)).unwrap_err();
    assert_eq!(error.parameter(), Some("feedforward"));
    assert!(HybridController::with_source(inverse, None, &of(f64::from(-0.1_f32))).is_ok());
    let free = Inverse::new(&model, None).unwrap();
    assert!(HybridController::with_source(free, None, &of(-0.1)).is_err());
}
