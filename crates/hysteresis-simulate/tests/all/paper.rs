//! The paper's tables and figures, as far as they concern operators, models and inverses.

use hysteresis_core::{CoupledPlay, Process, Ratios, Tracked};
use hysteresis_simulate::paper;

/// Fig. 5: drive and output of the operator r 10, ra 8, rb 3, rc 4.
const WALK: [(f64, f64); 8] =
    [(0.0, 0.0), (20.0, 10.0), (-20.0, -12.0), (15.0, 5.0), (6.0, 5.0), (25.0, 15.0), (-15.0, -7.0), (-5.0, -7.0)];

#[test]
fn fig_5_walk_is_exact_at_any_sampling() {
    for parts in [1, 2, 8, 64, 1024] {
        let mut z = Tracked::new(CoupledPlay::new(10.0, 8.0, 3.0, 4.0).unwrap());
        let mut last = 0.0;
        for (x, output) in WALK {
            for part in 1..parts {
                z.step(last + (x - last) * f64::from(part) / f64::from(parts));
            }
            assert_eq!(z.step(x), output, "at {x} in {parts} parts");
            last = x;
        }
    }
}

#[test]
fn recovered_weights_round_to_table_1() {
    for (recovered, printed) in paper::table_1_recovered().weights().iter().zip(paper::table_1().weights()) {
        assert_eq!((recovered * 1e4).round() / 1e4, *printed);
    }
}

#[test]
fn parametric_inverse_is_table_2() {
    let computed = paper::table_1_recovered().parametric_inverse(Ratios::PAPER_INVERSE).unwrap();
    let printed = paper::table_2();
    // Four decimals are printed, and r' comes from weights that were recovered from four decimals.
    let close = |one: f64, other: f64| assert!((one - other).abs() <= 5.1e-5, "{one} and {other}");
    for i in 0..20 {
        close(computed.weights()[i], printed.weights()[i]);
        let (one, other) = (computed.operators()[i], printed.operators()[i]);
        for (one, other) in
            [(one.r(), other.r()), (one.ra(), other.ra()), (one.rb(), other.rb()), (one.rc(), other.rc())]
        {
            close(one, other);
        }
    }
}

#[test]
fn reach_from_the_virgin_state() {
    let actuator = paper::table_1_recovered();
    let reach = |drive: f64| (actuator.forward().step(drive) * 1e4).round() / 1e4;
    assert_eq!(reach(500.0), 3.0624);
    assert_eq!(reach(-500.0), -3.1072);
}

/// Largest error of the actuator driven through `inverse`, in % of the peak-to-peak displacement, over the triangle
/// 0, +a, -a, 0 with a the reach at +500 V.
fn residual_percent(inverse: &mut impl Process) -> f64 {
    let mut actuator = paper::table_1_recovered().forward();
    let amplitude = actuator.peek(500.0);
    let triangle = (0..=40_000_u32).map(|k| {
        let phase = f64::from(k) / 10_000.0;
        amplitude
            * if phase < 1.0 {
                phase
            } else if phase < 3.0 {
                2.0 - phase
            } else {
                phase - 4.0
            }
    });
    let error = triangle.map(|target| (actuator.step(inverse.step(target)) - target).abs()).fold(0.0, f64::max);
    100.0 * error / (2.0 * amplitude)
}

#[test]
fn table_2_leaves_what_the_exact_inverse_removes() {
    let actuator = paper::table_1_recovered();
    let table_2 = residual_percent(&mut paper::table_2().forward());
    assert!((table_2 - 0.732).abs() < 5e-4, "Table II leaves {table_2} %");
    let exact = residual_percent(&mut actuator.inverse(None).unwrap());
    assert!(exact < 1e-12, "the exact inverse leaves {exact} %");
}
