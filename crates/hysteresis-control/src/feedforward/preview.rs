//! Feed-forward from a window of references, sample by sample.

use core::f64::consts::TAU;

use nalgebra::Complex;

use super::Shaper;
use super::stencil::stencil;
use crate::linear::Error;

/// The longest window, in samples.
pub(super) const MAX_WINDOW: usize = 1000;

/// The highest degree that is chosen unasked: beyond, noise grows faster than what is gained.
pub(super) const DEGREE: usize = 5;

/// The window of [`Shaper::preview`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PreviewOptions {
    /// How many samples ahead the newest reference is.
    pub ahead: usize,
    /// How many references the window has; by default as many before the moment that the target aims at as after it,
    /// and at least 4.
    pub window: Option<usize>,
    /// The degree of the polynomials through the window; by default 5, or what a window of less than 6 allows.
    pub degree: Option<usize>,
}

impl PreviewOptions {
    /// The defaults for a number of samples ahead.
    #[must_use]
    pub fn new(ahead: usize) -> Self {
        Self { ahead, window: None, degree: None }
    }
}

/// What makes the target of a window of references: target(k) = sum_j c_j r(k + ahead - j). Made by [`Shaper::preview`].
#[derive(Clone, Debug, PartialEq)]
pub struct PreviewCoefficients {
    /// c_j, the newest reference's first.
    pub coefficients: Vec<f64>,
    /// How many samples ahead the newest reference is.
    pub ahead: usize,
    shaper: Shaper,
}

impl Shaper {
    /// The target as a weighted sum of references of which some lie ahead: derivatives by Savitzky and Golay's local
    /// polynomials, at the moment that the target aims at.
    ///
    /// Exact for polynomials up to the degree. Relative errors of the target for a sine at T = 1e-4 s, with the defaults
    /// ([`PreviewCoefficients::error`] tells them for any other case), and the sum of |c_j|, which bounds what noise of
    /// the reference becomes:
    ///
    /// | dynamics | ahead | window, degree | 1 Hz | 20 Hz | 100 Hz | sum of abs c_j |
    /// |---|---|---|---|---|---|---|
    /// | 400 Hz, damping 0.95 | 2 | 4, 3 | 6e-13 | 9e-8 | 5e-5 | 33 |
    /// | | 4 | 8, 5 | 1e-14 | 2e-11 | 2e-7 | 28 |
    /// | | 8 | 16, 5 | 1e-14 | 3e-10 | 4e-6 | 8 |
    /// | 2 kHz, damping 0.03, amplifier 279 Hz | 2 | 4, 3 | 1e-13 | 5e-9 | 3e-6 | 16 |
    /// | | 4 | 8, 5 | 1e-14 | 1e-12 | 8e-9 | 5 |
    /// | | 8 | 16, 5 | 1e-14 | 2e-11 | 2e-7 | 4 |
    ///
    /// An `ahead` that does not reach the moment that the target aims at, half a sample and the delay after t_k,
    /// extrapolates, which makes noise and errors larger.
    ///
    /// ```
    /// use hysteresis_control::linear::SecondOrder;
    /// use hysteresis_control::feedforward::{PreviewOptions, Shaper};
    /// let stage = SecondOrder::new(400.0, 0.95)?;
    /// let preview = Shaper::new(&stage.into(), 1e-4)?.preview(&PreviewOptions::new(4))?;
    /// assert_eq!(preview.coefficients.len(), 8);
    /// assert!((preview.coefficients.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    /// assert!(preview.error(20.0) < 1e-9 && preview.error(100.0) < 1e-6);
    /// # Ok::<(), hysteresis_control::linear::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error`] unless the window has 2 to 1000 references and reaches from `ahead` to the present at least, and the
    /// degree is less than the window and not less than the order of the dynamics.
    pub fn preview(&self, options: &PreviewOptions) -> Result<PreviewCoefficients, Error> {
        let PreviewOptions { ahead, window, degree } = *options;
        if ahead > MAX_WINDOW {
            return Err(wrong("ahead", "at most 1000 samples", ahead));
        }
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay of at most 2^20 samples")]
        let before = self.lead as usize;
        let window = window.unwrap_or_else(|| (2 * ahead.saturating_sub(before)).max(ahead + 1).max(4));
        let window = check_window(window)?;
        if window <= ahead {
            return Err(wrong("window", "more references than lie ahead", window));
        }
        let degree = self.check_degree(degree, window)?;
        // The stencil counts from the oldest reference on.
        #[expect(clippy::cast_precision_loss, reason = "windows are short")]
        let aim = self.lead + (window - 1 - ahead) as f64;
        let mut coefficients = self.weights(window, degree, aim)?;
        coefficients.reverse();
        Ok(PreviewCoefficients { coefficients, ahead, shaper: *self })
    }

    /// The degree, or the default one, if the dynamics can be inverted with it.
    pub(super) fn check_degree(&self, degree: Option<usize>, window: usize) -> Result<usize, Error> {
        let degree = degree.unwrap_or(DEGREE.min(window - 1));
        if degree >= window {
            return Err(wrong("degree", "less than the number of references in the window", degree));
        }
        if degree < self.order.max(1) {
            return Err(wrong("degree", "at least 1 and the order of dynamics and amplifier", degree));
        }
        Ok(degree)
    }

    /// The weights of a window's samples for the target that aims at `x` samples after the first of them.
    pub(super) fn weights(&self, window: usize, degree: usize, x: f64) -> Result<Vec<f64>, Error> {
        let mut per_sample = self.terms;
        let mut unit = 1.0;
        for term in &mut per_sample {
            *term *= unit;
            unit /= self.dt;
        }
        let weights = stencil(window, degree, &per_sample[..=self.order], x);
        if weights.iter().all(|weight| weight.is_finite()) {
            Ok(weights)
        } else {
            let expected = "a sampling interval at which the inverse dynamics have finite coefficients";
            Err(Error { parameter: "dt", index: None, expected, got: self.dt })
        }
    }
}

impl PreviewCoefficients {
    /// The error of the target for a sine of this frequency in Hz, relative to the target.
    ///
    /// |sum_j c_j exp(i w (ahead - j) T) / ((1 + a_1 i w + a_2 (i w)^2 + a_3 (i w)^3) exp(i w lead)) - 1|
    #[must_use]
    pub fn error(&self, frequency: f64) -> f64 {
        let Shaper { terms, lead, dt, .. } = self.shaper;
        let s = Complex::new(0.0, TAU * frequency);
        let exact = terms.iter().rev().fold(Complex::from(0.0), |sum, term| sum * s + term);
        #[expect(clippy::cast_precision_loss, reason = "windows are short")]
        let after_aim = |j: usize| self.ahead as f64 - j as f64 - lead;
        let summed = self.coefficients.iter().enumerate().map(|(j, c)| (s * dt * after_aim(j)).exp() * *c);
        (summed.sum::<Complex<f64>>() / exact - 1.0).norm()
    }
}

/// A window's length, if it can be one.
pub(super) fn check_window(window: usize) -> Result<usize, Error> {
    if (2..=MAX_WINDOW).contains(&window) { Ok(window) } else { Err(wrong("window", "2 to 1000 samples", window)) }
}

fn wrong(parameter: &'static str, expected: &'static str, got: usize) -> Error {
    #[expect(clippy::cast_precision_loss, reason = "only shown")]
    Error { parameter, index: None, expected, got: got as f64 }
}
