//! A million samples of random walks, jumps and minor loops: the inverse returns the input, and nothing drifts.

use hysteresis_core::{CompiledModel, Forward, Inverse, ModifiedPrandtlIshlinskii, Offsets, Process, Ratios};

/// Marsaglia's xorshift: plenty for a walk, and the same walk everywhere.
struct Random(u64);

impl Random {
    /// Uniform in -0.5..0.5.
    #[allow(clippy::cast_precision_loss, reason = "53 bits are kept")]
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

fn model(operators: u32) -> ModifiedPrandtlIshlinskii {
    let n = f64::from(operators);
    let r: Vec<f64> = (0..operators).map(|i| 500.0 * f64::from(i) / n).collect();
    let weights: Vec<f64> = (0..operators).map(|i| if i == 0 { 4e-3 } else { 4e-3 / n }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default()).unwrap()
}

fn walk(operators: u32, samples: u32) {
    let model = model(operators);
    let compiled = CompiledModel::new(&model);
    let (mut forward, mut inverse) = (Forward::new(&compiled), Inverse::new(&compiled, None).unwrap());
    let mut random = Random(0x9E37_79B9_7F4A_7C15);
    let mut x: f64 = 0.0;
    for k in 0..samples {
        // A random walk, every 50 samples a jump anywhere, every 1000 samples a full stroke up.
        x = match k {
            _ if k % 1000 == 0 => 500.0,
            _ if k % 50 == 0 => 1000.0 * random.next(),
            _ => (x + 20.0 * random.next()).clamp(-500.0, 500.0),
        };
        let back = inverse.step(forward.step(x));
        assert!((back - x).abs() <= 1e-11 * 1000.0, "n = {operators}, sample {k}: {x} came back as {back}");
    }
    // All that is left of a full stroke is the stroke: a fresh bank that is fed only that agrees.
    let mut fresh = Forward::with_initial(&compiled, &vec![0.0; operators as usize]).unwrap();
    for x in [-500.0, 500.0, 100.0, -50.0] {
        let (one, other) = (forward.step(x), fresh.step(x));
        assert!((one - other).abs() <= 1e-12 * 8.0, "n = {operators}: {one} and {other}");
    }
}

#[test]
fn a_million_samples_come_back() {
    for operators in [1, 2, 5, 20, 100, 500, 2000] {
        walk(operators, 150_000);
    }
}
