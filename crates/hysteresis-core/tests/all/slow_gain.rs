//! The slow gain alone, behind a hysteresis that is none: v = zero + g (u - zero).

use hysteresis_core::{Bracket, CreepTerms, Error, LoopShiftTerms, Process, QuasiStatic, SlowGainTerms};
use proptest::prelude::*;

use crate::support::past_drives::{assert_refusals_move_nothing, identity};

const HALF_RANGE: f64 = 60.0;
const ZERO: f64 = -10.0;

fn changing(amplitude: f64, decay: f64) -> QuasiStatic {
    identity().with_slow_gain(SlowGainTerms::new(HALF_RANGE, amplitude, ZERO, decay).unwrap())
}

/// g at each sample.
fn gains(stage: &QuasiStatic, drives: &[f64]) -> Vec<f64> {
    let mut forward = stage.forward();
    forward.settle(drives[0]);
    drives.iter().map(|u| (forward.step(*u) - ZERO) / (u - ZERO)).collect()
}

/// The equations between samples, integrated with 500 steps of fourth order per sample; tau is 1.
fn integrated(amplitude: f64, dt: f64, drives: &[f64]) -> Vec<f64> {
    let (mut m, mut f, h) = (0.0, drives[0] / HALF_RANGE, dt / 500.0);
    let mut found = Vec::new();
    for u in drives {
        found.push(1.0 + amplitude * m);
        let x = u / HALF_RANGE;
        // The follower never stays behind by more than 1.
        f = x - (x - f).clamp(-1.0, 1.0);
        for _ in 0..500 {
            let rates = |[m, f]: [f64; 2]| [(x - f) * (x - f) - m, 4.0 * (x - f)];
            let ahead = |k: [f64; 2], by: f64| [m + by * k[0], f + by * k[1]];
            let k1 = rates([m, f]);
            let k2 = rates(ahead(k1, 0.5 * h));
            let k3 = rates(ahead(k2, 0.5 * h));
            let k4 = rates(ahead(k3, h));
            let slope = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            (m, f) = (m + slope(0), f + slope(1));
        }
    }
    found
}

#[test]
fn the_samples_are_those_of_the_differential_equations() {
    let drives: Vec<f64> =
        (0..60).map(|k| 75.0 + 50.0 * (0.3 * f64::from(k)).sin() + if k % 20 > 14 { 40.0 } else { 0.0 }).collect();
    for dt in [0.02, 0.5] {
        let found = gains(&changing(-0.4, f64::exp(-dt)), &drives);
        for (got, want) in found.iter().zip(integrated(-0.4, dt, &drives)) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
    }
}

#[test]
fn a_sine_over_the_whole_range_has_half_the_amplitude() {
    let drive = |amplitude: f64, k: i32| 75.0 + amplitude * (0.3 * f64::from(k)).sin();
    for (amplitude, mean) in [(HALF_RANGE, 0.5), (0.5 * HALF_RANGE, 0.125)] {
        let drives: Vec<f64> = (0..20_000).map(|k| drive(amplitude, k)).collect();
        let found = gains(&changing(-0.1, 0.999), &drives);
        let last = found[19_000..].iter().sum::<f64>() / 1000.0;
        assert!((last - (1.0 - 0.1 * mean)).abs() < 1e-3, "{last}");
    }
}

#[test]
fn at_rest_the_gain_is_one_and_after_a_motion_it_comes_back() {
    let stage = changing(-0.4, 0.9);
    assert!(gains(&stage, &[130.0; 50]).iter().all(|gain| (gain - 1.0).abs() < 1e-15));
    let mut drives: Vec<f64> = (0..120_i32).map(|k| 75.0 + 50.0 * (0.5 * f64::from(k)).sin()).collect();
    drives.extend([75.0; 600]);
    let found = gains(&stage, &drives);
    assert!(found[119] < 0.95 && (found[719] - 1.0).abs() < 1e-12, "{} {}", found[119], found[719]);
    // Reset is rest as well.
    let mut forward = stage.forward();
    forward.follow(&drives[..100]).unwrap();
    forward.reset();
    assert_eq!([forward.step(0.0), forward.step(0.0)], [0.0, 0.0]);
    let mut inverse = stage.inverse(Some((0.0, 150.0))).unwrap();
    inverse.follow(&drives[..100]).unwrap();
    inverse.reset();
    assert_eq!([inverse.step(0.0), inverse.step(0.0)], [0.0, 0.0]);
}

#[test]
fn it_stands_between_loop_shift_and_creep() {
    let shift = LoopShiftTerms::new(75.0, HALF_RANGE, [-3.0, 2.0], 10.0, 0.8).unwrap();
    let creep = CreepTerms::new(&[0.1], &[0.9]).unwrap();
    let gain = changing(-0.4, 0.9);
    let drives: Vec<f64> = (0..100_i32).map(|k| 75.0 + 50.0 * (0.5 * f64::from(k)).sin()).collect();
    let gains = gains(&gain, &drives);
    let mut shifted = identity().with_loop_shift(shift).forward();
    let mut whole = gain.with_loop_shift(shift).with_creep(creep).forward();
    shifted.settle(drives[0]);
    let mut slow = whole.settle(drives[0]) / 1.1;
    for (drive, gain) in drives.iter().zip(gains) {
        let v = ZERO + gain * (shifted.step(*drive) - ZERO);
        let (got, want) = (whole.step(*drive), v + 0.1 * slow);
        assert!((got - want).abs() < 1e-12 * 150.0, "{got} {want}");
        slow = 0.9 * slow + 0.1 * v;
    }
}

#[test]
fn no_drive_takes_the_gain_beyond_its_amplitude() {
    for amplitude in [-0.5, 0.5] {
        let mut drives: Vec<f64> = (0..400_i32).map(|k| if k % 2 == 0 { 1e100 } else { -1e100 }).collect();
        drives.push(50.0);
        let last = gains(&changing(amplitude, 0.9), &drives)[400];
        assert!((last - 1.0).abs() <= 0.5 && (last - 1.0).abs() > 0.2, "{last}");
    }
}

#[test]
fn a_bracket_leaves_the_gain_out() {
    let mut bracket = Bracket::of_stage(&changing(-0.4, 0.5), (0.0, 150.0)).unwrap();
    for drive in [0.0, 150.0, 40.0, 90.0] {
        assert_eq!(bracket.step(drive), (drive, drive));
    }
}

#[test]
fn what_is_refused_moves_nothing() {
    assert_refusals_move_nothing(changing(-0.4, 0.9));
}

#[test]
fn bad_numbers_are_named() {
    let made = |half_range, amplitude, zero, decay| {
        SlowGainTerms::new(half_range, amplitude, zero, decay).unwrap_err().to_string()
    };
    assert_eq!(made(0.0, 0.1, 0.0, 0.5), "half_range: expected a number above 0 (1e-50 to 1e50), got 0.0");
    assert_eq!(made(1.0, -0.51, 0.0, 0.5), "amplitude: expected a number from -0.5 to 0.5, got -0.51");
    assert!(made(1.0, f64::NAN, 0.0, 0.5).starts_with("amplitude: expected"));
    assert!(made(1.0, 0.1, f64::INFINITY, 0.5).starts_with("zero: expected a finite number"));
    assert_eq!(made(1.0, 0.1, 0.0, 1.5), "decay: expected a number from 0.0 to 1.0, got 1.5");
}

#[test]
fn a_state_that_cannot_be_is_refused() {
    let shift = LoopShiftTerms::new(75.0, HALF_RANGE, [-3.0, 2.0], 10.0, 0.8).unwrap();
    for (stage, first) in [(changing(-0.4, 0.9), 0), (changing(-0.4, 0.9).with_loop_shift(shift), 3)] {
        let mut with = stage.forward();
        with.follow(&[20.0, 90.0]).unwrap();
        let good = with.state();
        assert_eq!(good.loop_shift.len(), first + 2);
        assert!(matches!(identity().forward().set_state(&good), Err(Error::OtherModel { .. })));
        let mut refused = |change: &dyn Fn(&mut Vec<f64>)| {
            let mut state = good.clone();
            change(&mut state.loop_shift);
            with.set_state(&state).unwrap_err().to_string()
        };
        let length = refused(&|states| states.truncate(first + 1));
        assert_eq!(length, format!("state.loop_shift: expected {} elements, got {}", first + 2, first + 1));
        for mean_square in [-0.1, 1.1] {
            let mean = refused(&|states| states[first] = mean_square);
            assert!(
                mean.starts_with(&format!("state.loop_shift[{first}]: expected a number from 0.0 to 1.0")),
                "{mean}"
            );
        }
        assert!(refused(&|states| states[first + 1] = f64::NAN).contains("expected a finite number"));
        assert_eq!(with.state(), good);
    }
}

#[test]
fn the_terms_tell_what_they_were_made_of() {
    let terms = SlowGainTerms::new(HALF_RANGE, -0.4, ZERO, 0.9).unwrap();
    assert_eq!((terms.half_range(), terms.amplitude(), terms.zero(), terms.decay()), (HALF_RANGE, -0.4, ZERO, 0.9));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Rounding only: the mean is a sum of products of a few units.
    #[test]
    fn a_hold_in_parts_is_a_hold(
        drives in proptest::collection::vec(10.0..150.0_f64, 2..40),
        (amplitude, decay) in (-0.5..0.5, 0.01..0.999_f64),
    ) {
        let once = gains(&changing(amplitude, decay), &drives);
        let mut parts = changing(amplitude, decay.sqrt().sqrt()).forward();
        parts.settle(drives[0]);
        for (drive, want) in drives.iter().zip(once) {
            let got = (parts.step(*drive) - ZERO) / (drive - ZERO);
            prop_assert!((got - want).abs() < 1e-12, "{} {}", got, want);
            for _ in 1..4 {
                parts.step(*drive);
            }
        }
    }
}
