//! The loop shift alone, behind a hysteresis that is none: y = u + s.

use hysteresis_core::{Bracket, CreepTerms, Error, LoopShiftTerms, Process, QuasiStatic};
use proptest::prelude::*;

use crate::support::past_drives::{assert_refusals_move_nothing, identity};

const CENTER: f64 = 75.0;
const HALF_RANGE: f64 = 60.0;

fn shifting(amplitudes: [f64; 2], limit: f64, decay: f64) -> QuasiStatic {
    identity().with_loop_shift(LoopShiftTerms::new(CENTER, HALF_RANGE, amplitudes, limit, decay).unwrap())
}

/// s at each sample.
fn shifts(stage: &QuasiStatic, drives: &[f64]) -> Vec<f64> {
    let mut forward = stage.forward();
    forward.settle(drives[0]);
    drives.iter().map(|u| forward.step(*u) - u).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, value| sum + value) / f64::from(u32::try_from(values.len()).unwrap())
}

/// A triangle about `middle`: `periods` of `samples` each, from its middle upwards.
fn triangle(middle: f64, amplitude: f64, samples: u32, periods: u32) -> Vec<f64> {
    let phase = |k: u32| (f64::from(k % samples) / f64::from(samples) + 0.25).rem_euclid(1.0);
    (0..samples * periods).map(|k| middle + amplitude * (1.0 - 4.0 * (phase(k) - 0.5).abs())).collect()
}

/// The equations between samples, integrated with 500 steps of fourth order per sample; tau is 1.
fn integrated([c, d]: [f64; 2], limit: f64, dt: f64, drives: &[f64]) -> Vec<f64> {
    let x = |u: f64| (u - CENTER) / HALF_RANGE;
    let (mut m, mut n, mut f, h) = (0.0, 0.0, x(drives[0]), dt / 500.0);
    let mut found = Vec::new();
    for u in drives {
        found.push(c * m + d * n);
        // The follower never stays behind by more than the limit.
        f = x(*u) - (x(*u) - f).clamp(-limit, limit);
        for _ in 0..500 {
            let rates = |[m, n, f]: [f64; 3]| {
                let e = x(*u) - f;
                [e * e - m, x(*u) * e.abs() - n, 4.0 * e]
            };
            let ahead = |k: [f64; 3], by: f64| [m + by * k[0], n + by * k[1], f + by * k[2]];
            let k1 = rates([m, n, f]);
            let k2 = rates(ahead(k1, 0.5 * h));
            let k3 = rates(ahead(k2, 0.5 * h));
            let k4 = rates(ahead(k3, h));
            let slope = |i: usize| h / 6.0 * (k1[i] + 2.0 * k2[i] + 2.0 * k3[i] + k4[i]);
            (m, n, f) = (m + slope(0), n + slope(1), f + slope(2));
        }
    }
    found
}

#[test]
fn the_samples_are_those_of_the_differential_equations() {
    let drives: Vec<f64> =
        (0..60).map(|k| 75.0 + 50.0 * (0.3 * f64::from(k)).sin() + if k % 20 > 14 { 40.0 } else { 0.0 }).collect();
    for (limit, dt) in [(10.0, 0.02), (0.1, 0.02), (10.0, 0.5)] {
        let found = shifts(&shifting([-3.0, 2.0], limit, f64::exp(-dt)), &drives);
        for (got, want) in found.iter().zip(integrated([-3.0, 2.0], limit, dt, &drives)) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
    }
}

#[test]
fn a_cycle_moves_the_centre_by_the_mean_square_of_what_the_follower_is_behind() {
    // Slow beside tau: e is theta x' but for a while after each reversal, theta = tau / 4.
    let (dt, tau, period) = (1e-3, 0.02, 2.0);
    for amplitude in [30.0, 60.0] {
        let drives = triangle(CENTER + 15.0, amplitude, 2000, 4);
        let behind = 0.25 * tau * 4.0 * amplitude / HALF_RANGE / period;
        let decay = f64::exp(-dt / tau);
        let square = mean(&shifts(&shifting([-3.0, 0.0], 10.0, decay), &drives)[6000..]);
        let want = -3.0 * behind * behind;
        // After a reversal e comes back from -theta x' to theta x' in a few theta, of the 200 of a half period.
        assert!((square / want - 1.0).abs() < 0.02, "{square} {want}");
        // The other mean has no centre of its own: it is that of x.
        let product = mean(&shifts(&shifting([0.0, 2.0], 10.0, decay), &drives)[6000..]);
        let want = 2.0 * 15.0 / HALF_RANGE * behind;
        assert!((product / want - 1.0).abs() < 0.03, "{product} {want}");
    }
}

#[test]
fn at_rest_the_loop_does_not_shift_and_after_a_motion_it_comes_back() {
    let stage = shifting([-3.0, 2.0], 10.0, 0.9);
    assert!(shifts(&stage, &[130.0; 50]).iter().all(|s| *s == 0.0));
    let mut drives = triangle(CENTER, 50.0, 40, 3);
    drives.extend([CENTER; 600]);
    let found = shifts(&stage, &drives);
    assert!(found[119].abs() > 0.1 && found[719].abs() < 1e-12, "{} {}", found[119], found[719]);
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
fn what_the_loop_has_shifted_creeps() {
    let creep = CreepTerms::new(&[0.1, 0.2], &[0.9, 0.5]).unwrap();
    let stage = shifting([-3.0, 2.0], 10.0, 0.9);
    let drives = triangle(CENTER, 50.0, 40, 3);
    let (mut rigid, mut creeping) = (stage.forward(), stage.with_creep(creep).forward());
    let h = rigid.settle(drives[0]);
    creeping.settle(drives[0]);
    let (mut slow, mut fast) = (h, h);
    for drive in drives {
        let h = rigid.step(drive);
        let (got, want) = (creeping.step(drive), h + 0.1 * slow + 0.2 * fast);
        assert!((got - want).abs() < 1e-12 * 150.0, "{got} {want}");
        (slow, fast) = (0.9 * slow + 0.1 * h, 0.5 * fast + 0.5 * h);
    }
}

#[test]
fn behind_by_more_than_the_limit_nothing_grows() {
    let largest = |samples, limit| {
        let found = shifts(&shifting([-3.0, 0.0], limit, 0.99), &triangle(CENTER, 60.0, samples, 40));
        found.iter().fold(0.0_f64, |most, s| most.max(s.abs()))
    };
    let (at_its_rate, faster) = (largest(4000, 10.0), largest(400, 10.0));
    assert!(faster > 50.0 * at_its_rate);
    let limit = (at_its_rate / 3.0).sqrt();
    assert!(largest(400, limit) <= 3.0 * limit * limit);
    assert!(largest(4, limit) <= 3.0 * limit * limit);
    let far = shifts(&shifting([1.0, 0.0], limit, 0.99), &[0.0, 1e100, -1e100, 0.0]);
    assert!(far.iter().all(|s| s.abs() <= limit * limit), "{far:?}");
}

#[test]
fn a_bracket_leaves_the_shift_out() {
    let mut bracket = Bracket::of_stage(&shifting([-3.0, 2.0], 10.0, 0.5), (0.0, 150.0)).unwrap();
    for drive in [0.0, 150.0, 40.0, 90.0] {
        assert_eq!(bracket.step(drive), (drive, drive));
    }
}

#[test]
fn what_is_refused_moves_nothing() {
    assert_refusals_move_nothing(shifting([-3.0, 2.0], 0.5, 0.9));
}

#[test]
fn bad_numbers_are_named() {
    let made = |center, half_range, amplitudes, limit, decay| {
        LoopShiftTerms::new(center, half_range, amplitudes, limit, decay).unwrap_err().to_string()
    };
    let good = [1.0, 2.0];
    assert!(made(f64::NAN, 1.0, good, 1.0, 0.5).starts_with("center: expected a finite number"));
    assert_eq!(made(0.0, 0.0, good, 1.0, 0.5), "half_range: expected a number above 0 (1e-50 to 1e50), got 0.0");
    assert!(made(0.0, 1.0, [0.0, f64::INFINITY], 1.0, 0.5).starts_with("amplitudes[1]: expected a finite number"));
    assert_eq!(made(0.0, 1.0, good, -1.0, 0.5), "limit: expected a number above 0 (1e-50 to 1e50), got -1.0");
    assert_eq!(made(0.0, 1.0, good, 1.0, 1.5), "decay: expected a number from 0.0 to 1.0, got 1.5");
}

#[test]
fn a_state_that_cannot_be_is_refused() {
    let (mut with, mut without) = (shifting([-3.0, 2.0], 0.5, 0.9).forward(), identity().forward());
    let good = with.state();
    assert_eq!(good.loop_shift.len(), 3);
    assert!(without.state().loop_shift.is_empty());
    assert!(matches!(without.set_state(&good), Err(Error::OtherModel { .. })));
    let mut refused = |loop_shift: &[f64]| {
        let mut state = good.clone();
        state.loop_shift = loop_shift.to_vec();
        with.set_state(&state).unwrap_err().to_string()
    };
    assert_eq!(refused(&[]), "state.loop_shift: expected 3 elements, got 0");
    assert_eq!(refused(&[-1.0, 0.0, 0.0]), "state.loop_shift[0]: expected a finite number >= 0, got -1.0");
    assert!(refused(&[0.0, 0.0, f64::NAN]).starts_with("state.loop_shift[2]: expected a finite number"));
    let mut state = without.state();
    state.loop_shift = vec![0.0; 3];
    assert_eq!(without.set_state(&state).unwrap_err().to_string(), "state.loop_shift: expected 0 elements, got 3");
    let other = |shift: LoopShiftTerms| identity().with_loop_shift(shift).fingerprint();
    let terms = |c, d| LoopShiftTerms::new(CENTER, HALF_RANGE, [c, d], 0.5, 0.9).unwrap();
    assert_ne!(other(terms(1.0, 2.0)), other(terms(2.0, 1.0)));
    assert_ne!(other(terms(0.0, 0.0)), identity().fingerprint());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    // Rounding only: the means are sums of products of a few units, and the drives are of up to 150 V.
    #[test]
    fn a_hold_in_parts_is_a_hold(
        drives in proptest::collection::vec(0.0..150.0_f64, 2..40),
        (c, d, limit, decay) in (-5.0..5.0, -5.0..5.0, 0.05..3.0, 0.01..0.999_f64),
    ) {
        let once = shifts(&shifting([c, d], limit, decay), &drives);
        let mut parts = shifting([c, d], limit, decay.sqrt().sqrt()).forward();
        parts.settle(drives[0]);
        for (drive, want) in drives.iter().zip(once) {
            let got = parts.step(*drive) - drive;
            prop_assert!((got - want).abs() < 1e-12 * 150.0, "{} {}", got, want);
            for _ in 1..4 {
                parts.step(*drive);
            }
        }
    }
}

#[test]
fn the_terms_tell_what_they_were_made_of() {
    let terms = LoopShiftTerms::new(CENTER, HALF_RANGE, [-3.0, 2.0], 0.5, 0.9).unwrap();
    assert_eq!((terms.center(), terms.half_range(), terms.amplitudes()), (CENTER, HALF_RANGE, [-3.0, 2.0]));
    assert_eq!((terms.limit(), terms.decay()), (0.5, 0.9));
}
