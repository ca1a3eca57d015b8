//! The inverse of linear dynamics, over a record and from a window of references.

use core::f64::consts::TAU;

use hysteresis_control::feedforward::{DynamicsInverse, PreviewCoefficients, PreviewOptions};
use hysteresis_control::linear::{
    Antiresonance, Block, Delay, FirstOrder, LinearDynamics, Modes, SecondOrder, StateSpace,
};
use nalgebra::{Complex, DMatrix, DVector};
use proptest::prelude::*;

const DT: f64 = 1e-4;

fn resonance(frequency: f64, damping: f64) -> SecondOrder {
    SecondOrder::new(frequency, damping).unwrap()
}

fn lag(frequency: f64) -> LinearDynamics {
    FirstOrder::new(frequency).unwrap().into()
}

fn delay(samples: f64) -> Delay {
    Delay::new(samples * DT).unwrap()
}

fn gain(gain: f64) -> LinearDynamics {
    StateSpace::from_gain(gain).unwrap().into()
}

/// 70 um up and down at a frequency in Hz.
fn triangle(count: u32, frequency: f64, dt: f64) -> Vec<f64> {
    (0..count).map(|k| 70.0 * (1.0 - (2.0 * (f64::from(k) * dt * frequency).fract() - 1.0).abs())).collect()
}

fn sine(count: u32, amplitude: f64, frequency: f64, dt: f64) -> Vec<f64> {
    (0..count).map(|k| amplitude * (TAU * frequency * dt * f64::from(k)).sin()).collect()
}

/// The positions at the samples that inputs lead to, from rest at `start`.
fn positions(dynamics: &LinearDynamics, inputs: &[f64], start: f64, dt: f64) -> Vec<f64> {
    let mut block = dynamics.block(dt).unwrap();
    block.settle(start / dynamics.static_gain());
    inputs.iter().map(|w| block.step(*w)).collect()
}

/// The largest and the root mean square distance, in nm, over all but the first and the last samples.
fn distance(positions: &[f64], reference: &[f64], left_out: usize) -> (f64, f64) {
    let errors = positions.iter().zip(reference).map(|(y, r)| 1e3 * (y - r));
    let kept: Vec<f64> = errors.skip(left_out).take(positions.len() - 2 * left_out).collect();
    let squares: f64 = kept.iter().map(|e| e * e).sum();
    #[expect(clippy::cast_precision_loss, reason = "short")]
    let rms = (squares / kept.len() as f64).sqrt();
    (kept.iter().fold(0.0, |most, e| f64::max(most, e.abs())), rms)
}

/// Ten times as many, on straight lines.
fn refined(reference: &[f64]) -> Vec<f64> {
    let pairs = reference.windows(2);
    pairs.flat_map(|pair| (0..10).map(|i| pair[0] + (pair[1] - pair[0]) * 0.1 * f64::from(i))).collect()
}

struct Case {
    name: &'static str,
    dynamics: LinearDynamics,
    dt: f64,
    /// Triangle: rms at the samples, rms and largest between, in nm.
    triangle: [f64; 3],
    /// Sine: largest error at all samples and after the first, in nm.
    sine: [f64; 2],
}

/// The figures of the documentation with some room, and those of other dynamics.
fn cases() -> Vec<Case> {
    let case = |name, dynamics: LinearDynamics, dead_time, dt: f64, triangle, sine| {
        let dynamics = dynamics.with_dead_time(dead_time * dt).unwrap();
        Case { name, dynamics, dt, triangle, sine }
    };
    let a1: LinearDynamics = resonance(400.0, 0.95).into();
    let light: LinearDynamics = resonance(800.0, 0.02).into();
    let pair = Antiresonance::new(resonance(600.0, 0.01), resonance(650.0, 0.01));
    let opposed = Modes::new(&[1.2, -0.2], &[resonance(800.0, 0.02), resonance(1500.0, 0.02)]).unwrap();
    vec![
        case("800 Hz", light.clone(), 0.0, 1e-4, [1.6, 1.5, 30.0], [10.0, 1e-6]),
        case("800 Hz, a sample late", light.clone(), 1.0, 1e-4, [1.6, 1.5, 30.0], [40.0, 1e-6]),
        case("800 Hz, 1.5 samples late", light.clone(), 1.5, 1e-4, [2.0, 2.0, 40.0], [80.0, 1e-6]),
        case("400 Hz", a1, 0.0, 1e-4, [2.5, 1.8, 50.0], [20.0, 1e-6]),
        case("279 Hz lag", lag(279.0), 0.0, 1e-4, [0.4, 2.5, 6.0], [1.0, 1e-6]),
        case("behind 5 kHz", lag(5000.0).then(light.clone()), 0.0, 1e-4, [1.5, 1.3, 30.0], [20.0, 1e-6]),
        case("behind 279 Hz", lag(279.0).then(resonance(2000.0, 0.03)), 0.0, 1e-4, [1.6, 1.3, 25.0], [30.0, 1e-6]),
        case("antiresonance", light.then(pair), 0.0, 1e-4, [1.5, 1.5, 30.0], [10.0, 1e-4]),
        case("zero on the right", opposed.into(), 0.0, 1e-4, [3.0, 2.0, 50.0], [15.0, 1e-4]),
        case("60 Hz at 1 kHz", resonance(60.0, 0.02).into(), 0.0, 1e-3, [2.0, 1.5, 35.0], [15.0, 1e-6]),
        // Every change of the input rings the mode, far above the sampling: only between the samples.
        case("6 kHz at 10 kHz", resonance(6000.0, 0.02).into(), 0.0, 1e-4, [0.1, 20.0, 80.0], [0.1, 1e-3]),
    ]
}

#[test]
fn references_are_followed_at_the_samples_and_between_them() {
    for Case { name, dynamics, dt, triangle: [at, between, most], sine: [start, later] } in cases() {
        let slower = 1e-4 / dt;
        let inverse = DynamicsInverse::new(&dynamics, dt).unwrap();
        let reference = triangle(4000, 10.0 * slower, dt);
        let inputs = inverse.invert(&reference, None).unwrap();
        let (_, rms) = distance(&positions(&dynamics, &inputs, 0.0, dt), &reference, 100);
        let held: Vec<f64> = inputs.iter().flat_map(|w| [*w; 10]).collect();
        let dense = positions(&dynamics, &held, 0.0, 0.1 * dt);
        let (largest, fine) = distance(&dense, &refined(&reference), 1000);
        assert!(rms < at && fine < between && largest < most, "{name}: {rms} {fine} {largest}");
        let reference = sine(4000, 3.0, 20.0 * slower, dt);
        let inputs = inverse.invert(&reference, None).unwrap();
        let sampled = positions(&dynamics, &inputs, 0.0, dt);
        let ((first, _), (after, _)) = (distance(&sampled, &reference, 0), distance(&sampled, &reference, 200));
        assert!(first < start && after < later, "{name}: {first} {after}");
    }
}

/// Without a dead time, all zeros on the left: what has others must move before the record begins.
fn undelayed() -> impl Strategy<Value = LinearDynamics> {
    let mode = || (100.0..4500.0, 0.01..2.0).prop_map(|(f, zeta)| resonance(f, zeta));
    let first = prop_oneof![
        (50.0..4000.0).prop_map(lag),
        mode().prop_map(LinearDynamics::from),
        (mode(), mode(), 0.0..0.8).prop_map(|(a, b, g)| Modes::new(&[1.0 - g, g], &[a, b]).unwrap().into()),
    ];
    // What an antiresonance rings after the start is over within the record.
    let zero = (300.0..4500.0, 0.05..2.0).prop_map(|(f, zeta)| resonance(f, zeta));
    let pair = (zero, mode()).prop_map(|(zero, pole)| Antiresonance::new(zero, pole));
    let amplifier = prop::option::of((300.0..6000.0).prop_map(lag));
    (amplifier, first, prop::option::of(pair), 0.1..3.0).prop_map(|(amplifier, first, pair, k)| {
        pair.into_iter().fold(gain(k).then(amplifier.unwrap_or_default()).then(first), LinearDynamics::then)
    })
}

fn dynamics() -> impl Strategy<Value = LinearDynamics> {
    let dead_time = prop_oneof![Just(0.0), Just(1.0), 0.0..6.0];
    (undelayed(), dead_time).prop_map(|(dynamics, samples)| dynamics.then(delay(samples)))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn what_was_inverted_leads_through_the_reference(dynamics in dynamics(), level in -5.0..5.0, f in 5.0..30.0) {
        // From rest at any level, without a jump of position or velocity. Zeros on the left may be sampled to outside
        // of the unit circle, such as those of 300 Hz before poles of 3.7 kHz: there must be time to move before the
        // reference does.
        let swing = |k: u32| level + 1.0 - f64::cos(TAU * f * DT * f64::from(k.saturating_sub(600)));
        let reference: Vec<f64> = (0..3000).map(swing).collect();
        let inputs = DynamicsInverse::new(&dynamics, DT).unwrap().invert(&reference, None).unwrap();
        let reached = positions(&dynamics, &inputs, level, DT);
        for (k, (y, r)) in reached.iter().zip(&reference).enumerate() {
            // The record ends in motion; what cannot be seen to come is missed, as is a corner.
            let tolerance = if k < 2900 { 1e-4 } else { 0.05 };
            prop_assert!((y - r).abs() < tolerance, "{k}: {y} {r}");
        }
    }

    #[test]
    fn whole_dead_times_shift_what_is_aimed_at(dynamics in undelayed(), whole in 1_u16..400, seed in 1_u32..1000) {
        let late = dynamics.clone().then(delay(f64::from(whole)));
        let [now, late] = [dynamics, late].map(|dynamics| DynamicsInverse::new(&dynamics, DT).unwrap());
        // At rest at its end: a motion would go on.
        let reference: Vec<f64> =
            (0..200_u32).map(|k| k.min(197)).map(|k| f64::from(k * k * seed % 101) / 50.0 - 1.0).collect();
        let aimed: Vec<f64> = (0..200).map(|k| reference[usize::min(k + usize::from(whole), 199)]).collect();
        prop_assert_eq!(late.invert(&reference, Some(0.25)).unwrap(), now.invert(&aimed, Some(0.25)).unwrap());
    }

    #[test]
    fn constants_need_no_more_than_themselves(dynamics in dynamics(), level in -5.0..5.0) {
        let inputs = DynamicsInverse::new(&dynamics, DT).unwrap().invert(&[level; 50], None).unwrap();
        prop_assert!(inputs.iter().all(|w| *w == level / dynamics.static_gain()));
    }

    #[test]
    fn preview_errs_on_sines_as_it_says(dynamics in dynamics(), ahead in 0_usize..12, f in 1.0..4000.0) {
        let preview = PreviewCoefficients::new(&dynamics, DT, &PreviewOptions::new(ahead)).unwrap();
        prop_assert_eq!(preview.ahead(), ahead);
        // Both parts of a complex reference.
        let reference = |k: f64| Complex::cis(TAU * f * DT * k);
        let mut blocks = [dynamics.block(DT).unwrap(), dynamics.block(DT).unwrap()];
        let mut error = Complex::from(0.0);
        for k in 0..4000_u32 {
            let newest = f64::from(k) + f64::from(u32::try_from(ahead).unwrap());
            let window = (0_u32..).zip(preview.coefficients());
            let w: Complex<f64> = window.map(|(j, c)| reference(newest - f64::from(j)) * *c).sum();
            let y = Complex::new(blocks[0].step(w.re), blocks[1].step(w.im));
            error = y / reference(f64::from(k)) - 1.0;
        }
        let expected = preview.error(f);
        // The slowest, 100 Hz and a damping of 0.01, has decayed by exp(-2.5) in 0.4 s; most by far more.
        let magnitude: f64 = preview.coefficients().iter().map(|c| c.abs()).sum();
        let left = magnitude * dynamics.static_gain() * (-0.4 / dynamics.settling_time()).exp();
        prop_assert!((error.norm() - expected).abs() < 1e-9 * (1.0 + magnitude) + 50.0 * left, "{error} {expected}");
    }

    #[test]
    fn preview_is_exact_for_polynomials(
        mode in (400.0..4000.0, 0.2..2.0), dead_time in 0.0..4.0, k in 0.1..3.0, direct in 0.1..1.0,
        ahead in 0_usize..9, polynomial in prop::array::uniform4(-3.0..3.0)
    ) {
        let dynamics = gain(k).then(resonance(mode.0, mode.1)).parallel(&gain(direct)).unwrap().then(delay(dead_time));
        let preview = PreviewCoefficients::new(&dynamics, DT, &PreviewOptions::new(ahead)).unwrap();
        // In units of 1000 samples, so that no derivative dwarfs the others; at rest nowhere, but what was at the start
        // has faded.
        let position = |k: f64| {
            let x = k / 1000.0;
            let [p0, p1, p2, p3]: [f64; 4] = polynomial;
            ((p3 * x + p2) * x + p1) * x + p0
        };
        let degree = usize::min(preview.coefficients().len() - 1, 5);
        let magnitude: f64 = preview.coefficients().iter().map(|c| c.abs()).sum();
        let mut block = dynamics.block(DT).unwrap();
        for k in -900_i32..=0 {
            let newest = f64::from(k) + f64::from(u32::try_from(ahead).unwrap());
            let window = (0_u32..).zip(preview.coefficients());
            let w: f64 = window.map(|(j, c)| position(newest - f64::from(j)) * c).sum();
            let y = block.step(w);
            let settled = k > -10 && degree >= 3;
            let tolerance = 1e-10 * (1.0 + magnitude * dynamics.static_gain());
            prop_assert!(!settled || (y - position(f64::from(k))).abs() < tolerance, "{k}: {y}");
        }
    }
}

/// The least squares themselves, over a record and 300 samples of rest behind it.
#[test]
fn the_inverse_is_the_least_squares() {
    let direct = gain(0.5).parallel(&lag(900.0)).unwrap();
    // With the whole samples of the dead time.
    for (dynamics, late, smoothing) in [
        (direct.then(delay(0.3)), 0, 1e-3),
        (gain(2.0).then(resonance(1500.0, 0.3)).then(delay(2.0)), 2, 1e-4),
        (resonance(2000.0, 0.2).into(), 0, 1e-2),
        (gain(-0.5).then(lag(700.0)).then(delay(1.75)), 1, 1e-4),
        (LinearDynamics::from(delay(0.4)), 0, 1e-1),
    ] {
        let (all, start, k) = (340, 0.3, dynamics.static_gain());
        let reference: Vec<f64> = (0..40_u32).map(|k| f64::from(k * k * 7 % 23) / 10.0).collect();
        let at = |i: usize| reference[i.min(39)];
        let mut pulse = vec![0.0; all];
        pulse[0] = 1.0;
        let pulse = positions(&dynamics, &pulse, 0.0, DT);
        // Inputs count from that of the rest; positions come a dead time later.
        let answer = DMatrix::from_fn(all - late, all - late, |i, j| if i >= j { pulse[i + late - j] } else { 0.0 });
        let wanted = DVector::from_fn(all - late, |i, _| at(i + late) - start);
        let second = DMatrix::from_fn(all - late, all - late, |i, j| match i.wrapping_sub(j) {
            0 | 2 => 1.0,
            1 => -2.0,
            _ => 0.0,
        });
        let normal = answer.tr_mul(&answer) + second.tr_mul(&second) * (smoothing * k * k);
        let best = normal.cholesky().unwrap().solve(&answer.tr_mul(&wanted));
        let inverse = DynamicsInverse::with_smoothing(&dynamics, DT, smoothing).unwrap();
        let inputs = inverse.invert(&reference, Some(start)).unwrap();
        for (i, w) in inputs.iter().enumerate() {
            let expected = best[i] + start / k;
            assert!((w - expected).abs() < 1e-7, "{dynamics:?} {i}: {w} {expected}");
        }
    }
}

/// What holds its input over whole samples only is inverted exactly, whatever the smoothing.
#[test]
fn what_has_no_dynamics_is_divided_by_its_gain() {
    let dynamics = gain(0.25).then(delay(2.0));
    let reference: Vec<f64> = (0..50_u32).map(|k| k.min(47)).map(|k| f64::from(k * k % 17)).collect();
    let inputs = DynamicsInverse::new(&dynamics, DT).unwrap().invert(&reference, Some(3.0)).unwrap();
    assert!(inputs.iter().zip(&reference[2..]).all(|(w, r)| (w - r / 0.25).abs() < 1e-12));
    assert!(inputs[48..].iter().all(|w| (w - reference[49] / 0.25).abs() < 1e-12));
}

/// At least as exact as local polynomials are: errors at 1, 20 and 100 Hz, and what noise may become.
#[test]
fn preview_is_exact_at_low_frequencies() {
    let a1: LinearDynamics = resonance(400.0, 0.95).into();
    let p3 = lag(279.0).then(resonance(2000.0, 0.03));
    for (dynamics, ahead, errors, magnitude) in [
        (&a1, 2, [1e-12, 1e-7, 6e-5], 40.0),
        (&a1, 4, [1e-13, 2e-11, 2.4e-7], 40.0),
        (&a1, 8, [1e-13, 3e-10, 4e-6], 40.0),
        (&p3, 2, [1e-13, 6e-9, 4e-6], 20.0),
        (&p3, 4, [1e-13, 1e-12, 8e-9], 20.0),
        (&p3, 8, [1e-13, 2e-11, 2e-7], 20.0),
    ] {
        let preview = PreviewCoefficients::new(dynamics, DT, &PreviewOptions::new(ahead)).unwrap();
        for (frequency, most) in [1.0, 20.0, 100.0].into_iter().zip(errors) {
            assert!(preview.error(frequency) < most, "{ahead} {frequency}: {}", preview.error(frequency));
        }
        let sum: f64 = preview.coefficients().iter().map(|c| c.abs()).sum();
        assert!(sum < magnitude, "{ahead}: {sum}");
    }
}

/// Resonances need short windows, antiresonances those that their ringing lasts.
#[test]
fn preview_reaches_as_far_as_its_window() {
    let light: LinearDynamics = resonance(800.0, 0.02).into();
    let pair = Antiresonance::new(resonance(600.0, 0.05), resonance(650.0, 0.05));
    let worst = |dynamics: &LinearDynamics, ahead| {
        let preview = PreviewCoefficients::new(dynamics, DT, &PreviewOptions::new(ahead)).unwrap();
        (1..=1200).map(|f| preview.error(f64::from(f))).fold(0.0, f64::max)
    };
    assert!(worst(&light, 8) < 0.02, "{}", worst(&light, 8));
    let pair = light.then(pair);
    assert!(worst(&pair, 8) > 0.5 && worst(&pair, 200) < 0.04, "{} {}", worst(&pair, 8), worst(&pair, 200));
}

/// The sample at which the position is furthest from the reference, and how far, for `inputs` of the dynamics from rest
/// at the position `start`; nothing if all samples pass before the start has faded to exp(-7).
fn worst_miss(dynamics: &LinearDynamics, reference: &[f64], inputs: &[f64], start: f64) -> Option<(usize, f64)> {
    let mut block = dynamics.block(DT).unwrap();
    block.settle(start / dynamics.static_gain());
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a short time")]
    let settled = ((dynamics.dead_time() + 7.0 * dynamics.settling_time()) / DT).ceil() as usize;
    let rows = inputs.iter().zip(reference).enumerate();
    let errors = rows.map(|(sample, (input, r))| (sample, (block.step(*input) - r).abs()));
    errors.filter(|(sample, _)| *sample > settled).max_by(|a, b| a.1.total_cmp(&b.1))
}

#[test]
fn steps_are_missed() {
    let stage = LinearDynamics::from(resonance(400.0, 0.95)).then(delay(2.0));
    let step: Vec<f64> = (0..400).map(|k| if k < 200 { 0.5 } else { 1.5 }).collect();
    let inputs = DynamicsInverse::new(&stage, DT).unwrap().invert(&step, None).unwrap();
    let (sample, error) = worst_miss(&stage, &step, &inputs, 0.5).unwrap();
    assert!(error > 0.05 && sample.abs_diff(200) < 8, "{sample} {error}");
    assert_eq!(worst_miss(&stage, &step[..20], &step[..20], 0.5), None);
    let slow = gain(2.0).then(resonance(4.0, 0.95));
    let (rest, inputs) = (vec![0.5; 4000], vec![0.25; 4000]);
    assert_eq!(worst_miss(&slow, &rest, &inputs, 0.5).map(|(_, error)| error), Some(0.0));
    let (_, left) = worst_miss(&slow, &rest, &inputs, 0.0).unwrap();
    assert!((1e-5..0.01).contains(&left), "{left}");
}

#[test]
fn what_cannot_be_inverted_is_named() {
    let stage: LinearDynamics = resonance(400.0, 0.95).into();
    let inverse = DynamicsInverse::new(&stage, DT).unwrap();
    let refused = |reference: &[f64], start| inverse.invert(reference, start).unwrap_err().to_string();
    let finite = "expected a finite number (at most 1e100 in magnitude)";
    assert_eq!(refused(&[0.0, f64::NAN], None), format!("reference[1]: {finite}, got NaN"));
    assert_eq!(refused(&[0.0], Some(f64::INFINITY)), format!("start: {finite}, got inf"));
    assert_eq!(inverse.invert(&[], Some(1.0)).unwrap(), [0.0; 0]);
    let smoothing = |s| DynamicsInverse::with_smoothing(&stage, DT, s).unwrap_err().to_string();
    assert_eq!(smoothing(0.0), "smoothing: expected 1e-12 to 1e6, got 0.0");
    assert_eq!(smoothing(f64::NAN), "smoothing: expected 1e-12 to 1e6, got NaN");
    assert_eq!(DynamicsInverse::new(&stage, 0.0).unwrap_err().parameter(), Some("dt"));
    let preview = |change: &dyn Fn(&mut PreviewOptions)| {
        let mut options = PreviewOptions::new(4);
        change(&mut options);
        PreviewCoefficients::new(&stage, DT, &options).unwrap_err().to_string()
    };
    assert_eq!(preview(&|o| o.ahead = 1001), "ahead: expected at most 1000 samples, got 1001");
    assert_eq!(preview(&|o| o.window = Some(0)), "window: expected 1 to 1000 samples, got 0");
    assert_eq!(preview(&|o| o.window = Some(4)), "window: expected more references than lie ahead, got 4");
    let degree = "degree: expected less than the number of references in the window, at most 12";
    assert_eq!(preview(&|o| o.degree = Some(8)), format!("{degree}, got 8"));
    let band = "band: expected a frequency above 0 and at most half the sampling rate, got";
    assert_eq!(preview(&|o| o.band = Some(5001.0)), format!("{band} 5001.0"));
    assert_eq!(preview(&|o| o.band = Some(f64::NAN)), format!("{band} NaN"));
}

/// What is smooth at its end goes on with its acceleration, and what jumps there stays: as if those samples had come.
#[test]
fn the_end_of_a_reference_is_as_it_says() {
    let parabola = |k: u32| 3.0 + 2e-3 * f64::from(k) + 1e-6 * f64::from(k * k);
    let smooth: Vec<f64> = (0..2000).map(parabola).collect();
    let falling: Vec<f64> = smooth.iter().map(|r| -r).collect();
    let mut jumps = smooth.clone();
    jumps[1199..].fill(9.0);
    let mut rests = smooth.clone();
    rests[1100..].fill(smooth[1100]);
    for dynamics in [resonance(400.0, 0.95).into(), resonance(800.0, 0.1).into(), lag(279.0).then(delay(2.0))] {
        let inverse = DynamicsInverse::new(&dynamics, DT).unwrap();
        for (name, reference) in [("smooth", &smooth), ("falling", &falling), ("jumps", &jumps), ("rests", &rests)] {
            let cut = inverse.invert(&reference[..1200], None).unwrap();
            let whole = inverse.invert(reference, None).unwrap();
            let worst = cut.iter().zip(&whole).map(|(cut, whole)| (cut - whole).abs()).fold(0.0, f64::max);
            // Of what lies farther ahead than it looks, some 1e-6 is left.
            assert!(worst < 1e-5, "{name}: {worst}");
        }
    }
}
