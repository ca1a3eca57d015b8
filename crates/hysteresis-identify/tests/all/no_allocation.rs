//! What runs beside a controller never allocates: an update, and a model swapped into a running inverse.

use hysteresis_core::{CompiledModel, Inverse, Process};
use hysteresis_identify::{RecursiveIdentifier, RecursiveOptions};
use hysteresis_simulate::paper;

/// Swings over the whole range that decay and grow again.
fn signal() -> impl Iterator<Item = f64> {
    (0..5000_u32).map(|k| 500.0 * (0.02 * f64::from(k)).sin() * (0.55 + 0.45 * (0.00071 * f64::from(k)).cos()))
}

#[test]
fn update_never_allocates() {
    for forgotten in [1.0, 0.999] {
        let options = RecursiveOptions { forgetting: forgotten, ..RecursiveOptions::default() };
        let mut identifier = RecursiveIdentifier::new(&paper::table_1().into(), &options).unwrap();
        let mut held = 0;
        let count = allocations::count(|| {
            for (k, u) in signal().enumerate() {
                // An output that no weights give, so that some are held at zero.
                let y = if k % 100 == 0 {
                    f64::NAN
                } else {
                    0.003 * u.abs() + 0.3 * f64::from(u32::try_from(k * k % 7).unwrap())
                };
                std::hint::black_box(identifier.update(u, y));
                held += u32::from(identifier.weights().any(|w| w == 0.0));
            }
            identifier.reset();
        });
        assert_eq!(count, 0);
        assert!(held > 4000, "{held}");
    }
}

#[test]
fn a_swap_into_a_running_inverse_allocates_nothing() {
    let (old, new) = (CompiledModel::new(&paper::table_1_recovered()), CompiledModel::new(&paper::table_1()));
    let zeros = [0.0; 20];
    let mut inverses = [Inverse::new(&old, None).unwrap(), Inverse::with_initial(&old, None, &zeros).unwrap()];
    for inverse in &mut inverses {
        for k in 0..200 {
            inverse.step(3.0 * (0.1 * f64::from(k)).sin() * (1.0 - 0.005 * f64::from(k)));
        }
        assert_eq!(allocations::count(|| inverse.set_model(&new).unwrap()), 0);
    }
}
