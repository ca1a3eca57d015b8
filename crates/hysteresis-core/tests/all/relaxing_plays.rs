//! Plays that relax, behind a hysteresis that is none: y = u + r.

use hysteresis_core::{Bracket, CreepTerms, Error, Process, QuasiStatic, RelaxingPlayTerms, SlowGainTerms};
use proptest::prelude::*;

use crate::support::past_drives::{assert_refusals_move_nothing, identity};

const THRESHOLDS: [f64; 3] = [0.0, 8.0, 25.0];
const ORIGIN: f64 = 5.0;
const WEIGHTS: [[f64; 3]; 2] = [[0.02, 0.1, 0.04], [0.0, 0.05, -0.03]];

fn terms(decays: [f64; 2]) -> RelaxingPlayTerms {
    RelaxingPlayTerms::new(&THRESHOLDS, ORIGIN, &decays, &WEIGHTS.map(Vec::from)).unwrap()
}

fn relaxing(decays: [f64; 2]) -> QuasiStatic {
    identity().with_relaxing_plays(terms(decays))
}

/// r at each sample.
fn relaxed(stage: &QuasiStatic, drives: &[f64]) -> Vec<f64> {
    let mut forward = stage.forward();
    forward.settle(drives[0]);
    drives.iter().map(|u| forward.step(*u) - u).collect()
}

/// The lags between samples, integrated with 200 steps of fourth order per sample.
fn integrated(taus: [f64; 2], dt: f64, drives: &[f64]) -> Vec<f64> {
    let mut z = [0.0_f64; 3];
    let mut see = |u: f64| {
        for (z, r) in z.iter_mut().zip(THRESHOLDS) {
            *z = f64::max(*z, u - ORIGIN - r).min(u - ORIGIN + r);
        }
        WEIGHTS.map(|row| row.iter().zip(z).map(|(weight, z)| weight * z).sum::<f64>())
    };
    let (mut s, h) = (see(drives[0]), dt / 200.0);
    let mut found = Vec::new();
    for u in drives {
        found.push(s[0] + s[1]);
        let targets = see(*u);
        for ((s, target), tau) in s.iter_mut().zip(targets).zip(taus) {
            for _ in 0..200 {
                let rate = |s: f64| (target - s) / tau;
                let k1 = rate(*s);
                let k2 = rate(*s + 0.5 * h * k1);
                let k3 = rate(*s + 0.5 * h * k2);
                let k4 = rate(*s + h * k3);
                *s += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
            }
        }
    }
    found
}

fn wave(count: i32) -> Vec<f64> {
    (0..count).map(|k| 60.0 + 50.0 * (0.3 * f64::from(k)).sin() + 20.0 * (1.1 * f64::from(k)).sin()).collect()
}

#[test]
fn the_samples_are_those_of_the_differential_equations() {
    let (drives, taus) = (wave(80), [0.03, 0.4]);
    for dt in [0.01, 0.2] {
        let found = relaxed(&relaxing(taus.map(|tau| f64::exp(-dt / tau))), &drives);
        for (got, want) in found.iter().zip(integrated(taus, dt, &drives)) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
    }
}

#[test]
fn one_play_of_no_threshold_is_creep_of_the_drive() {
    let plays = RelaxingPlayTerms::new(&[0.0], 0.0, &[0.9], &[vec![0.1]]).unwrap();
    let mut relaxing = identity().with_relaxing_plays(plays).forward();
    let mut creeping = identity().with_creep(CreepTerms::new(&[0.1], &[0.9]).unwrap()).forward();
    relaxing.settle(3.0);
    creeping.settle(3.0);
    for drive in wave(200) {
        let (got, want) = (relaxing.step(drive), creeping.step(drive));
        assert!((got - want).abs() < 1e-12, "{got} {want}");
    }
}

#[test]
fn at_rest_nothing_moves_and_a_loop_is_wider_where_it_is_slow() {
    let stage = relaxing([0.9, 0.99]);
    let still = relaxed(&stage, &[90.0; 50]);
    assert!(still.iter().all(|r| (r - still[0]).abs() < 1e-12));
    // Half way up and half way down, in the second loop, which is closed.
    let width = |samples: u32| {
        let at = |k: u32| 60.0 - 60.0 * (std::f64::consts::TAU * f64::from(k) / f64::from(samples)).cos();
        let drives: Vec<f64> = (0..4 * samples).map(at).collect();
        let r = relaxed(&relaxing([0.9, 0.9]), &drives);
        let start = 3 * samples as usize;
        r[start + 3 * samples as usize / 4] - r[start + samples as usize / 4]
    };
    let slow = THRESHOLDS.iter().enumerate().map(|(i, r)| 2.0 * r * (WEIGHTS[0][i] + WEIGHTS[1][i])).sum::<f64>();
    assert!((width(100_000) - slow).abs() < 0.02, "{} {slow}", width(100_000));
    // The lag comes on top, until nothing follows any more.
    assert!(width(400) > slow + 0.5 && width(4) < slow, "{} {}", width(400), width(4));
    // Reset is rest as well.
    let mut forward = stage.forward();
    forward.follow(&wave(100)).unwrap();
    forward.reset();
    let again = [forward.step(0.0), forward.step(0.0)];
    assert_eq!(again[0], again[1]);
    assert_eq!(again[0], stage.forward().settle(0.0));
}

#[test]
fn they_stand_in_front_of_slow_gain_and_creep() {
    let gain = SlowGainTerms::new(60.0, -0.2, 10.0, 0.9).unwrap();
    let (decays, creep) = ([0.7, 0.95], CreepTerms::new(&[0.1], &[0.9]).unwrap());
    let drives = wave(120);
    let mut gains = identity().with_slow_gain(SlowGainTerms::new(60.0, -0.2, 0.0, 0.9).unwrap()).forward();
    let mut whole = relaxing(decays).with_slow_gain(gain).with_creep(creep).forward();
    gains.settle(drives[0]);
    let mut slow = whole.settle(drives[0]) / 1.1;
    for (drive, r) in drives.iter().zip(relaxed(&relaxing(decays), &drives)) {
        let v = 10.0 + gains.step(*drive) / drive * (drive + r - 10.0);
        let (got, want) = (whole.step(*drive), v + 0.1 * slow);
        assert!((got - want).abs() < 1e-12 * 150.0, "{got} {want}");
        slow = 0.9 * slow + 0.1 * v;
    }
}

#[test]
fn a_bracket_leaves_them_out() {
    let mut bracket = Bracket::of_stage(&relaxing([0.5, 0.9]), (0.0, 150.0)).unwrap();
    for drive in [0.0, 150.0, 40.0, 90.0] {
        assert_eq!(bracket.step(drive), (drive, drive));
    }
}

#[test]
fn what_is_refused_moves_nothing() {
    assert_refusals_move_nothing(relaxing([0.5, 0.9]));
}

#[test]
fn bad_numbers_are_named() {
    let made = |thresholds: &[f64], origin, decays: &[f64], weights: &[Vec<f64>]| {
        RelaxingPlayTerms::new(thresholds, origin, decays, weights).unwrap_err().to_string()
    };
    let one = [vec![0.1]];
    assert_eq!(made(&[], 0.0, &[0.5], &one), "thresholds: expected at least one number, got 0");
    assert_eq!(made(&[1.0], 0.0, &[], &one), "decays: expected at least one number, got 0");
    assert!(made(&[-1.0], 0.0, &[0.5], &one).starts_with("thresholds[0]: expected a finite number >= 0"));
    assert!(made(&[1.0, 1.0], 0.0, &[0.5], &one).starts_with("thresholds[1]: expected a number above the one before"));
    assert!(made(&[1.0], f64::NAN, &[0.5], &one).starts_with("origin: expected a finite number"));
    assert_eq!(made(&[1.0], 0.0, &[1.5], &one), "decays[0]: expected a number from 0.0 to 1.0, got 1.5");
    assert_eq!(made(&[1.0], 0.0, &[0.5, 0.9], &one), "weights: expected 2 elements, got 1");
    assert_eq!(made(&[1.0, 2.0], 0.0, &[0.5], &one), "weights: expected 2 elements, got 1");
    assert!(made(&[1.0], 0.0, &[0.5], &[vec![f64::INFINITY]]).starts_with("weights[0]: expected a finite number"));
}

#[test]
fn a_state_that_cannot_be_is_refused() {
    let gain = SlowGainTerms::new(60.0, -0.2, 10.0, 0.9).unwrap();
    for (stage, first) in [(relaxing([0.5, 0.9]), 0), (relaxing([0.5, 0.9]).with_slow_gain(gain), 2)] {
        let mut with = stage.forward();
        with.follow(&[20.0, 90.0, 30.0]).unwrap();
        let good = with.state();
        assert_eq!(good.loop_shift.len(), first + 5);
        assert!(matches!(identity().forward().set_state(&good), Err(Error::OtherModel { .. })));
        let mut other = stage.forward();
        other.set_state(&good).unwrap();
        assert_eq!([other.step(40.0), other.step(10.0)], [with.step(40.0), with.step(10.0)]);
        let good = with.state();
        let mut refused = |change: &dyn Fn(&mut Vec<f64>)| {
            let mut state = good.clone();
            change(&mut state.loop_shift);
            with.set_state(&state).unwrap_err().to_string()
        };
        let length = refused(&|states| states.truncate(first + 4));
        assert_eq!(length, format!("state.loop_shift: expected {} elements, got {}", first + 5, first + 4));
        assert!(refused(&|states| states[first + 1] = f64::NAN).contains("expected a finite number"));
        assert_eq!(with.state(), good);
    }
}

#[test]
fn the_terms_tell_what_they_were_made_of() {
    let terms = terms([0.5, 0.9]);
    assert_eq!((terms.origin(), terms.decays()), (ORIGIN, &[0.5, 0.9][..]));
    assert!(terms.thresholds().eq(THRESHOLDS));
    assert!(terms.weights().zip(&WEIGHTS).all(|(got, want)| got == want));
    let (one, other) = (relaxing([0.5, 0.9]), relaxing([0.5, 0.91]));
    assert!(one.fingerprint() != other.fingerprint() && one.fingerprint() != identity().fingerprint());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Rounding only: sums of a few products of at most 200.
    #[test]
    fn a_hold_in_parts_is_a_hold(
        drives in proptest::collection::vec(-50.0..150.0_f64, 2..40),
        decays in proptest::array::uniform2(0.01..0.999_f64),
    ) {
        let once = relaxed(&relaxing(decays), &drives);
        let mut parts = relaxing(decays.map(|decay| decay.sqrt().sqrt())).forward();
        parts.settle(drives[0]);
        for (drive, want) in drives.iter().zip(once) {
            let got = parts.step(*drive) - drive;
            prop_assert!((got - want).abs() < 1e-11, "{} {}", got, want);
            for _ in 1..4 {
                parts.step(*drive);
            }
        }
    }

    #[test]
    fn forward_of_inverse_is_the_target(
        targets in proptest::collection::vec(-50.0..150.0_f64, 1..60),
        decays in proptest::array::uniform2(0.0..1.0_f64),
    ) {
        let stage = relaxing(decays);
        let (mut forward, mut inverse) = (stage.forward(), stage.inverse(None).unwrap());
        for target in targets {
            let reached = forward.step(inverse.step(target));
            prop_assert!((reached - target).abs() < 1e-11, "{} {}", reached, target);
        }
    }
}
