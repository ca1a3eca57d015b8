//! What the benches have in common: the actuators, the signals and the yardstick.

use hysteresis_core::{Forward, Kernel, ModifiedPrandtlIshlinskii, Offsets, Ratios};

/// The numbers of operators that are compared.
pub const OPERATORS: [u32; 3] = [20, 100, 1000];

/// Four seconds at 10 kHz: four periods of the slowest signal.
pub const SAMPLES: u32 = 40_000;

/// An actuator like the paper's with `operators` operators over +-500 V, in um.
///
/// # Panics
/// Never: uniform thresholds and positive weights are valid.
#[must_use]
pub fn actuator(operators: u32) -> ModifiedPrandtlIshlinskii {
    let n = f64::from(operators);
    let r: Vec<f64> = (0..operators).map(|i| 500.0 * f64::from(i) / n).collect();
    let weights: Vec<f64> = (0..operators).map(|i| if i == 0 { 4.3e-3 } else { 3.2e-3 / n }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, Ratios::PAPER, Offsets::default())
        .expect("uniform thresholds and positive weights are valid")
}

/// A drive signal in V, sampled at 10 kHz.
#[derive(Clone, Copy, Debug)]
pub enum Signal {
    /// A sine of 1 Hz whose amplitude decays from 500 V to nothing.
    Smooth,
    /// A sine of 50 Hz and 500 V, with 0.1 V rms of uniform noise.
    Noisy,
    /// Uniform over +-500 V, every sample anew.
    White,
}

impl Signal {
    /// All of them, with the names that the tables use.
    pub const ALL: [(Self, &'static str); 3] = [
        (Self::Smooth, "1 Hz sine, decaying"),
        (Self::Noisy, "50 Hz sine + 0.1 V noise"),
        (Self::White, "white noise, full range"),
    ];

    /// The first `count` samples of a signal that is `count` long.
    #[must_use]
    pub fn samples(self, count: u32) -> Vec<f64> {
        let mut noise = Noise(0x9E37_79B9_7F4A_7C15);
        let sine = |frequency: f64, k: u32| (core::f64::consts::TAU * frequency * f64::from(k) * 1e-4).sin();
        let sample = |k: u32| match self {
            Self::Smooth => 500.0 * (1.0 - f64::from(k) / f64::from(count)) * sine(1.0, k),
            Self::Noisy => 500.0 * sine(50.0, k) + 0.1 * 12.0_f64.sqrt() * noise.next(),
            Self::White => 1000.0 * noise.next(),
        };
        (0..count).map(sample).collect()
    }
}

/// Uniform in -0.5..0.5, the same on every machine (Marsaglia's xorshift).
struct Noise(u64);

impl Noise {
    #[expect(clippy::cast_precision_loss, reason = "53 bits are kept")]
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }
}

/// The yardstick: a loop over all operators for every sample.
///
/// # Panics
/// Never: there is one initial output per operator.
#[must_use]
pub fn plain_loop(kernel: &Kernel) -> Forward {
    Forward::with_initial(kernel, &vec![0.0; kernel.operators()]).expect("one initial output per operator")
}
