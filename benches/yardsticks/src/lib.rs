//! What the streams are compared with, compiled with the same flags and measured in the same run: loops over all
//! operators, and the actuators, Duhem operators and drive signals along which streams and loops go.

mod fused;
mod signals;

use hysteresis_core::{CoupledPlay, Duhem, MAX_KNOTS, ModifiedPrandtlIshlinskii, Offsets, Operator, Process, Ratios};

pub use fused::{FusedLoop, Instructions};
pub use signals::{REACH, SAMPLES, Signal};

/// An actuator like the paper's with `operators` operators over +-500 V, in um.
///
/// # Panics
/// Never: uniform thresholds and positive weights are valid.
#[must_use]
pub fn actuator(operators: u32) -> ModifiedPrandtlIshlinskii {
    varied(operators, Ratios::PAPER, || 1.0)
}

/// An actuator of the same kind whose weights, thresholds and their ratios are its own: each up to 10 % away.
///
/// # Panics
/// Never: as [`actuator`].
#[must_use]
pub fn individual(operators: u32, seed: u64) -> ModifiedPrandtlIshlinskii {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut factor = || 0.9 + 0.2 * random.f64();
    let Ratios { ra, rb, rc } = Ratios::PAPER;
    let ratios = Ratios { ra: ra * factor(), rb: rb * factor(), rc: rc * factor() };
    varied(operators, ratios, factor)
}

fn varied(operators: u32, ratios: Ratios, mut factor: impl FnMut() -> f64) -> ModifiedPrandtlIshlinskii {
    let n = f64::from(operators);
    let reach = REACH * factor();
    let r: Vec<f64> = (0..operators).map(|i| reach * f64::from(i) / n).collect();
    let weights: Vec<f64> = (0..operators).map(|i| factor() * if i == 0 { 4.3e-3 } else { 3.2e-3 / n }).collect();
    ModifiedPrandtlIshlinskii::from_ratios(&weights, &r, ratios, Offsets::default())
        .expect("uniform thresholds and positive weights are valid")
}

/// The slope beside [`duhem`] where its inverse is measured, in um/V.
pub const BESIDE: f64 = 2e-3;

/// A Duhem operator of nine knots, in um over V. A drive over the whole range passes them all.
///
/// # Panics
/// Never: knots increase, and no slope is zero.
#[must_use]
pub fn duhem() -> Duhem<9> {
    nine_knots(1.0, 4e-3)
}

/// The same for a force inside of an oscillator, in m/s^2 over m.
///
/// # Panics
/// Never: as [`duhem`].
#[must_use]
pub fn duhem_inside() -> Duhem<MAX_KNOTS> {
    nine_knots(100.0, 2.5e4)
}

/// Knots from -`reach` to `reach`, with this slope in their middle.
fn nine_knots<const N: usize>(reach: f64, slope: f64) -> Duhem<N> {
    let shares = [-1.0, -0.75, -0.5, -0.25, 0.0, 0.25, 0.5, 0.75, 1.0];
    let along = |share: f64| slope * (1.0 - 0.8 * share - 0.15 * share * share);
    let (rising, falling) = (shares.map(along), shares.map(|share| along(-share)));
    Duhem::new(&shares.map(|share| reach * share), &rising, &falling).expect("knots increase, slopes are above 0")
}

/// A loop over all operators for every sample, one after the other: what a user writes first.
#[derive(Clone, Debug)]
pub struct PlainLoop {
    operators: Vec<(f64, CoupledPlay, f64)>,
}

impl PlainLoop {
    /// The operators of a model at rest.
    ///
    /// # Panics
    /// If the model has offsets, or weights of their own below zero: the loop has neither.
    #[must_use]
    pub fn new(model: &ModifiedPrandtlIshlinskii) -> Self {
        assert!(!model.is_split() && model.offsets() == Offsets::default(), "one weight for each operator, no offsets");
        let operators = model.operators().iter().zip(model.weights());
        Self { operators: operators.map(|(operator, weight)| (*weight, *operator, 0.0)).collect() }
    }
}

impl Process for PlainLoop {
    fn step(&mut self, x: f64) -> f64 {
        let mut sum = 0.0;
        for (weight, operator, z) in &mut self.operators {
            *z = operator.next(*z, x);
            sum += *weight * *z;
        }
        sum
    }

    fn peek(&self, x: f64) -> f64 {
        self.operators.iter().map(|(weight, operator, z)| weight * operator.next(*z, x)).sum()
    }

    fn reset(&mut self) {
        for (_, _, z) in &mut self.operators {
            *z = 0.0;
        }
    }
}
