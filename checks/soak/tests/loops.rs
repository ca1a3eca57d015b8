//! A short run of all loops, and that a breach is seen.

use soak::loops::{Actuators, Axes, Axis, Episode, Guard, Learning, run};

/// Some set-ups hold nothing back; many together must, or the run would show nothing.
fn holds<E: Episode>(set_ups: u64, samples: u64) {
    assert!(run::<E>(1, set_ups, samples).unwrap() > set_ups);
}

#[test]
fn one_axis_keeps_limits_and_slew_whatever_comes() {
    holds::<Axis>(30, 1000);
}

#[test]
fn several_axes_keep_limits_and_slew_whatever_comes() {
    holds::<Axes>(10, 1000);
}

#[test]
fn an_array_keeps_limits_and_slew_whatever_comes() {
    holds::<Actuators>(10, 1000);
}

#[test]
fn learning_keeps_limits_and_slew_whatever_comes() {
    holds::<Learning>(20, 20);
}

#[test]
fn a_breach_is_seen() {
    let law = |drive| Guard::new((-10.0, 20.0), Some(3e4), 1e-4, 1.0).pass(drive).map_err(|breach| breach.law);
    assert_eq!(law(4.0), Ok(()));
    assert_eq!(law(4.0_f64.next_up()), Err("the drive keeps its slew rate"));
    assert_eq!(law(f64::NAN), Err("the drive is finite"));
    assert_eq!(law(-10.5), Err("the drive is above its low limit"));
    assert_eq!(law(20.5), Err("the drive is below its high limit"));
}
