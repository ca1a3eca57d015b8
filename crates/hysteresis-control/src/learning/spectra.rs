//! Signals at the harmonics of a period.

use std::sync::Arc;

use realfft::num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

use super::feedback_loop::FeedbackLoop;
use crate::linear::Error;

/// To and from the frequencies j / (period dt), j = 0..=period/2.
#[derive(Clone)]
pub(super) struct Spectra {
    forward: Arc<dyn RealToComplex<f64>>,
    back: Arc<dyn ComplexToReal<f64>>,
}

impl Spectra {
    pub(super) fn new(period: usize) -> Self {
        let mut planner = RealFftPlanner::new();
        Self { forward: planner.plan_fft_forward(period), back: planner.plan_fft_inverse(period) }
    }

    /// The number of samples.
    pub(super) fn period(&self) -> usize {
        self.forward.len()
    }

    pub(super) fn transform(&self, samples: &[f64]) -> Vec<Complex64> {
        transform(&*self.forward, samples.to_vec())
    }

    /// Back to samples.
    pub(super) fn samples(&self, mut spectrum: Vec<Complex64>) -> Vec<f64> {
        let mut samples = self.back.make_output_vec();
        // A real signal has real ends of its spectrum; what rounding added to them would be refused.
        if let Some(first) = spectrum.first_mut() {
            first.im = 0.0;
        }
        if let (0, Some(last)) = (samples.len() % 2, spectrum.last_mut()) {
            last.im = 0.0;
        }
        self.back.process(&mut spectrum, &mut samples).expect("a spectrum of its own length");
        let scale = as_f64(samples.len()).recip();
        for x in &mut samples {
            *x *= scale;
        }
        samples
    }
}

pub(super) fn transform(forward: &dyn RealToComplex<f64>, mut samples: Vec<f64>) -> Vec<Complex64> {
    let mut spectrum = forward.make_output_vec();
    forward.process(&mut samples, &mut spectrum).expect("samples of its own length");
    spectrum
}

/// The frequency response of a loop at the harmonics of a period.
pub(super) fn response(feedback: &FeedbackLoop, period: usize) -> Result<Vec<Complex64>, Error> {
    Ok(transform(&*RealFftPlanner::new().plan_fft_forward(period), feedback.impulse_response(period)?))
}

#[expect(clippy::cast_precision_loss, reason = "a period has less than 2^52 samples")]
pub(super) fn as_f64(count: usize) -> f64 {
    count as f64
}

/// Q at the frequencies j / (period dt) for a bandwidth, or 1 without one.
pub(super) fn low_pass(bandwidth: Option<f64>, period: usize, dt: f64) -> Vec<f64> {
    let ratio = |j: usize| bandwidth.map_or(0.0, |bandwidth| as_f64(j) / (as_f64(period) * dt * bandwidth));
    (0..=period / 2).map(|j| 1.0 / (1.0 + ratio(j).powi(4))).collect()
}
