use hysteresis_core::{Process, paper};
use hysteresis_identify::*;
use std::time::Instant;
fn main() {
    let actuator = paper::table_1_recovered();
    for (name, forgetting, noise, neg) in [
        ("lambda=1", 1.0, 0.0, false),
        ("lambda=.9999", 0.9999, 0.0, false),
        ("noise .9999", 0.9999, 0.016, false),
        ("noise 1", 1.0, 0.016, false),
        ("adverse", 0.9999, 0.3, true),
    ] {
        let mut plant = actuator.forward();
        let mut id =
            RecursiveIdentifier::new(&paper::table_1().into(), &RecursiveOptions { forgetting, ..Default::default() })
                .unwrap();
        let n = 400_000usize;
        let mut rng = 1u64;
        let mut r = || {
            rng = rng.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            ((rng >> 33) as f64 / (1u64 << 31) as f64) * 3.46 - 1.73
        };
        let data: Vec<(f64, f64)> = (0..n)
            .map(|k| {
                let t = k as f64 * 1e-4;
                let u = 400.0 * (6.283 * 5.0 * t).sin() * (0.6 + 0.4 * (6.283 * 0.37 * t).sin());
                let y = plant.step(u);
                (u, if neg { 3e-3 * u.abs() } else { y } + noise * r())
            })
            .collect();
        let mut worst = 0.0f64;
        let mut times = Vec::with_capacity(n);
        let mut frozen = 0;
        let mut bounds = 0;
        let t0 = Instant::now();
        for (u, y) in &data {
            id.update(*u, *y);
        }
        let mean = t0.elapsed().as_secs_f64() / n as f64 * 1e9;
        id.reset();
        for (u, y) in &data {
            let t = Instant::now();
            id.update(*u, *y);
            times.push(t.elapsed().as_nanos() as f64);
            frozen += id.frozen().is_some() as usize;
            bounds += id.state_bounds();
        }
        times.sort_by(f64::total_cmp);
        worst = worst.max(*times.last().unwrap());
        let err = id.weights().zip(actuator.weights()).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!(
            "{name}: {mean:.0} ns mean, median {:.0} p99 {:.0} p99.99 {:.0} max {worst:.0}; frozen {:.3}; mean bound {:.2}; err {err:.2e}",
            times[n / 2],
            times[n * 99 / 100],
            times[n * 9999 / 10000],
            frozen as f64 / n as f64,
            bounds as f64 / n as f64
        );
    }
}
