//! Filters of the feedback against their continuous form.

use core::f64::consts::TAU;

use hysteresis_control::filters::{FeedbackFilter, Lead, LowPass, Notch, response};
use nalgebra::Complex;

const DT: f64 = 1e-4;

/// Where the bilinear transform puts z = e^(j w dt): s / w of the continuous form, for a filter that is prewarped at
/// `own` Hz.
fn prewarped(frequency: f64, own: f64) -> Complex<f64> {
    let half = |frequency: f64| (0.5 * TAU * frequency * DT).tan();
    Complex::new(0.0, half(frequency) / half(own))
}

/// The formulas of the documentation, in s / w.
#[test]
fn filters_have_the_response_of_their_continuous_form() {
    type Continuous = fn(f64) -> Complex<f64>;
    let filters: [(&str, FeedbackFilter, Continuous); 6] = [
        ("notch", Notch::new(800.0, 0.02, 1.5).unwrap().into(), |f| {
            let s = prewarped(f, 800.0);
            (s * s + s * 0.04 + 1.0) / (s * s + s * 3.0 + 1.0)
        }),
        ("deep notch", Notch::new(800.0, 0.0, 1.5).unwrap().into(), |f| {
            let s = prewarped(f, 800.0);
            (s * s + 1.0) / (s * s + s * 3.0 + 1.0)
        }),
        ("low-pass", LowPass::new(200.0, None).unwrap().into(), |f| (prewarped(f, 200.0) + 1.0).inv()),
        ("second-order low-pass", LowPass::new(200.0, Some(0.3)).unwrap().into(), |f| {
            let s = prewarped(f, 200.0);
            (s * s + s * 0.6 + 1.0).inv()
        }),
        ("lead", Lead::new(100.0, 900.0).unwrap().into(), |f| {
            (prewarped(f, 100.0) + 1.0) / (prewarped(f, 900.0) + 1.0)
        }),
        ("lag", Lead::new(900.0, 100.0).unwrap().into(), |f| (prewarped(f, 900.0) + 1.0) / (prewarped(f, 100.0) + 1.0)),
    ];
    for (name, filter, continuous) in filters {
        let section = filter.section(DT).unwrap();
        for frequency in [0.0, 30.0, 200.0, 777.0, 1900.0, 4500.0] {
            let of_section = response(&[section], Complex::from_polar(1.0, TAU * frequency * DT));
            let expected = continuous(frequency);
            assert!(
                (of_section - expected).norm() < 1e-9,
                "{name} at {frequency} Hz: expected {expected}, got {of_section}"
            );
        }
    }
}
