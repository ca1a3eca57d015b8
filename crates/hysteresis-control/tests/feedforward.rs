//! The inverse of linear dynamics.

use hysteresis_control::feedforward::{PreviewOptions, Shaper, worst_miss};
use hysteresis_control::linear::{Delay, FirstOrder, LinearDynamics, SecondOrder};
use hysteresis_control::trajectory::{MotionLimits, PointToPoint, Trajectory};
use proptest::prelude::*;

const DT: f64 = 1e-4;

fn chains() -> impl Strategy<Value = LinearDynamics> {
    let dynamics = prop_oneof![
        Just(LinearDynamics::none()),
        (50.0..4000.0).prop_map(|f| FirstOrder::new(f).unwrap().into()),
        (50.0..4000.0, 0.01..2.0).prop_map(|(f, zeta)| SecondOrder::new(f, zeta).unwrap().into()),
    ];
    let amplifier = prop::option::of((50.0..4000.0).prop_map(|f| LinearDynamics::from(FirstOrder::new(f).unwrap())));
    let dead_time = prop_oneof![Just(0.0), 0.0..6.0].prop_map(|samples| Delay::new(samples * DT).unwrap());
    (dynamics, amplifier, dead_time)
        .prop_map(|(dynamics, amplifier, delay)| amplifier.unwrap_or_default().then(dynamics).then(delay))
}

proptest! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn the_shaped_target_of_a_polynomial_is_exact(
        chain in chains(), polynomial in prop::array::uniform4(-3.0..3.0), window in 6_usize..20, ahead in 0_usize..9
    ) {
        // In units of 40 samples, so that no derivative dwarfs the others.
        let unit = 40.0 * DT;
        let [p0, p1, p2, p3]: [f64; 4] = polynomial;
        let position = |t: f64| ((p3 * (t / unit) + p2) * (t / unit) + p1) * (t / unit) + p0;
        let shaper = Shaper::new(&chain, DT).unwrap();
        let [_, a1, a2, a3] = shaper.terms();
        let exact = |t: f64| -> f64 {
            let x = t / unit;
            let (first, second) = ((3.0 * p3 * x + 2.0 * p2) * x + p1, 6.0 * p3 * x + 2.0 * p2);
            position(t) + a1 * first / unit + a2 * second / unit.powi(2) + a3 * 6.0 * p3 / unit.powi(3)
        };
        // The weights are a_m / T^m, of which a rounding is left.
        let tolerance = 1e-10 * (1.0 + a1 / DT + a2 / DT.powi(2) + a3 / DT.powi(3));
        let samples: Vec<f64> = (0..40).map(|k| position(f64::from(k) * DT)).collect();
        for (k, target) in (0_u32..).zip(shaper.shape(&samples, window).unwrap()) {
            let aim = (f64::from(k) * DT + shaper.lead()).min(39.0 * DT);
            prop_assert!(f64::abs(target - exact(aim)) < tolerance, "{k}: {target} {}", exact(aim));
        }
        let preview = shaper.preview(&PreviewOptions::new(ahead)).unwrap();
        prop_assert_eq!(preview.ahead, ahead);
        let newest = f64::from(u32::try_from(ahead).unwrap());
        let seen = (0_u32..).zip(&preview.coefficients).map(|(j, c)| c * position((newest - f64::from(j)) * DT));
        // Where the window does not reach the aim, the weights grow with the distance.
        let magnitude: f64 = preview.coefficients.iter().map(|c| c.abs()).sum();
        prop_assert!((seen.sum::<f64>() - exact(shaper.lead())).abs() < tolerance + 1e-12 * magnitude);
    }
}

/// Moves from rest are followed from the first sample on, and what misses them is measured.
#[test]
fn moves_are_followed_and_steps_are_missed() {
    let stage = SecondOrder::new(400.0, 0.95).unwrap();
    let chain = LinearDynamics::from(stage).then(Delay::new(2.0 * DT).unwrap());
    let limits = MotionLimits { velocity: 200.0, acceleration: 1e5, jerk: 1e8 };
    let moves = PointToPoint::new(&[0.0, 2.0, 1.0], limits, 0.01).unwrap();
    let count = moves.samples(DT, None).unwrap();
    let shaper = Shaper::new(&chain, DT).unwrap();
    let reference: Vec<f64> = (0..count).map(|k| moves.at(f64::from(k) * DT).position).collect();
    let targets: Vec<f64> = (0..count).map(|k| shaper.target(&moves, f64::from(k) * DT)).collect();
    let miss = worst_miss(&chain, DT, &reference, &targets).unwrap().unwrap();
    // A jump of the jerk, held over half a sample, is a T^2 / 24 of acceleration and a ripple of a2 jerk T / 2.
    assert!(miss.error < 1e-4, "{miss:?}");
    let step: Vec<f64> = (0..400).map(|k| if k < 200 { 0.0 } else { 1.0 }).collect();
    let miss = worst_miss(&chain, DT, &step, &shaper.shape(&step, 8).unwrap()).unwrap().unwrap();
    assert!(miss.error > 0.05 && miss.sample.abs_diff(200) < 8, "{miss:?}");
    assert_eq!(worst_miss(&chain, DT, &step[..20], &step[..20]).unwrap(), None);
}
