//! An actuator in a loop, plain: what learning and observation are tested on.

use core::f64::consts::TAU;

use hysteresis_core::{Forward, Inverse, Model, Process};

use hysteresis_control::linear::{Block, Dynamics, LinearBlock, SecondOrder};

#[path = "../../../../hysteresis-core/tests/all/support/models.rs"]
pub(crate) mod models;
pub(crate) mod past_drives;

pub(crate) const DT: f64 = 1e-4;
pub(crate) const KP: f64 = 60.0;
pub(crate) const KI: f64 = 6000.0;

/// The dynamics of benchmark plant A1.
pub(crate) fn a1() -> Dynamics {
    SecondOrder::new(400.0, 0.95).unwrap().into()
}

/// White noise of about normal distribution and unit variance: the sum of twelve uniform numbers.
pub(crate) struct Noise(pub(crate) fastrand::Rng);

impl Noise {
    pub(crate) fn new(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    pub(crate) fn next(&mut self) -> f64 {
        (0..12).map(|_| self.0.f64()).sum::<f64>() - 6.0
    }
}

/// Actuator A1, an inverse of another model, and positional proportional-integral feedback.
pub(crate) struct Loop {
    inverse: Inverse,
    actuator: Forward,
    dynamics: LinearBlock,
    noise: Noise,
    noise_rms: f64,
    integral: f64,
    pub(crate) drive: f64,
    pub(crate) position: f64,
}

impl Loop {
    pub(crate) fn new(model: &Model, noise_rms: f64, seed: u64) -> Self {
        let inverse = match model {
            Model::Conventional(model) => model.inverse(Some((-560.0, 560.0))),
            Model::Modified(model) => model.inverse(Some((-560.0, 560.0))),
        };
        Self {
            inverse: inverse.unwrap(),
            actuator: models::actuator().forward(),
            dynamics: a1().block(DT).unwrap(),
            noise: Noise::new(seed),
            noise_rms,
            integral: 0.0,
            drive: 0.0,
            position: 0.0,
        }
    }

    /// What the sensor says now.
    pub(crate) fn measure(&mut self) -> f64 {
        self.position + self.noise_rms * self.noise.next()
    }

    /// One sample: feed-forward of the target, feedback of the error.
    pub(crate) fn advance(&mut self, target: f64, error: f64) {
        self.integral += KI * DT * error;
        self.drive = (self.inverse.step(target) + KP * error + self.integral).clamp(-560.0, 560.0);
        self.position = self.dynamics.advance(self.actuator.step(self.drive));
    }
}

/// One period of a 20 Hz sine of 3.3 um, and the target that the inverse of second-order dynamics makes of it, half a
/// sample ahead.
pub(crate) fn reference_and_target(frequency: f64, zeta: f64) -> (Vec<f64>, Vec<f64>) {
    let (w, wn) = (TAU * 20.0, TAU * frequency);
    (0..500)
        .map(|k| {
            let (t, lead) = (w * DT * f64::from(k), w * DT * 0.5);
            let (sin, cos) = (t + lead).sin_cos();
            let through = sin * (1.0 - (w / wn).powi(2)) + 2.0 * zeta * w / wn * cos;
            (3.3 * t.sin(), 3.3 * through)
        })
        .unzip()
}
