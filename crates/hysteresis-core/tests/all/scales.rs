//! Models of any size: what underflows on the way costs looks, and no digits.

use hysteresis_core::{Offsets, PrandtlIshlinskii, Process};

/// Numbers from 0 to 1 that look like chance.
fn shares() -> impl Iterator<Item = f64> {
    (1..400_u32).map(|k| (f64::from(k) * 0.618_033_988_749_894_9).fract())
}

#[test]
fn an_inverse_is_exact_at_every_scale() {
    for exponent in (-300..=90).step_by(3) {
        let scale = 10_f64.powi(exponent);
        let model = PrandtlIshlinskii::new(&[1.0, 0.5, 0.3], &[0.0, scale, 2.0 * scale], Offsets::default()).unwrap();
        let mut inverse = model.inverse(Some((-10.0 * scale, 10.0 * scale))).unwrap();
        let mut forward = model.forward();
        for share in shares() {
            let target = (16.0 * share - 8.0) * scale;
            let output = forward.step(inverse.step(target));
            assert!((output - target).abs() < 1e-13 * scale, "{target:e} at {scale:e}: {output:e}");
            let state = inverse.state();
            inverse.set_state(&state).unwrap();
        }
    }
}
