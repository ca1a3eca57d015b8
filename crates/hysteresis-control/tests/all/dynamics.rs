//! Linear dynamics in general: against step responses from residues, and laws of their composition.

use core::f64::consts::TAU;

use hysteresis_control::linear::{
    Antiresonance, Block, Delay, FirstOrder, LinearBlock, LinearDynamics, Modes, SecondOrder, Section, StateSpace,
};
use nalgebra::{Complex, DMatrix, DVector};
use proptest::prelude::*;

const DT: f64 = 1e-4;

fn resonance(frequency: f64, damping: f64) -> SecondOrder {
    SecondOrder::new(frequency, damping).unwrap()
}

/// The roots of (s/w)^2 + 2 zeta s/w + 1 for zeta < 1.
fn roots(mode: SecondOrder) -> [Complex<f64>; 2] {
    let (w, zeta) = (TAU * mode.frequency(), mode.damping());
    let root = Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * w;
    [root, root.conj()]
}

/// The step response at t > 0 of the product of (1 - s/z) over that of (1 - s/p), from residues: 1 + sum R exp(p t).
fn step_response(zeros: &[Complex<f64>], poles: &[Complex<f64>], t: f64) -> f64 {
    let term = |(i, p): (usize, &Complex<f64>)| {
        let above: Complex<f64> = zeros.iter().map(|z| Complex::from(1.0) - p / z).product();
        let others = poles.iter().enumerate().filter(|(j, _)| *j != i);
        let below: Complex<f64> = others.map(|(_, q)| Complex::from(1.0) - p / q).product();
        -above / below * (p * t).exp()
    };
    1.0 + poles.iter().enumerate().map(term).sum::<Complex<f64>>().re
}

/// Sections of unit gain, with their zeros and poles.
type Parts = (LinearDynamics, Vec<Complex<f64>>, Vec<Complex<f64>>);

/// One to four sections; poles that come close to each other would cost the residues their digits.
fn parts() -> impl Strategy<Value = Parts> {
    let mode = |low: f64, high: f64| (low..high, 0.01..0.9).prop_map(|(f, zeta)| resonance(f, zeta));
    let lag = prop::option::of(4000.0..6000.0);
    let pair = prop::option::of((mode(700.0, 900.0), mode(1000.0, 1100.0)));
    (lag, mode(100.0, 600.0), pair, prop::option::of(mode(1500.0, 3000.0))).prop_map(|(lag, first, pair, second)| {
        let (mut dynamics, mut zeros, mut poles) = (LinearDynamics::from(first), Vec::new(), roots(first).to_vec());
        if let Some(f) = lag {
            dynamics = LinearDynamics::from(FirstOrder::new(f).unwrap()).then(dynamics);
            poles.push(Complex::from(-TAU * f));
        }
        if let Some((zero, pole)) = pair {
            dynamics = dynamics.then(Antiresonance::new(zero, pole));
            zeros.extend(roots(zero));
            poles.extend(roots(pole));
        }
        if let Some(mode) = second {
            dynamics = dynamics.then(mode);
            poles.extend(roots(mode));
        }
        (dynamics, zeros, poles)
    })
}

fn dynamics() -> impl Strategy<Value = LinearDynamics> {
    parts().prop_map(|(dynamics, _, _)| dynamics)
}

fn dead_time() -> impl Strategy<Value = f64> {
    prop_oneof![Just(0.0), Just(DT), Just(3.0 * DT), (0.0..5.0).prop_map(|samples: f64| samples * DT)]
}

fn input() -> impl Strategy<Value = Vec<f64>> {
    prop::collection::vec(-1.0..1.0, 1..40)
}

/// Whether two lists have the same numbers, in any order.
fn same(one: &[Complex<f64>], other: &[Complex<f64>], tolerance: f64) -> bool {
    let near = |z: &Complex<f64>| one.iter().any(|w| (w - z).norm() <= tolerance * z.norm());
    one.len() == other.len() && other.iter().all(near)
}

fn rows(mut block: LinearBlock, input: &[f64]) -> Vec<f64> {
    input.iter().map(|u| block.step(*u)).collect()
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_record_is_the_sum_of_its_steps((dynamics, zeros, poles) in parts(), dead_time in dead_time(), input in input()) {
        let late = dynamics.with_dead_time(dead_time).unwrap();
        let mut block = late.block(DT).unwrap();
        // At the time t: every change of the input since the start has begun its step response a dead time later.
        let at = |t: f64| -> f64 {
            let changes = input.iter().enumerate().map(|(i, u)| (i, u - if i == 0 { 0.0 } else { input[i - 1] }));
            #[expect(clippy::cast_precision_loss, reason = "a handful")]
            let since = changes.map(|(i, change)| (t - i as f64 * DT - dead_time, change));
            since.filter(|(since, _)| *since > 0.0).map(|(since, change)| change * step_response(&zeros, &poles, since)).sum()
        };
        for (k, u) in (0_u32..).zip(&input) {
            let t = f64::from(k) * DT;
            prop_assert!((block.output(*u) - at(t)).abs() < 1e-9, "{k}: {} {}", block.output(*u), at(t));
            prop_assert!((block.clone().advance(*u) - at(t + DT)).abs() < 1e-9, "{k}");
            prop_assert_eq!(block.look_ahead(*u), block.clone().advance(*u));
            prop_assert_eq!(block.output(*u), block.step(*u));
        }
    }

    #[test]
    fn whole_dead_times_shift_the_record_bit_for_bit(dynamics in dynamics(), whole in 0_u32..6, input in input()) {
        let (now, late) = (dynamics.block(DT).unwrap(), dynamics.with_dead_time(f64::from(whole) / 1e4).unwrap());
        let shifted = [vec![0.0; whole as usize], input.clone()].concat();
        prop_assert_eq!(&rows(late.block(DT).unwrap(), &input), &rows(now, &shifted)[..input.len()]);
    }

    #[test]
    fn a_dead_time_alone_is_a_delay(dead_time in dead_time(), input in input()) {
        let delay = Delay::new(dead_time).unwrap();
        let (mut alone, mut general) = (delay.block(DT).unwrap(), LinearDynamics::from(delay).block(DT).unwrap());
        for u in input {
            prop_assert!((alone.look_ahead(u) - general.look_ahead(u)).abs() < 1e-15);
            prop_assert!((alone.step(u) - general.step(u)).abs() < 1e-15);
        }
    }

    #[test]
    fn at_rest_nothing_moves(dynamics in dynamics(), dead_time in dead_time(), level in -5.0..5.0) {
        let mut block = dynamics.with_dead_time(dead_time).unwrap().block(DT).unwrap();
        prop_assert_eq!(block.settle(level), level);
        prop_assert!((0..50).all(|_| block.look_ahead(level) == level && block.step(level) == level));
    }

    #[test]
    fn a_saved_state_goes_on(dynamics in dynamics(), dead_time in dead_time(), input in input()) {
        let fresh = dynamics.with_dead_time(dead_time).unwrap().block(DT).unwrap();
        let (mut block, mut other) = (fresh.clone(), fresh);
        block.settle(0.5);
        for u in &input {
            block.step(*u);
        }
        other.restore(&block.state()).unwrap();
        prop_assert!(other == block);
        prop_assert_eq!(rows(other, &input), rows(block, &input));
    }

    #[test]
    fn sections_in_series_may_change_places(
        (one, other) in (dynamics(), dynamics()), dead_time in dead_time(), input in input()
    ) {
        let late = one.clone().with_dead_time(dead_time).unwrap();
        let matrices = LinearDynamics::from(other.state_space().then(&one.state_space()));
        let all = [
            late.clone().then(other.clone()),
            other.clone().then(late),
            matrices.then(Delay::new(dead_time).unwrap()),
        ];
        prop_assert!(all.iter().all(|dynamics| dynamics.dead_time() == dead_time));
        let [first, second, third] = all.map(|dynamics| rows(dynamics.block(DT).unwrap(), &input));
        for (k, y) in first.iter().enumerate() {
            prop_assert!((y - second[k]).abs() < 1e-9 && (y - third[k]).abs() < 1e-9, "{k}");
        }
    }

    #[test]
    fn matrices_and_polynomials_are_the_same_dynamics((dynamics, zeros, poles) in parts(), f in 1.0..5000.0) {
        let product = |roots: &[Complex<f64>], s: Complex<f64>| -> Complex<f64> {
            roots.iter().map(|root| Complex::from(1.0) - s / root).product()
        };
        let s = Complex::new(0.0, TAU * f);
        let expected = product(&zeros, s) / product(&poles, s);
        let tolerance = 1e-9 * (1.0 + expected.norm());
        prop_assert!((dynamics.frequency_response(f) - expected).norm() < tolerance);
        let turn = Complex::cis(-TAU * f * 2.5 * DT);
        let late = dynamics.clone().with_dead_time(2.5 * DT).unwrap();
        prop_assert!((late.frequency_response(f) - expected * turn).norm() < tolerance);
        let matrices = dynamics.state_space();
        prop_assert!((matrices.frequency_response(f) - expected).norm() < tolerance);
        prop_assert!(same(&dynamics.zeros(), &zeros, 1e-9) && same(&dynamics.poles(), &poles, 1e-9));
        prop_assert!(same(&matrices.zeros(), &zeros, 1e-6), "{:?} {:?}", matrices.zeros(), zeros);
        let general = StateSpace::new(matrices.a().clone(), matrices.b().clone(), matrices.c().clone(), matrices.d());
        let general = general.unwrap();
        prop_assert!((general.static_gain() - 1.0).abs() < 1e-9 && same(general.poles(), &poles, 1e-6));
        // Coefficients of s in units of 1000 radians per second, from the highest power on.
        let expanded = |roots: &[Complex<f64>]| {
            let mut polynomial = vec![Complex::from(1.0)];
            for root in roots {
                let shifted: Vec<_> = polynomial.iter().map(|c| -c / (root / 1e3)).chain([Complex::from(0.0)]).collect();
                let same = [Complex::from(0.0)].into_iter().chain(polynomial);
                polynomial = shifted.into_iter().zip(same).map(|(a, b)| a + b).collect();
            }
            let n = i32::try_from(polynomial.len()).unwrap() - 1;
            let power = |i: i32| 1e3_f64.powi(i - n);
            (0..).zip(polynomial).map(|(i, c)| c.re * power(i)).collect::<Vec<f64>>()
        };
        let transfer = StateSpace::from_transfer_function(&expanded(&zeros), &expanded(&poles)).unwrap();
        prop_assert!((transfer.frequency_response(f) - expected).norm() < 1e-7 * (1.0 + expected.norm()));
        prop_assert!(same(transfer.poles(), &poles, 1e-5) && same(&transfer.zeros(), &zeros, 1e-5));
        let input = [1.0, 0.0, -0.5, 2.0, 1.0, 1.0];
        let record = rows(dynamics.block(DT).unwrap(), &input);
        for other in [matrices, general, transfer] {
            for (y, same) in rows(LinearDynamics::from(other).block(DT).unwrap(), &input).iter().zip(&record) {
                prop_assert!((y - same).abs() < 1e-7);
            }
        }
    }

    #[test]
    fn a_pulse_transfer_is_the_transform_of_the_pulse_response(
        dynamics in dynamics(), direct in 0.0..0.5, dead_time in dead_time(), angle in 0.0..TAU, radius in 1.2..2.0
    ) {
        let through = LinearDynamics::from(StateSpace::from_gain(direct + 0.1).unwrap());
        let dynamics = dynamics.parallel(&through).unwrap().with_dead_time(dead_time).unwrap();
        let z = Complex::from_polar(radius, angle);
        let mut block = dynamics.block(DT).unwrap();
        let (mut record, mut before) = (Complex::from(0.0), Complex::from(0.0));
        for k in 0..400 {
            let u = if k == 0 { 1.0 } else { 0.0 };
            record += z.powi(-k) * block.output(u);
            before += z.powi(-k - 1) * block.advance(u);
        }
        // Outside of the radius 1.2 the rest of the series is below 1.2^-400.
        prop_assert!((dynamics.record_transfer(DT).unwrap().at(z) - record).norm() < 1e-11);
        prop_assert!((dynamics.pulse_transfer(DT).unwrap().at(z) - before).norm() < 1e-11);
    }
}

/// Modes side by side are the sum of their responses, and so are any dynamics.
#[test]
fn modes_in_parallel_add_up() {
    let [one, two] = [resonance(800.0, 0.02), resonance(1500.0, 0.3)];
    let modes = LinearDynamics::from(Modes::new(&[0.8, -0.3], &[one, two]).unwrap());
    let weighted = |gain, mode| LinearDynamics::from(StateSpace::from_gain(gain).unwrap()).then(mode);
    let beside = weighted(0.8, one).parallel(&weighted(-0.3, two)).unwrap();
    assert!((modes.static_gain() - 0.5).abs() < 1e-15 && (beside.static_gain() - 0.5).abs() < 1e-15);
    let input: Vec<f64> = (0..60_u32).map(|k| f64::from(k * k % 17)).collect();
    let parts = [one, two].map(|mode| rows(mode.block(DT).unwrap(), &input));
    for (k, (y, same)) in
        rows(modes.block(DT).unwrap(), &input).into_iter().zip(rows(beside.block(DT).unwrap(), &input)).enumerate()
    {
        let sum = 0.8 * parts[0][k] - 0.3 * parts[1][k];
        assert!((y - sum).abs() < 1e-12 && (same - sum).abs() < 1e-12, "{k}");
    }
    let difference = modes.frequency_response(900.0) - beside.frequency_response(900.0);
    assert!(difference.norm() < 1e-12 && modes.frequency_response(900.0).norm() > 0.1);
    assert!(same(&modes.zeros(), &beside.zeros(), 1e-9) && modes.zeros().len() == 2);
    for zero in modes.zeros() {
        // With gains of opposite sign there is a zero in the right half plane, and none on the imaginary axis.
        assert!(zero.im.abs() < 1e-6 && modes.zeros().iter().any(|zero| zero.re > 0.0), "{zero}");
    }
}

/// (2 s + 3) / (4 s + 5) in a unit of time of a millisecond: two fifths at high frequencies pass at once.
#[test]
fn what_passes_at_once_is_part_of_the_polynomials() {
    let transfer = StateSpace::from_transfer_function(&[0.0, 2e-3, 3.0], &[4e-3, 5.0]).unwrap();
    let s = Complex::new(0.0, TAU * 300.0);
    let expected = (s * 2e-3 + 3.0) / (s * 4e-3 + 5.0);
    assert!((transfer.frequency_response(300.0) - expected).norm() < 1e-14);
    assert!((transfer.d() - 0.5).abs() < 1e-15 && (transfer.static_gain() - 0.6).abs() < 1e-15);
    assert!(same(&transfer.zeros(), &[Complex::from(-1500.0)], 1e-12));
}

/// Poles on both sides of critical damping and far above it: their sum and their product.
#[test]
fn poles_are_the_roots_of_the_denominator() {
    for (frequency, zeta) in [(400.0, 0.02), (400.0, 1.0), (3.0, 1.7), (50.0, 1e7)] {
        let stage = LinearDynamics::from(resonance(frequency, zeta));
        let w = TAU * frequency;
        let [one, other] = stage.poles()[..] else { unreachable!() };
        assert!((one + other + 2.0 * zeta * w).norm() < 1e-12 * zeta * w);
        assert!((one * other - w * w).norm() < 1e-12 * w * w);
        let slowest = if zeta < 1.0 { 1.0 / (zeta * w) } else { (zeta + (zeta * zeta - 1.0).sqrt()) / w };
        assert!((stage.settling_time() - slowest).abs() < 1e-12 * slowest);
    }
    assert_eq!(LinearDynamics::none().settling_time(), 0.0);
}

#[test]
fn what_is_no_dynamics_is_named() {
    let space = |a: &[f64], b: &[f64], c: &[f64], d| {
        let n = a.len().isqrt();
        let matrices = (DMatrix::from_row_slice(n, n, a), DVector::from_row_slice(b), DVector::from_row_slice(c));
        StateSpace::new(matrices.0, matrices.1, matrices.2, d).unwrap_err().to_string()
    };
    assert_eq!(space(&[-1.0], &[1.0, 2.0], &[1.0], 0.0), "b: expected as many entries as a has rows, got 2");
    assert_eq!(space(&[-1.0], &[1.0], &[], 0.0), "c: expected as many entries as a has rows, got 0");
    assert_eq!(space(&[1.0], &[1.0], &[1.0], 0.0), "a: expected poles with negative real parts, got 1.0");
    assert!(
        space(&[0.0, 1.0, -1.0, 0.0], &[0.0, 1.0], &[1.0, 0.0], 0.0).starts_with("a: expected poles with negative")
    );
    assert!(space(&[f64::NAN], &[1.0], &[1.0], 0.0).starts_with("a[0]: expected a finite number"));
    assert!(space(&[-1.0], &[1.0], &[1.0], f64::INFINITY).starts_with("d[0]: expected a finite number"));
    assert_eq!(space(&[-1.0], &[1.0], &[1.0], -1.0), "c: expected a static gain d - c a^-1 b that is not 0, got 0.0");
    let wide = StateSpace::new(DMatrix::zeros(1, 2), DVector::zeros(1), DVector::zeros(1), 1.0);
    assert_eq!(wide.unwrap_err().to_string(), "a: expected a square matrix of at most 64 rows, got 2");
    let transfer = |n: &[f64], d: &[f64]| StateSpace::from_transfer_function(n, d).unwrap_err().to_string();
    let improper = "numerator: expected a degree that is not above that of the denominator, got 1.0";
    assert_eq!(transfer(&[1.0, 1.0], &[0.0, 2.0]), improper);
    assert_eq!(transfer(&[1.0], &[0.0]), "denominator: expected a polynomial that is not 0, got 0.0");
    assert!(transfer(&[1.0], &[1.0, -1.0]).starts_with("denominator: expected poles with negative real parts"));
    assert!(transfer(&[1.0, 0.0], &[1.0, 1.0]).starts_with("numerator: expected a last coefficient"));
    let modes = [resonance(1.0, 1.0); 2];
    assert_eq!(
        Modes::new(&[1.0, -1.0], &modes).unwrap_err().to_string(),
        "gains: expected a sum that is not 0, got 0.0"
    );
    assert!(Modes::new(&[1.0], &modes).unwrap_err().to_string().starts_with("gains: expected one for each mode"));
    let lag = LinearDynamics::from(FirstOrder::new(10.0).unwrap());
    let minus = LinearDynamics::from(StateSpace::from_gain(-1.0).unwrap());
    assert_eq!(lag.parallel(&minus).unwrap_err().parameter().unwrap(), "other");
    assert_eq!(StateSpace::from_gain(0.0).unwrap_err().parameter().unwrap(), "gain");
    let many = (0..65).fold(lag, |all, _| all.then(FirstOrder::new(10.0).unwrap()));
    assert_eq!(many.block(DT).unwrap_err().to_string(), "dynamics: expected at most 64 poles, got 66");
    let stiff = LinearDynamics::from(resonance(1.0, 0.5)).then(FirstOrder::new(1e12).unwrap());
    let expected = "dt: expected at most 1e6 time constants of the fastest part of the dynamics, got 0.0001";
    assert_eq!(stiff.block(DT).unwrap_err().to_string(), expected);
    let mut block = resonance(400.0, 0.5).block(DT).unwrap();
    let other = FirstOrder::new(10.0).unwrap().block(DT).unwrap();
    assert_eq!(block.restore(&other.state()).unwrap_err().parameter().unwrap(), "deviation");
    assert!(matches!(LinearDynamics::from(resonance(1.0, 1.0)).sections(), [Section::SecondOrder(_)]));
}
